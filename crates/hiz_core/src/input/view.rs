//! From a float64 camera to what the cull shader reads: float32 rows about a reference point, with
//! magnitude rows that bound every rounding.
//! All of it in float64 on the host, once a camera.
//!
//! The certificates compare linear functions of the position.
//! Written about the eye, with the depth row relative to w (`z = A w + Z'`), their rounding errors
//! are proportional to the *distance* instead of the world coordinates: margins come out near 1e-5
//! of the distance.
//! Parallel rays have no eye: theirs is the distance from a point that is likely to be near.
//! The magnitude rows carry the share that each coefficient can contribute to an error, in units of
//! float32's eps; the shader multiplies them by the instance's own magnitudes.

use crate::error::{Error, Result};
use crate::host::linear::Mat3;
use crate::host::linear::Mat4;
use crate::host::linear::Vec3;
use crate::host::linear::dot;
use crate::host::linear::solve3;
use crate::host::linear::sub;
use crate::host::rounding::ROUNDING;
use crate::host::rounding::split3;
use crate::host::rounding::{EPS, flushed, round_up};
use crate::input::camera::Camera;

/// The certificates' margin in eps, `docs/accuracy.md`, section "Counting the roundings".
/// The shader's `ERROR_ULPS`.
pub const ERROR_ULPS: f64 = 24.0;

/// A linear function of the position about the reference point: `m . d + m3`, and the magnitudes
/// that bound its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    /// Three linear coefficients and the constant.
    pub(crate) m: [f32; 4],
    /// An upper bound of each coefficient's size, raised where its own error exceeds an eps.
    pub(crate) a: [f32; 4],
}

/// A camera made ready for float32.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ViewRows {
    /// Pixel column relative to the image's middle, times w.
    pub(crate) x: Row,
    /// Pixel row relative to the image's middle (downwards), times w.
    pub(crate) y: Row,
    /// Depth: z less `z_slope` times w.
    pub(crate) z: Row,
    /// w: view depth up to a power of two.
    pub(crate) w: Row,
    /// A: `z = A w + Z'`.
    pub(crate) z_slope: f32,
    /// The reference point is exactly `eye_hi + eye_lo`.
    pub(crate) eye_hi: [f32; 3],
    /// See `eye_hi`.
    pub(crate) eye_lo: [f32; 3],
    /// Instances whose magnitudes reach this far are invalid for this camera: products could
    /// overflow float32.
    pub(crate) coordinate_limit: f32,
}

impl ViewRows {
    /// Rounds `camera` to float32.
    /// `transform_slack` is kappa: how many eps of `sum |M| |p|` another renderer's own transform
    /// may have cost the depth image (0: the depth is exact for these matrices).
    pub(crate) fn new(camera: &Camera, transform_slack: f64) -> Result<Self> {
        let rows = camera.rows_near_one();
        let linear = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
        let origin = camera.origin();
        let (w_lin, z_lin) = (linear(3), linear(2));
        let Reference { hi: eye_hi, lo: eye_lo, point: eye, is_eye } = Reference::of(camera);
        let about_eye = |r: usize| Affine::about(eye, rows[r], origin);
        let size = camera.size();
        let x = about_eye(0).scaled(f64::from(size.width) / 2.0);
        let y = about_eye(1).scaled(-f64::from(size.height) / 2.0);
        let w = about_eye(3);
        // About the eye: what of z is proportional to w.
        // Elsewhere: the depth of that point, so that Z' and `d - A` are small near it.
        let slope =
            if is_eye { dot(z_lin, w_lin) / dot(w_lin, w_lin) } else { about_eye(2).m[3] / w.m[3] };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "rounding to float32 is the point; what it leaves over stays in Z'"
        )]
        let z_slope = if slope.abs() < 32_768.0 { flushed(slope as f32) } else { 0.0 };
        let z = about_eye(2).minus(f64::from(z_slope), &w);
        let [x, y, z, w] = [x, y, z, w].map(|r| r.rounded(transform_slack));

        let linear_limit = [(&x, 1.0), (&y, 1.0), (&z, 1.0), (&w, 65_536.0)]
            .iter()
            .flat_map(|(r, factor)| r.a[..3].iter().map(move |a| f64::from(*a) * factor))
            .fold(0.0_f64, f64::max);
        let constant_limit = [(&x, 1.0), (&y, 1.0), (&z, 1.0), (&w, 65_536.0)]
            .iter()
            .map(|(r, factor)| f64::from(r.a[3]) * factor)
            .fold(0.0_f64, f64::max);
        // Written so that NaN fails, too.
        if !(linear_limit <= 2.0_f64.powi(34) && constant_limit <= 2.0_f64.powi(58)) {
            return Err(Error::invalid(
                "camera",
                format!(
                    "expected rows whose coefficients stay below 2^34 and constants below 2^58 when w is scaled to 1, \
                     got {linear_limit:e} and {constant_limit:e}"
                ),
            ));
        }
        let coordinate_limit =
            2.0_f64.powf((58.0 - linear_limit.log2()).floor()).min(2.0_f64.powi(50));
        if coordinate_limit < 1.0 {
            return Err(Error::invalid(
                "camera",
                "expected a projection that leaves room for coordinates of at least 1",
            ));
        }
        #[expect(clippy::cast_possible_truncation, reason = "a power of two in float32's range")]
        let coordinate_limit = coordinate_limit as f32;
        Ok(Self { x, y, z, w, z_slope, eye_hi, eye_lo, coordinate_limit })
    }
}

