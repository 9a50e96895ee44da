//! Levels of detail (LODs): the rule that chooses one for each instance, and its numbers for the
//! shader.
//!
//! The shader, `shaders/cull/lod.wgsl`, chooses the coarsest LOD for which w surely exceeds a need
//! on all of the bounds.
//! `docs/accuracy.md` derives the needs, under "Levels of detail".

use crate::error::{Error, Result};
use crate::host::rounding::round_up;
use crate::input::camera::Camera;
use crate::input::image::DepthConvention;
use crate::input::stretch::Stretch;
use crate::output::mesh_table::MAX_LODS;

/// The largest distance that a rule may name, in world units: 2^50, past every valid bound.
const FARTHEST: f64 = 1_125_899_906_842_624.0;

/// Numbers of pixels that a rule may name.
/// With fewer than the least, products in the shader could overflow.
const PIXELS: std::ops::RangeInclusive<f64> = 1.0 / 1024.0..=32_768.0;

/// Which level of detail (LOD) of its mesh an instance is drawn with.
///
/// LOD 0 is the full mesh, and each further one is coarser.
/// A rule chooses the coarsest LOD that it allows together with all finer ones.
/// Where the bounds cross the plane of the eye, it chooses LOD 0.
///
/// The choice rests on a certificate that includes every rounding.
/// What a rule says therefore holds for the exact bounds, which must contain all LODs.
///
/// # Examples
/// ```
/// use hiz_core::{CullOptions, DepthConvention, LodRule};
///
/// // At most one pixel of error.
/// let lod = LodRule::Error { pixels: 1.0 };
/// let options = CullOptions { lod, ..CullOptions::default() };
///
/// // LOD 1 from NDC depth 0.8 on, LOD 2 from 0.9 and LOD 3 from 0.95.
/// let depths = [0.8, 0.9, 0.95];
/// let rule = LodRule::at_ndc_depths(&depths, 1.0, Some(500.0), DepthConvention::Standard)?;
/// let LodRule::Distance { thresholds } = rule else { unreachable!() };
/// let rounded: Vec<f64> = thresholds.iter().map(|d| (d * 100.0).round() / 100.0).collect();
/// assert_eq!(rounded, [4.96, 9.82, 19.27]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub enum LodRule {
    /// LOD 0 everywhere.
    #[default]
    Finest,
    /// The coarsest LOD of which no point that shows is more than `pixels` away from its
    /// counterpart on the full mesh.
    ///
    /// It goes by the errors of the mesh's LODs and the scales of the instances.
    /// The promise holds if an error bounds how far each point of the LOD and of the full mesh is
    /// from the nearest one of the other, at scale 1.
    /// Simplifiers often give an estimate instead: `result_error` of meshoptimizer is one.
    Error {
        /// The largest error, in pixels, 1/1024..=32768.
        pixels: f64,
    },
    /// LOD l + 1 where all of the bounds are farther than `thresholds[l]`.
    ///
    /// Distance is view depth, measured along the camera's axis.
    Distance {
        /// View depths in world units, ascending: 1 to 7 numbers in 0..=2^50.
        thresholds: Vec<f64>,
    },
    /// LOD l + 1 where the bounds surely are less than `pixels[l]` wide in any direction.
    ///
    /// Precisely, no two points of the bounds are farther apart in the image, if one of them shows.
    Size {
        /// Widths in pixels, descending: 1 to 7 numbers in 1/1024..=32768.
        pixels: Vec<f64>,
    },
}

impl LodRule {
    /// The rule by distance whose thresholds are given as NDC depths of a perspective camera.
    ///
    /// `near` and `far` are view depths of the camera's planes; `None`: infinitely far.
    /// The depths run from near to far: ascending, or descending with reversed Z.
    ///
    /// # Errors
    /// [`Error::Invalid`] for depths outside of `0..=1`, at an infinitely far plane or in another
    /// order, and for planes that are not `0 < near < far`.
    pub fn at_ndc_depths(
        depths: &[f64],
        near: f64,
        far: Option<f64>,
        convention: DepthConvention,
    ) -> Result<Self> {
        let far = far.unwrap_or(f64::INFINITY);
        if !(near > 0.0 && near.is_finite() && near < far) {
            return Err(Error::invalid(
                "near",
                format!("expected 0 < near < far with a finite near, got {near} and far {far}"),
            ));
        }
        let view_depth = |depth: f64| {
            if !(0.0..=1.0).contains(&depth) {
                return Err(Error::invalid(
                    "depths",
                    format!("expected NDC depths in 0..=1, got {depth}"),
                ));
            }
            // Standard z of view depth v is (1 - near / v) / (1 - near / far).
            let from_far = if convention.is_reversed() { depth } else { 1.0 - depth };
            let at_far = near / far;
            Ok(near / (from_far + (1.0 - from_far) * at_far))
        };
        let thresholds = depths.iter().copied().map(view_depth).collect::<Result<Vec<_>>>()?;
        check_list("depths", &thresholds, &(0.0..=FARTHEST), true).map_err(|error| {
            let way = if convention.is_reversed() { "descending" } else { "ascending" };
            Error::invalid(
                "depths",
                format!(
                    "expected {way} NDC depths, got {depths:?}, so for their distances {error}"
                ),
            )
        })?;
        Ok(Self::Distance { thresholds })
    }

