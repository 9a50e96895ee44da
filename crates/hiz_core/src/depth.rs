//! Depth images of other makers: from what their numbers mean to NDC depth, in float64, rounded towards far.
//!
//! Rounding towards far loses culling by a hair and never hides anything. What is no depth at all (NaN, infinite, outside
//! the camera's range; for sensors zero and negative) becomes far, which never occludes.

use crate::bounds::Floats;
use crate::camera::{Camera, DepthConvention, Mat3, Mat4, Vec3, cross, dot, inverse3, mul3, normalized};
use crate::error::{Error, Result};
use crate::host;

/// What the numbers of a depth image mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DepthKind {
    /// NDC depth, near 0, far 1.
    Ndc,
    /// NDC depth, near 1, far 0.
    ReversedNdc,
    /// View depth: world units along the viewing direction.
    Z,
    /// World units along the ray through the pixel's centre.
    Distance,
}

/// The NDC depth in `camera`'s convention of each pixel of `image` (row 0 on top), `scale` times its numbers being depth of
/// `kind`. The lens is that of `camera`; a view depth or distance belongs to the pixel's centre.
///
/// # Errors
/// [`Error::Invalid`] for a number of pixels other than the camera's, a kind that contradicts its convention, a scale
/// that is not positive and finite, and for kinds `Z` and `Distance` an orthographic camera made from a bare matrix (it does
/// not say where its depth starts).
pub fn ndc_from_kind(image: Floats<'_>, kind: DepthKind, scale: f64, camera: &Camera) -> Result<Vec<f32>> {
    let size = camera.size();
    if image.len() as u64 != size.pixels() {
        return Err(Error::invalid(
            "depth",
            format!("expected the camera's size {size} = {} numbers, got {}", size.pixels(), image.len()),
        ));
    }
    let reversed = camera.convention().is_reversed();
    match kind {
        DepthKind::Ndc | DepthKind::ReversedNdc => {
            if (kind == DepthKind::ReversedNdc) != reversed {
                let (image, camera) = if reversed { ("ndc", "reversed Z") } else { ("reversed_ndc", "standard Z") };
                return Err(Error::invalid("kind", format!("expected the camera's convention, {camera}, got {image}")));
            }
            if scale != 1.0 {
                return Err(Error::invalid("scale", format!("expected 1 for NDC depth, got {scale}")));
            }
            host::collected((0..image.len()).map(|i| toward_far(image.get(i), reversed)), "depth")
        }
        DepthKind::Z | DepthKind::Distance => {
            if !(scale.is_finite() && scale > 0.0) {
                return Err(Error::invalid("scale", format!("expected a positive finite number, got {scale}")));
            }
            let lens = Lens::new(camera)?;
            let mut out = host::list(image.len(), "depth")?;
            for row in 0..size.height {
                for column in 0..size.width {
                    let value = image.get(out.len()) * scale;
                    let known = value.is_finite() && value > 0.0;
                    out.push(if known { lens.ndc(column, row, value, kind) } else { camera.convention().far() });
                }
            }
            Ok(out)
        }
    }
}

/// `d` as float32 that is not nearer; far where it is outside 0..1 or NaN. float32 input passes unchanged in value.
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

/// A stored depth as the shaders read it: NaN and what is outside 0..1 is far, subnormals and -0 are 0.
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

/// How a camera's rays run: what turns a depth along them into NDC depth.
struct Lens {
    reversed: bool,
    half: [f64; 2],
    rays: Rays,
}

enum Rays {
    /// Clip z is `k . (x, y, w) + constant` everywhere, so NDC depth is `k . (ndc x, ndc y, 1) + constant / w`.
    FromEye {
        k: Vec3,
        constant: f64,
        /// How far each of them may be off.
        k_error: Vec3,
        constant_error: f64,
        /// The inverse of the rows x, y, w: directions of rays. The length of w's linear part: w for a view depth of 1.
        inverse: Mat3,
        w_length: f64,
    },
    /// Depth starts at the plane through the origin and grows along the rays.
    Parallel { slope: f64, constant: f64 },
}

