//! A box in a view, in float64: its rectangle and its depths.
//!
//! Nothing here is certified: these numbers are rounded like any others.

use crate::host::linear::{Mat4, Vec3, dot, sub};
use crate::input::camera::Camera;

/// A camera as boxes are seen with it.
#[derive(Debug)]
pub(super) struct Eye {
    rows: Mat4,
    origin: Vec3,
    /// View depth is this row's product, in world units.
    depth: [f64; 4],
    is_reversed: bool,
    is_parallel: bool,
}

/// A box in a view.
#[derive(Debug, Clone, Copy)]
pub(super) enum Seen {
    /// All of it is outside of one plane of the frustum.
    Outside,
    /// It crosses the near plane, or its numbers are no numbers.
    Crossing(Depths),
    /// It has a rectangle.
    Inside([f64; 4], Depths),
}

/// View depths of a box' corners, in world units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Depths {
    pub(super) nearest: f64,
    pub(super) farthest: f64,
}

impl Eye {
    pub(super) fn new(camera: &Camera) -> Self {
        let rows = camera.rows();
        let [.., z, w] = rows;
        let is_parallel = [w[0], w[1], w[2]] == [0.0; 3];
        let is_reversed = camera.convention().is_reversed();
        // NDC depth of parallel rays grows or falls with the way along them.
        let along = match (is_parallel, is_reversed) {
            (false, _) => w,
            (true, false) => z,
            (true, true) => z.map(|v| -v),
        };
        let linear = [along[0], along[1], along[2]];
        let length = dot(linear, linear).sqrt();
        let depth = along.map(|v| v / length);
        Self { rows, origin: camera.origin(), depth, is_reversed, is_parallel }
    }

    /// How large a box looks: its diagonal per view depth of its middle.
    ///
    /// The eye may be within the box, so the depth counts as half of the diagonal at least.
    pub(super) fn apparent_size(&self, corners: &[Vec3; 8]) -> f64 {
        let across = sub(corners[7], corners[0]);
        let diagonal = dot(across, across).sqrt();
        if self.is_parallel {
            return diagonal;
        }
        let middle = std::array::from_fn(|k| 0.5 * (corners[0][k] + corners[7][k]));
        diagonal / self.depth_of(middle).max(0.5 * diagonal).max(f64::MIN_POSITIVE)
    }

    fn depth_of(&self, p: Vec3) -> f64 {
        let d = sub(p, self.origin);
        let [x, y, z, w] = self.depth;
        dot([x, y, z], d) + w
    }

    /// Where a box is: columns and rows as parts of the image's sides, `[x0, y0, x1, y1]`.
    pub(super) fn look(&self, corners: &[Vec3; 8]) -> Seen {
        let clip = corners.map(|p| {
            let d = sub(p, self.origin);
            self.rows.map(|r| dot([r[0], r[1], r[2]], d) + r[3])
        });
        let nearness = |[_, _, z, w]: [f64; 4]| if self.is_reversed { z } else { w - z };
        let all = |is: &dyn Fn([f64; 4]) -> bool| clip.iter().all(|c| is(*c));
        let is_outside = all(&|c| c[0] < -c[3])
            || all(&|c| c[0] > c[3])
            || all(&|c| c[1] < -c[3])
            || all(&|c| c[1] > c[3])
            || all(&|c| nearness(c) > c[3])
            || all(&|c| nearness(c) < 0.0);
        if is_outside {
            return Seen::Outside;
        }
        let depths = corners.map(|p| self.depth_of(p));
        let depths = Depths {
            nearest: depths.into_iter().fold(f64::INFINITY, f64::min),
            farthest: depths.into_iter().fold(f64::NEG_INFINITY, f64::max),
        };
        // NaN is not in front.
        if !all(&|c| nearness(c) <= c[3] && c[3] > 0.0 && c[0].abs() + c[1].abs() < f64::INFINITY) {
            return Seen::Crossing(depths);
        }
        let [x, y] = [clip.map(|c| 0.5 + 0.5 * c[0] / c[3]), clip.map(|c| 0.5 - 0.5 * c[1] / c[3])];
        let least = |v: [f64; 8]| v.into_iter().fold(f64::INFINITY, f64::min);
        let most = |v: [f64; 8]| v.into_iter().fold(f64::NEG_INFINITY, f64::max);
        Seen::Inside([least(x), least(y), most(x), most(y)], depths)
    }
}

/// The pixels of a side that a part of it touches, `first..=last`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
pub(super) fn touched(from: f64, to: f64, side: u32) -> (u32, u32) {
    let last = f64::from(side - 1);
    let pixel = |v: f64| (v * f64::from(side)).floor().clamp(0.0, last) as u32;
    (pixel(from), pixel(to))
}
