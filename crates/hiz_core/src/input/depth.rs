//! Depth images from other sources, converted to NDC depth in float64 and rounded towards far.
//!
//! Rounding towards far loses a little culling and never hides anything.
//! These numbers are no depth, and become far, which never occludes:
//!
//! - NaN and infinity;
//! - the caller's invalid values;
//! - depth outside the camera's range;
//! - for most cameras, zero and negative numbers.

use crate::error::{Error, Result};
use crate::host::inverse::{Bounded, inverse};
use crate::host::linear::{Mat4, Vec3, cross, dot, normalized};
use crate::host::memory;
use crate::host::rounding::ROUNDING;
use crate::input::bounds::Floats;
use crate::input::camera::Camera;
use crate::input::image::DepthConvention;
use crate::input::tolerance::DepthTolerance;

/// What the numbers of a depth image mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DepthKind {
    /// NDC depth: near 0, far 1.
    Ndc,
    /// NDC depth in reversed Z: near 1, far 0.
    ReversedNdc,
    /// View depth: world units along the viewing direction.
    Z,
    /// Distance from the eye: world units along the ray through the pixel's centre.
    Distance,
}

/// Converts a depth image to NDC depth in `camera`'s convention, rounded to float32 towards far.
///
/// `image` has one number per pixel of `camera`, rows from top to bottom.
/// `scale` times a number is depth of `kind`; it must be 1 for NDC depth.
/// `camera` must have the lens that the image was made with.
/// A view depth or distance belongs to the pixel's centre.
/// The result has the shape of `image`.
///
/// `invalid` lists the numbers of `image`, before `scale`, that mean "no data": they become far.
/// For a float32 image they are rounded to float32 before they are compared.
/// NaN and infinity become far as well.
/// For the kinds `Z` and `Distance` so do zero and negative numbers, with one exception.
/// An orthographic camera with a near plane behind the eye (`near < 0`) sees depth of either sign.
///
/// # Errors
/// [`Error::Invalid`] for
///
/// - a number of pixels that differs from the camera's;
/// - a kind that contradicts the camera's convention;
/// - a scale that is not positive and finite, or not 1 for NDC depth;
/// - for the kinds `Z` and `Distance`: a singular camera, or an orthographic one that was made from
///   a bare matrix, which does not say where depth starts, or whose depth does not grow along its
///   rays.
///
/// [`Error::OutOfMemory`](crate::Error::OutOfMemory) if the host has no room for the result.
pub fn ndc_from_kind(
    image: Floats<'_>,
    kind: DepthKind,
    scale: f64,
    invalid: &[f64],
    camera: &Camera,
) -> Result<Vec<f32>> {
    converted(image, kind, scale, invalid, camera, DepthTolerance::NONE)
}

/// [`ndc_from_kind`] for an image whose numbers were rounded within `tolerance` before this call.
///
/// `tolerance` is in the units of the numbers, before `scale`.
/// The result holds the NDC depth, and the tolerance that is left for the pyramid to account for.
///
/// - Numbers of the kinds `Z` and `Distance` are moved away from the eye by the tolerance before
///   they are converted, and none is left.
/// - NDC depth keeps its numbers and its tolerance.
///
/// # Errors
/// As [`ndc_from_kind`], and [`Error::Invalid`] for a tolerance outside 0..=0.5.
pub fn ndc_from_kind_within(
    image: Floats<'_>,
    kind: DepthKind,
    scale: f64,
    invalid: &[f64],
    camera: &Camera,
    tolerance: DepthTolerance,
) -> Result<(Vec<f32>, DepthTolerance)> {
    let tolerance = tolerance.checked()?;
    let ndc = converted(image, kind, scale, invalid, camera, tolerance)?;
    let is_ndc = matches!(kind, DepthKind::Ndc | DepthKind::ReversedNdc);
    Ok((ndc, if is_ndc { tolerance } else { DepthTolerance::NONE }))
}

