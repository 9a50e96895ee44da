//! The view uniform: what the shaders know of a camera and of the options.

use crate::cull::lod::LodNumbers;
use crate::cull::options::{Coverage, CullOptions};
use crate::cull::shadow::{ShadowNumbers, shadow_descent};
use crate::error::{Error, Result};
use crate::gpu::numbers::UNIFORM_BYTES;
use crate::host::rounding::{EPS, round_up};
use crate::input::bounds::BoundsKind;
use crate::input::camera::Camera;
use crate::input::image::DepthConvention;
use crate::input::near_slack::NearSlack;
use crate::input::tolerance::DepthTolerance;
use crate::input::view::ViewRows;
use crate::output::mesh_table::MAX_LODS;

/// Twin: `shaders/cull/view.wgsl`, `View`, which documents the fields.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ViewUniform {
    pub(crate) x: [f32; 4],
    pub(crate) y: [f32; 4],
    pub(crate) z: [f32; 4],
    pub(crate) w: [f32; 4],
    pub(crate) magnitudes: [f32; 4],
    pub(crate) constant_magnitudes: [f32; 4],
    pub(crate) eye_hi: [f32; 3],
    pub(crate) z_slope: f32,
    pub(crate) eye_lo: [f32; 3],
    pub(crate) halves_size: f32,
    pub(crate) half_size: [f32; 2],
    pub(crate) reach: f32,
    pub(crate) depth_factor: f32,
    pub(crate) size: [i32; 2],
    pub(crate) runtime_zero: u32,
    pub(crate) reduction: u32,
    pub(crate) descent_budget: u32,
    pub(crate) depth_offset: f32,
    pub(crate) coordinate_limit: f32,
    pub(crate) lod_end: u32,
    pub(crate) lod_needs: [f32; MAX_LODS],
    pub(crate) source_origin: u32,
    pub(crate) near_factor: f32,
    pub(crate) near_offset: f32,
    pub(crate) padding: u32,
    pub(crate) shadow: ShadowNumbers,
}

const _: () = assert!(size_of::<ViewUniform>() as u64 <= UNIFORM_BYTES);

/// The default guard of points in area coverage, in pixels.
///
/// A depth image knows depth at the centres of its pixels alone.
/// So the pixels of the four centres around a point decide about it (`docs/accuracy.md`).
const GUARD_OF_POINTS: f64 = 0.5;

/// Bits of a column in `source_origin`; twin: `shaders/cull/view.wgsl`, `COORDINATE_BITS`.
pub(crate) const COORDINATE_BITS: u32 = 16;

/// Column and row of a pixel in one word; images have at most 2^15 pixels a side.
pub(crate) fn packed([column, row]: [u32; 2]) -> u32 {
    column | row << COORDINATE_BITS
}

impl CullOptions {
    /// The guard of a cull of instances of `kind`, in pixels.
    pub(crate) fn guard_of(&self, kind: BoundsKind) -> f64 {
        match (self.guard_px, self.coverage) {
            (Some(given), _) => given,
            (None, coverage) if kind.is_point() => GUARD_OF_POINTS + coverage.own_reach(),
            (None, Coverage::Area) => 0.0,
            (None, Coverage::Sample) => 1.0 / 64.0,
        }
    }
}

