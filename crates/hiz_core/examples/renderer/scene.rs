//! What is drawn: a small town of boxes and the cameras that look at it. No GPU here.
//!
//! Large boxes (ground and houses) are the occluders, small ones (the crowd) are the instances to be culled.

use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection, Vec3};

/// An axis-aligned box in world coordinates: its bounds are exactly what is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Block {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
    pub(crate) colour: [f32; 3],
}

/// Triangles of a box: four vertices a face in the numbering of [`corner`], so that a face has a normal of its own.
pub(crate) const BLOCK_INDICES: [u32; 36] = {
    let mut indices = [0; 36];
    let mut i = 0;
    while i < 36 {
        indices[i] = 4 * (i as u32 / 6) + [0, 1, 2, 2, 1, 3][i % 6];
        i += 1;
    }
    indices
};

/// Which of `min` (0) and `max` (1) vertex `v` of a box takes on each axis. `boxes.wgsl` has the same lines.
fn corner(v: u32) -> [u32; 3] {
    let axis = v as usize / 8;
    let mut sides = [0; 3];
    sides[axis] = v / 4 % 2;
    sides[(axis + 1) % 3] = v % 2;
    sides[(axis + 2) % 3] = v / 2 % 2;
    sides
}

/// The boxes as one triangle mesh: the same triangles that the renderer draws.
pub(crate) fn mesh(blocks: &[Block]) -> (Vec<f64>, Vec<u32>) {
    let vertices = blocks.iter().flat_map(|b| (0..24).flat_map(|v| at(b, corner(v)))).collect();
    let triangles = (0..blocks.len() as u32).flat_map(|b| BLOCK_INDICES.map(|i| 24 * b + i)).collect();
    (vertices, triangles)
}

fn at(block: &Block, sides: [u32; 3]) -> Vec3 {
    std::array::from_fn(|k| if sides[k] == 0 { block.min[k] } else { block.max[k] })
}

/// Boxes by their number: first the crowd, then the walls.
#[derive(Debug)]
pub(crate) struct Scene {
    pub(crate) blocks: Vec<Block>,
    pub(crate) crowd: u32,
}

impl Scene {
    pub(crate) fn crowd(&self) -> &[Block] {
        &self.blocks[..self.crowd as usize]
    }

    pub(crate) fn walls(&self) -> &[Block] {
        &self.blocks[self.crowd as usize..]
    }

    /// The town around `origin`.
    pub(crate) fn new(origin: Vec3) -> Self {
        let mut random = Random(7);
        let walls = walls(&mut random);
        let houses = &walls[1..];
        let mut blocks = Vec::new();
        for i in 0..5000 {
            let half: Vec3 = std::array::from_fn(|_| random.range(0.1, 0.7));
            let mut at = [random.range(-62.0, 62.0), half[1], random.range(-62.0, 62.0)];
            match i % 10 {
                // Most stand on the ground, in the streets and, never seen, in the houses. Some hover.
                0..7 => {}
                7 => at[1] = random.range(1.0, 25.0),
                // A crowd around the crossing at the origin, for the camera inside of it.
                8 => at = [random.range(-4.0, 4.0), random.range(0.2, 3.5), random.range(-4.0, 4.0)],
                _ => {
                    blocks.push(near_a_face(&houses[random.below(houses.len())], &mut random));
                    continue;
                }
            }
            let colour = [0; 3].map(|_| random.range(0.15, 1.0) as f32);
            blocks.push(Block {
                min: [0, 1, 2].map(|k| at[k] - half[k]),
                max: [0, 1, 2].map(|k| at[k] + half[k]),
                colour,
            });
        }
        // Twins of another colour at the same place: which one is seen is a matter of the order of drawing alone.
        for i in (0..5000).step_by(20) {
            let colour = blocks[i].colour.map(|c| 1.15 - c);
            blocks.push(Block { colour, ..blocks[i] });
        }
        let crowd = blocks.len() as u32;
        blocks.extend(walls);
        for block in &mut blocks {
            for ((min, max), shift) in block.min.iter_mut().zip(&mut block.max).zip(origin) {
                *min += shift;
                *max += shift;
            }
        }
        Self { blocks, crowd }
    }
}

/// The ground and 6 x 6 houses of 12 m, 8 m apart.
fn walls(random: &mut Random) -> Vec<Block> {
    let mut walls = vec![Block { min: [-70.0, -12.0, -70.0], max: [70.0, 0.0, 70.0], colour: [0.42, 0.44, 0.40] }];
    for house in 0..36 {
        let [x, z] = [f64::from(house / 6) * 20.0 - 56.0, f64::from(house % 6) * 20.0 - 56.0];
        let shade = random.range(0.55, 0.9) as f32;
        walls.push(Block {
            min: [x, 0.0, z],
            max: [x + 12.0, random.range(6.0, 20.0), z + 12.0],
            colour: [shade, 0.93 * shade, 0.82 * shade],
        });
    }
    walls
}