/// [`ndc_from_kind`] with kinds `Z` and `Distance` taken at the far end of `tolerance`.
///
/// NDC depth ignores the tolerance.
fn converted(
    image: Floats<'_>,
    kind: DepthKind,
    scale: f64,
    invalid: &[f64],
    camera: &Camera,
    tolerance: DepthTolerance,
) -> Result<Vec<f32>> {
    let size = camera.size();
    if image.len() as u64 != size.pixels() {
        return Err(Error::invalid(
            "depth",
            format!(
                "expected the camera's size {size} = {} numbers, got {}",
                size.pixels(),
                image.len()
            ),
        ));
    }
    let invalid = as_stored(invalid, image);
    let convention = camera.convention();
    let reversed = convention.is_reversed();
    match kind {
        DepthKind::Ndc | DepthKind::ReversedNdc => {
            if (kind == DepthKind::ReversedNdc) != reversed {
                let (image, camera) =
                    if reversed { ("ndc", "reversed Z") } else { ("reversed_ndc", "standard Z") };
                return Err(Error::invalid(
                    "kind",
                    format!("expected the camera's convention, {camera}, got {image}"),
                ));
            }
            if scale != 1.0 {
                return Err(Error::invalid(
                    "scale",
                    format!("expected 1 for NDC depth, got {scale}"),
                ));
            }
            let ndc = |number| {
                if invalid.contains(&number) {
                    convention.far()
                } else {
                    toward_far(number, reversed)
                }
            };
            memory::collected((0..image.len()).map(|i| ndc(image.get(i))), "depth")
        }
        DepthKind::Z | DepthKind::Distance => {
            if !(scale.is_finite() && scale > 0.0) {
                return Err(Error::invalid(
                    "scale",
                    format!("expected a positive finite number, got {scale}"),
                ));
            }
            let lens = Lens::new(camera)?;
            let mut out = memory::list(image.len(), "depth")?;
            for row in 0..size.height {
                for column in 0..size.width {
                    let number = image.get(out.len());
                    let value = number * scale;
                    let known = value.is_finite()
                        && (value > 0.0 || lens.signed)
                        && !invalid.contains(&number);
                    // Slightly more than the tolerance, to cover the roundings of this expression.
                    let off = (number.abs() * tolerance.relative + tolerance.absolute)
                        * scale
                        * (1.0 + 1e-15);
                    out.push(if known {
                        lens.ndc(column, row, (value, off), kind)
                    } else {
                        convention.far()
                    });
                }
            }
            Ok(out)
        }
    }
}

/// The caller's invalid values, rounded to the image's own type.
#[expect(clippy::cast_possible_truncation, reason = "rounded as the image's own numbers were")]
fn as_stored(invalid: &[f64], image: Floats<'_>) -> Vec<f64> {
    match image {
        Floats::F32(_) => invalid.iter().map(|v| f64::from(*v as f32)).collect(),
        Floats::F64(_) => invalid.to_vec(),
    }
}

/// `d` rounded to float32 towards far; far where `d` is NaN or outside 0..1.
///
/// A number that float32 holds keeps its value.
#[expect(clippy::cast_possible_truncation, reason = "rounded towards far in the next lines")]
fn toward_far(d: f64, reversed: bool) -> f32 {
    if !(0.0..=1.0).contains(&d) {
        return if reversed { 0.0 } else { 1.0 };
    }
    let nearest = d as f32;
    match reversed {
        false if f64::from(nearest) < d => nearest.next_up(),
        true if f64::from(nearest) > d => nearest.next_down(),
        _ => nearest,
    }
}

/// A stored depth as the shaders read it.
///
/// NaN and numbers outside 0..1 become far; subnormals and -0 become 0.
pub(crate) fn sanitized(bits: u32, convention: DepthConvention) -> f32 {
    let d = f32::from_bits(bits);
    if !(0.0..=1.0).contains(&d) {
        convention.far()
    } else if d.is_subnormal() || d == 0.0 {
        0.0
    } else {
        d
    }
}

/// How a camera's rays run, which turns a depth along them into NDC depth.
struct Lens {
    reversed: bool,
    /// Whether zero and negative numbers are depth too, since the near plane lies behind the eye.
    signed: bool,
    size: [f64; 2],
    rays: Rays,
}

enum Rays {
    /// Rays through an eye.
    ///
    /// Clip z is `k . (x, y, w) + constant` everywhere.
    /// NDC depth therefore is `k . (ndc x, ndc y, 1) + constant / w`.
    FromEye {
        k: Vec3,
        constant: f64,
        /// Error bounds of the entries of `k`.
        k_error: Vec3,
        constant_error: f64,
        /// The inverse of the rows x, y, w, which maps NDC positions to directions of rays.
        /// Each entry comes with its error bound.
        inverse: [[(f64, f64); 3]; 3],
        /// w at view depth 1: the length of the linear part of the w row.
        w_length: f64,
    },
    /// Parallel rays: depth is 0 on the plane through the origin and grows along the rays.
    Parallel {
        slope: f64,
        constant: f64,
        /// A bound of the error of NDC depth anywhere in the image.
        /// It is due to rays that are not exactly parallel to the direction in which depth grows.
        tilt: f64,
    },
}