    /// The value of `LOD_RULE` in the shader.
    pub(crate) fn code(&self) -> u32 {
        match self {
            Self::Finest => 0,
            Self::Error { .. } => 1,
            Self::Distance { .. } => 2,
            Self::Size { .. } => 3,
        }
    }

    /// Checks the numbers of the rule, for any camera.
    ///
    /// # Errors
    /// [`Error::Invalid`] and [`Error::Limit`], which name the field.
    pub(crate) fn check(&self) -> Result<()> {
        match self {
            Self::Finest => Ok(()),
            Self::Error { pixels } if PIXELS.contains(pixels) => Ok(()),
            Self::Error { pixels } => Err(Error::invalid(
                "lod.pixels",
                format!("expected a number of pixels in 1/1024..=32768, got {pixels}"),
            )),
            Self::Distance { thresholds } => {
                check_list("lod.thresholds", thresholds, &(0.0..=FARTHEST), true)
            }
            Self::Size { pixels } => check_list("lod.pixels", pixels, &PIXELS, false),
        }
    }
}

fn check_list(
    name: &str,
    numbers: &[f64],
    range: &std::ops::RangeInclusive<f64>,
    ascending: bool,
) -> Result<()> {
    if numbers.is_empty() {
        return Err(Error::invalid(name, "expected at least one number, got none"));
    }
    if numbers.len() >= MAX_LODS {
        return Err(Error::limit(name, numbers.len() as u64, MAX_LODS as u64 - 1));
    }
    // NaN is in no range.
    if let Some(bad) = numbers.iter().find(|v| !range.contains(v)) {
        let (least, most) = (range.start(), range.end());
        return Err(Error::invalid(
            name,
            format!("expected numbers in {least}..={most}, got {bad}"),
        ));
    }
    let in_order = |pair: &[f64]| if ascending { pair[0] < pair[1] } else { pair[0] > pair[1] };
    if !numbers.windows(2).all(in_order) {
        let way = if ascending { "ascending" } else { "descending" };
        return Err(Error::invalid(
            name,
            format!("expected {way} numbers without equal ones, got {numbers:?}"),
        ));
    }
    Ok(())
}

/// The numbers of a rule for one camera: fields of `View` in `shaders/cull/view.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LodNumbers {
    /// `lod_end`.
    pub(crate) end: u32,
    /// `lod_needs`.
    pub(crate) needs: [f32; MAX_LODS],
}

impl LodNumbers {
    /// Rounds the needs of `rule` up.
    ///
    /// # Errors
    /// Those of [`LodRule::check`].
    /// [`Error::Invalid`] for distances and an orthographic camera.
    pub(crate) fn new(camera: &Camera, rule: &LodRule) -> Result<Self> {
        rule.check()?;
        let mut needs = [0.0; MAX_LODS];
        let end = match rule {
            LodRule::Finest => 1,
            LodRule::Error { pixels } => {
                needs[0] = rounded_up(Stretch::of(camera).pixels / pixels);
                MAX_LODS
            }
            LodRule::Distance { .. } if camera.is_orthographic() => {
                return Err(Error::invalid(
                    "lod",
                    "expected a rule by error or by size for an orthographic camera, which shows \
                     nothing smaller from farther away, got one by distance",
                ));
            }
            LodRule::Distance { thresholds } => {
                let depth = Stretch::of(camera).depth;
                for (need, threshold) in needs[1..].iter_mut().zip(thresholds) {
                    *need = rounded_up(threshold * depth);
                }
                thresholds.len() + 1
            }
            LodRule::Size { pixels } => {
                let stretch = Stretch::of(camera).pixels;
                for (need, pixels) in needs[1..].iter_mut().zip(pixels) {
                    *need = rounded_up(2.0 * stretch / pixels);
                }
                pixels.len() + 1
            }
        };
        Ok(Self { end: end as u32, needs })
    }
}

