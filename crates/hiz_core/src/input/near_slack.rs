//! How much nearer than a stored depth a surface may be: what conversions have moved towards far.
//!
//! `docs/accuracy.md`, section "The nearest end", has the proof.

use crate::error::{Error, Result};
use crate::host::rounding::{EPS, ROUNDING, round_up};
use crate::input::depth_kind::DepthKind;
use crate::input::image::DepthConvention;
use crate::input::lens::{Lens, Rays};
use crate::input::quick::quotient_share;
use crate::input::tolerance::DepthTolerance;

/// How near the surface may be that a stored depth stands for.
///
/// A stored depth `d` stands for depths no nearer than `slope * d - offset` with standard Z, and
/// `slope * d + offset` with reversed Z.
/// Conversions move depth towards far, which is right for the farthest end of a pyramid.
/// The nearest end counts this.
///
/// It comes before the [`DepthTolerance`] of the same image, which holds in either direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearSlack {
    /// The factor of a stored depth; from 0 on.
    pub slope: f64,
    /// In NDC depth, from 0 on.
    pub offset: f64,
}

impl NearSlack {
    /// Depths are stored as they are, or nearer.
    pub const NONE: Self = Self { slope: 1.0, offset: 0.0 };

    /// Nothing is known: every stored depth may stand for one on the near plane.
    pub const UNKNOWN: Self = Self { slope: 0.0, offset: 1.0 };

    /// That of NDC depth in float64 that was rounded to float32 towards far.
    pub(super) fn of_rounding(reversed: bool) -> Self {
        if reversed {
            Self { slope: 1.0 + EPS, offset: f32::MIN_POSITIVE.into() }
        } else {
            Self { slope: 1.0, offset: EPS / 2.0 }
        }
    }

    /// The slack of both images, where a pixel may come from either.
    #[must_use]
    pub(crate) fn or(self, other: Self, convention: DepthConvention) -> Self {
        let (more, less) = if self.slope >= other.slope { (self, other) } else { (other, self) };
        let offset = more.offset.max(less.offset);
        if convention.is_reversed() {
            Self { slope: more.slope, offset }
        } else {
            Self { slope: less.slope, offset }
        }
    }

    /// The slack of a cull: the format erred after this was lost, and the caller before it.
    #[must_use]
    pub(crate) fn with(
        self,
        format: DepthTolerance,
        caller: DepthTolerance,
        convention: DepthConvention,
    ) -> Self {
        let none = DepthTolerance::NONE;
        if self == Self::NONE && format == none && caller == none {
            return self;
        }
        let sign = if convention.is_reversed() { 1.0 } else { -1.0 };
        let factor = (1.0 + sign * format.relative) * (1.0 + sign * caller.relative);
        let of_format = format.absolute * self.slope + self.offset;
        Self {
            slope: self.slope * factor * (1.0 + sign * 1e-14),
            offset: (of_format * (1.0 + caller.relative) + caller.absolute) * (1.0 + 1e-14),
        }
    }

    /// The factor and the offset by which the shader moves a stored depth, roundings included.
    ///
    /// The product and the sum lose 2^-24 of themselves each.
    /// `NONE` is exact, and moves nothing.
    pub(crate) fn in_single(self, convention: DepthConvention) -> (f32, f32) {
        let sign = if convention.is_reversed() { 1.0 } else { -1.0 };
        if self == Self::NONE {
            return (1.0, 0.0);
        }
        let factor = self.slope * (1.0 + sign * 1.01 * EPS);
        let offset = round_up(self.offset * (1.0 + EPS));
        if convention.is_reversed() {
            (round_up(factor), offset)
        } else {
            (-round_up(-factor), -offset)
        }
    }

    pub(crate) fn checked(self) -> Result<Self> {
        let fits = |v: f64| (0.0..=2.0).contains(&v);
        if fits(self.slope) && fits(self.offset) {
            return Ok(self);
        }
        let Self { slope, offset } = self;
        Err(Error::invalid(
            "near_slack",
            format!("expected slope and offset in 0..=2, got {slope} and {offset}"),
        ))
    }
}

