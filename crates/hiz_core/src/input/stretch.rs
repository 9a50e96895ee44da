//! How far the image of a point can move when the point moves by one unit.

use crate::host::linear::{Vec3, dot};
use crate::input::camera::Camera;

/// Room for the roundings of this file, as a share of each result.
/// A few dozen roundings of float64 make less than 2^-46.
const ROOM: f64 = 1.0 + 1.0 / 1_099_511_627_776.0; // 2^-40

/// The same where rows cancel, as a share of what cancels.
const CANCELLED: f64 = 1.0 / 281_474_976_710_656.0; // 2^-48

/// Upper bounds of what a camera makes of lengths in the world.
/// Both are in the scale of `ViewRows`, whose W' is w times a power of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretch {
    /// Pixels times W', per world unit.
    ///
    /// Take two points at a distance e of each other, of which one shows in the image, and whose W'
    /// is at least m.
    /// Their pixel positions are at most `pixels * e / m` apart.
    pub(crate) pixels: f64,
    /// W' per world unit of view depth; 0 for parallel rays.
    pub(crate) depth: f64,
}

impl Stretch {
    /// The bounds for `camera`.
    ///
    /// `pixels` is the greatest operator norm of the two rows `X' - t_x W'` and `Y' - t_y W'` for
    /// any pixel position t of the image.
    /// A norm is convex and the rows are linear in t, so one of the image's corners has it.
    pub(crate) fn of(camera: &Camera) -> Self {
        let pixels = at_corners(camera).into_iter().fold(0.0, f64::max);
        let w = [0, 1, 2].map(|k| camera.rows_near_one()[3][k]);
        Self { pixels, depth: dot(w, w).sqrt() * ROOM }
    }
}

/// Upper bounds of the operator norm at the four corners of the image.
fn at_corners(camera: &Camera) -> [f64; 4] {
    let rows = camera.rows_near_one();
    let linear = |r: usize, factor: f64| [0, 1, 2].map(|k| factor * rows[r][k]);
    let half_width = f64::from(camera.size().width) / 2.0;
    let half_height = f64::from(camera.size().height) / 2.0;
    let (x, y, w) = (linear(0, half_width), linear(1, -half_height), linear(3, 1.0));
    let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
    corners.map(|(right, down)| {
        let (t_x, t_y) = (right * half_width, down * half_height);
        let less = |row: Vec3, t: f64| [0, 1, 2].map(|k| row[k] - t * w[k]);
        let size = |row: Vec3, t: f64| [0, 1, 2].map(|k| row[k].abs() + (t * w[k]).abs());
        let sizes = [size(x, t_x), size(y, t_y)];
        let cancelled = sizes.map(|s| dot(s, s)).iter().sum::<f64>().sqrt();
        operator_norm(less(x, t_x), less(y, t_y)) * ROOM + CANCELLED * cancelled
    })
}

