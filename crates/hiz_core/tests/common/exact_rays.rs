//! The truth about rays and triangles, in exact integers and by brute force.
//! It uses no code of the crate except a camera's rows.

use hiz_core::Camera;
use num_bigint::{BigInt, Sign};

/// Numbers are integers times 2^-SCALE; no input of these tests is finer.
const SCALE: i32 = 200;

fn exact(x: f64) -> BigInt {
    assert!(x.is_finite());
    if x == 0.0 {
        return BigInt::ZERO;
    }
    let bits = x.to_bits();
    let field = ((bits >> 52) & 0x7ff) as i32;
    let fraction = bits & ((1 << 52) - 1);
    let (integer, exponent) =
        if field == 0 { (fraction, -1074) } else { (fraction | 1 << 52, field - 1075) };
    let shift = exponent + SCALE;
    let magnitude = if shift >= 0 {
        BigInt::from(integer) << shift as usize
    } else {
        assert!(integer.trailing_zeros() as i32 >= -shift, "{x} is finer than 2^-{SCALE}");
        BigInt::from(integer >> -shift)
    };
    if x < 0.0 { -magnitude } else { magnitude }
}

/// A triangle's corners in clip space, at twice the scale: x, y, z, w.
type ClipTriangle = [[BigInt; 4]; 3];

/// Triangles as one camera sees them, exactly.
pub(crate) struct ExactScene {
    triangles: Vec<ClipTriangle>,
    size: [f64; 2],
    reversed: bool,
}

impl ExactScene {
    pub(crate) fn new(camera: &Camera, vertices: &[f64], triangles: &[u32]) -> Self {
        let rows = camera.rows().map(|row| row.map(exact));
        let origin = camera.origin().map(exact);
        let clip: Vec<[BigInt; 4]> = vertices
            .chunks_exact(3)
            .map(|p| {
                let d: Vec<BigInt> = p.iter().zip(&origin).map(|(p, o)| exact(*p) - o).collect();
                std::array::from_fn(|i| {
                    (0..3).fold(&rows[i][3] << SCALE as usize, |sum, k| sum + &rows[i][k] * &d[k])
                })
            })
            .collect();
        let triangles = triangles
            .chunks_exact(3)
            .map(|t| [0, 1, 2].map(|k| clip[t[k] as usize].clone()))
            .collect();
        let size = camera.size();
        Self {
            triangles,
            size: [f64::from(size.width), f64::from(size.height)],
            reversed: camera.convention().is_reversed(),
        }
    }

    /// Whether a ray meets a triangle of `facing` beyond the near plane, at `depth` or nearer.
    /// The ray goes through the image point `at` (pixels, row 0 on top).
    /// Triangles that are exactly edge-on count as missed.
    pub(crate) fn blocked(&self, at: [f64; 2], depth: f32, facing: Facing) -> bool {
        let [width, height] = self.size.map(exact);
        let (px, py) = (exact(at[0]), exact(at[1]));
        // NDC times the image's size: x = 2 px - W, y = H - 2 py.
        let (qx, qy) = ((&px << 1usize) - &width, &height - (&py << 1usize));
        let depth = exact(f64::from(depth));
        self.triangles.iter().any(|t| {
            // The ray's line meets the combination of the corners with x W = q w.
            let u: [[BigInt; 2]; 3] = std::array::from_fn(|i| {
                [&t[i][0] * &width - &qx * &t[i][3], &t[i][1] * &height - &qy * &t[i][3]]
            });
            let beside = |axis: usize, sign| u.iter().all(|corner| corner[axis].sign() == sign);
            if [0, 1].iter().any(|axis| beside(*axis, Sign::Plus) || beside(*axis, Sign::Minus)) {
                return false;
            }
            let cross = |a: usize, b: usize| &u[a][0] * &u[b][1] - &u[a][1] * &u[b][0];
            let weights = [cross(1, 2), cross(2, 0), cross(0, 1)];
            let has = |sign| weights.iter().any(|w| w.sign() == sign);
            let (plus, minus) = (has(Sign::Plus), has(Sign::Minus));
            if plus == minus || !facing.admits(plus) {
                return false;
            }
            let along = |k: usize| {
                let sum = (0..3).fold(BigInt::ZERO, |sum, i| sum + &weights[i] * &t[i][k]);
                if plus { sum } else { -sum }
            };
            let (z, w) = (along(2), along(3));
            if w.sign() != Sign::Plus {
                return false;
            }
            let at_depth = &depth * &w;
            let z = z << SCALE as usize;
            let w = w << SCALE as usize;
            if self.reversed {
                z <= w && z >= at_depth
            } else {
                z.sign() != Sign::Minus && z <= at_depth
            }
        })
    }
}

/// Which triangles block, by their sense of rotation in the image with y up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Facing {
    Any,
    CounterClockwise,
    Clockwise,
}

impl Facing {
    fn admits(self, counter_clockwise: bool) -> bool {
        match self {
            Self::Any => true,
            Self::CounterClockwise => counter_clockwise,
            Self::Clockwise => !counter_clockwise,
        }
    }
}
