//! Depth that is moved away from the eye by a tolerance in world units, before a cull reads it.
//!
//! Metric depth is moved on its way to NDC depth (`depth`, `quick`).
//! NDC depth is moved here: to view depth, away from the eye, and back, in one expression.
//! `docs/accuracy.md`, section "Depth that is moved", has the proof.

use crate::error::{Error, Result};
use crate::host::rounding::ROUNDING;
use crate::input::camera::Camera;
use crate::input::depth_kind::DepthKind;
use crate::input::lens::{Lens, Rays, toward_far};
use crate::input::near_slack::{self, NearSlack};
use crate::input::quick::Number;
use crate::input::tolerance::DepthTolerance;

/// How far the depths of an image may lie before the surfaces that they measure, in the world.
///
/// The upload moves each depth away from the eye, by `relative` times the depth plus `absolute`.
/// View depth moves along the view, a distance along its ray, and NDC depth along the view.
/// What is no depth stays: the background, and numbers that mean "no data".
/// So do depths in front of the near plane.
///
/// The promise then holds for the moved image.
///
/// # Examples
/// ```
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// use hiz_core::{DepthInput, DepthKind, DepthTolerance, Floats, WorldTolerance, ndc_of};
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let camera = camera.with_size(ImageSize::new(2, 1))?;
///
/// // A wall at 10 m, measured to within 1 % and 2 cm, and a pixel without data.
/// let input = DepthInput {
///     numbers: Floats::F64(&[10.0, f64::NAN]).into(),
///     kind: DepthKind::Z,
///     scale: 1.0,
///     invalid: &[],
///     tolerance: DepthTolerance::NONE,
///     world_tolerance: WorldTolerance { relative: 0.01, absolute: 0.02 },
/// };
/// let (ndc, _) = ndc_of(&input, &camera)?;
/// let moved = 0.1 / 10.12; // near / view depth
/// assert!((moved - 1e-9..=moved).contains(&f64::from(ndc[0])));
/// assert_eq!(ndc[1], 0.0);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WorldTolerance {
    /// Relative to the depth, in 0..=0.5.
    pub relative: f64,
    /// In world units: from 0 on, and finite.
    pub absolute: f64,
}

impl WorldTolerance {
    /// Depth stays where it is.
    pub const NONE: Self = Self { relative: 0.0, absolute: 0.0 };

    pub(crate) fn checked(self) -> Result<Self> {
        if !(0.0..=0.5).contains(&self.relative) {
            return Err(Error::invalid(
                "tolerance.relative",
                format!("expected a number in 0..=0.5, got {}", self.relative),
            ));
        }
        if !(self.absolute >= 0.0 && self.absolute.is_finite()) {
            return Err(Error::invalid(
                "tolerance.absolute",
                format!("expected a finite number from 0 on, got {}", self.absolute),
            ));
        }
        Ok(self)
    }

    /// A number of world units with what moves it away from the eye.
    /// Its two products and two sums lose less than 4 roundings of the result.
    #[inline]
    pub(super) fn moved(self, value: f64) -> f64 {
        value + (value.abs() * self.relative + self.absolute)
    }

    /// This and the rounding of an image's numbers, in their units of `scale` world units each.
    pub(super) fn with_rounding(self, rounding: DepthTolerance, scale: f64) -> DepthTolerance {
        let of_world = DepthTolerance { relative: self.relative, absolute: self.absolute / scale };
        of_world.after(rounding)
    }
}

/// NDC depth of a camera, and how far it is moved.
pub(super) struct NdcMove {
    lens: Lens,
    tolerance: WorldTolerance,
    /// What the image's numbers were rounded by, in their units.
    rounding: DepthTolerance,
    /// A bound of what the expressions of a pixel lose, whatever the pixel.
    lost: f64,
}