/// The clip-space rows about the reference point, for a vertex shader.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ClipRows {
    pub(crate) rows: [[f32; 4]; 4],
    pub(crate) eye_hi: [f32; 3],
    pub(crate) eye_lo: [f32; 3],
}

impl ClipRows {
    /// Rounds `camera`'s rows to float32, with w scaled to be near 1.
    pub(crate) fn new(camera: &Camera) -> Result<Self> {
        // The cull's own view decides what float32 can hold: what it refuses is not worth drawing
        // either.
        ViewRows::new(camera, 0.0)?;
        let Reference { hi: eye_hi, lo: eye_lo, point: eye, .. } = Reference::of(camera);
        let rows = camera
            .rows_near_one()
            .map(|row| Affine::about(eye, row, camera.origin()).rounded(0.0).m);
        Ok(Self { rows, eye_hi, eye_lo })
    }
}

/// The point that a camera's float32 rows stand about.
/// Any would be *valid*; one near what is tested makes the margins small, for they are proportional
/// to the distance from it.
struct Reference {
    /// The two halves add up to the point without rounding: `lo` holds bits of a float64 below
    /// those of `hi`.
    hi: [f32; 3],
    lo: [f32; 3],
    point: Vec3,
    /// Whether it is the centre of projection.
    is_eye: bool,
}

impl Reference {
    /// A point of the image's middle axis (x = y = 0).
    ///
    /// - Perspective: the eye, where w = 0; the near plane where the far one is not twice as far
    ///   away, so that all that is seen is nearer to it than to the eye.
    /// - Parallel rays: [`depth_of_interest`].
    /// - The world's origin where no such point can be found.
    fn of(camera: &Camera) -> Self {
        let rows = camera.rows_near_one();
        let middle = |third: usize, value: f64| {
            let m: Mat3 = [0, 1, third].map(|r| [rows[r][0], rows[r][1], rows[r][2]]);
            solve3(&m, [-rows[0][3], -rows[1][3], value - rows[third][3]])
        };
        let (relative, is_eye) = if camera.is_orthographic() {
            (middle(2, depth_of_interest(camera, &rows)), false)
        } else {
            let depth = |p: Vec3| dot([rows[2][0], rows[2][1], rows[2][2]], p) + rows[2][3];
            let (eye, ahead) = (middle(3, 0.0), middle(3, 1.0));
            // Along the axis z grows from the eye's by so much for each w.
            let near = eye.zip(ahead).and_then(|(eye, ahead)| {
                near_of_thin_range(
                    depth(eye),
                    depth(ahead) - depth(eye),
                    camera.convention().is_reversed(),
                )
            });
            match near {
                Some(w) => (middle(3, w), false),
                None => (eye, true),
            }
        };
        let origin = camera.origin();
        let point: Vec3 = std::array::from_fn(|k| origin[k] + relative.unwrap_or([0.0; 3])[k]);
        // Beyond 2^60 the shader would call everything invalid; the origin is as good as any point
        // there.
        let point = if point.iter().all(|v| v.abs() < 2.0_f64.powi(60)) { point } else { [0.0; 3] };
        let (hi, lo) = split3(point);
        Self { hi, lo, point: std::array::from_fn(|k| f64::from(hi[k]) + f64::from(lo[k])), is_eye }
    }
}

/// w at the near plane, where at the far plane it is less than twice that.
/// Depth is `slope + at_eye / w`.
fn near_of_thin_range(at_eye: f64, slope: f64, reversed: bool) -> Option<f64> {
    let (at_zero, at_one) = (-at_eye / slope, at_eye / (1.0 - slope));
    let (near, far) = if reversed { (at_one, at_zero) } else { (at_zero, at_one) };
    // Written so that NaN is not thin, either.
    (near > 0.0 && near < far && far < 2.0 * near).then_some(near)
}

