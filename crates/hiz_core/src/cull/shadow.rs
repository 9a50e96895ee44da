//! The numbers of a cull of shadow casters (`shaders/cull/shadow.wgsl`).

use crate::cull::options::{CullOptions, Fit};
use crate::error::{Error, Result};
use crate::host::linear::{Vec3, dot};
use crate::host::rounding::{EPS, flushed, round_up};
use crate::input::light::DirectionalLight;
use crate::input::view::{Row, ViewRows};
use crate::pyramid::ends::Depths;

/// The fewest texels of finer levels that the test of a caster may read.
/// A shadow is long in the image, so its footprint is coarse (`docs/shadows.md`).
const SHADOW_DESCENT: u32 = 256;

/// Below this speed towards a face, the light may as well never leave through it.
const SLOWEST: f64 = 1.0 / 1_048_576.0; // 2^-20

/// More than what float64 loses of any number here, relative to it.
const HOST_ROUNDING: f64 = 1.0 / 1_125_899_906_842_624.0; // 2^-50

/// What the shader's own sums and products with the growth may lose, in EPS of it.
const GROWTH_ULPS: f64 = 32.0;

/// The fields of the view uniform that only a cull of casters reads.
/// Twin: the last fields of `View` in `shaders/cull/view.wgsl`, which documents them.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ShadowNumbers {
    pub(crate) half_sweeps: [f32; 4],
    pub(crate) steepness: [f32; 4],
    pub(crate) exits: [f32; 3],
    pub(crate) filter_radius: f32,
    pub(crate) exit_rates: [f32; 3],
    pub(crate) light_slope: f32,
    pub(crate) exit_size: f32,
    pub(crate) light_size: f32,
    pub(crate) padding: [u32; 2],
}

/// How many texels of finer levels a test may read.
pub(super) fn shadow_descent(options: &CullOptions) -> u32 {
    options.descent.max(if options.shadow.is_some() { SHADOW_DESCENT } else { 0 })
}

/// Refuses what a cull of casters does not have.
pub(super) fn check_shadow_options(options: &CullOptions) -> Result<()> {
    if options.shadow.is_some() && options.fit == Fit::Volume {
        return Err(Error::invalid(
            "fit",
            "expected Fit::Rectangle in a cull of shadow casters, got Fit::Volume: the volume that \
             a caster can shadow has no outline of its own",
        ));
    }
    Ok(())
}

/// Refuses a pyramid that does not tell receivers from the background.
pub(super) fn check_receivers(depths: Depths) -> Result<()> {
    if depths == Depths::Receivers {
        return Ok(());
    }
    Err(Error::mismatch(
        "pyramid",
        format!(
            "expected one of Depths::Receivers for a cull of shadow casters, got one of \
             Depths::{depths:?}"
        ),
    ))
}

/// Refuses a light where `what` tests what the camera sees.
pub(super) fn check_no_shadow(options: &CullOptions, what: &str) -> Result<()> {
    if options.shadow.is_none() {
        return Ok(());
    }
    Err(Error::invalid(
        "shadow",
        format!("expected None for {what}, got a light: casters are culled by `record_cull`"),
    ))
}

impl ShadowNumbers {
    /// Of a cull that is not one of casters.
    pub(crate) const NONE: Self = Self {
        half_sweeps: [0.0; 4],
        steepness: [0.0; 4],
        exits: [0.0; 3],
        filter_radius: 0.0,
        exit_rates: [0.0; 3],
        light_slope: 0.0,
        exit_size: 0.0,
        light_size: 0.0,
        padding: [0; 2],
    };

    /// The numbers of `light` for the camera with these rows.
    /// Every one but `half_sweeps` is rounded to the side where shadows are longer or wider.
    pub(crate) fn new(light: &DirectionalLight, rows: &ViewRows) -> Result<Self> {
        let unit = light.unit_direction()?;
        let slope = light.angular_radius.tan() * (1.0 + HOST_ROUNDING);
        let point: Vec3 =
            std::array::from_fn(|k| f64::from(rows.eye_hi[k]) + f64::from(rows.eye_lo[k]));
        let (mut exits, mut exit_rates) = ([0.0_f32; 3], [0.0_f32; 3]);
        for k in 0..3 {
            // A direction of the disc is unit + slope n, for a vector n across that is no longer
            // than 1.
            let across = (1.0 - unit[k] * unit[k]).max(0.0).sqrt();
            let speed = unit[k].abs() - slope * across - HOST_ROUNDING;
            let [face, sign] = if unit[k] > 0.0 {
                [light.receivers_max[k], 1.0]
            } else {
                [light.receivers_min[k], -1.0]
            };
            let lost = HOST_ROUNDING * (face.abs() + point[k].abs());
            let outward = round_up(sign * (face - point[k]) + lost);
            exits[k] = sign as f32 * outward;
            if speed > SLOWEST {
                exit_rates[k] = sign as f32 * round_up((1.0 + HOST_ROUNDING) / speed);
            }
        }
        let all = [&rows.x, &rows.y, &rows.z, &rows.w];
        let with_room = 1.0 + GROWTH_ULPS * EPS;
        let largest_exit = exits.iter().map(|v| f64::from(v.abs())).fold(0.0, f64::max);
        Ok(Self {
            half_sweeps: all.map(|row| half_sweep(row, unit)),
            steepness: all.map(|row| round_up(steepness(row) * with_room)),
            exits,
            filter_radius: round_up(light.filter_radius),
            exit_rates,
            light_slope: round_up(slope * with_room),
            exit_size: round_up((largest_exit + light.filter_radius) * with_room),
            light_size: round_up(unit.iter().map(|v| v.abs()).sum::<f64>() * with_room),
            padding: [0; 2],
        })
    }
}

fn linear(row: &Row) -> Vec3 {
    [0, 1, 2].map(|k| f64::from(row.m[k]))
}

/// The change of a row along half of a unit vector.
#[expect(clippy::cast_possible_truncation, reason = "the certificates count this rounding")]
fn half_sweep(row: &Row, unit: Vec3) -> f32 {
    flushed((dot(linear(row), unit) / 2.0) as f32)
}

/// The most that a row changes per unit of length, what its rounding has taken away included.
fn steepness(row: &Row) -> f64 {
    let raised = [0, 1, 2].map(|k| f64::from(row.m[k].abs()) + EPS * f64::from(row.a[k]));
    dot(raised, raised).sqrt()
}