/// The slack of numbers of the kinds `Z` and `Distance` of this camera, whichever way they take.
///
/// Before the conversion the numbers have `tolerance` in either direction.
/// It moves them by that towards far, so the nearest one is twice as far away.
///
/// Depth is `base + Q` with a quotient `Q = N length / number`, which is below 0 with standard Z.
pub(super) fn of_metric(
    lens: &Lens,
    kind: DepthKind,
    scale: f64,
    tolerance: DepthTolerance,
) -> NearSlack {
    let DepthTolerance { relative, absolute } = tolerance;
    match &lens.rays {
        Rays::Parallel { slope, constant, tilt } => {
            let lost = 16.0 * ROUNDING * (1.0 + constant.abs()) + tilt;
            let of_number = (1.0 + 2.0 * constant.abs()) * (relative + 16.0 * ROUNDING)
                + slope.abs() * scale * absolute;
            let offset = 4.0 * (lost + of_number) + EPS;
            if offset < 0.5 { NearSlack { slope: 1.0, offset } } else { NearSlack::UNKNOWN }
        }
        Rays::FromEye { k, constant, k_error, constant_error, w_length, .. } => {
            let quotient = constant / (w_length * scale);
            let share =
                16.0 * ROUNDING + constant_error / constant.abs() + quotient_share(lens, kind);
            let size: f64 = k.iter().map(|v| v.abs()).sum();
            // Q is at most 1 + |base|, and the ray's length at least 1.
            let near_number = 2.0 * (1.0 + size) / quotient.abs();
            let share_of_number = relative + absolute * near_number;
            if !(share_of_number < 0.25 && share < 1e-3) {
                return NearSlack::UNKNOWN;
            }
            // By how much of itself Q may be larger than it was stored.
            let grown = (1.0 + share_of_number) / ((1.0 - share_of_number) * (1.0 - 4.0 * share))
                * (1.0 + 1e-9)
                - 1.0;
            let leaning = k[0].abs() + k[1].abs();
            let error: f64 = k_error.iter().sum();
            let lost = 2.0 * (16.0 * ROUNDING * size + error * (1.0 + 1e-9))
                + f64::from(f32::MIN_POSITIVE);
            let runs_right = (quotient > 0.0) == lens.reversed;
            let towards = if lens.reversed { -k[2] } else { k[2] };
            let base = (towards + leaning + error).max(0.0);
            let slack = match (runs_right, lens.reversed) {
                (true, true) => NearSlack { slope: 1.0 + grown + EPS, offset: grown * base + lost },
                (true, false) => {
                    NearSlack { slope: 1.0 + grown, offset: grown * base + lost + EPS / 2.0 }
                }
                (false, _) => NearSlack { slope: 1.0, offset: grown * (1.0 + size) + lost + EPS },
            };
            if slack.offset < 0.5 { slack } else { NearSlack::UNKNOWN }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::bounds::Floats;
    use crate::input::camera::Camera;
    use crate::input::depth::{Conversion, DepthInput};
    use crate::input::image::ImageSize;
    use crate::input::lens::test_cameras::POSE;
    use crate::input::projection::Projection;
    use crate::input::world_tolerance::WorldTolerance;

    const SIZE: ImageSize = ImageSize { width: 300, height: 2 };

    fn cameras(convention: DepthConvention) -> Vec<Camera> {
        let eye = |far| Projection::Frustum {
            left: -0.09,
            right: 0.12,
            bottom: -0.05,
            top: 0.06,
            near: 0.1,
            far,
            convention,
        };
        let parallel = Projection::Orthographic {
            left: -3.0,
            right: 2.0,
            bottom: -1.0,
            top: 1.0,
            near: 0.1,
            far: 90.0,
            convention,
        };
        [eye(None), eye(Some(90.0)), parallel]
            .map(|projection| Camera::look_at(&POSE, &projection, SIZE).unwrap())
            .to_vec()
    }

    /// NDC depth of view depth z, by the definition of these projections.
    fn ndc(camera: usize, z: f64, reversed: bool) -> f64 {
        let standard = match camera {
            0 => 1.0 - 0.1 / z,
            1 => 90.0 / 89.9 * (1.0 - 0.1 / z),
            _ => (z - 0.1) / 89.9,
        };
        if reversed { 1.0 - standard } else { standard }
    }

    /// Depths from the near plane to the far one; each may be nearer by twice what moved it.
    /// The slack covers that, and without what it counts some depth is not covered.
    #[test]
    fn a_depth_is_never_nearer_than_its_slack_says() {
        let numbers: Vec<f64> =
            (0..SIZE.pixels()).map(|i| 0.102 * 1.0113_f64.powi(i as i32)).collect();
        let tolerances = [
            DepthTolerance::NONE,
            DepthTolerance::HALF,
            DepthTolerance { relative: 0.01, absolute: 1e-4 },
        ];
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            let reversed = convention.is_reversed();
            for (which, camera) in cameras(convention).iter().enumerate() {
                for tolerance in tolerances {
                    let depth = DepthInput {
                        numbers: Floats::F64(&numbers).into(),
                        kind: DepthKind::Z,
                        scale: 1.0,
                        invalid: &[],
                        tolerance,
                        world_tolerance: WorldTolerance { relative: 0.001, absolute: 1e-5 },
                    };
                    let conversion = Conversion::new(&depth, camera).unwrap();
                    let slack = conversion.near_slack();
                    let mut stored = vec![0.0; numbers.len()];
                    conversion.rows(0, &mut stored);
                    let mut least = f64::INFINITY;
                    for (number, stored) in numbers.iter().zip(&stored) {
                        let off = |n: f64| n - (n * tolerance.relative + tolerance.absolute);
                        let nearest = off(*number - (number * 0.001 + 1e-5));
                        if *stored == convention.far() || nearest < 0.1 {
                            continue;
                        }
                        let truth = ndc(which, nearest, reversed);
                        let stored = f64::from(*stored);
                        let room = if reversed {
                            slack.slope * stored + slack.offset - truth
                        } else {
                            truth - (slack.slope * stored - slack.offset)
                        };
                        least = least.min(room);
                        let bare = if reversed { stored - truth } else { truth - stored };
                        assert!(bare < 0.0, "no depth is nearer than it was stored");
                    }
                    let what = format!("{convention:?} {which} {tolerance:?} {slack:?}");
                    assert!((0.0..0.2).contains(&least), "{what}: {least}");
                }
            }
        }
    }

    /// Quotients of float32 lose more than one rounding, and the slack covers all of it.
    #[test]
    fn quotients_of_float32_are_covered() {
        let camera = &cameras(DepthConvention::Reversed)[0];
        let numbers: Vec<f32> =
            (0..SIZE.pixels()).map(|i| 0.102 * 1.0113_f32.powi(i as i32)).collect();
        let depth = DepthInput {
            numbers: Floats::F32(&numbers).into(),
            kind: DepthKind::Z,
            scale: 1.0,
            invalid: &[],
            tolerance: DepthTolerance::NONE,
            world_tolerance: WorldTolerance::NONE,
        };
        let conversion = Conversion::new(&depth, camera).unwrap();
        let (slack, rounding) = (conversion.near_slack(), NearSlack::of_rounding(true));
        let mut stored = vec![0.0; numbers.len()];
        conversion.rows(0, &mut stored);
        let mut beyond_rounding = 0;
        for (number, stored) in numbers.iter().zip(&stored) {
            let (truth, stored) = (ndc(0, f64::from(*number), true), f64::from(*stored));
            assert!(stored <= truth && truth <= slack.slope * stored + slack.offset, "{number}");
            beyond_rounding += usize::from(truth > rounding.slope * stored + rounding.offset);
        }
        assert!(beyond_rounding > 100, "{beyond_rounding}");
        assert!(slack.slope < 1.0 + 1e-6, "{slack:?}");
    }
}
