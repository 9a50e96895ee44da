//! The rounding of depth formats, as a tolerance that every cull adds to the caller's slack.
//!
//! The numbers are derived in `docs/accuracy.md`, section "What a depth format rounds".

use crate::error::{Error, Result};
use crate::host::rounding::EPS;

/// How far a stored depth may lie from the depth that was given to be stored.
///
/// The distance is at most `relative` times the stored depth plus `absolute`, in either direction.
/// It covers two roundings: to the format, and of the stored number read back as float32.
///
/// Errors of the renderer that computed the depth are separate.
/// [`CullOptions::depth_slack`](crate::CullOptions::depth_slack) and
/// [`depth_slack_abs`](crate::CullOptions::depth_slack_abs) cover those.
/// Every cull counts both.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DepthTolerance {
    /// Relative to the stored number, in 0..=0.5.
    pub relative: f64,
    /// In the units of the stored number, in 0..=0.5; those of NDC depth in a depth texture.
    pub absolute: f64,
}

impl DepthTolerance {
    /// Nothing is lost: the depth is stored as it was given, or was rounded towards far.
    ///
    /// This holds for float32 formats, too, since the default `depth_slack` covers their rounding.
    pub const NONE: Self = Self { relative: 0.0, absolute: 0.0 };

    /// Half floats: 2^-10 relative and 2^-24 absolute, one spacing of half floats.
    ///
    /// Vulkan lets a driver round to either neighbour.
    pub const HALF: Self = Self { relative: 1.0 / 1024.0, absolute: 1.0 / 16_777_216.0 };

    /// Rounding to nearest in float32: half a spacing.
    ///
    /// For NDC depth the default `depth_slack` covers it.
    /// A metric depth is rounded before it is converted.
    /// Close to the near plane a relative slack of the converted depth would be too small.
    pub const SINGLE: Self = Self { relative: 0.5 * EPS, absolute: f32::MIN_POSITIVE as f64 * EPS };

    /// The tolerance of a texture format; `None` for formats that no pyramid can be built from.
    ///
    /// | format | relative | absolute |
    /// |---|---|---|
    /// | `Depth16Unorm` | 2^-22 | 1/65535 |
    /// | `Depth24Plus`, `Depth24PlusStencil8` | 2^-22 | 1/(2^24 - 1) |
    /// | `R16Float` | 2^-10 | 2^-24: [`DepthTolerance::HALF`] |
    /// | `Depth32Float`, `Depth32FloatStencil8` | 0 | 0: [`DepthTolerance::NONE`] |
    /// | `R32Float`, `Rgba32Uint` | 0 | 0: [`DepthTolerance::NONE`] |
    ///
    /// The relative 2^-22 is for the conversion back to float32.
    /// A driver without 24 bits stores `Depth24Plus` as float32; the numbers hold for that, too.
    pub fn of(format: wgpu::TextureFormat) -> Option<Self> {
        use wgpu::TextureFormat as Format;
        match format {
            Format::Depth16Unorm => Some(Self::fixed_point(16)),
            Format::Depth24Plus | Format::Depth24PlusStencil8 => Some(Self::fixed_point(24)),
            Format::R16Float => Some(Self::HALF),
            Format::Depth32Float
            | Format::Depth32FloatStencil8
            | Format::R32Float
            | Format::Rgba32Uint => Some(Self::NONE),
            _ => None,
        }
    }

    /// Normalised integers of `bits` bits: one step, and two spacings of float32 for reading back.
    fn fixed_point(bits: u32) -> Self {
        let steps = f64::from((1_u32 << bits) - 1);
        Self { relative: 2.0 * EPS, absolute: (1.0 / steps).next_up() }
    }

    /// The tolerance of a depth that was moved by `before` first and by `self` second, rounded up.
    #[must_use]
    pub fn after(self, before: Self) -> Self {
        if self == Self::NONE || before == Self::NONE {
            return if self == Self::NONE { before } else { self };
        }
        let up = |v: f64| if v > 0.0 { v.next_up().next_up() } else { v };
        Self {
            relative: up(self.relative + before.relative + self.relative * before.relative),
            absolute: up(self.absolute * (1.0 + before.relative) + before.absolute),
        }
    }

