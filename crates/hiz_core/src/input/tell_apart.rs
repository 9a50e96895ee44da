//! Conversions tell pixels apart whose depth came out as far (`far_pixels`).

use crate::input::depth::Conversion;
use crate::input::far_pixels::FarPixels;

impl Conversion<'_> {
    /// Tells the far pixels of converted rows apart, the first of which is row `first`.
    pub(super) fn tell_apart(&self, first: u32, out: &mut [f32]) {
        let far = self.convention.far();
        let short = match self.far_pixels {
            _ if self.convention.is_reversed() => f32::MIN_POSITIVE,
            FarPixels::BackgroundApart => 1.0_f32.next_down(),
            _ => f32::NAN,
        };
        let width = self.size.width;
        let begin = (first - self.first_row) as usize * width as usize;
        // Most far pixels have the same number, and often its depth does not depend on the pixel.
        let mut last: Option<(u64, f32)> = None;
        for (i, depth) in out.iter_mut().enumerate().filter(|(_, depth)| **depth == far) {
            let number = self.numbers.get(begin + i);
            *depth = match last {
                Some((bits, told)) if bits == number.to_bits() => told,
                _ => {
                    let at = (i as u32 % width, first + i as u32 / width);
                    let told = match self.is_depth(at, number) {
                        None => f32::NAN,
                        Some(true) => far,
                        Some(false) => short,
                    };
                    last = self.is_alike().then_some((number.to_bits(), told));
                    told
                }
            };
        }
    }

    /// Whether a number whose depth came out as far is a depth at all, and is background.
    fn is_depth(&self, (column, row): (u32, u32), number: f64) -> Option<bool> {
        if self.invalid.contains(&number) {
            return None;
        }
        match &self.metric {
            // -0 is 0, which is background where far is 0.
            None => {
                (0.0..=1.0).contains(&number).then(|| number == f64::from(self.convention.far()))
            }
            Some(metric) => {
                let value = self.value_of(metric, number)?;
                metric.lens.may_lie_inside(column, row, value, metric.kind).then_some(false)
            }
        }
    }

    /// Whether equal numbers have equal depths, wherever they are.
    fn is_alike(&self) -> bool {
        self.metric.as_ref().is_none_or(|metric| metric.lens.is_alike(metric.kind))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::bounds::Floats;
    use crate::input::camera::Camera;
    use crate::input::depth::DepthInput;
    use crate::input::depth_kind::DepthKind;
    use crate::input::image::DepthConvention;
    use crate::input::lens::test_cameras::perspective;
    use crate::input::tolerance::DepthTolerance;
    use crate::input::world_tolerance::WorldTolerance;

    fn converted(
        numbers: &[f64; 4],
        kind: DepthKind,
        far_pixels: FarPixels,
        camera: &Camera,
    ) -> Vec<f32> {
        let input = DepthInput {
            numbers: Floats::F64(numbers).into(),
            kind,
            scale: 1.0,
            invalid: &[4.0],
            tolerance: DepthTolerance::NONE,
            world_tolerance: WorldTolerance::NONE,
        };
        let conversion = Conversion::new(&input, camera).unwrap().telling(far_pixels);
        let mut out = vec![0.5; 4];
        conversion.rows(0, &mut out);
        out
    }

    /// The camera sees view depths 1 to 9.
    #[test]
    fn no_depth_is_told_from_far_depth_and_background() {
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            let (camera, far) = (perspective(convention), convention.far());
            let short =
                if convention.is_reversed() { 2.0_f32.powi(-126) } else { 1.0 - 2.0_f32.powi(-24) };
            let z = |numbers, far_pixels| converted(&numbers, DepthKind::Z, far_pixels, &camera);
            for unknown in [f64::NAN, f64::INFINITY, 0.0, -1.0, 4.0, 9.5, 0.5] {
                let found = |far_pixels| z([unknown, 9.0, 3.0, 8.999_999_999], far_pixels);
                assert_eq!(found(FarPixels::Alike)[..2], [far; 2]);
                for told in [FarPixels::NoDepthApart, FarPixels::BackgroundApart] {
                    let found = found(told);
                    let what = format!("{convention:?} {told:?} {unknown}: {found:?}");
                    assert!(found[0].is_nan(), "{what}");
                    let is_short = convention.is_reversed() || told == FarPixels::BackgroundApart;
                    assert!(if is_short { found[1] == short } else { found[1].is_nan() }, "{what}");
                    assert!(found[2] != far && found[3] != far, "{what}");
                }
            }
            let own =
                if convention.is_reversed() { DepthKind::ReversedNdc } else { DepthKind::Ndc };
            let nearly = if convention.is_reversed() { 1e-300 } else { 1.0 - 1e-12 };
            let given = [f64::from(far), nearly, f64::NAN, 1.5];
            let told = converted(&given, own, FarPixels::BackgroundApart, &camera);
            assert_eq!(told[..2], [far, short]);
            assert!(told[2].is_nan() && told[3].is_nan());
        }
    }
}