/// A box whose face lies in the plane of a house's face (a tie, which must stay) or a hair behind it (which may go).
fn near_a_face(house: &Block, random: &mut Random) -> Block {
    let axis = 2 * random.below(2);
    let along = 2 - axis;
    let depth = if random.below(2) == 0 { 0.0 } else { 10.0_f64.powf(random.range(-4.0, -1.0)) };
    let mut block = Block { min: [0.0; 3], max: [0.0; 3], colour: [0.9, 0.25, 0.2] };
    for (k, size) in [(1, house.max[1]), (along, 12.0)] {
        block.min[k] = house.min[k] + random.range(0.0, size - 1.5);
        block.max[k] = block.min[k] + random.range(0.3, 1.5);
    }
    if random.below(2) == 0 {
        (block.min[axis], block.max[axis]) = (house.min[axis] + depth, house.min[axis] + depth + 0.3);
    } else {
        (block.min[axis], block.max[axis]) = (house.max[axis] - depth - 0.3, house.max[axis] - depth);
    }
    block
}

/// A camera, and what it looks at.
#[derive(Debug)]
pub(crate) struct Shot {
    pub(crate) name: &'static str,
    pub(crate) camera: Camera,
    /// Which of [`ORIGINS`] the town stands at.
    pub(crate) town: usize,
    /// Whether the crowd is drawn into the depth prepass, too, so that it hides itself: nobody may be hidden by his own depth.
    pub(crate) crowd_occludes: bool,
}

/// Where the town is built: at the world's origin, and where float32 knows quarters of a metre only.
pub(crate) const ORIGINS: [Vec3; 2] = [[0.0; 3], [2_345_678.9, 123.4, -3_456_789.1]];

/// The cameras, for images of `size`.
pub(crate) fn shots(size: ImageSize) -> hiz_core::Result<Vec<Shot>> {
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
    let shot = |name, eye: Vec3, target: Vec3, projection, (town, crowd_occludes): (usize, bool)| {
        let [eye, target] = [eye, target].map(|p| std::array::from_fn(|k| p[k] + ORIGINS[town][k]));
        let camera = Camera::look_at(&Pose { eye, target, up: [0.0, 1.0, 0.0] }, &projection, size)?;
        Ok(Shot { name, camera, town, crowd_occludes })
    };
    let street = ([1.0, 1.7, 58.0], [-1.0, 3.0, 0.0]);
    let hill = ([-70.0, 26.0, 68.0], [0.0, 0.0, 0.0]);
    let walls_occlude = (0, false);
    Ok(vec![
        shot("street", street.0, street.1, perspective(60.0, 0.5, Some(160.0), Standard), walls_occlude)?,
        shot(
            "corner",
            [21.0, 2.5, 41.0],
            [-30.0, 4.0, -8.0],
            perspective(75.0, 0.1, Some(200.0), Reversed),
            walls_occlude,
        )?,
        shot("hill", hill.0, hill.1, perspective(50.0, 0.1, None, Reversed), walls_occlude)?,
        // Straight along an axis: faces towards the eye have one depth, those beside it are seen edge-on.
        shot("off_centre", [-41.0, 3.0, 62.0], [-41.0, 3.0, 0.0], off_centre(0.3, None, Standard), walls_occlude)?,
        shot("parallel", [3.0, 9.0, 90.0], [3.0, 9.0, 0.0], parallel(16.0, 200.0, Standard), walls_occlude)?,
        shot("isometric", [80.0, 60.0, 70.0], [0.0, 0.0, 0.0], parallel(24.0, 250.0, Reversed), walls_occlude)?,
        // The eye is 3 cm off a wall and looks into it at less than a degree.
        shot(
            "along_a_wall",
            [3.97, 2.0, 34.0],
            [4.2, 2.2, 0.0],
            perspective(70.0, 0.01, None, Reversed),
            walls_occlude,
        )?,
        // Boxes in front of the eye, around it and through the near plane.
        shot(
            "in_the_crowd",
            [0.0, 1.7, 0.0],
            [3.0, 1.9, 9.0],
            perspective(80.0, 0.3, Some(150.0), Standard),
            walls_occlude,
        )?,
        shot("crowd_hides_crowd", hill.0, hill.1, perspective(50.0, 1.0, Some(220.0), Standard), (0, true))?,
        shot(
            "straight_hides_crowd",
            [1.0, 1.7, 66.0],
            [1.0, 1.7, 0.0],
            perspective(60.0, 0.1, None, Reversed),
            (0, true),
        )?,
        // Faces parallel to the image: all of a box's pixels hold the depth of its nearest point.
        shot("parallel_hides_crowd", [3.0, 9.0, 90.0], [3.0, 9.0, 0.0], parallel(16.0, 200.0, Reversed), (0, true))?,
        shot("far_from_the_origin", hill.0, hill.1, perspective(50.0, 0.1, None, Reversed), (1, false))?,
    ])
}

/// `SplitMix64` (Steele, Lea, Flood, OOPSLA 2014): the same town everywhere.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}
