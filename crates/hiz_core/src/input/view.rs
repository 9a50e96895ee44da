//! From a float64 camera to the float32 rows that the cull shader reads.
//!
//! Everything here runs in float64 on the host, once per camera.
//! The rows are linear functions of the position about a reference point.
//! Magnitude rows beside them bound every rounding.
//!
//! The certificates compare these linear functions.
//! About the eye, with the depth row relative to w (`z = A w + Z'`), rounding errors are
//! proportional to the distance from the eye, not to the world coordinates.
//! Margins then are near 1e-5 of the distance.
//! Parallel rays have no eye; their reference point is one that is likely to be near the instances.
//!
//! A magnitude row holds what each coefficient can contribute to an error, in eps of float32.
//! The shader multiplies these by the instance's own magnitudes.

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

/// The certificates' margin in units of float32's eps (2^-23).
///
/// It is derived in `docs/accuracy.md`, section "Counting the roundings".
/// The shader calls it `ERROR_ULPS`, too.
pub const ERROR_ULPS: f64 = 24.0;

/// A linear function of the position `d` about the reference point, with bounds of its errors.
///
/// The value is `m . d + m3`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    /// Three linear coefficients, then the constant.
    pub(crate) m: [f32; 4],
    /// Upper bounds of the coefficients' sizes, raised where a coefficient's error exceeds one eps.
    pub(crate) a: [f32; 4],
}

/// A camera in float32: four rows, the reference point, and the range of coordinates they hold for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ViewRows {
    /// Pixel column relative to the middle of the image, times w.
    pub(crate) x: Row,
    /// Pixel row relative to the middle of the image, downwards, times w.
    pub(crate) y: Row,
    /// Depth: clip z minus `z_slope` times w.
    pub(crate) z: Row,
    /// w, which is view depth times a power of two.
    pub(crate) w: Row,
    /// A in `z = A w + Z'`.
    pub(crate) z_slope: f32,
    /// The reference point is exactly `eye_hi + eye_lo`.
    pub(crate) eye_hi: [f32; 3],
    /// See `eye_hi`.
    pub(crate) eye_lo: [f32; 3],
    /// Instances whose magnitudes reach this limit are invalid for this camera, since products
    /// could overflow float32.
    pub(crate) coordinate_limit: f32,
}