impl Lens {
    fn new(camera: &Camera) -> Result<Self> {
        let size = [camera.size().width, camera.size().height].map(f64::from);
        let rows = camera.rows_near_one();
        let reversed = camera.convention().is_reversed();
        let (rays, signed) = if camera.is_orthographic() {
            (parallel(camera, &rows)?, starts_behind_the_eye(&rows, camera.origin(), reversed))
        } else {
            (from_eye(&rows)?, false)
        };
        Ok(Self { reversed, signed, size, rays })
    }

    /// The NDC depth of the number `value` of `kind` at a pixel, rounded towards far.
    ///
    /// `value` may be off by up to `off` in either direction.
    fn ndc(&self, column: u32, row: u32, (value, off): (f64, f64), kind: DepthKind) -> f32 {
        match &self.rays {
            // The rays are parallel, so view depth and distance are the same.
            // Roundings: `value`, the slope (6), the constant, the product and the sum, less than
            // 12 in all.
            Rays::Parallel { slope, constant, tilt } => {
                let terms = [slope * value, *constant];
                let of_value = slope.abs() * off * (1.0 + 16.0 * ROUNDING);
                let lost = 12.0 * ROUNDING * (terms[0].abs() + terms[1].abs()) + tilt + of_value;
                toward_far_by(terms[0] + terms[1], lost, self.reversed)
            }
            Rays::FromEye { k, constant, k_error, constant_error, inverse, w_length } => {
                // The numerators are whole numbers and exact, so each ratio is rounded once.
                let x = (2.0 * f64::from(column) + 1.0 - self.size[0]) / self.size[0];
                let y = (self.size[1] - 2.0 * f64::from(row) - 1.0) / self.size[1];
                let at = [x, y, 1.0];
                // 1 / w, and a bound of its error beyond the roundings that are counted below.
                let (per_w, per_w_error) = match kind {
                    DepthKind::Z => ((value * w_length).recip(), 0.0),
                    _ => {
                        let (length, error) = ray_length(inverse, at);
                        (length / value, error / value)
                    }
                };
                // Where depth is off by a share s, 1 / w is off by at most the share s / (1 - s).
                let share = off / value;
                if share >= 0.5 {
                    return if self.reversed { 0.0 } else { 1.0 };
                }
                let per_w_error = per_w_error
                    + (per_w + per_w_error) * share / (1.0 - share) * (1.0 + 16.0 * ROUNDING);
                let terms = [k[0] * x, k[1] * y, k[2], constant * per_w];
                // Roundings of a term: `x`, the product and three sums.
                // Roundings of the last term: `w_length` (5) or the length's division, `value`, the
                // product and a sum.
                // 16 cover each term.
                let size: f64 = terms.iter().map(|t| t.abs()).sum();
                let inherited = (0..3).map(|i| k_error[i] * at[i].abs()).sum::<f64>()
                    + constant_error * per_w
                    + (constant.abs() + constant_error) * per_w_error;
                let lost = 16.0 * ROUNDING * size + inherited * (1.0 + 1e-9);
                toward_far_by(terms.iter().sum(), lost, self.reversed)
            }
        }
    }
}

/// The length of the part of the ray through `at` along which w grows by 1, and its error bound.
fn ray_length(inverse: &[[(f64, f64); 3]; 3], at: Vec3) -> (f64, f64) {
    let (mut ray, mut error) = ([0.0; 3], 0.0);
    for (coordinate, entries) in ray.iter_mut().zip(inverse) {
        for ((entry, off), v) in entries.iter().zip(at) {
            *coordinate += entry * v;
            // Roundings of `v`, of the product and of two sums.
            error += (off + 5.0 * ROUNDING * entry.abs()) * v.abs();
        }
    }
    // Scaled by the largest coordinate, so that no square overflows or underflows.
    // The error of a vector's length is at most the sum of the errors of its coordinates.
    let largest = ray.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    let scaled = ray.map(|c| c / largest);
    let length = largest * dot(scaled, scaled).sqrt();
    (length, error * (1.0 + 1e-9) + 8.0 * ROUNDING * length)
}

/// Converts NDC depth and w back to view depth in world units.
///
/// It serves explanations that people read; no decision rests on it.
pub(crate) enum ViewDepth {
    /// `ndc` is the slope, its error bound and the constant of `slope + constant / w`.
    /// It is `None` where NDC depth depends on the pixel as well.
    FromEye {
        w_length: f64,
        ndc: Option<[f64; 3]>,
    },
    Parallel {
        slope: f64,
        constant: f64,
    },
}