impl ViewUniform {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "multiples of 2^-8 and sizes below 2^15 are exact, the factor is rounded towards \
                  far"
    )]
    /// Rounds a camera and the options to the numbers of a cull of instances of `kind`.
    ///
    /// `tolerance` is what the format of the depth image has rounded; the slack of the options is
    /// added to it.
    pub(crate) fn new(
        camera: &Camera,
        kind: BoundsKind,
        reduction: u32,
        options: &CullOptions,
        tolerance: DepthTolerance,
    ) -> Result<Self> {
        let range = |name: &str, value: f64, most: f64| {
            if (0.0..=most).contains(&value) {
                Ok(value)
            } else {
                Err(Error::invalid(name, format!("expected a number in 0..={most}, got {value}")))
            }
        };
        range("depth_slack", options.depth_slack, 0.5)?;
        range("depth_slack_abs", options.depth_slack_abs, 0.5)?;
        let of_caller = options.depth_tolerance();
        // The renderer's error came first, then the rounding of the format.
        let DepthTolerance { relative: slack, absolute: slack_abs } = tolerance.after(of_caller);
        range("descent", f64::from(options.descent), 65_536.0)?;
        let kappa = range("transform_slack", options.transform_slack, 1e6)?;
        let guard = range("guard_px", options.guard_of(kind), 16.0)?;
        if (guard * 256.0).fract() != 0.0 {
            return Err(Error::invalid(
                "guard_px",
                format!("expected a multiple of 1/256, got {guard}"),
            ));
        }
        let reach = guard - options.coverage.own_reach();
        // Rounded towards far; this does not cover the rounding of the product in the shader
        // (`docs/accuracy.md`).
        let depth_factor = if camera.convention().is_reversed() {
            -round_up(slack - 1.0)
        } else {
            round_up(1.0 + slack)
        };
        // The product and the sum in the shader lose less than 2^-24 each while the depth stays
        // below 1.
        // That loss is added here.
        // An offset of 0 adds nothing, so it loses nothing.
        let depth_offset = if slack_abs > 0.0 { round_up(slack_abs + EPS) } else { 0.0 };
        let depth_offset =
            if camera.convention().is_reversed() { -depth_offset } else { depth_offset };
        let rows =
            ViewRows::new(camera, kappa).map_err(|error| match ViewRows::new(camera, 0.0) {
                Ok(_) if kappa > 0.0 => Error::invalid(
                    "transform_slack",
                    format!(
                        "expected a number that leaves room for this camera in float32, got {kappa}"
                    ),
                ),
                _ => error,
            })?;
        let LodNumbers { end: lod_end, needs: lod_needs } = LodNumbers::new(camera, &options.lod)?;
        let shadow = match &options.shadow {
            Some(light) => ShadowNumbers::new(light, &rows)?,
            None => ShadowNumbers::NONE,
        };
        let size = camera.size();
        let rows_of_all = [rows.x, rows.y, rows.z, rows.w];
        Ok(Self {
            x: rows.x.m,
            y: rows.y.m,
            z: rows.z.m,
            w: rows.w.m,
            magnitudes: rows_of_all.map(|row| row.a[..3].iter().copied().fold(0.0, f32::max)),
            constant_magnitudes: rows_of_all.map(|row| row.a[3]),
            eye_hi: rows.eye_hi,
            z_slope: rows.z_slope,
            eye_lo: rows.eye_lo,
            halves_size: round_up(halves_size(&rows)),
            half_size: [size.width as f32 / 2.0, size.height as f32 / 2.0],
            reach: reach as f32,
            depth_factor,
            size: [size.width as i32, size.height as i32],
            runtime_zero: 0,
            reduction,
            descent_budget: shadow_descent(options),
            depth_offset,
            coordinate_limit: rows.coordinate_limit,
            lod_end,
            lod_needs,
            source_origin: 0,
            near_factor: 1.0,
            near_offset: 0.0,
            padding: 0,
            shadow,
        }
        .with_near_slack(camera.convention(), NearSlack::NONE, options, tolerance))
    }

    /// The same view, where stored depths stand for nearer ones by `slack` and by the tolerances.
    pub(crate) fn with_near_slack(
        self,
        convention: DepthConvention,
        slack: NearSlack,
        options: &CullOptions,
        tolerance: DepthTolerance,
    ) -> Self {
        let all = slack.with(tolerance, options.depth_tolerance(), convention);
        let (near_factor, near_offset) = all.in_single(convention);
        Self { near_factor, near_offset, ..self }
    }
}

