//! A small town: ground and houses are the occluders, and the crowd is thousands of boxes.
//!
//! Some faces lie in one plane, and some boxes have a twin at the same place.

use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection, Vec3};

use crate::scene::{Body, Mesh, Random, Scene, Shape, Shot, block};

/// The town around `origin`.
pub(crate) fn scene(origin: Vec3) -> Scene {
    let mut random = Random(7);
    let walls = walls(&mut random);
    let houses = &walls[1..];
    let mut crowd = Vec::new();
    for i in 0..5000 {
        let half: Vec3 = std::array::from_fn(|_| random.range(0.1, 0.7));
        let mut at = [random.range(-62.0, 62.0), half[1], random.range(-62.0, 62.0)];
        match i % 10 {
            // Most boxes stand on the ground: in the streets, or inside of houses.
            // Some hover.
            0..7 => {}
            7 => at[1] = random.range(1.0, 25.0),
            // Boxes around the crossing at the origin, for the camera that stands among them.
            8 => at = [random.range(-4.0, 4.0), random.range(0.2, 3.5), random.range(-4.0, 4.0)],
            _ => {
                crowd.push(near_a_face(houses[random.below(houses.len())], &mut random));
                continue;
            }
        }
        let corner = |side: f64| [0, 1, 2].map(|k| at[k] + side * half[k]);
        crowd.push(block(corner(-1.0), corner(1.0), random.colour()));
    }
    // Twins of another colour at the same place.
    // Only the order of drawing decides which one is seen.
    for i in (0..5000).step_by(20) {
        let colour = crowd[i].colour.map(|c| 1.15 - c);
        crowd.push(Body { colour, ..crowd[i] });
    }
    let walls: Vec<Body> =
        walls.iter().map(|(min, max, colour)| block(*min, *max, *colour)).collect();
    Scene::at(origin, "town", &crowd, Mesh::of_bodies(&walls), [70.0, 20.0, 70.0])
}

type Block = (Vec3, Vec3, [f32; 3]);

/// The ground and 6 x 6 houses, each 12 m wide, 8 m apart.
fn walls(random: &mut Random) -> Vec<Block> {
    let mut walls = vec![([-70.0, -12.0, -70.0], [70.0, 0.0, 70.0], [0.42, 0.44, 0.40])];
    for house in 0..36 {
        let [x, z] = [f64::from(house / 6) * 20.0 - 56.0, f64::from(house % 6) * 20.0 - 56.0];
        let shade = random.range(0.55, 0.9) as f32;
        let top = random.range(6.0, 20.0);
        walls.push(([x, 0.0, z], [x + 12.0, top, z + 12.0], [shade, 0.93 * shade, 0.82 * shade]));
    }
    walls
}

/// A box with a face in the plane of a house's face, or up to 10 cm behind it.
///
/// - In the plane it is a tie, and the box must be kept.
/// - Behind it the box may be culled.
fn near_a_face(house: Block, random: &mut Random) -> Body {
    let axis = 2 * random.below(2);
    let along = 2 - axis;
    let depth = if random.below(2) == 0 { 0.0 } else { 10.0_f64.powf(random.range(-4.0, -1.0)) };
    let (house_min, house_max, _) = house;
    let (mut min, mut max) = ([0.0; 3], [0.0; 3]);
    for (k, size) in [(1, house_max[1]), (along, 12.0)] {
        min[k] = house_min[k] + random.range(0.0, size - 1.5);
        max[k] = min[k] + random.range(0.3, 1.5);
    }
    if random.below(2) == 0 {
        (min[axis], max[axis]) = (house_min[axis] + depth, house_min[axis] + depth + 0.3);
    } else {
        (min[axis], max[axis]) = (house_max[axis] - depth - 0.3, house_max[axis] - depth);
    }
    Body { shape: Shape::Box { min, max }, colour: [0.9, 0.25, 0.2] }
}