/// Half a spacing of float64 at 1: the relative error of one rounding.
const ROUNDING: f64 = f64::EPSILON / 2.0;

impl Lens {
    fn new(camera: &Camera) -> Result<Self> {
        let size = camera.size();
        let half = [f64::from(size.width) / 2.0, f64::from(size.height) / 2.0];
        let rows = camera.rows_near_one();
        let rays = if camera.is_orthographic() { parallel(camera, &rows)? } else { from_eye(&rows)? };
        Ok(Self { reversed: camera.convention().is_reversed(), half, rays })
    }

    fn ndc(&self, column: u32, row: u32, value: f64, kind: DepthKind) -> f32 {
        match &self.rays {
            // Rays are parallel: both kinds are the same.
            Rays::Parallel { slope, constant } => {
                let terms = [slope * value, *constant];
                toward_far_by(terms[0] + terms[1], 8.0 * ROUNDING * (terms[0].abs() + terms[1].abs()), self.reversed)
            }
            Rays::FromEye { k, constant, k_error, constant_error, inverse, w_length } => {
                let x = (f64::from(column) + 0.5) / self.half[0] - 1.0;
                let y = 1.0 - (f64::from(row) + 0.5) / self.half[1];
                let at = [x, y, 1.0];
                let w = match kind {
                    DepthKind::Z => value * w_length,
                    // The ray along which w grows by 1.
                    _ => {
                        let ray = mul3(inverse, at);
                        value / dot(ray, ray).sqrt()
                    }
                };
                let size: f64 = (0..3).map(|i| (k[i] * at[i]).abs()).sum::<f64>() + (constant / w).abs();
                let inherited: f64 = (0..3).map(|i| k_error[i] * at[i].abs()).sum::<f64>() + constant_error / w.abs();
                toward_far_by(dot(*k, at) + constant / w, 32.0 * ROUNDING * size + 2.0 * inherited, self.reversed)
            }
        }
    }
}

/// What view depth, in world units, a camera's NDC depth and w stand for: for people, nothing is
/// decided by it.
pub(crate) enum ViewDepth {
    /// NDC depth is `slope + constant / w`, within the error, where it depends on w alone.
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
    /// Nothing for a parallel camera that does not say where its depth starts or whose depth does
    /// not grow along its rays.
    pub(crate) fn new(camera: &Camera) -> Option<Self> {
        let rows = camera.rows_near_one();
        let rays = if camera.is_orthographic() { parallel(camera, &rows) } else { from_eye(&rows) };
        match rays.ok()? {
            Rays::Parallel { slope, constant } => Some(Self::Parallel { slope, constant }),
            Rays::FromEye { k, constant, k_error, w_length, .. } => {
                let is_of_w_alone = (0..2).all(|i| k[i].abs() <= k_error[i]);
                Some(Self::FromEye { w_length, ndc: is_of_w_alone.then_some([k[2], k_error[2], constant]) })
            }
        }
    }

    /// Of an NDC depth; infinite for that of an infinitely far point.
    pub(crate) fn of_ndc(&self, depth: f64) -> Option<f64> {
        match *self {
            Self::Parallel { slope, constant } => Some((depth - constant) / slope),
            Self::FromEye { w_length, ndc } => ndc.map(|[slope, error, constant]| {
                let difference = depth - slope;
                if difference.abs() <= error { f64::INFINITY } else { constant / difference / w_length }
            }),
        }
    }

    /// Of w, as the rows near one have it; parallel rays have the same everywhere.
    pub(crate) fn of_w(&self, w: f64) -> Option<f64> {
        match *self {
            Self::Parallel { .. } => None,
            Self::FromEye { w_length, .. } => Some(w / w_length),
        }
    }
}