/// Upper bound, summed over the axes, of `|eye_lo| + 2 * 2^-24 * |eye_hi|`, and a little more for
/// the roundings of this sum.
///
/// It bounds two things: the low half of a position near the eye, and the remainder that two
/// float32 cannot represent.
fn halves_size(rows: &ViewRows) -> f64 {
    let sum = |v: [f32; 3]| v.iter().map(|v| f64::from(v.abs())).sum::<f64>();
    sum(rows.eye_lo) * (1.0 + EPS) + EPS * (1.0 + 1.0 / 256.0) * sum(rows.eye_hi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::image::ImageSize;

    /// The slack is never less than what was asked for.
    /// A factor that is rounded to nearest would be too small half of the time.
    #[test]
    fn the_depth_factor_is_rounded_towards_far() {
        for (convention, z) in [
            (DepthConvention::Standard, [0.0, 0.0, 1.0, -1.0]),
            (DepthConvention::Reversed, [0.0, 0.0, 0.0, 1.0]),
        ] {
            let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, [0.0, 0.0, 1.0, 0.0]];
            let camera =
                Camera::from_clip_from_world(rows, ImageSize::new(8, 8), convention).unwrap();
            for k in 0..100 {
                let depth_slack = 0.5 * 10.0_f64.powf(-f64::from(k) / 8.0);
                let options = CullOptions { depth_slack, ..CullOptions::default() };
                let factor = f64::from(
                    ViewUniform::new(&camera, BoundsKind::Box, 0, &options, DepthTolerance::NONE)
                        .unwrap()
                        .depth_factor,
                );
                let moved = if convention.is_reversed() { 1.0 - factor } else { factor - 1.0 };
                assert!(
                    moved >= depth_slack && moved <= depth_slack + EPS,
                    "{convention:?} {depth_slack}: {factor}"
                );
            }
        }
    }

    /// The shader reads the whole step of a format, and no more than upward rounding adds to it.
    /// The caller's slack is added on top, in either convention.
    #[test]
    fn the_step_of_a_format_comes_before_the_callers_slack() {
        use wgpu::TextureFormat as Format;
        // The step, and the part relative to the depth, worked out by hand.
        let formats = [
            (Format::Depth16Unorm, 1.0 / 65_535.0, 2.0_f64.powi(-22)),
            (Format::Depth24Plus, 1.0 / 16_777_215.0, 2.0_f64.powi(-22)),
            (Format::Depth24PlusStencil8, 1.0 / 16_777_215.0, 2.0_f64.powi(-22)),
            (Format::R16Float, 2.0_f64.powi(-24), 2.0_f64.powi(-10)),
        ];
        for (convention, z) in [
            (DepthConvention::Standard, [0.0, 0.0, 1.0, -1.0]),
            (DepthConvention::Reversed, [0.0, 0.0, 0.0, 1.0]),
        ] {
            let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, [0.0, 0.0, 1.0, 0.0]];
            let camera =
                Camera::from_clip_from_world(rows, ImageSize::new(8, 8), convention).unwrap();
            for (format, step, relative) in formats {
                for (depth_slack, depth_slack_abs) in
                    [(0.0, 0.0), (EPS, 0.0), (0.25, 0.0), (0.0, 1e-3), (0.25, 1e-3)]
                {
                    let options =
                        CullOptions { depth_slack, depth_slack_abs, ..CullOptions::default() };
                    let tolerance = DepthTolerance::of(format).unwrap();
                    let view =
                        ViewUniform::new(&camera, BoundsKind::Box, 0, &options, tolerance).unwrap();
                    let (factor, offset) =
                        (f64::from(view.depth_factor), f64::from(view.depth_offset));
                    let (moved, offset) = if convention.is_reversed() {
                        (1.0 - factor, -offset)
                    } else {
                        (factor - 1.0, offset)
                    };
                    let of_both = (1.0 + relative) * (1.0 + depth_slack) - 1.0;
                    let what = format!(
                        "{convention:?} {format:?} {depth_slack} {depth_slack_abs}: {moved} \
                         {offset}"
                    );
                    assert!(moved >= of_both && moved <= of_both + 1.01 * EPS, "{what}");
                    let of_both = step * (1.0 + depth_slack) + depth_slack_abs + EPS;
                    assert!(offset >= of_both && offset <= of_both * 1.000_001, "{what}");
                }
            }
        }
    }
}