impl ViewRows {
    /// Rounds the rows of `camera` to float32.
    ///
    /// `transform_slack` is kappa, in eps of `sum |M| |p|`.
    /// It allows for a renderer that computed the depth image with its own float32 matrices.
    /// With 0 the depth image is taken to be exact for this camera's float64 numbers.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a camera whose rows float32 cannot hold.
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
        // About the eye, A is the part of z that is proportional to w.
        // About another point, A is that point's depth, so that Z' and `d - A` are small near it.
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
        // The condition is negated so that NaN is refused, too.
        if !(linear_limit <= 2.0_f64.powi(34) && constant_limit <= 2.0_f64.powi(58)) {
            return Err(Error::invalid(
                "camera",
                format!(
                    "expected rows whose coefficients stay below 2^34 and constants below 2^58 \
                     when w is scaled to 1, got {linear_limit:e} and {constant_limit:e}"
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

/// The point that the float32 rows of `camera` are relative to, for those who draw with it.
///
/// It is the sum of two float32 vectors, without rounding.
///
/// # Errors
/// As [`ViewRows::new`]: a camera that the cull refuses is not worth drawing with.
pub(crate) fn reference_point(camera: &Camera) -> Result<Vec3> {
    ViewRows::new(camera, 0.0)?;
    Ok(Reference::of(camera).point)
}

/// The point that a camera's float32 rows are relative to.
///
/// Every point would be valid.
/// Margins are proportional to the distance from it, so one near the tested instances is best.
struct Reference {
    /// `hi + lo` is the point without rounding, since `lo` holds lower bits of a float64 than `hi`.
    hi: [f32; 3],
    lo: [f32; 3],
    point: Vec3,
    /// Whether the point is the centre of projection.
    is_eye: bool,
}

impl Reference {
    /// Chooses a point on the middle axis of the image (x = y = 0).
    ///
    /// - Perspective: the eye, where w = 0.
    /// - Perspective with a far plane less than twice as far away as the near plane: the near
    ///   plane.
    ///   Everything visible is then nearer to it than to the eye.
    /// - Parallel rays: [`depth_of_interest`].
    /// - Where no such point can be computed: the world's origin.
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
            // On the axis z is linear in w; the factor is the difference of its values at w = 1 and
            // at w = 0.
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
        // Beyond 2^60 every instance is invalid in the shader, so the world's origin will do.
        let point = if point.iter().all(|v| v.abs() < 2.0_f64.powi(60)) { point } else { [0.0; 3] };
        let (hi, lo) = split3(point);
        Self { hi, lo, point: std::array::from_fn(|k| f64::from(hi[k]) + f64::from(lo[k])), is_eye }
    }
}

/// w at the near plane, if w at the far plane is less than twice that; `None` otherwise.
///
/// Depth along the axis is `slope + at_eye / w`.
fn near_of_thin_range(at_eye: f64, slope: f64, reversed: bool) -> Option<f64> {
    let (at_zero, at_one) = (-at_eye / slope, at_eye / (1.0 - slope));
    let (near, far) = if reversed { (at_one, at_zero) } else { (at_zero, at_one) };
    // Comparisons with NaN are false, so NaN gives `None`.
    (near > 0.0 && near < far && far < 2.0 * near).then_some(near)
}

/// The z around which a camera with parallel rays is likely to see most.
///
/// With a known eye this is the depth of the eye, clamped to the camera's range.
/// A bare matrix does not say where the eye is.
/// It gives the depth of the world's origin if that is in view, and the near plane otherwise.
fn depth_of_interest(camera: &Camera, rows: &Mat4) -> f64 {
    let [x, y, z, w] = rows.map(|row| row[3]);
    // The rows are about the origin, so their constants are the origin's clip coordinates.
    // w is not 0, so no ratio is NaN.
    let ratios = [x / w, y / w, z / w];
    let in_view =
        ratios[0].abs() <= 1.0 && ratios[1].abs() <= 1.0 && (0.0..=1.0).contains(&ratios[2]);
    let near = if camera.convention().is_reversed() { 1.0 } else { 0.0 };
    w * if camera.is_posed() || in_view { ratios[2].clamp(0.0, 1.0) } else { near }
}

/// A row in float64, bounds of its errors, and the world-space magnitudes that kappa multiplies.
///
/// Index 3 of each array belongs to the constant.
#[derive(Debug, Clone, Copy)]
struct Affine {
    m: [f64; 4],
    error: [f64; 4],
    world: [f64; 4],
}

impl Affine {
    /// Moves `row` from `origin` to `eye`.
    ///
    /// The linear part stays exact, and the constant becomes the row's value at the eye.
    /// One subtraction, three products and three sums: 8 roundings of float64 cover them.
    fn about(eye: Vec3, row: [f64; 4], origin: Vec3) -> Self {
        let lin = [row[0], row[1], row[2]];
        let from_origin = sub(eye, origin);
        let travelled: f64 = (0..3).map(|k| lin[k].abs() * (eye[k].abs() + origin[k].abs())).sum();
        // For kappa: |p| <= |d| + |eye|; the renderer's constant is the one about the world's
        // origin.
        let world: f64 = (0..3).map(|k| lin[k].abs() * eye[k].abs()).sum::<f64>()
            + (row[3] - dot(lin, origin)).abs();
        Self {
            m: [lin[0], lin[1], lin[2], dot(lin, from_origin) + row[3]],
            error: [0.0, 0.0, 0.0, 8.0 * ROUNDING * (travelled + row[3].abs())],
            world: [lin[0].abs(), lin[1].abs(), lin[2].abs(), world],
        }
    }

    /// `s * self`.
    ///
    /// This is exact where `s` is a power of two; one rounding is charged anyway.
    fn scaled(&self, s: f64) -> Self {
        Self {
            m: self.m.map(|v| v * s),
            error: std::array::from_fn(|k| (self.error[k] + ROUNDING * self.m[k].abs()) * s.abs()),
            world: self.world.map(|v| v * s.abs()),
        }
    }

    /// `self - slope * other`.
    ///
    /// Where terms cancel their roundings remain, in all four coefficients.
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

    /// Rounds to float32 and forms the magnitudes.
    ///
    /// They satisfy `a >= |m|`, and `a * eps` is at least the error of the coefficient.
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
        // x, y and w vanish at the eye, up to the remainder that two float32 cannot represent.
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

    /// With a far plane less than twice as far away as the near plane, the reference point is the
    /// middle of the near plane, and A is its depth.
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

    /// The reference point of parallel rays, worked out by hand.
    /// The eye is at (0, 0, 5) and looks along -z.
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
            // Each case: view depths of the near and far planes, how far the image's middle is
            // beside the eye, and the expected z of the point.
            // That z is the eye's, or the one of the nearest plane.
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
                // A is the depth of the point, so Z' has no constant.
                let depth = (5.0 - z - near) / (far - near);
                let depth = if convention.is_reversed() { 1.0 - depth } else { depth };
                assert!(
                    (f64::from(view.z_slope) - depth).abs() < 1e-7 && view.z.m[3].abs() < 1e-7,
                    "{view:?}"
                );
            }
            // A bare matrix: the world's origin, at view depth 5, if it is in view, or the near
            // plane.
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

    /// The two float32 halves are not exactly the eye; the constants hold the difference.
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
        // The constant of Z' is -f n / (f - n) up to the power of two; the linear part is almost 0.
        assert!(view.z.m[..3].iter().all(|v| v.abs() < 1e-6));
        assert!(view.z.m[3] < 0.0);
        // kappa adds at least kappa / 24 of the world-space magnitude.
        let slack = ViewRows::new(&camera, 24.0).unwrap();
        assert!(slack.z.a.iter().zip(view.z.a).all(|(a, b)| *a > b));
    }

    /// A matrix means the same times any positive number while its products stay in float64's
    /// range.
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
        // Half of an image of 8 pixels is 4, so the row is 4 times the coefficient.
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