/// The depth of rays through an eye. `k` solves `k . (x_lin, y_lin, w_lin) = z_lin`; its error is bounded by what its residual
/// says, and the constant `z3 - k . (x3, y3, w3)`, which cancels for an eye far from the origin, inherits it.
fn from_eye(rows: &Mat4) -> Result<Rays> {
    let used = [0, 1, 3];
    let lin = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
    let inverse = inverse3(&used.map(lin))
        .ok_or_else(|| Error::invalid("camera", "expected an invertible projection, got a singular matrix"))?;
    let z_lin = lin(2);
    let column = |m: &Mat3, j: usize| [m[0][j], m[1][j], m[2][j]];
    let k: Vec3 = std::array::from_fn(|i| dot(column(&inverse, i), z_lin));
    // What k misses of z_lin, and what evaluating that loses, per coordinate of the world.
    let missing: Vec3 = std::array::from_fn(|c| {
        let terms = [k[0] * rows[0][c], k[1] * rows[1][c], k[2] * rows[3][c]];
        let size: f64 = terms.iter().map(|t| t.abs()).sum::<f64>() + z_lin[c].abs();
        (z_lin[c] - terms.iter().sum::<f64>()).abs() + 4.0 * ROUNDING * size
    });
    let k_error: Vec3 = std::array::from_fn(|i| 2.0 * dot(column(&inverse, i).map(f64::abs), missing));
    let constants = used.map(|r| rows[r][3]);
    let constant = rows[2][3] - dot(k, constants);
    let size: f64 = (0..3).map(|i| (k[i] * constants[i]).abs()).sum::<f64>() + rows[2][3].abs();
    let constant_error = 8.0 * ROUNDING * size + dot(k_error, constants.map(f64::abs));
    Ok(Rays::FromEye { k, constant, k_error, constant_error, inverse, w_length: dot(lin(3), lin(3)).sqrt() })
}

/// The depth of parallel rays, if the camera says where it starts and if it grows along them.
fn parallel(camera: &Camera, rows: &Mat4) -> Result<Rays> {
    if !camera.is_posed() {
        return Err(Error::invalid(
            "kind",
            "expected ndc or reversed_ndc for an orthographic camera made from a bare matrix: it does not say where view depth starts",
        ));
    }
    let unit = |r: usize| normalized([rows[r][0], rows[r][1], rows[r][2]]);
    let along = match (unit(0), unit(1), unit(2)) {
        (Some(x), Some(y), Some(z)) => normalized(cross(x, y)).map(|ray| cross(ray, z)),
        _ => None,
    };
    if !along.is_some_and(|sine| dot(sine, sine) < 1e-24) {
        return Err(Error::invalid(
            "kind",
            "expected ndc or reversed_ndc for an orthographic camera whose depth does not grow along its rays (a sheared or oblique matrix)",
        ));
    }
    let (z, w) = (rows[2], rows[3][3]);
    let length = dot([z[0], z[1], z[2]], [z[0], z[1], z[2]]).sqrt();
    // Depth grows (standard) or falls (reversed) along the view.
    let slope = if camera.convention().is_reversed() { -length } else { length };
    Ok(Rays::Parallel { slope: slope / w.abs(), constant: z[3] / w })
}