impl ViewDepth {
    /// `None` for a parallel camera if it does not say where its depth starts, or if its depth
    /// does not grow along its rays.
    pub(crate) fn new(camera: &Camera) -> Option<Self> {
        let rows = camera.rows_near_one();
        let rays = if camera.is_orthographic() { parallel(camera, &rows) } else { from_eye(&rows) };
        match rays.ok()? {
            Rays::Parallel { slope, constant, .. } => Some(Self::Parallel { slope, constant }),
            Rays::FromEye { k, constant, k_error, w_length, .. } => {
                let is_of_w_alone = (0..2).all(|i| k[i].abs() <= k_error[i]);
                Some(Self::FromEye {
                    w_length,
                    ndc: is_of_w_alone.then_some([k[2], k_error[2], constant]),
                })
            }
        }
    }

    /// The view depth of an NDC depth; infinite for the depth of an infinitely far point.
    pub(crate) fn of_ndc(&self, depth: f64) -> Option<f64> {
        match *self {
            Self::Parallel { slope, constant } => Some((depth - constant) / slope),
            Self::FromEye { w_length, ndc } => ndc.map(|[slope, error, constant]| {
                let difference = depth - slope;
                if difference.abs() <= error {
                    f64::INFINITY
                } else {
                    constant / difference / w_length
                }
            }),
        }
    }

    /// The view depth of w, scaled as in [`Camera::rows_near_one`].
    ///
    /// `None` for parallel rays, whose w is the same everywhere.
    pub(crate) fn of_w(&self, w: f64) -> Option<f64> {
        match *self {
            Self::Parallel { .. } => None,
            Self::FromEye { w_length, .. } => Some(w / w_length),
        }
    }
}

/// The rays of a perspective camera.
///
/// `k` solves `k . (x_lin, y_lin, w_lin) = z_lin`.
/// Far off the axis these rows are nearly parallel.
/// For an eye far from the origin the constant `z3 - k . (x3, y3, w3)` cancels.
/// Both are therefore computed in pairs of float64, with error bounds.
fn from_eye(rows: &Mat4) -> Result<Rays> {
    let used = [0, 1, 3];
    let lin = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
    let inverse = inverse(&used.map(lin)).ok_or_else(|| {
        Error::invalid("camera", "expected an invertible projection, got a singular matrix")
    })?;
    let z_lin = lin(2);
    let k: [Bounded; 3] =
        std::array::from_fn(|j| Bounded::dot(&[0, 1, 2].map(|i: usize| (z_lin[i], inverse[i][j]))));
    let constant = Bounded::dot(&[
        (1.0, rows[2][3].into()),
        (-rows[0][3], k[0]),
        (-rows[1][3], k[1]),
        (-rows[3][3], k[2]),
    ]);
    let (constant, constant_error) = constant.rounded();
    let [k, k_error] =
        [0, 1].map(|part| k.map(Bounded::rounded).map(|both| [both.0, both.1][part]));
    let w_length = dot(lin(3), lin(3)).sqrt();
    let inverse = inverse.map(|row| row.map(Bounded::rounded));
    Ok(Rays::FromEye { k, constant, k_error, constant_error, inverse, w_length })
}

/// Whether the near plane of an orthographic camera lies behind its eye.
///
/// View depth 0 then is farther than the near plane, by more than the rows' roundings.
fn starts_behind_the_eye(rows: &Mat4, origin: Vec3, reversed: bool) -> bool {
    let (z, w) = (rows[2], rows[3][3]);
    let at_eye = z[3] / w;
    let behind_near = if reversed { 1.0 - at_eye } else { at_eye };
    let moved: f64 = (0..3).map(|i| (z[i] * origin[i]).abs()).sum::<f64>() / w.abs();
    behind_near > 2.0_f64.powi(-40) + 2.0_f64.powi(-48) * moved
}