impl NdcMove {
    /// The errors are those of cameras that do not say where view depth starts.
    pub(super) fn new(
        camera: &Camera,
        tolerance: WorldTolerance,
        rounding: DepthTolerance,
    ) -> Result<Self> {
        let lens = Lens::new(camera).map_err(|_| {
            Error::invalid(
                "tolerance",
                "expected 0 for this camera, whose NDC depth has no view depth (an orthographic \
                 camera from a bare or sheared matrix, or a singular one): use depth_slack and \
                 depth_slack_abs of the cull",
            )
        })?;
        let lost = match &lens.rays {
            // Roundings of the difference, the products and the sums are less than 16 of
            // 1 + |constant|.
            // A depth that is off by `tilt` moves by so much of it.
            Rays::Parallel { constant, tilt, .. } => {
                16.0 * ROUNDING * (1.0 + constant.abs()) + tilt * tolerance.relative
            }
            // Both terms of the base, the difference, the quotient and the sum: less than 32.
            // A base that is off by e moves the result by less than e, since the quotient grows by
            // at most as much as the difference.
            Rays::FromEye { k, constant, k_error, constant_error, .. } => {
                let base = k.iter().map(|v| v.abs()).sum::<f64>();
                let inherited = k_error.iter().sum::<f64>()
                    + 2.0 * (1.0 + base) * constant_error / constant.abs();
                32.0 * ROUNDING * (1.0 + base) + inherited * (1.0 + 1e-9)
            }
        };
        Ok(Self { lens, tolerance, rounding, lost })
    }

    /// How near the depth may be that a moved one stands for.
    pub(super) fn near_slack(&self) -> NearSlack {
        let Self { lens, tolerance, rounding, lost } = self;
        let WorldTolerance { relative, absolute } = *tolerance;
        let of_move = DepthTolerance { relative, absolute };
        let slack = near_slack::of_metric(lens, DepthKind::Z, 1.0, of_move);
        // The number was rounded before it was moved, and was moved by as much.
        let off = 2.0 * (rounding.relative + rounding.absolute);
        // The quotient's growth applies to what rounding may add to it.
        NearSlack { offset: slack.offset + 2.0 * (off + 2.0 * lost), ..slack }
    }