/// The z around which a camera with parallel rays is likely to see most: where its eye stands, or
/// at the plane next to it where that is outside the camera's range.
/// A bare matrix does not say where the eye is: there it is the world's origin, if that is in view,
/// or else the near plane, in either convention.
fn depth_of_interest(camera: &Camera, rows: &Mat4) -> f64 {
    let [x, y, z, w] = rows.map(|row| row[3]);
    // The rows stand about the origin, and the constants are its clip coordinates. w is not 0: no
    // NaN.
    let ratios = [x / w, y / w, z / w];
    let in_view =
        ratios[0].abs() <= 1.0 && ratios[1].abs() <= 1.0 && (0.0..=1.0).contains(&ratios[2]);
    let near = if camera.convention().is_reversed() { 1.0 } else { 0.0 };
    w * if camera.is_posed() || in_view { ratios[2].clamp(0.0, 1.0) } else { near }
}

/// A row in float64, what is known about its errors, and the world-space sizes that kappa
/// multiplies.
/// Index 3: the constant.
#[derive(Debug, Clone, Copy)]
struct Affine {
    m: [f64; 4],
    error: [f64; 4],
    world: [f64; 4],
}

impl Affine {
    /// `row` (about `origin`) about `eye`.
    /// The linear part is exact; the constant is evaluated at the eye, and 8 roundings of float64
    /// cover its subtraction, three products and three sums with room.
    fn about(eye: Vec3, row: [f64; 4], origin: Vec3) -> Self {
        let lin = [row[0], row[1], row[2]];
        let from_origin = sub(eye, origin);
        let travelled: f64 = (0..3).map(|k| lin[k].abs() * (eye[k].abs() + origin[k].abs())).sum();
        // kappa: |p| <= |d| + |eye|, and the renderer's own constant is the one about the world's
        // origin.
        let world: f64 = (0..3).map(|k| lin[k].abs() * eye[k].abs()).sum::<f64>()
            + (row[3] - dot(lin, origin)).abs();
        Self {
            m: [lin[0], lin[1], lin[2], dot(lin, from_origin) + row[3]],
            error: [0.0, 0.0, 0.0, 8.0 * ROUNDING * (travelled + row[3].abs())],
            world: [lin[0].abs(), lin[1].abs(), lin[2].abs(), world],
        }
    }

    /// `s * self`; exact where `s` is a power of two, and one rounding is charged anyway.
    fn scaled(&self, s: f64) -> Self {
        Self {
            m: self.m.map(|v| v * s),
            error: std::array::from_fn(|k| (self.error[k] + ROUNDING * self.m[k].abs()) * s.abs()),
            world: self.world.map(|v| v * s.abs()),
        }
    }

    /// `self - slope * other`; what cancels leaves its rounding behind, in all four coefficients.
    fn minus(&self, slope: f64, other: &Self) -> Self {
        let each = |f: &dyn Fn(usize) -> f64| std::array::from_fn(f);
        Self {
            m: each(&|k| self.m[k] - slope * other.m[k]),
            error: each(&|k| {
                self.error[k]
                    + slope.abs() * other.error[k]
                    + 8.0 * ROUNDING * (self.m[k].abs() + (slope * other.m[k]).abs())
            }),
            world: each(&|k| self.world[k] + slope.abs() * other.world[k]),
        }
    }