/// The least float32 above a positive product or quotient that float64 has rounded.
///
/// It is no subnormal, because a device may flush those to 0.
fn rounded_up(v: f64) -> f32 {
    if v == 0.0 { 0.0 } else { round_up(v.next_up()).max(f32::MIN_POSITIVE) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::image::ImageSize;
    use crate::input::projection::{Pose, Projection};

    fn camera() -> Camera {
        let pose = Pose { eye: [0.0; 3], target: [1.0, 2.0, -3.0], up: [0.0, 1.0, 0.0] };
        let (fov_y, convention) = (1.0, DepthConvention::Standard);
        let projection = Projection::Perspective { fov_y, near: 0.1, far: Some(100.0), convention };
        Camera::look_at(&pose, &projection, ImageSize::new(641, 359)).unwrap()
    }

    fn message(rule: &LodRule) -> String {
        LodNumbers::new(&camera(), rule).unwrap_err().to_string()
    }

    #[test]
    fn bad_rules_are_refused_by_name() {
        for pixels in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-6] {
            let text = message(&LodRule::Error { pixels });
            assert!(
                text.starts_with("lod.pixels: expected a number of pixels in 1/1024"),
                "{text}"
            );
        }
        let distance =
            |thresholds: &[f64]| message(&LodRule::Distance { thresholds: thresholds.to_vec() });
        assert_eq!(distance(&[]), "lod.thresholds: expected at least one number, got none");
        assert!(distance(&[1.0; 8]).contains("requested 8"), "{}", distance(&[1.0; 8]));
        for bad in [&[-1.0][..], &[1.0, f64::NAN], &[f64::INFINITY]] {
            assert!(distance(bad).contains("expected numbers in 0..="), "{}", distance(bad));
        }
        for bad in [&[2.0, 1.0][..], &[1.0, 1.0]] {
            assert!(distance(bad).contains("expected ascending numbers"), "{}", distance(bad));
        }
        let size = |pixels: &[f64]| message(&LodRule::Size { pixels: pixels.to_vec() });
        assert!(size(&[10.0, 20.0]).starts_with("lod.pixels: expected descending"));
        assert!(size(&[0.0]).contains("expected numbers in"), "{}", size(&[0.0]));
    }

    #[test]
    fn distances_need_an_eye() {
        let camera = Camera::look_at(
            &Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] },
            &Projection::Orthographic {
                left: -1.0,
                right: 1.0,
                bottom: -1.0,
                top: 1.0,
                near: 0.0,
                far: 1.0,
                convention: DepthConvention::Reversed,
            },
            ImageSize::new(8, 8),
        )
        .unwrap();
        let rule = LodRule::Distance { thresholds: vec![1.0] };
        let text = LodNumbers::new(&camera, &rule).unwrap_err().to_string();
        assert!(text.starts_with("lod: expected a rule by error or by size"), "{text}");
        for rule in [LodRule::Error { pixels: 1.0 }, LodRule::Size { pixels: vec![1.0] }] {
            assert!(LodNumbers::new(&camera, &rule).is_ok());
        }
    }

    /// ARM's thresholds with the near plane at 1 and the far plane at 500, worked out by hand: view
    /// depth is 500 / (500 - 499 z).
    #[test]
    fn ndc_depths_become_distances() {
        let expected = [500.0 / 100.8, 500.0 / 50.9, 500.0 / 25.95];
        for (depths, convention) in [
            ([0.8, 0.9, 0.95], DepthConvention::Standard),
            ([0.2, 0.1, 0.05], DepthConvention::Reversed),
        ] {
            let rule = LodRule::at_ndc_depths(&depths, 1.0, Some(500.0), convention).unwrap();
            let LodRule::Distance { thresholds } = rule else { panic!("{rule:?}") };
            for (found, expected) in thresholds.iter().zip(expected) {
                assert!((found / expected - 1.0).abs() < 1e-12, "{thresholds:?}");
            }
            let turned: Vec<f64> = depths.iter().rev().copied().collect();
            let text = LodRule::at_ndc_depths(&turned, 1.0, None, convention).unwrap_err();
            assert!(text.to_string().starts_with("depths: expected"), "{text}");
        }
        let reversed = DepthConvention::Reversed;
        let rule = LodRule::at_ndc_depths(&[0.25], 2.0, None, reversed).unwrap();
        assert_eq!(rule, LodRule::Distance { thresholds: vec![8.0] });
        for (depths, near, far) in [
            (&[0.0][..], 1.0, None),
            (&[1.5], 1.0, None),
            (&[0.5], 0.0, None),
            (&[0.5], 2.0, Some(1.0)),
        ] {
            assert!(LodRule::at_ndc_depths(depths, near, far, reversed).is_err(), "{depths:?}");
        }
    }

    /// A need rounded to nearest would be too small half of the time.
    #[test]
    fn needs_are_rounded_up() {
        let stretch = Stretch::of(&camera());
        for k in 0..200 {
            let number = 1.0 + f64::from(k) / 7.0;
            let [rule_error, rule_distance, rule_size] = [
                LodRule::Error { pixels: number },
                LodRule::Distance { thresholds: vec![number] },
                LodRule::Size { pixels: vec![number] },
            ]
            .map(|rule| LodNumbers::new(&camera(), &rule).unwrap().needs);
            for (need, exact) in [
                (rule_error[0], stretch.pixels / number),
                (rule_distance[1], stretch.depth * number),
                (rule_size[1], 2.0 * stretch.pixels / number),
            ] {
                assert!(
                    f64::from(need) > exact && f64::from(need.next_down()) <= exact * 1.000_000_1
                );
            }
        }
    }
}
