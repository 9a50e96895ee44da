//! A floor of rooms with doors, seen from inside.
//!
//! There are walls on all sides, cameras that touch them, and furniture of rotated boxes.

use std::f64::consts::PI;

use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection, Vec3};

use crate::scene::{Body, Mesh, Random, Scene, Shape, Shot, block};

const ROOMS: [usize; 2] = [6, 5];
/// The length and depth of a room, in metres.
const ROOM: [f64; 2] = [5.0, 4.0];
const CEILING: f64 = 2.8;
const HALF_WALL: f64 = 0.075;
const HALF_DOOR: f64 = 0.45;
const DOOR_TOP: f64 = 2.1;

/// The floor around `origin`, at the height of `origin`.
pub(crate) fn scene(origin: Vec3) -> Scene {
    let mut random = Random(11);
    let size = [0, 1].map(|k| ROOMS[k] as f64 * ROOM[k]);
    let mut walls = vec![
        block([-0.5, -0.3, -0.5], [size[0] + 0.5, 0.0, size[1] + 0.5], [0.55, 0.42, 0.3]),
        block(
            [-0.5, CEILING, -0.5],
            [size[0] + 0.5, CEILING + 0.3, size[1] + 0.5],
            [0.9, 0.9, 0.88],
        ),
    ];
    for axis in 0..2 {
        let across = 1 - axis;
        for line in 0..=ROOMS[axis] {
            for room in 0..ROOMS[across] {
                let outer = line == 0 || line == ROOMS[axis];
                let begin = room as f64 * ROOM[across];
                let door = (!outer).then(|| begin + random.range(0.8, ROOM[across] - 0.8));
                add_wall(
                    &mut walls,
                    axis,
                    line as f64 * ROOM[axis],
                    [begin, begin + ROOM[across]],
                    door,
                );
            }
        }
    }
    let crowd: Vec<Body> = (0..3000).map(|i| furniture(i, &mut random)).collect();
    let middle = [-size[0] / 2.0, 0.0, -size[1] / 2.0];
    let crowd: Vec<Body> = crowd.iter().map(|body| body.moved(middle)).collect();
    let walls: Vec<Body> = walls.iter().map(|body| body.moved(middle)).collect();
    let reach = [size[0] / 2.0, CEILING, size[1] / 2.0];
    Scene::at(origin, "rooms", &crowd, Mesh::of_bodies(&walls), reach)
}

/// Adds a wall at `at` on `axis` (0: x, 1: z), from `ends[0]` to `ends[1]`.
/// If `door` is given, the wall has a door around it.
fn add_wall(walls: &mut Vec<Body>, axis: usize, at: f64, ends: [f64; 2], door: Option<f64>) {
    let mut part = |from: f64, to: f64, bottom: f64| {
        let (mut min, mut max) = ([0.0, bottom, 0.0], [0.0, CEILING, 0.0]);
        let [thick, long] = [2 * axis, 2 - 2 * axis];
        (min[thick], max[thick]) = (at - HALF_WALL, at + HALF_WALL);
        (min[long], max[long]) = (from, to);
        walls.push(block(min, max, [0.82, 0.8, 0.74]));
    };
    match door {
        None => part(ends[0], ends[1], 0.0),
        Some(door) => {
            part(ends[0], door - HALF_DOOR, 0.0);
            part(door + HALF_DOOR, ends[1], 0.0);
            part(door - HALF_DOOR, door + HALF_DOOR, DOOR_TOP);
        }
    }
}

/// Furniture: on the floor, in the air, or like a picture that touches a wall.
fn furniture(i: usize, random: &mut Random) -> Body {
    let room = [random.below(ROOMS[0]) as f64 * ROOM[0], random.below(ROOMS[1]) as f64 * ROOM[1]];
    let mut half: Vec3 = [0; 3].map(|_| random.range(0.02, 0.35));
    let mut center = [0, 1, 2].map(|k| match k {
        1 => half[1],
        _ => room[k / 2] + random.range(0.4, ROOM[k / 2] - 0.4),
    });
    let mut rotation = turned_about_y(random.range(0.0, 2.0 * PI));
    match i % 6 {
        0 => center[1] = random.range(0.5, CEILING - 0.5),
        1 => rotation = tumbled(random),
        // Flat on a wall: in its plane, or a tenth of a millimetre in front of it or behind it.
        2 => {
            rotation = turned_about_y(0.0);
            half[0] = 0.01;
            let gap = random.pick(&[0.0, 1e-4, -1e-4]);
            center[0] = room[0] + HALF_WALL + half[0] + gap;
            center[1] = random.range(0.8, 2.0);
        }
        _ => {}
    }
    Body { shape: Shape::Turned { center, half, rotation }, colour: random.colour() }
}

fn turned_about_y(angle: f64) -> [f64; 9] {
    let (s, c) = angle.sin_cos();
    [c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c]
}

/// A rotation about y, then about x.
fn tumbled(random: &mut Random) -> [f64; 9] {
    let [(s, c), (t, d)] = [random.range(0.0, 2.0 * PI), random.range(0.0, PI)].map(f64::sin_cos);
    [c, 0.0, s, t * s, d, -t * c, -d * s, t, d * c]
}

/// The cameras around `origin`, for images of `size`.
pub(crate) fn shots(origin: Vec3, size: ImageSize) -> hiz_core::Result<Vec<Shot>> {
    let shot = |name, eye: Vec3, target: Vec3, (near, far, convention), crowd_occludes| {
        let [eye, target] = [eye, target].map(|p| [0, 1, 2].map(|k| p[k] + origin[k]));
        let projection = Projection::Perspective { fov_y: 1.2, near, far, convention };
        let camera =
            Camera::look_at(&Pose { eye, target, up: [0.0, 1.0, 0.0] }, &projection, size)?;
        Ok(Shot { name, camera, crowd_occludes })
    };
    let (standard, reversed) =
        ((0.05, Some(60.0), DepthConvention::Standard), (0.02, None, DepthConvention::Reversed));
    Ok(vec![
        shot("rooms_through_doors", [-12.0, 1.6, -7.0], [5.0, 1.2, 4.0], standard, false)?,
        // The eye is in the plane of a wall's face, 5 m from its end.
        shot(
            "rooms_on_a_wall",
            [-10.0 + HALF_WALL, 1.5, -4.0],
            [-10.0 + HALF_WALL, 1.4, 8.0],
            reversed,
            false,
        )?,
        shot("rooms_hide_themselves", [1.5, 1.7, 1.0], [9.0, 0.6, -3.0], reversed, true)?,
    ])
}