    /// Moves the NDC depths of a row away from the eye, rounded to float32 towards far.
    pub(super) fn row<T: Number>(&self, row: u32, numbers: &[T], invalid: &[T], out: &mut [f32]) {
        let Self { lens, tolerance, rounding, lost } = self;
        let reversed = lens.reversed;
        let (far, sign) = if reversed { (0.0, -1.0) } else { (1.0, 1.0) };
        let WorldTolerance { relative, absolute } = *tolerance;
        // `(slope, base)` of the row, or the base and the inverse of the quotient's numerator.
        let [width, height] = lens.size;
        let y = (height - 2.0 * f64::from(row) - 1.0) / height;
        for (column, (out, number)) in (0_u32..).zip(out.iter_mut().zip(numbers)) {
            let given: f64 = (*number).into();
            let is_depth =
                (0.0..=1.0).contains(&given) && given != far && !invalid.contains(number);
            if !is_depth {
                *out = if reversed { 0.0 } else { 1.0 };
                continue;
            }
            // What rounded the number may have moved it towards near.
            let d = given + sign * (given * rounding.relative + rounding.absolute) * (1.0 + 1e-15);
            let moved = match &lens.rays {
                Rays::Parallel { slope, constant, .. } => {
                    d + sign * ((d - constant).abs() * relative + slope.abs() * absolute)
                }
                Rays::FromEye { k, constant, w_length, .. } => {
                    let x = (2.0 * f64::from(column) + 1.0 - width) / width;
                    let base = k[0] * x + k[1] * y + k[2];
                    // View depth is `quotient / from_base`.
                    let (from_base, quotient) = (d - base, constant / w_length);
                    let per_depth = from_base / quotient;
                    // What lies at or beyond infinity stays there.
                    if per_depth > 0.0 {
                        base + from_base / (1.0 + relative + absolute * per_depth)
                    } else {
                        d
                    }
                }
            };
            *out = toward_far(moved + sign * lost, reversed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::bounds::Floats;
    use crate::input::depth::{DepthInput, ndc_of};
    use crate::input::image::{DepthConvention, ImageSize};
    use crate::input::lens::test_cameras::POSE;
    use crate::input::projection::Projection;

    const SIZE: ImageSize = ImageSize { width: 300, height: 2 };
    const CONVENTIONS: [DepthConvention; 2] =
        [DepthConvention::Standard, DepthConvention::Reversed];

    fn cameras(convention: DepthConvention) -> Vec<Camera> {
        let borders = (-0.09, 0.12, -0.05, 0.06);
        let (left, right, bottom, top) = borders;
        let frustum =
            |far| Projection::Frustum { left, right, bottom, top, near: 0.1, far, convention };
        let parallel = |near| Projection::Orthographic {
            left: -3.0,
            right: 2.0,
            bottom: -1.0,
            top: 1.0,
            near,
            far: 900.0,
            convention,
        };
        [frustum(None), frustum(Some(1000.0)), parallel(0.1), parallel(-5.0)]
            .map(|projection| Camera::look_at(&POSE, &projection, SIZE).unwrap())
            .to_vec()
    }

    fn ndc(camera: &Camera, kind: DepthKind, numbers: &[f64], by: WorldTolerance) -> Vec<f32> {
        let input = DepthInput {
            numbers: Floats::F64(numbers).into(),
            kind,
            scale: 1.0,
            invalid: &[7.0],
            tolerance: DepthTolerance::NONE,
            world_tolerance: by,
        };
        let (ndc, left) = ndc_of(&input, camera).unwrap();
        assert_eq!(left, DepthTolerance::NONE);
        ndc
    }

    fn own_kind(camera: &Camera) -> DepthKind {
        if camera.convention().is_reversed() { DepthKind::ReversedNdc } else { DepthKind::Ndc }
    }

    /// The oracle's depth of the numbers that were moved by hand.
    fn truth(camera: &Camera, kind: hiz_ref::DepthKind, moved: &[f64]) -> Vec<f32> {
        let view = hiz_ref::View {
            rows: camera.rows(),
            origin: camera.origin(),
            width: SIZE.width,
            height: SIZE.height,
            reversed: camera.convention().is_reversed(),
        };
        let meaning =
            hiz_ref::DepthMeaning { kind, scale: 1.0, invalid: &[7.0], origin_is_eye: true };
        hiz_ref::depth_bounds(&view, moved, meaning).unwrap().farther
    }

    const TOLERANCES: [WorldTolerance; 4] = [
        WorldTolerance { relative: 0.01, absolute: 0.02 },
        WorldTolerance { relative: 0.5, absolute: 0.0 },
        WorldTolerance { relative: 0.0, absolute: 3.0 },
        WorldTolerance { relative: 1e-6, absolute: 1e-6 },
    ];

    /// Steps by which depths are farther than the truth, at least and at most.
    fn steps(got: &[f32], truth: &[f32], reversed: bool) -> [i64; 2] {
        let sign = if reversed { -1 } else { 1 };
        let steps = got.iter().zip(truth).filter(|(_, truth)| **truth > 0.0 && **truth < 1.0);
        let steps: Vec<i64> = steps
            .map(|(got, truth)| (i64::from(got.to_bits()) - i64::from(truth.to_bits())) * sign)
            .collect();
        assert!(steps.len() > 100, "{}", steps.len());
        [*steps.iter().min().unwrap(), *steps.iter().max().unwrap()]
    }

    /// Metric depth is that of the moved numbers: never nearer, and hardly farther.
    #[test]
    fn metric_depth_is_moved_away_from_the_eye() {
        let numbers: Vec<f64> =
            (0..SIZE.pixels()).map(|i| 0.2 * 1.014_f64.powi((i * 211 % 542) as i32)).collect();
        for convention in CONVENTIONS {
            for camera in cameras(convention) {
                for (kind, of_oracle) in [
                    (DepthKind::Z, hiz_ref::DepthKind::Z),
                    (DepthKind::Distance, hiz_ref::DepthKind::Distance),
                ] {
                    for by in TOLERANCES {
                        let moved: Vec<f64> =
                            numbers.iter().map(|v| v + (v * by.relative + by.absolute)).collect();
                        let expected = truth(&camera, of_oracle, &moved);
                        let got = ndc(&camera, kind, &numbers, by);
                        let [least, most] = steps(&got, &expected, convention.is_reversed());
                        assert!(
                            least >= 0 && most <= 64,
                            "{convention:?} {kind:?} {by:?}: {least}..{most}"
                        );
                    }
                }
            }
        }
    }

    /// NDC depth is moved as the view depth that it stands for.
    #[test]
    fn ndc_depth_is_moved_as_view_depth_is() {
        for convention in CONVENTIONS {
            for camera in cameras(convention) {
                let sign = if convention.is_reversed() { -1.0 } else { 1.0 };
                for by in TOLERANCES {
                    let numbers: Vec<f64> = (0..SIZE.pixels())
                        .map(|i| 0.2 * 1.014_f64.powi((i * 211 % 542) as i32))
                        .collect();
                    let given = truth(&camera, hiz_ref::DepthKind::Z, &numbers);
                    let given: Vec<f64> = given.iter().map(|d| f64::from(*d)).collect();
                    let moved: Vec<f64> =
                        numbers.iter().map(|v| v + (v * by.relative + by.absolute)).collect();
                    let expected = truth(&camera, hiz_ref::DepthKind::Z, &moved);
                    let got = ndc(&camera, own_kind(&camera), &given, by);
                    // `given` was rounded towards far by up to one float32, which stays.
                    for (i, (got, expected)) in got.iter().zip(&expected).enumerate() {
                        let off = (f64::from(*got) - f64::from(*expected)) * sign;
                        assert!(
                            (0.0..=2.0_f64.powi(-22)).contains(&off),
                            "{convention:?} {by:?} {}: {off:e}",
                            numbers[i]
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_no_depth_stays() {
        for convention in CONVENTIONS {
            let far = convention.far();
            for camera in cameras(convention) {
                let own = own_kind(&camera);
                let near = 1.0 - f64::from(far);
                let fill = |v: f64| vec![v; SIZE.pixels() as usize];
                for by in TOLERANCES {
                    let ours: [f64; 5] = [f64::from(far), f64::NAN, 1.5, -0.5, f64::INFINITY];
                    for v in ours {
                        let got = ndc(&camera, own, &fill(v), by);
                        assert!(got.iter().all(|d| *d == far), "{convention:?} {by:?} {v}");
                    }
                    // The near plane itself is a depth.
                    let got = ndc(&camera, own, &fill(near), by);
                    assert!(got.iter().all(|d| f64::from(*d) != near));
                    let none: [f64; 4] = [f64::NAN, f64::INFINITY, 7.0, -9.0];
                    for kind in [DepthKind::Z, DepthKind::Distance] {
                        for v in none {
                            let got = ndc(&camera, kind, &fill(v), by);
                            assert!(got.iter().all(|d| *d == far), "{convention:?} {by:?} {v}");
                        }
                    }
                }
            }
            // In front of the near plane, however far the tolerance would move it.
            for camera in &cameras(convention)[..3] {
                for v in [0.0, 1e-9, 0.05, 0.0999, -0.01] {
                    let numbers = vec![v; SIZE.pixels() as usize];
                    for by in TOLERANCES {
                        let got = ndc(camera, DepthKind::Z, &numbers, by);
                        assert!(got.iter().all(|d| *d == far), "{convention:?} {by:?} {v}");
                    }
                }
            }
        }
    }

    #[test]
    fn bad_tolerances_and_cameras_without_view_depth_are_refused() {
        let camera = &cameras(DepthConvention::Reversed)[0];
        let numbers = vec![0.5; SIZE.pixels() as usize];
        let refused = |camera: &Camera, relative, absolute| {
            let input = DepthInput {
                numbers: Floats::F64(&numbers).into(),
                kind: own_kind(camera),
                scale: 1.0,
                invalid: &[],
                tolerance: DepthTolerance::NONE,
                world_tolerance: WorldTolerance { relative, absolute },
            };
            ndc_of(&input, camera).unwrap_err().to_string()
        };
        for (relative, absolute, text) in [
            (0.6, 0.0, "tolerance.relative: expected a number in 0..=0.5, got 0.6"),
            (f64::NAN, 0.0, "tolerance.relative: expected a number in 0..=0.5, got NaN"),
            (0.0, -1.0, "tolerance.absolute: expected a finite number from 0 on, got -1"),
            (0.0, f64::INFINITY, "tolerance.absolute: expected a finite number from 0 on, got inf"),
        ] {
            assert_eq!(refused(camera, relative, absolute), text);
        }
        let rows = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let bare = Camera::from_clip_from_world(rows, SIZE, DepthConvention::Standard).unwrap();
        assert!(refused(&bare, 0.0, 0.1).starts_with("tolerance: expected 0 for this camera"));
    }
}