/// The greatest length that the matrix of these two rows gives to a unit vector.
fn operator_norm(first: Vec3, second: Vec3) -> f64 {
    let (a, b, c) = (dot(first, first), dot(first, second), dot(second, second));
    // The greater eigenvalue of [a b; b c].
    (0.5 * (a + c) + (0.5 * (a - c)).hypot(b)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::image::{DepthConvention, ImageSize};
    use crate::input::projection::{Pose, Projection};

    fn camera(projection: &Projection, size: (u32, u32)) -> Camera {
        let pose = Pose { eye: [3.0, 4.0, 5.0], target: [4.0, 2.0, 9.0], up: [0.1, 1.0, 0.0] };
        Camera::look_at(&pose, projection, ImageSize::new(size.0, size.1)).unwrap()
    }

    /// A camera along z with square pixels: the farthest corner moves fastest.
    /// There `|t|^2 + f^2 = G^2`, with t the corner and f the focal length in pixels.
    #[test]
    fn a_centred_perspective_by_hand() {
        for (fov_y, (width, height)) in [(1.0_f64, (640, 360)), (2.5, (100, 300))] {
            let convention = DepthConvention::Reversed;
            let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
            let camera = camera(&projection, (width, height));
            let half = [f64::from(width) / 2.0, f64::from(height) / 2.0];
            let focal = half[1] / (fov_y / 2.0).tan();
            let found = Stretch::of(&camera);
            let corner = (half[0] * half[0] + half[1] * half[1] + focal * focal).sqrt();
            // The scale of W' is a power of two, and W' is view depth times that.
            let expected = corner * found.depth;
            assert!((found.pixels / expected - 1.0).abs() < 1e-9, "{found:?}, not {expected}");
            assert!(found.pixels >= expected * (1.0 - 1e-15));
        }
    }

    /// Parallel rays: a unit along either axis of the image is that many pixels.
    #[test]
    fn parallel_rays_by_hand() {
        let projection = Projection::Orthographic {
            left: -4.0,
            right: 12.0,
            bottom: -2.0,
            top: 1.0,
            near: 0.0,
            far: 100.0,
            convention: DepthConvention::Standard,
        };
        // 40 pixels per unit across, and 30 down.
        let found = Stretch::of(&camera(&projection, (640, 90)));
        assert!((found.pixels - 40.0).abs() < 1e-9 && found.depth == 0.0, "{found:?}");
        let found = Stretch::of(&camera(&projection, (64, 90)));
        assert!((found.pixels - 30.0).abs() < 1e-9, "{found:?}");
    }

    /// No position within an off-centre image has a greater norm than its corners, and each of the
    /// four is needed.
    #[test]
    fn corners_are_the_greatest() {
        // The borders of the image at depth 1; each of its four corners is farthest out once.
        let mut without = [0; 4];
        for (left, right, bottom, top) in [
            (-0.3, 2.0, -1.5, 0.1),
            (-2.0, 0.3, -1.5, 0.1),
            (-0.3, 2.0, -0.1, 1.5),
            (-2.0, 0.3, -0.1, 1.5),
        ] {
            let (near, far, convention) = (0.2, Some(50.0), DepthConvention::Standard);
            let projection =
                Projection::Frustum { left, right, bottom, top, near, far, convention };
            let camera = camera(&projection, (30, 20));
            let greatest = greatest_norm(&camera);
            let whole = Stretch::of(&camera).pixels;
            assert!(greatest <= whole && greatest > whole * 0.99, "{greatest} of {whole}");
            // Planted: one corner is left out.
            for (left_out, misses) in without.iter_mut().enumerate() {
                let mut corners = at_corners(&camera);
                corners[left_out] = 0.0;
                *misses += i32::from(corners.into_iter().fold(0.0, f64::max) < greatest);
            }
        }
        assert_eq!(without, [1; 4], "a corner that is left out shows in one camera");
    }

    /// The greatest norm at the corners of all pixels of 30 x 20.
    fn greatest_norm(camera: &Camera) -> f64 {
        let rows = camera.rows_near_one();
        let row = |r: usize, s: f64| [0, 1, 2].map(|k| s * rows[r][k]);
        let (x, y, w) = (row(0, 15.0), row(1, -10.0), row(3, 1.0));
        let mut greatest = 0.0_f64;
        for i in 0..=30 {
            for j in 0..=20 {
                let (t_x, t_y) = (f64::from(i) - 15.0, f64::from(j) - 10.0);
                let at = |row: Vec3, t: f64| [0, 1, 2].map(|k| row[k] - t * w[k]);
                let (first, second) = (at(x, t_x), at(y, t_y));
                for turn in 0..64 {
                    // The norm once more, as the longest image of a circle of unit vectors in the
                    // span of both rows.
                    let angle = f64::from(turn) * std::f64::consts::PI / 64.0;
                    let v = [0, 1, 2].map(|k| angle.cos() * first[k] + angle.sin() * second[k]);
                    let length = dot(v, v).sqrt();
                    let moved = dot(first, v).hypot(dot(second, v)) / length;
                    greatest = greatest.max(moved);
                }
            }
        }
        greatest
    }
}