/// The rays of an orthographic camera.
///
/// # Errors
/// [`Error::Invalid`] where the camera does not say where depth starts, or depth does not grow
/// along the rays.
fn parallel(camera: &Camera, rows: &Mat4) -> Result<Rays> {
    if !camera.is_posed() {
        return Err(Error::invalid(
            "kind",
            "expected ndc or reversed_ndc for an orthographic camera made from a bare matrix: it \
             does not say where view depth starts",
        ));
    }
    let lin = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
    let unit = |r: usize| normalized(lin(r));
    // The axes of the image, and the direction in which depth grows.
    let (Some(x), Some(y), Some(z)) = (unit(0), unit(1), unit(2)) else {
        return Err(Error::invalid(
            "camera",
            "expected an invertible projection, got a singular matrix",
        ));
    };
    let across = cross(x, y);
    let sine = normalized(across).map_or(f64::NAN, |ray| dot(cross(ray, z), cross(ray, z)).sqrt());
    // The comparison refuses NaN, too.
    if sine.is_nan() || sine >= 1e-12 {
        return Err(Error::invalid(
            "kind",
            "expected ndc or reversed_ndc for an orthographic camera whose depth does not grow \
             along its rays (a sheared or oblique matrix)",
        ));
    }
    let w = rows[3][3];
    // The lengths of rows whose squares may leave float64's range.
    let length = |r: usize| {
        lin(r).iter().map(|v| v.abs()).fold(0.0, f64::max) / unit(r).map_or(f64::NAN, largest)
    };
    // Along the view depth grows (standard) or falls (reversed).
    let slope = if camera.convention().is_reversed() { -length(2) } else { length(2) } / w.abs();
    // A bound of the distance between any point of the image and the ray through the origin.
    // There |x| <= |w|, so x without its constant is at most |w| + |constant|; likewise y.
    // The axes may be skewed, which divides by the sine of their angle.
    let reach: f64 = (0..2).map(|r| (w.abs() + rows[r][3].abs()) / length(r)).sum::<f64>()
        / dot(across, across).sqrt();
    // 16 roundings cover the three unit vectors and their products.
    // Skewed axes magnify them by 1 / the sine of their angle.
    let sine = sine + 16.0 * ROUNDING / dot(across, across).sqrt();
    Ok(Rays::Parallel { slope, constant: rows[2][3] / w, tilt: 1.01 * sine * reach * slope.abs() })
}