    pub(crate) fn checked(self) -> Result<Self> {
        for (name, value) in
            [("tolerance.relative", self.relative), ("tolerance.absolute", self.absolute)]
        {
            if !(0.0..=0.5).contains(&value) {
                return Err(Error::invalid(
                    name,
                    format!("expected a number in 0..=0.5, got {value}"),
                ));
            }
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::bounds::Floats;
    use crate::input::camera::Camera;
    use crate::input::depth::ndc_from_kind_within;
    use crate::input::depth_kind::DepthKind;
    use crate::input::image::{DepthConvention, ImageSize};
    use crate::input::projection::{Pose, Projection};

    /// Worked out by hand: a step of the format, never less, and at most slightly more.
    #[test]
    fn each_format_has_its_step() {
        use wgpu::TextureFormat as Format;
        let close = |tolerance: DepthTolerance, steps: f64| {
            tolerance.absolute * steps >= 1.0 && tolerance.absolute * steps < 1.0 + 1e-12
        };
        let of = |format| DepthTolerance::of(format).expect("a source");
        assert!(close(of(Format::Depth16Unorm), 65_535.0));
        assert!(
            close(of(Format::Depth24Plus), 16_777_215.0)
                && close(of(Format::Depth24PlusStencil8), 16_777_215.0)
        );
        assert_eq!(of(Format::Depth16Unorm).relative, 2.0_f64.powi(-22));
        assert_eq!(
            of(Format::R16Float),
            DepthTolerance { relative: 2.0_f64.powi(-10), absolute: 2.0_f64.powi(-24) }
        );
        for format in [
            Format::Depth32Float,
            Format::Depth32FloatStencil8,
            Format::R32Float,
            Format::Rgba32Uint,
        ] {
            assert_eq!(of(format), DepthTolerance::NONE);
        }
        assert_eq!(DepthTolerance::of(Format::Rgba8Unorm), None);
        assert_eq!(DepthTolerance::of(Format::Stencil8), None);
    }

    /// A relative 0.001 and an absolute 0.25, then 0.5 and 0.125.
    /// In either convention the sum is at least as far as both in turn.
    #[test]
    fn tolerances_add_up_one_after_the_other() {
        let (format, caller) = (
            DepthTolerance { relative: 0.001, absolute: 0.25 },
            DepthTolerance { relative: 0.5, absolute: 0.125 },
        );
        let both = format.after(caller);
        for stored in [0.0, 0.1, 0.5, 1.0] {
            let in_turn = (stored * 1.001 + 0.25) * 1.5 + 0.125;
            let at_once = stored * (1.0 + both.relative) + both.absolute;
            assert!(at_once >= in_turn && at_once <= in_turn + 1e-12, "{at_once} {in_turn}");
            // Towards 0 the same numbers are more than enough.
            let in_turn = (stored * 0.999 - 0.25) * 0.5 - 0.125;
            assert!(stored * (1.0 - both.relative) - both.absolute <= in_turn);
        }
        assert_eq!(DepthTolerance::NONE.after(caller), caller);
    }

    /// View depth 3 as a half float may mean anything up to 3.0029...
    /// The result is that depth, in either convention.
    #[test]
    fn metric_halves_are_moved_before_they_are_converted() {
        let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, 1.0], up: [0.0, 1.0, 0.0] };
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            let projection =
                Projection::Perspective { fov_y: 1.0, near: 1.0, far: Some(9.0), convention };
            let camera = Camera::look_at(&pose, &projection, ImageSize::new(2, 2)).unwrap();
            // Depths in front of the near plane, beyond the far plane, and NaN stay far.
            let image = [3.0, 0.9999, 8.999, f64::NAN];
            for kind in [DepthKind::Z, DepthKind::Distance] {
                let within = |image: &[f64], scale, tolerance| {
                    ndc_from_kind_within(Floats::F64(image), kind, scale, &[], &camera, tolerance)
                        .unwrap()
                };
                let moved = 3.0 * (1.0 + 1.0 / 1024.0) + 1.0 / 16_777_216.0;
                let (truth, _) = within(&[moved; 4], 1.0, DepthTolerance::NONE);
                let (ndc, left) = within(&image, 1.0, DepthTolerance::HALF);
                assert_eq!(left, DepthTolerance::NONE);
                let farther =
                    if convention.is_reversed() { truth[0] - ndc[0] } else { ndc[0] - truth[0] };
                assert!(
                    (0.0..1e-6).contains(&farther),
                    "{convention:?} {kind:?}: {ndc:?} {truth:?}"
                );
                assert_eq!(ndc[3], convention.far());
                if kind == DepthKind::Z {
                    assert_eq!(ndc[1..3], [convention.far(); 2], "{convention:?}");
                }
                // In steps of a thousandth the tolerance is in steps, too.
                let (in_steps, _) = within(&[3000.0; 4], 0.001, DepthTolerance::HALF);
                let most = 3.0 * (1.0 + 1.0 / 1024.0) + 0.001 / 16_777_216.0;
                let (truth, _) = within(&[most; 4], 1.0, DepthTolerance::NONE);
                assert!((in_steps[0] - truth[0]).abs() < 1e-6, "{convention:?} {kind:?}");
            }
        }
    }
}