    /// Rounds to float32 and forms the magnitudes: `a >= |m|`, and `a * eps >=` the coefficient's
    /// own error.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "rounding to float32 is the point; the magnitude bounds it"
    )]
    fn rounded(&self, transform_slack: f64) -> Row {
        let kappa = transform_slack / ERROR_ULPS;
        let m = self.m.map(|v| flushed(v as f32));
        let a = std::array::from_fn(|k| {
            let error = self.error[k] + (self.m[k] - f64::from(m[k])).abs();
            let a = f64::from(m[k]).abs().max(error / EPS) + kappa * self.world[k];
            round_up(if error > 0.0 { a.max(2.0_f64.powi(-120)) } else { a })
        });
        Row { m, a }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::image::{DepthConvention, ImageSize};
    use crate::input::projection::{Pose, Projection};

    fn camera(eye: Vec3, near: f64, far: Option<f64>, convention: DepthConvention) -> Camera {
        let pose =
            Pose { eye, target: [eye[0] + 1.0, eye[1] + 2.0, eye[2] - 3.0], up: [0.0, 1.0, 0.0] };
        let projection = Projection::Perspective { fov_y: 1.0, near, far, convention };
        Camera::look_at(&pose, &projection, ImageSize::new(641, 359)).unwrap()
    }

    #[test]
    fn the_eye_is_exactly_its_two_halves() {
        let eye = [1.0e6 + 0.1, -3.0e8 + 0.7, 1.0 / 3.0];
        let rows = ViewRows::new(&camera(eye, 0.1, None, DepthConvention::Reversed), 0.0).unwrap();
        for (k, coordinate) in eye.iter().enumerate() {
            let sum = f64::from(rows.eye_hi[k]) + f64::from(rows.eye_lo[k]);
            assert!((sum - coordinate).abs() <= coordinate.abs() * 2.0_f64.powi(-47));
        }
        // x, y and w vanish at the eye up to what the two halves leave over.
        for row in [rows.x, rows.y, rows.w] {
            assert!(f64::from(row.m[3]).abs() < 1e-4, "{row:?}");
        }
    }

    fn point(view: &ViewRows) -> Vec3 {
        std::array::from_fn(|k| f64::from(view.eye_hi[k]) + f64::from(view.eye_lo[k]))
    }

    fn close(a: Vec3, b: Vec3) -> bool {
        sub(a, b).iter().all(|v| v.abs() < 1e-9)
    }

    /// A far plane less than twice as far away as the near one: the near one's middle, and its
    /// depth.
    /// The eye is at (0, 0, 5).
    #[test]
    fn thin_ranges_are_measured_from_their_near_plane() {
        let pose = Pose { eye: [0.0, 0.0, 5.0], target: [0.0; 3], up: [0.0, 1.0, 0.0] };
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            for (near, far, z) in [
                (64.0, Some(127.0), -59.0),
                (64.0, Some(129.0), 5.0),
                (64.0, None, 5.0),
                (1.0, Some(1e3), 5.0),
            ] {
                let projection = Projection::Perspective { fov_y: 1.0, near, far, convention };
                let posed = Camera::look_at(&pose, &projection, ImageSize::new(8, 8)).unwrap();
                let bare = Camera::from_clip_from_world(
                    posed.clip_from_world(),
                    ImageSize::new(8, 8),
                    convention,
                );
                for camera in [posed, bare.unwrap()] {
                    let view = ViewRows::new(&camera, 0.0).unwrap();
                    assert!(close(point(&view), [0.0, 0.0, z]), "{near} {far:?}: {view:?}");
                    if z < 0.0 {
                        let depth = if convention.is_reversed() { 1.0 } else { 0.0 };
                        assert!(
                            (view.z_slope - depth).abs() < 1e-6
                                && view.z.m[3].abs() < 1e-7
                                && (view.w.m[3] - 64.0).abs() < 1e-3,
                            "{view:?}"
                        );
                    }
                }
            }
        }
    }

    /// Parallel rays: the reference point by hand.
    /// The eye is at (0, 0, 5), and looks along -z.
    #[test]
    fn parallel_rays_are_measured_from_where_things_are() {
        let pose = Pose { eye: [0.0, 0.0, 5.0], target: [0.0; 3], up: [0.0, 1.0, 0.0] };
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            let camera = |near, far, beside: f64| {
                let (left, right) = (beside - 2.0, beside + 2.0);
                let projection = Projection::Orthographic {
                    left,
                    right,
                    bottom: -2.0,
                    top: 2.0,
                    near,
                    far,
                    convention,
                };
                Camera::look_at(&pose, &projection, ImageSize::new(8, 8)).unwrap()
            };
            // View depths of the planes, the image's middle beside the eye, and the point's z: the
            // eye's, or the next plane's.
            for (near, far, beside, z) in [
                (0.0, 1024.0, 0.0, 5.0),
                (1.0, 1024.0, 0.0, 4.0),
                (-1024.0, 1024.0, 8.0, 5.0),
                (-1024.0, -2.0, 0.0, 7.0),
            ] {
                let camera = camera(near, far, beside);
                let view = ViewRows::new(&camera, 0.0).unwrap();
                let found = point(&view);
                assert!(close(found, [beside, 0.0, z]), "{near} {far}: {found:?}");
                // Its depth is A, and nothing is left of it in Z'.
                let depth = (5.0 - z - near) / (far - near);
                let depth = if convention.is_reversed() { 1.0 - depth } else { depth };
                assert!(
                    (f64::from(view.z_slope) - depth).abs() < 1e-7 && view.z.m[3].abs() < 1e-7,
                    "{view:?}"
                );
            }
            // A bare matrix: the world's origin where it is in view, at view depth 5; or else the
            // near plane.
            for (near, far, beside, z) in [
                (1.0, 1024.0, 0.0, 0.0),
                (1.0, 1024.0, 8.0, 4.0),
                (8.0, 1024.0, 0.0, -3.0),
                (1.0, 2.0, 0.0, 4.0),
            ] {
                let m = camera(near, far, beside).clip_from_world();
                let bare =
                    Camera::from_clip_from_world(m, ImageSize::new(8, 8), convention).unwrap();
                let found = point(&ViewRows::new(&bare, 0.0).unwrap());
                assert!(close(found, [beside, 0.0, z]), "{near} {far} {beside}: {found:?}");
            }
        }
    }

    /// The two halves are not the eye: what lies between stays in the constants.
    #[test]
    fn constants_stand_at_the_two_halves() {
        let eye = [1.0e9 + 0.1, -3.0e8 + 0.7, 1.0e7 + 1.0 / 3.0];
        let camera = camera(eye, 0.1, None, DepthConvention::Reversed);
        let view = ViewRows::new(&camera, 0.0).unwrap();
        let offset: Vec3 =
            std::array::from_fn(|k| f64::from(view.eye_hi[k]) + f64::from(view.eye_lo[k]) - eye[k]);
        for (row, r, scale) in [(view.x, 0, 320.5), (view.y, 1, -179.5), (view.w, 3, 1.0)] {
            let [a, b, c, _] = camera.rows_near_one()[r];
            let expected = scale * dot([a, b, c], offset);
            assert!(
                expected.abs() > 1e-9 && (f64::from(row.m[3]) / expected - 1.0).abs() < 1e-3,
                "{row:?} {expected}"
            );
        }
    }

    #[test]
    fn magnitudes_bound_the_coefficients_and_what_float32_cannot_hold() {
        let camera = camera([12.3, -4.5, 6.7], 1e-3, Some(1e5), DepthConvention::Standard);
        let view = ViewRows::new(&camera, 0.0).unwrap();
        for row in [view.x, view.y, view.z, view.w] {
            for k in 0..4 {
                assert!(row.a[k] >= row.m[k].abs());
            }
        }
        // Z' carries the near plane in its constant: -f n / (f - n) up to the power of two, and
        // next to nothing in its linear part.
        assert!(view.z.m[..3].iter().all(|v| v.abs() < 1e-6));
        assert!(view.z.m[3] < 0.0);
        // kappa adds kappa / 24 of the world-space size, never less.
        let slack = ViewRows::new(&camera, 24.0).unwrap();
        assert!(slack.z.a.iter().zip(view.z.a).all(|(a, b)| *a > b));
    }

    /// A matrix means the same times any positive number, down to where its products leave
    /// float64's range.
    #[test]
    fn the_scale_of_the_matrix_does_not_matter() {
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            let camera = camera([1e3 + 0.1, -20.0, 7.0], 0.1, Some(1e4), convention);
            let rows = ViewRows::new(&camera, 1.0).unwrap();
            for power in [-1000, -500, -1, 1, 500, 990] {
                let scale = 2.0_f64.powi(power);
                let m = camera.rows().map(|r| r.map(|v| v * scale));
                let scaled =
                    Camera::from_rows(m, camera.origin(), camera.size(), convention).unwrap();
                assert_eq!(ViewRows::new(&scaled, 1.0).unwrap(), rows, "2^{power}");
            }
        }
    }

    #[test]
    fn rows_that_float32_cannot_hold_are_refused() {
        let m = [
            [1e30, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ];
        let camera =
            Camera::from_clip_from_world(m, ImageSize::new(8, 8), DepthConvention::Standard)
                .unwrap();
        assert!(ViewRows::new(&camera, 0.0).unwrap_err().to_string().contains("2^34"));
        // Half an image of 8 pixels is 4 times the coefficient.
        for (exponent, held) in [(31, true), (33, false)] {
            let mut m = m;
            m[0][0] = 2.0_f64.powi(exponent);
            let camera =
                Camera::from_clip_from_world(m, ImageSize::new(8, 8), DepthConvention::Standard)
                    .unwrap();
            assert_eq!(ViewRows::new(&camera, 0.0).is_ok(), held, "2^{exponent}");
        }
    }

    #[test]
    fn rounding_up_never_falls_below() {
        for v in [0.0, 0.1, 1.0 / 3.0, 1e-40, 16_777_217.0, 3.5e38] {
            let up = round_up(v);
            assert!(f64::from(up) >= v);
            assert!(up == 0.0 || up.is_infinite() || f64::from(up.next_down()) < v);
        }
        assert!(round_up(f64::NAN).is_nan());
    }
}
