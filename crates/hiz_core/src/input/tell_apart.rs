//! Conversions tell pixels apart whose depth came out as far (`far_pixels`).

use crate::input::depth::Conversion;
use crate::input::far_pixels::FarPixels;
use crate::input::lens::Place;
use crate::input::world_tolerance::WorldTolerance;

/// What a number is whose depth came out as far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Told {
    /// Anything may be there.
    NoDepth,
    /// A depth that may lie within the view.
    Measured,
    /// Nothing within the view is farther: exactly far, or for metric depth infinity and what lies
    /// surely beyond the far plane.
    Background,
}

impl Conversion<'_> {
    /// Tells the far pixels of converted rows apart, the first of which is row `first`.
    pub(super) fn tell_apart(&self, first: u32, out: &mut [f32]) {
        let far = self.convention.far();
        let short = match self.far_pixels {
            _ if self.convention.is_reversed() => f32::MIN_POSITIVE,
            FarPixels::BackgroundApart => 1.0_f32.next_down(),
            _ => f32::NAN,
        };
        // A receiver of shadows may lie beyond the far plane.
        let keeps_background =
            self.metric.is_none() || self.far_pixels != FarPixels::BackgroundApart;
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
                    let told = match self.told(at, number) {
                        Told::Background if keeps_background => far,
                        Told::Background | Told::NoDepth => f32::NAN,
                        Told::Measured => short,
                    };
                    last = self.is_alike().then_some((number.to_bits(), told));
                    told
                }
            };
        }
    }

    /// What a number is whose depth came out as far.
    fn told(&self, (column, row): (u32, u32), number: f64) -> Told {
        if self.invalid.contains(&number) {
            return Told::NoDepth;
        }
        let Some(metric) = &self.metric else {
            // -0 is 0, which is background where far is 0.
            return if !(0.0..=1.0).contains(&number) {
                Told::NoDepth
            } else if number == f64::from(self.convention.far()) {
                Told::Background
            } else {
                Told::Measured
            };
        };
        if number == f64::INFINITY {
            return if metric.lens.grows_to_far() { Told::Background } else { Told::NoDepth };
        }
        let Some(value) = self.value_of(metric, number) else { return Told::NoDepth };
        let place = |value| metric.lens.place(column, row, value, metric.kind);
        match place(value) {
            Place::Inside => Told::Measured,
            Place::Beyond if place(self.with_tolerance(value)) == Place::Beyond => Told::Background,
            Place::Beyond | Place::Unknown => Told::NoDepth,
        }
    }

    /// A number in world units, and by how much its surface may lie before it or behind.
    fn with_tolerance(&self, (value, off): (f64, f64)) -> (f64, f64) {
        let WorldTolerance { relative, absolute } = self.world_tolerance;
        let moved = value.abs() * relative + absolute;
        (value, (off * (1.0 + relative) + moved) * (1.0 + 1e-15))
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
    use crate::input::image::{DepthConvention, ImageSize};
    use crate::input::lens::test_cameras::{POSE, perspective};
    use crate::input::projection::Projection;
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
            for beyond in [f64::INFINITY, 9.5, 1e300] {
                let found = |far_pixels| z([beyond; 4], far_pixels)[0];
                assert_eq!(found(FarPixels::Alike), far);
                assert_eq!(found(FarPixels::NoDepthApart), far, "{convention:?} {beyond}");
                assert!(found(FarPixels::BackgroundApart).is_nan(), "it may be a receiver");
            }
            for unknown in [f64::NAN, f64::NEG_INFINITY, 0.0, -1.0, 4.0, 0.5] {
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

    /// What decides that a number is background: the conversion's own way, or a fault.
    type Decides = fn(&Conversion<'_>, (u32, u32), f64) -> bool;

    fn is_background(conversion: &Conversion<'_>, at: (u32, u32), number: f64) -> bool {
        conversion.told(at, number) == Told::Background
    }

    const FAULTS: [(&str, Decides); 5] = [
        ("the rounding of the number is left out", |conversion, (column, row), number| {
            let metric = conversion.metric.as_ref().unwrap();
            metric.lens.place(column, row, (number, 0.0), metric.kind) == Place::Beyond
        }),
        ("the tolerance of the world is left out", |conversion, (column, row), number| {
            let metric = conversion.metric.as_ref().unwrap();
            let value = conversion.value_of(metric, number);
            value.is_some_and(|value| {
                metric.lens.place(column, row, value, metric.kind) == Place::Beyond
            })
        }),
        ("whatever came out as far", |conversion, (column, row), number| {
            let metric = conversion.metric.as_ref().unwrap();
            conversion.exact(metric, column, row, number) == conversion.convention.far()
        }),
        ("no data of the caller", |conversion, at, number| {
            is_background(conversion, at, number) || conversion.invalid.contains(&number)
        }),
        ("whatever is not a number", |conversion, at, number| {
            is_background(conversion, at, number) || !number.is_finite()
        }),
    ];

    /// Cameras of every kind, from near 1 to far 9 or to infinity.
    fn cameras(convention: DepthConvention) -> Vec<Camera> {
        let parallel = |near| Projection::Orthographic {
            left: -3.0,
            right: 2.0,
            bottom: -1.0,
            top: 1.0,
            near,
            far: 9.0,
            convention,
        };
        let fov_y = 1.0;
        let endless = Projection::Perspective { fov_y, near: 1.0, far: None, convention };
        let size = ImageSize::new(2, 2);
        let mut cameras = vec![perspective(convention)];
        for projection in [parallel(1.0), parallel(-4.0), endless] {
            cameras.push(Camera::look_at(&POSE, &projection, size).unwrap());
        }
        cameras
    }

    /// Numbers whose surface may lie within the view but which are called background, and how many
    /// are background in truth and are not called so.
    fn wrong_and_missed(decides: Decides) -> (usize, usize) {
        let (mut wrong, mut missed) = (0, 0);
        let tolerances = [(0.0, 0.0), (0.01, 0.0), (0.0, 0.3)];
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            for camera in cameras(convention) {
                for kind in [DepthKind::Z, DepthKind::Distance] {
                    for (relative, absolute) in tolerances {
                        for rounding in [DepthTolerance::NONE, DepthTolerance::SINGLE] {
                            let (a, b) = of_camera(
                                &camera,
                                kind,
                                (WorldTolerance { relative, absolute }, rounding),
                                decides,
                            );
                            wrong += a;
                            missed += b;
                        }
                    }
                }
            }
        }
        (wrong, missed)
    }

    fn of_camera(
        camera: &Camera,
        kind: DepthKind,
        (world_tolerance, tolerance): (WorldTolerance, DepthTolerance),
        decides: Decides,
    ) -> (usize, usize) {
        let numbers = [0.0; 4];
        let input = DepthInput {
            numbers: Floats::F64(&numbers).into(),
            kind,
            scale: 1.0,
            invalid: &[12.0, 65_535.0],
            tolerance,
            world_tolerance,
        };
        let conversion = Conversion::new(&input, camera).unwrap().telling(FarPixels::NoDepthApart);
        let view = hiz_ref::View {
            rows: camera.rows(),
            origin: camera.origin(),
            width: 2,
            height: 2,
            reversed: camera.convention().is_reversed(),
        };
        let meaning = hiz_ref::DepthMeaning {
            kind: if kind == DepthKind::Z {
                hiz_ref::DepthKind::Z
            } else {
                hiz_ref::DepthKind::Distance
            },
            scale: 1.0,
            invalid: &[12.0, 65_535.0],
            origin_is_eye: true,
        };
        let far = camera.convention().far();
        // The far plane in these numbers: 9 along the view, and farther along a slanted ray.
        let slanted = 9.0 * 1.5_f64.sqrt();
        let mut numbers = vec![f64::NAN, f64::NEG_INFINITY, 0.0, -7.0, 12.0, 65_535.0, 20.0];
        for at in [9.0, slanted, 9.31, 9.0 / 0.99, 9.0 / 0.99 * 1.5_f64.sqrt(), slanted + 0.3] {
            numbers.extend([-1e-6, -1e-9, 0.0, 1e-9, 1e-6, 1e-3].map(|off| at * (1.0 + off)));
            numbers.extend([at.next_up(), at.next_down(), at.next_up().next_up()]);
        }
        let (mut wrong, mut missed) = (0, 0);
        for number in numbers {
            let WorldTolerance { relative, absolute } = world_tolerance;
            let off = number.abs() * tolerance.relative + tolerance.absolute;
            // As near as the surface may lie, in float64: 1 part in 10^15 is in nobody's favour.
            let nearest = number - off;
            let nearest = (nearest - (number.abs() * relative + absolute)) * (1.0 + 4e-16);
            let of = |number: f64| {
                hiz_ref::nearest_depth_bounds(&view, &[number; 4], meaning).unwrap().nearer[0]
            };
            let is_listed = meaning.invalid.contains(&number);
            let is_far = !is_listed && of(number) == far && of(nearest) == far;
            let said = decides(&conversion, (0, 0), number);
            wrong += usize::from(said && !is_far);
            missed += usize::from(is_far && !said);
        }
        assert!(is_background(&conversion, (0, 0), f64::INFINITY), "whatever the tolerance");
        (wrong, missed)
    }

    #[test]
    fn background_is_what_surely_lies_beyond_the_view() {
        let (wrong, missed) = wrong_and_missed(is_background);
        println!("{missed} numbers beyond the view are not told to be");
        assert_eq!(wrong, 0);
        // Within what float64 loses, and what nobody can tell.
        assert!(missed < 200, "{missed}");
        for (what, fault) in FAULTS {
            let (wrong, _) = wrong_and_missed(fault);
            println!("{what}: {wrong}");
            assert!(wrong > 0, "{what} stayed green");
        }
    }
}