/// The cameras around `origin`, for images of `size`.
pub(crate) fn shots(origin: Vec3, size: ImageSize) -> hiz_core::Result<Vec<Shot>> {
    use DepthConvention::{Reversed, Standard};
    let aspect = f64::from(size.width) / f64::from(size.height);
    let perspective = |degrees: f64, near, far, convention| Projection::Perspective {
        fov_y: degrees.to_radians(),
        near,
        far,
        convention,
    };
    let parallel = |top: f64, far, convention| Projection::Orthographic {
        left: -top * aspect,
        right: top * aspect,
        bottom: -top,
        top,
        near: 0.0,
        far,
        convention,
    };
    let off_centre = |near, far, convention| Projection::Frustum {
        left: -0.2 * aspect,
        right: 0.9 * aspect,
        bottom: -0.35,
        top: 0.75,
        near,
        far,
        convention,
    };
    let shot = |name, eye: Vec3, target: Vec3, projection, crowd_occludes| {
        let [eye, target] = [eye, target].map(|p| std::array::from_fn(|k| p[k] + origin[k]));
        let camera =
            Camera::look_at(&Pose { eye, target, up: [0.0, 1.0, 0.0] }, &projection, size)?;
        Ok(Shot { name, camera, crowd_occludes })
    };
    let street = ([1.0, 1.7, 58.0], [-1.0, 3.0, 0.0]);
    let hill = ([-70.0, 26.0, 68.0], [0.0, 0.0, 0.0]);
    let (walls_occlude, crowd_occludes) = (false, true);
    Ok(vec![
        shot(
            "street",
            street.0,
            street.1,
            perspective(60.0, 0.5, Some(160.0), Standard),
            walls_occlude,
        )?,
        shot(
            "corner",
            [21.0, 2.5, 41.0],
            [-30.0, 4.0, -8.0],
            perspective(75.0, 0.1, Some(200.0), Reversed),
            walls_occlude,
        )?,
        shot("hill", hill.0, hill.1, perspective(50.0, 0.1, None, Reversed), walls_occlude)?,
        // The view is along an axis.
        // Faces towards the eye have one depth, and the others are seen edge-on.
        shot(
            "off_centre",
            [-41.0, 3.0, 62.0],
            [-41.0, 3.0, 0.0],
            off_centre(0.3, None, Standard),
            walls_occlude,
        )?,
        shot(
            "parallel",
            [3.0, 9.0, 90.0],
            [3.0, 9.0, 0.0],
            parallel(16.0, 200.0, Standard),
            walls_occlude,
        )?,
        shot(
            "isometric",
            [80.0, 60.0, 70.0],
            [0.0, 0.0, 0.0],
            parallel(24.0, 250.0, Reversed),
            walls_occlude,
        )?,
        // The eye is 3 cm from a wall, and looks into it at less than a degree.
        shot(
            "along_a_wall",
            [3.97, 2.0, 34.0],
            [4.2, 2.2, 0.0],
            perspective(70.0, 0.01, None, Reversed),
            walls_occlude,
        )?,
        // Boxes are in front of the eye, around it, and across the near plane.
        shot(
            "in_the_crowd",
            [0.0, 1.7, 0.0],
            [3.0, 1.9, 9.0],
            perspective(80.0, 0.3, Some(150.0), Standard),
            walls_occlude,
        )?,
        shot(
            "crowd_hides_crowd",
            hill.0,
            hill.1,
            perspective(50.0, 1.0, Some(220.0), Standard),
            crowd_occludes,
        )?,
        shot(
            "straight_hides_crowd",
            [1.0, 1.7, 66.0],
            [1.0, 1.7, 0.0],
            perspective(60.0, 0.1, None, Reversed),
            crowd_occludes,
        )?,
        // The faces are parallel to the image.
        // So all pixels of a box hold the depth of its nearest point.
        shot(
            "parallel_hides_crowd",
            [3.0, 9.0, 90.0],
            [3.0, 9.0, 0.0],
            parallel(16.0, 200.0, Reversed),
            crowd_occludes,
        )?,
    ])
}
