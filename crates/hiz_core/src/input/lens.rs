//! How a camera's rays run, which turns a view depth or a distance into NDC depth.

use crate::error::{Error, Result};
use crate::host::inverse::{Bounded, inverse};
use crate::host::linear::{Mat4, Vec3, cross, dot, normalized};
use crate::host::rounding::ROUNDING;
use crate::input::camera::Camera;
use crate::input::depth_kind::DepthKind;

/// How a camera's rays run, which turns a depth along them into NDC depth.
pub(super) struct Lens {
    pub(super) reversed: bool,
    /// Whether zero and negative numbers are depth too, since the near plane lies behind the eye.
    pub(super) signed: bool,
    pub(super) size: [f64; 2],
    pub(super) rays: Rays,
}

/// Where the depth of a number lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// It may lie between the planes, and surely not in front of the near plane.
    Inside,
    /// Surely beyond the far plane.
    Beyond,
    /// It may lie in front of the near plane, or nothing is known.
    Unknown,
}

pub(super) enum Rays {
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
    pub(super) fn new(camera: &Camera) -> Result<Self> {
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
    #[inline]
    pub(super) fn ndc(&self, column: u32, row: u32, value: (f64, f64), kind: DepthKind) -> f32 {
        let (depth, lost) = self.depth(column, row, value, kind);
        toward_far_by(depth, lost, self.reversed)
    }

    /// Where the depth of the same number lies, as near as its error lets it be.
    pub(super) fn place(&self, column: u32, row: u32, value: (f64, f64), kind: DepthKind) -> Place {
        let (depth, lost) = self.depth(column, row, value, kind);
        let nearest = if self.reversed { depth + lost } else { depth - lost };
        let is_beyond = if self.reversed { nearest < 0.0 } else { nearest > 1.0 };
        if is_beyond {
            Place::Beyond
        } else if (0.0..=1.0).contains(&nearest) {
            Place::Inside
        } else {
            Place::Unknown
        }
    }

    /// Whether depth becomes farther with distance, so that infinity is farther than everything.
    ///
    /// A bare matrix may contradict its convention.
    pub(super) fn grows_to_far(&self) -> bool {
        match &self.rays {
            Rays::Parallel { slope, .. } => (*slope < 0.0) == self.reversed,
            Rays::FromEye { constant, .. } => (*constant > 0.0) == self.reversed,
        }
    }

    /// Whether equal numbers of a kind have equal depths, wherever in the image they are.
    pub(super) fn is_alike(&self, kind: DepthKind) -> bool {
        match &self.rays {
            Rays::Parallel { .. } => true,
            Rays::FromEye { k, .. } => kind == DepthKind::Z && k[0] == 0.0 && k[1] == 0.0,
        }
    }

    /// The NDC depth of the number, and a bound of its error; NaN where too little is known.
    #[inline]
    fn depth(
        &self,
        column: u32,
        row: u32,
        (value, off): (f64, f64),
        kind: DepthKind,
    ) -> (f64, f64) {
        match &self.rays {
            // The rays are parallel, so view depth and distance are the same.
            // Roundings: `value`, the slope (6), the constant, the product and the sum, less than
            // 12 in all.
            Rays::Parallel { slope, constant, tilt } => {
                let terms = [slope * value, *constant];
                let of_value = slope.abs() * off * (1.0 + 16.0 * ROUNDING);
                let lost = 12.0 * ROUNDING * (terms[0].abs() + terms[1].abs()) + tilt + of_value;
                (terms[0] + terms[1], lost)
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
                    return (f64::NAN, 0.0);
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
                (terms.iter().sum(), lost)
            }
        }
    }
}

/// The length of the part of the ray through `at` along which w grows by 1, and its error bound.
#[inline]
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

/// The rays of a perspective camera.
///
/// `k` solves `k . (x_lin, y_lin, w_lin) = z_lin`.
/// Far off the axis these rows are nearly parallel.
/// For an eye far from the origin the constant `z3 - k . (x3, y3, w3)` cancels.
/// Both are therefore computed in pairs of float64, with error bounds.
pub(super) fn from_eye(rows: &Mat4) -> Result<Rays> {
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
pub(super) fn parallel(camera: &Camera, rows: &Mat4) -> Result<Rays> {
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

/// `d` rounded to float32 towards far; far where `d` is NaN or outside 0..1.
///
/// A number that float32 holds keeps its value.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "rounded towards far in the next lines")]
pub(super) fn toward_far(d: f64, reversed: bool) -> f32 {
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

/// `d`, moved towards far by the error bound `lost` and rounded towards far.
///
/// The result is far wherever the exact depth may lie outside 0..1.
#[inline]
fn toward_far_by(d: f64, lost: f64, reversed: bool) -> f32 {
    let (nearest, farthest) = if reversed { (d + lost, d - lost) } else { (d - lost, d + lost) };
    // In front of the near plane, or NaN, which fails the comparison.
    // Past the far plane the result is far anyway.
    let inside = if reversed { nearest <= 1.0 } else { nearest >= 0.0 };
    toward_far(if inside { farthest } else { f64::NAN }, reversed)
}

/// Cameras for the unit tests of depth in either direction.
#[cfg(test)]
pub(super) mod test_cameras {
    use crate::input::camera::Camera;
    use crate::input::image::{DepthConvention, ImageSize};
    use crate::input::projection::{Pose, Projection};

    pub(in crate::input) const POSE: Pose =
        Pose { eye: [1.0, 2.0, 3.0], target: [1.0, 2.0, -7.0], up: [0.0, 1.0, 0.0] };

    pub(in crate::input) fn perspective(convention: DepthConvention) -> Camera {
        let projection = Projection::Perspective {
            fov_y: std::f64::consts::FRAC_PI_2,
            near: 1.0,
            far: Some(9.0),
            convention,
        };
        Camera::look_at(&POSE, &projection, ImageSize::new(2, 2)).unwrap()
    }
}