/// `d`, pushed towards far by what float64 may have lost, then rounded towards far; far where it is outside 0..1.
fn toward_far_by(d: f64, lost: f64, reversed: bool) -> f32 {
    if !(0.0..=1.0).contains(&d) {
        return if reversed { 0.0 } else { 1.0 };
    }
    toward_far(if reversed { (d - lost).max(0.0) } else { (d + lost).min(1.0) }, reversed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{ImageSize, Pose, Projection};

    const POSE: Pose = Pose { eye: [1.0, 2.0, 3.0], target: [1.0, 2.0, -7.0], up: [0.0, 1.0, 0.0] };

    fn perspective(convention: DepthConvention) -> Camera {
        let projection =
            Projection::Perspective { fov_y: std::f64::consts::FRAC_PI_2, near: 1.0, far: Some(9.0), convention };
        Camera::look_at(&POSE, &projection, ImageSize::new(2, 2)).unwrap()
    }

    #[test]
    fn view_depth_and_distance_give_hand_worked_ndc_depth() {
        // Pixel centres lie at tangents +-1/2, so a ray is sqrt(1 + 1/4 + 1/4) times its view depth long.
        let length = 1.5_f64.sqrt();
        for (convention, expected) in
            [(DepthConvention::Standard, (9.0 - 9.0 / 3.0) / 8.0), (DepthConvention::Reversed, (9.0 / 3.0 - 1.0) / 8.0)]
        {
            let camera = perspective(convention);
            let z = ndc_from_kind(Floats::F64(&[3.0; 4]), DepthKind::Z, 1.0, &camera).unwrap();
            let distance =
                ndc_from_kind(Floats::F64(&[3000.0 * length; 4]), DepthKind::Distance, 0.001, &camera).unwrap();
            for d in z.iter().chain(&distance) {
                let off = f64::from(*d) - expected;
                assert!(off.abs() < 1e-7, "{d} {expected}");
            }
        }
    }

    /// An eye far from the origin in a bare matrix: the constant cancels, and what that loses has to go towards far. The truth
    /// is that of integers: at eye (0, 0, e) looking along +z, near 1, far 9, the matrix is exact, and so is (9 - 9 / z) / 8.
    #[test]
    fn a_cancelling_eye_rounds_towards_far() {
        for e in [1.0e4, 1.0e6, 1.0e9] {
            for (convention, z_row) in [
                (DepthConvention::Standard, [0.0, 0.0, 9.0 / 8.0, -9.0 / 8.0 - 9.0 / 8.0 * e]),
                (DepthConvention::Reversed, [0.0, 0.0, -1.0 / 8.0, 9.0 / 8.0 + e / 8.0]),
            ] {
                let m = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z_row, [0.0, 0.0, 1.0, -e]];
                let camera = Camera::from_clip_from_world(m, ImageSize::new(1, 1), convention).unwrap();
                for z in [1.5, 2.0, 3.0, 7.7] {
                    let d = f64::from(ndc_from_kind(Floats::F64(&[z]), DepthKind::Z, 1.0, &camera).unwrap()[0]);
                    let truth = if convention.is_reversed() { (9.0 / z - 1.0) / 8.0 } else { (9.0 - 9.0 / z) / 8.0 };
                    let nearer = if convention.is_reversed() { d - truth } else { truth - d };
                    assert!(nearer <= 1e-15 && nearer > -1e-4, "{convention:?} eye {e} depth {z}: {d} for {truth}");
                }
            }
        }
    }

    #[test]
    fn orthographic_depth_by_hand_and_tilted_rows_refused() {
        for (convention, expected) in [(DepthConvention::Standard, 0.25), (DepthConvention::Reversed, 0.75)] {
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
                let d = ndc_from_kind(Floats::F64(&[3.0; 4]), kind, 1.0, &camera).unwrap();
                assert!(d.iter().all(|d| (f64::from(*d) - expected).abs() < 1e-7), "{d:?}");
            }
            // Depth that also depends on x: a wall of one view depth has no one NDC depth.
            let s = if convention.is_reversed() { -1.0 } else { 1.0 };
            let p = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.03 * s, 0.0, 0.04 * s, 0.5], [0.0, 0.0, 0.0, 1.0]];
            let identity = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
            let tilted = Camera::from_clip_from_camera(p, identity, ImageSize::new(2, 2), convention).unwrap();
            let error = ndc_from_kind(Floats::F64(&[0.5; 4]), DepthKind::Z, 1.0, &tilted).unwrap_err();
            assert!(error.to_string().contains("does not grow along its rays"), "{error}");
        }
    }

    /// View depth back from NDC depth, and from w: planes of the test's cameras at depths that are
    /// worked out by hand.
    #[test]
    fn view_depth_comes_back() {
        let near = |z: Option<f64>, expected: f64| assert!((z.unwrap() - expected).abs() < 1e-12, "{z:?} {expected}");
        for (convention, at_3) in [(DepthConvention::Standard, 0.75), (DepthConvention::Reversed, 0.25)] {
            let view = ViewDepth::new(&perspective(convention)).unwrap();
            near(view.of_ndc(at_3), 3.0);
            near(view.of_ndc(f64::from(convention.far())), 9.0);
            near(view.of_w(3.0), 3.0);
            let far = Projection::Perspective { fov_y: 1.0, near: 0.5, far: None, convention };
            let endless = Camera::look_at(&POSE, &far, ImageSize::new(2, 3)).unwrap();
            let view = ViewDepth::new(&endless).unwrap();
            // Depth 2 of near 1/2: a quarter of the way.
            near(view.of_ndc(if convention.is_reversed() { 0.25 } else { 0.75 }), 2.0);
            assert_eq!(view.of_ndc(f64::from(convention.far())), Some(f64::INFINITY));
            let (left, right, bottom, top) = (-1.0, 3.0, -1.0, 1.0);
            let parallel = Projection::Orthographic { left, right, bottom, top, near: -1.0, far: 7.0, convention };
            let view = ViewDepth::new(&Camera::look_at(&POSE, &parallel, ImageSize::new(2, 2)).unwrap()).unwrap();
            // Three quarters of the way from -1 to 7, in either direction.
            near(view.of_ndc(at_3), 5.0);
            assert_eq!(view.of_w(1.0), None);
        }
        // A bare orthographic matrix does not say where depth starts; with an oblique near plane
        // NDC depth depends on the pixel.
        let size = ImageSize::new(2, 2);
        let bare = |z, w| {
            let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, w];
            ViewDepth::new(&Camera::from_clip_from_world(rows, size, DepthConvention::Standard).unwrap())
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
        for (convention, far) in [(DepthConvention::Standard, 1.0), (DepthConvention::Reversed, 0.0)] {
            let camera = perspective(convention);
            for kind in [DepthKind::Z, DepthKind::Distance] {
                assert_eq!(ndc_from_kind(Floats::F64(&bad), kind, 1.0, &camera).unwrap(), [far; 4]);
            }
            // Before the near plane and beyond the far one.
            assert_eq!(
                ndc_from_kind(Floats::F64(&[0.5, 9.5, 0.99, 1e9]), DepthKind::Z, 1.0, &camera).unwrap(),
                [far; 4]
            );
        }
    }

    #[test]
    fn rounding_goes_towards_far() {
        let third = 1.0 / 3.0;
        assert!(f64::from(toward_far(third, false)) >= third && f64::from(toward_far(third, true)) <= third);
        assert_eq!(toward_far(0.25, false), 0.25);
        assert_eq!((toward_far(-1e-300, false), toward_far(1.0 + 1e-15, true)), (1.0, 0.0));
    }

    #[test]
    fn contradictions_are_refused() {
        let camera = perspective(DepthConvention::Reversed);
        let message =
            |kind, scale| ndc_from_kind(Floats::F32(&[0.5; 4]), kind, scale, &camera).unwrap_err().to_string();
        assert!(message(DepthKind::Ndc, 1.0).starts_with("kind: expected the camera's convention, reversed Z"));
        assert!(message(DepthKind::ReversedNdc, 2.0).starts_with("scale:"));
        assert!(message(DepthKind::Z, 0.0).starts_with("scale:"));
        let short = ndc_from_kind(Floats::F32(&[0.5; 3]), DepthKind::Z, 1.0, &camera).unwrap_err().to_string();
        assert!(short.contains("4 numbers, got 3"), "{short}");
    }
}
