//! Depth images of other makers: from what their numbers mean to NDC depth, in float64, rounded towards far.
//!
//! Rounding towards far loses culling by a hair and never hides anything. What is no depth at all (NaN, infinite, outside
//! the camera's range; for sensors zero and negative) becomes far, which never occludes.

use crate::bounds::Floats;
use crate::camera::{Camera, DepthConvention, Mat3, Vec3, dot, inverse3, mul3};
use crate::error::{Error, Result};

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
            Ok((0..image.len()).map(|i| toward_far(image.get(i), reversed)).collect())
        }
        DepthKind::Z | DepthKind::Distance => {
            if !(scale.is_finite() && scale > 0.0) {
                return Err(Error::invalid("scale", format!("expected a positive finite number, got {scale}")));
            }
            let lens = Lens::new(camera)?;
            let mut out = Vec::with_capacity(image.len());
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

/// How a camera's rays run: what turns a depth along them into clip coordinates.
struct Lens {
    camera: Camera,
    /// Perspective: the inverse of the rows x, y, w, and the length of w's. Orthographic: nothing, rays are parallel.
    perspective: Option<(Mat3, f64)>,
    /// Clip z at the eye (perspective) or at the origin's plane (orthographic).
    z_at_eye: f64,
    z_lin: Vec3,
    half: [f64; 2],
}

impl Lens {
    fn new(camera: &Camera) -> Result<Self> {
        let rows = camera.rows();
        let lin = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
        let size = camera.size();
        let half = [f64::from(size.width) / 2.0, f64::from(size.height) / 2.0];
        let z_lin = lin(2);
        if lin(3) == [0.0; 3] {
            if !camera.is_posed() {
                return Err(Error::invalid(
                    "kind",
                    "expected ndc or reversed_ndc for an orthographic camera made from a bare matrix: it does not say where view depth starts",
                ));
            }
            return Ok(Self { camera: camera.clone(), perspective: None, z_at_eye: rows[2][3], z_lin, half });
        }
        let inverse = inverse3(&[lin(0), lin(1), lin(3)])
            .ok_or_else(|| Error::invalid("camera", "expected an invertible projection, got a singular matrix"))?;
        let eye = mul3(&inverse, [-rows[0][3], -rows[1][3], -rows[3][3]]);
        let perspective = Some((inverse, dot(lin(3), lin(3)).sqrt()));
        Ok(Self { camera: camera.clone(), perspective, z_at_eye: dot(z_lin, eye) + rows[2][3], z_lin, half })
    }

    fn ndc(&self, column: u32, row: u32, value: f64, kind: DepthKind) -> f32 {
        let reversed = self.camera.convention().is_reversed();
        let Some((inverse, w_length)) = &self.perspective else {
            // Rays are parallel: both kinds are the same. Depth grows (standard) or falls (reversed) along the view.
            let slope = dot(self.z_lin, self.z_lin).sqrt() * if reversed { -1.0 } else { 1.0 };
            let w = self.camera.rows()[3][3];
            return biased(slope * value / w, self.z_at_eye / w, reversed);
        };
        let x = (f64::from(column) + 0.5) / self.half[0] - 1.0;
        let y = 1.0 - (f64::from(row) + 0.5) / self.half[1];
        // The direction of the ray, scaled so that w grows by 1.
        let ray = mul3(inverse, [x, y, 1.0]);
        let w = match kind {
            // w = |w_lin| times the view depth.
            DepthKind::Z => value * w_length,
            _ => value / dot(ray, ray).sqrt(),
        };
        biased(dot(self.z_lin, ray), self.z_at_eye / w, reversed)
    }
}

/// `a + b` as NDC depth, pushed towards far by more than float64 can have lost, then rounded towards far.
fn biased(a: f64, b: f64, reversed: bool) -> f32 {
    let lost = 16.0 * f64::EPSILON * (a.abs() + b.abs());
    let d = a + b;
    if !(0.0..=1.0).contains(&d) {
        return if reversed { 0.0 } else { 1.0 };
    }
    let d = if reversed { (d - lost).max(0.0) } else { (d + lost).min(1.0) };
    toward_far(d, reversed)
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