fn largest(v: Vec3) -> f64 {
    v.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// `d`, moved towards far by the error bound `lost` and rounded towards far.
///
/// The result is far wherever the exact depth may lie outside 0..1.
fn toward_far_by(d: f64, lost: f64, reversed: bool) -> f32 {
    let (nearest, farthest) = if reversed { (d + lost, d - lost) } else { (d - lost, d + lost) };
    // In front of the near plane, or NaN, which fails the comparison.
    // Past the far plane the result is far anyway.
    let inside = if reversed { nearest <= 1.0 } else { nearest >= 0.0 };
    toward_far(if inside { farthest } else { f64::NAN }, reversed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::image::ImageSize;
    use crate::input::projection::{Pose, Projection};

    const POSE: Pose = Pose { eye: [1.0, 2.0, 3.0], target: [1.0, 2.0, -7.0], up: [0.0, 1.0, 0.0] };

    fn perspective(convention: DepthConvention) -> Camera {
        let projection = Projection::Perspective {
            fov_y: std::f64::consts::FRAC_PI_2,
            near: 1.0,
            far: Some(9.0),
            convention,
        };
        Camera::look_at(&POSE, &projection, ImageSize::new(2, 2)).unwrap()
    }

    #[test]
    fn view_depth_and_distance_give_hand_worked_ndc_depth() {
        // Pixel centres lie at tangents +-1/2.
        // A ray is sqrt(1 + 1/4 + 1/4) times as long as its view depth.
        let length = 1.5_f64.sqrt();
        for (convention, expected) in [
            (DepthConvention::Standard, (9.0 - 9.0 / 3.0) / 8.0),
            (DepthConvention::Reversed, (9.0 / 3.0 - 1.0) / 8.0),
        ] {
            let camera = perspective(convention);
            let z = ndc_from_kind(Floats::F64(&[3.0; 4]), DepthKind::Z, 1.0, &[], &camera).unwrap();
            let distance = ndc_from_kind(
                Floats::F64(&[3000.0 * length; 4]),
                DepthKind::Distance,
                0.001,
                &[],
                &camera,
            )
            .unwrap();
            for d in z.iter().chain(&distance) {
                let off = f64::from(*d) - expected;
                assert!(off.abs() < 1e-7, "{d} {expected}");
            }
        }
    }

    /// For an eye far from the origin in a bare matrix the constant cancels.
    /// The error has to go towards far.
    /// The truth consists of integers: for an eye at (0, 0, e) that looks along +z, near 1 and far
    /// 9, the matrix is exact, and so is (9 - 9 / z) / 8.
    #[test]
    fn a_cancelling_eye_rounds_towards_far() {
        for e in [1.0e4, 1.0e6, 1.0e9] {
            for (convention, z_row) in [
                (DepthConvention::Standard, [0.0, 0.0, 9.0 / 8.0, -9.0 / 8.0 - 9.0 / 8.0 * e]),
                (DepthConvention::Reversed, [0.0, 0.0, -1.0 / 8.0, 9.0 / 8.0 + e / 8.0]),
            ] {
                let m = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z_row, [0.0, 0.0, 1.0, -e]];
                let camera =
                    Camera::from_clip_from_world(m, ImageSize::new(1, 1), convention).unwrap();
                for z in [1.5, 2.0, 3.0, 7.7] {
                    let d = f64::from(
                        ndc_from_kind(Floats::F64(&[z]), DepthKind::Z, 1.0, &[], &camera).unwrap()
                            [0],
                    );
                    let truth = if convention.is_reversed() {
                        (9.0 / z - 1.0) / 8.0
                    } else {
                        (9.0 - 9.0 / z) / 8.0
                    };
                    let nearer = if convention.is_reversed() { d - truth } else { truth - d };
                    assert!(
                        nearer <= 1e-15 && nearer > -1e-4,
                        "{convention:?} eye {e} depth {z}: {d} for {truth}"
                    );
                }
            }
        }
    }

    #[test]
    fn orthographic_depth_by_hand_and_tilted_rows_refused() {
        for (convention, expected) in
            [(DepthConvention::Standard, 0.25), (DepthConvention::Reversed, 0.75)]
        {
            let projection = Projection::Orthographic {
                left: -1.0,
                right: 1.0,
                bottom: -1.0,
                top: 1.0,
                near: 1.0,
                far: 9.0,
                convention,
            };
            let camera = Camera::look_at(&POSE, &projection, ImageSize::new(2, 2)).unwrap();
            for kind in [DepthKind::Z, DepthKind::Distance] {
                let d = ndc_from_kind(Floats::F64(&[3.0; 4]), kind, 1.0, &[], &camera).unwrap();
                assert!(d.iter().all(|d| (f64::from(*d) - expected).abs() < 1e-7), "{d:?}");
            }
            // Depth that also depends on x: a wall at one view depth has more than one NDC depth.
            let s = if convention.is_reversed() { -1.0 } else { 1.0 };
            let p = [
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.03 * s, 0.0, 0.04 * s, 0.5],
                [0.0, 0.0, 0.0, 1.0],
            ];
            let identity =
                std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
            let tilted =
                Camera::from_clip_from_camera(p, identity, ImageSize::new(2, 2), convention)
                    .unwrap();
            let error =
                ndc_from_kind(Floats::F64(&[0.5; 4]), DepthKind::Z, 1.0, &[], &tilted).unwrap_err();
            assert!(error.to_string().contains("does not grow along its rays"), "{error}");
        }
    }

    /// View depth from NDC depth and from w, at depths that are worked out by hand.
    #[test]
    fn view_depth_comes_back() {
        let near = |z: Option<f64>, expected: f64| {
            assert!((z.unwrap() - expected).abs() < 1e-12, "{z:?} {expected}");
        };
        for (convention, at_3) in
            [(DepthConvention::Standard, 0.75), (DepthConvention::Reversed, 0.25)]
        {
            let view = ViewDepth::new(&perspective(convention)).unwrap();
            near(view.of_ndc(at_3), 3.0);
            near(view.of_ndc(f64::from(convention.far())), 9.0);
            near(view.of_w(3.0), 3.0);
            let far = Projection::Perspective { fov_y: 1.0, near: 0.5, far: None, convention };
            let endless = Camera::look_at(&POSE, &far, ImageSize::new(2, 3)).unwrap();
            let view = ViewDepth::new(&endless).unwrap();
            // View depth 2 with near 1/2: a quarter of the way.
            near(view.of_ndc(if convention.is_reversed() { 0.25 } else { 0.75 }), 2.0);
            assert_eq!(view.of_ndc(f64::from(convention.far())), Some(f64::INFINITY));
            let (left, right, bottom, top) = (-1.0, 3.0, -1.0, 1.0);
            let parallel = Projection::Orthographic {
                left,
                right,
                bottom,
                top,
                near: -1.0,
                far: 7.0,
                convention,
            };
            let view =
                ViewDepth::new(&Camera::look_at(&POSE, &parallel, ImageSize::new(2, 2)).unwrap())
                    .unwrap();
            // Three quarters of the way from -1 to 7, in either direction.
            near(view.of_ndc(at_3), 5.0);
            assert_eq!(view.of_w(1.0), None);
        }
        // A bare orthographic matrix does not say where depth starts.
        // With an oblique near plane NDC depth depends on the pixel.
        let size = ImageSize::new(2, 2);
        let bare = |z, w| {
            let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, w];
            ViewDepth::new(
                &Camera::from_clip_from_world(rows, size, DepthConvention::Standard).unwrap(),
            )
        };
        assert!(bare([0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]).is_none());
        let oblique = bare([0.25, 0.0, 1.0, -1.0], [0.0, 0.0, 2.0, 0.0]).unwrap();
        assert_eq!(oblique.of_ndc(0.25), None);
        // w is scaled into 1..2: its length is 1.
        assert_eq!(oblique.of_w(5.0), Some(5.0));
    }

    #[test]
    fn what_is_no_depth_is_far() {
        let bad = [0.0, -1.0, f64::NAN, f64::INFINITY];
        for (convention, far) in
            [(DepthConvention::Standard, 1.0), (DepthConvention::Reversed, 0.0)]
        {
            let camera = perspective(convention);
            for kind in [DepthKind::Z, DepthKind::Distance] {
                assert_eq!(
                    ndc_from_kind(Floats::F64(&bad), kind, 1.0, &[], &camera).unwrap(),
                    [far; 4]
                );
            }
            // In front of the near plane and beyond the far one.
            assert_eq!(
                ndc_from_kind(Floats::F64(&[0.5, 9.5, 0.99, 1e9]), DepthKind::Z, 1.0, &[], &camera)
                    .unwrap(),
                [far; 4]
            );
        }
    }

    /// A camera at z = 3 that looks along -z and sees view depths from `near` to `far`.
    fn orthographic(near: f64, far: f64, convention: DepthConvention) -> Camera {
        let projection = Projection::Orthographic {
            left: -1.0,
            right: 1.0,
            bottom: -1.0,
            top: 1.0,
            near,
            far,
            convention,
        };
        Camera::look_at(&POSE, &projection, ImageSize::new(2, 2)).unwrap()
    }

    /// A near plane behind the eye: 8 units from -4 to 4, so depth is (z + 4) / 8, rounded.
    #[test]
    fn depth_of_either_sign_behind_the_eye() {
        for (convention, far) in
            [(DepthConvention::Standard, 1.0), (DepthConvention::Reversed, 0.0)]
        {
            let camera = orthographic(-4.0, 4.0, convention);
            // An image of another size is seen from the same place.
            for camera in [camera.clone(), camera.with_size(ImageSize::new(4, 1)).unwrap()] {
                for kind in [DepthKind::Z, DepthKind::Distance] {
                    let found = ndc_from_kind(
                        Floats::F64(&[-2.0, 0.0, -0.0, 3.0]),
                        kind,
                        1.0,
                        &[],
                        &camera,
                    )
                    .unwrap();
                    for (d, standard) in found.iter().zip([0.25, 0.5, 0.5, 0.875]) {
                        let expected =
                            if convention.is_reversed() { 1.0 - standard } else { standard };
                        assert!((d - expected).abs() < 1e-6, "{found:?}");
                        assert!(
                            if convention.is_reversed() { *d <= expected } else { *d >= expected },
                            "{found:?}"
                        );
                    }
                    let no_data = [f64::NAN, f64::NEG_INFINITY, -4.5, 4.5];
                    assert_eq!(
                        ndc_from_kind(Floats::F64(&no_data), kind, 1.0, &[], &camera).unwrap(),
                        [far; 4]
                    );
                    // Zero is depth for this camera, unless the caller lists it as invalid.
                    let zero = ndc_from_kind(
                        Floats::F64(&[0.0, -0.0, 2.0, -2.0]),
                        kind,
                        1.0,
                        &[0.0, -2.0],
                        &camera,
                    );
                    let zero = zero.unwrap();
                    assert_eq!([zero[0], zero[1], zero[3]], [far; 3]);
                    assert_ne!(zero[2], far);
                }
            }
            for near in [0.0, 1.0] {
                let camera = orthographic(near, 9.0, convention);
                let found = ndc_from_kind(
                    Floats::F64(&[0.0, -0.0, -2.0, -8.0]),
                    DepthKind::Z,
                    1.0,
                    &[],
                    &camera,
                );
                assert_eq!(found.unwrap(), [far; 4], "near {near}");
            }
            // Near planes at the eye that lie behind it by rounding alone.
            // float64 cannot hold these eyes exactly in world-to-camera form.
            let mut behind = 0;
            for step in 1..20 {
                let t = 1.0e6 / 3.0 * f64::from(step);
                let (s, c) = (0.3 * f64::from(step)).sin_cos();
                let m = [
                    [c, 0.0, s, t],
                    [0.0, 1.0, 0.0, t],
                    [-s, 0.0, c, t / 7.0],
                    [0.0, 0.0, 0.0, 1.0],
                ];
                let reversed = convention.is_reversed();
                let z = if reversed { [0.0, 0.0, -0.1, 1.0] } else { [0.0, 0.0, 0.1, 0.0] };
                let p = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, [0.0, 0.0, 0.0, 1.0]];
                let camera =
                    Camera::from_clip_from_camera(p, m, ImageSize::new(2, 2), convention).unwrap();
                let at_eye = camera.rows()[2][3];
                behind += usize::from(if reversed { at_eye < 1.0 - 1e-13 } else { at_eye > 1e-13 });
                let found =
                    ndc_from_kind(Floats::F64(&[0.0; 4]), DepthKind::Z, 1.0, &[], &camera).unwrap();
                assert_eq!(found, [far; 4], "{at_eye}");
            }
            assert!(behind > 1, "{behind} residuals of the eye put the near plane behind it");
        }
    }

    /// For every kind, invalid values are numbers as the image stores them, before the scale.
    #[test]
    fn invalid_values_are_far() {
        for (convention, far) in
            [(DepthConvention::Standard, 1.0), (DepthConvention::Reversed, 0.0)]
        {
            let camera = perspective(convention);
            for kind in [DepthKind::Z, DepthKind::Distance] {
                let image = Floats::F32(&[30.0, 40.1, 30.0, 40.1]);
                let found = ndc_from_kind(image, kind, 0.1, &[40.1, f64::NAN], &camera).unwrap();
                assert_eq!(
                    [found[1], found[3]],
                    [far; 2],
                    "float32(40.1), and not 40.1, is what the image holds"
                );
                assert!(found[0] != far && found[2] != far);
                let scaled = ndc_from_kind(image, kind, 0.1, &[4.01, 3.0], &camera).unwrap();
                assert!(scaled.iter().all(|d| *d != far), "{scaled:?}");
            }
            let own =
                if convention.is_reversed() { DepthKind::ReversedNdc } else { DepthKind::Ndc };
            let found =
                ndc_from_kind(Floats::F64(&[0.5, 0.25, 0.5, 0.75]), own, 1.0, &[0.5], &camera)
                    .unwrap();
            assert_eq!(found, [far, 0.25, far, 0.75]);
        }
    }

    /// A number in front of the near plane is far, however little it is in front.
    /// So is a number on the plane where float64 cannot decide.
    #[test]
    fn at_the_near_plane_nothing_is_nearer() {
        for (convention, far) in
            [(DepthConvention::Standard, 1.0), (DepthConvention::Reversed, 0.0)]
        {
            let before = ndc_from_kind(
                Floats::F64(&[1.0_f64.next_down(); 4]),
                DepthKind::Z,
                1.0,
                &[],
                &perspective(convention),
            );
            assert_eq!(before.unwrap(), [far; 4]);
        }
    }

    #[test]
    fn rounding_goes_towards_far() {
        let third = 1.0 / 3.0;
        assert!(
            f64::from(toward_far(third, false)) >= third
                && f64::from(toward_far(third, true)) <= third
        );
        assert_eq!(toward_far(0.25, false), 0.25);
        assert_eq!((toward_far(-1e-300, false), toward_far(1.0 + 1e-15, true)), (1.0, 0.0));
    }

    #[test]
    fn contradictions_are_refused() {
        let camera = perspective(DepthConvention::Reversed);
        let message = |kind, scale| {
            ndc_from_kind(Floats::F32(&[0.5; 4]), kind, scale, &[], &camera)
                .unwrap_err()
                .to_string()
        };
        assert!(
            message(DepthKind::Ndc, 1.0)
                .starts_with("kind: expected the camera's convention, reversed Z")
        );
        assert!(message(DepthKind::ReversedNdc, 2.0).starts_with("scale:"));
        assert!(message(DepthKind::Z, 0.0).starts_with("scale:"));
        let short = ndc_from_kind(Floats::F32(&[0.5; 3]), DepthKind::Z, 1.0, &[], &camera)
            .unwrap_err()
            .to_string();
        assert!(short.contains("4 numbers, got 3"), "{short}");
    }
}
