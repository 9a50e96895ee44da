//! The margins of float64 in `quick`, at numbers whose depth is next to a float32.
//!
//! Depth is rounded to float32 towards far, which hides what float64 loses for almost all numbers.
//! It shows only where the exact depth passes a float32 by less than a step of the number.
//! Such numbers are found by bisection with the exact oracle.

use std::collections::BTreeMap;

use super::*;
use crate::input::camera::Camera;
use crate::input::image::{DepthConvention, ImageSize};
use crate::input::projection::{Pose, Projection};

const SIZE: ImageSize = ImageSize { width: 61, height: 1 };

/// Far enough from the near plane, so that no number takes the long way.
const NEAR: f64 = 0.1;

/// Perspective cameras with and without a far plane, and parallel rays.
fn cameras() -> Vec<Camera> {
    let poses = [
        Pose { eye: [3.0, -2.0, 1.0], target: [9.0, 5.0, -7.0], up: [0.1, 1.0, 0.0] },
        Pose { eye: [40.1, -7.3, 2.9], target: [-3.7, 0.3, 11.3], up: [0.0, 0.3, 1.0] },
        Pose { eye: [-0.7, 0.2, 5.1], target: [0.3, 1.9, -6.1], up: [0.0, 1.0, 0.2] },
    ];
    let mut made = Vec::new();
    for pose in &poses {
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            let (left, right, bottom, top) = (-0.9, 0.7, -0.4, 0.6);
            let perspective =
                |far| Projection::Frustum { left, right, bottom, top, near: NEAR, far, convention };
            let parallel = Projection::Orthographic {
                left,
                right,
                bottom,
                top,
                near: NEAR,
                far: 777.0,
                convention,
            };
            for projection in [perspective(None), perspective(Some(777.0)), parallel] {
                made.push(Camera::look_at(pose, &projection, SIZE).unwrap());
            }
        }
    }
    made
}

/// A camera that sees far to one side: the square of a ray's length cancels near its axis.
fn camera_aside(convention: DepthConvention) -> Camera {
    let pose = Pose { eye: [3.0, -2.0, 1.0], target: [9.0, 5.0, -7.0], up: [0.1, 1.0, 0.0] };
    let (left, right, bottom, top) = (-1.0, 1999.0, -0.4, 0.6);
    let (near, far) = (NEAR, Some(7777.0));
    let projection = Projection::Frustum { left, right, bottom, top, near, far, convention };
    Camera::look_at(&pose, &projection, SIZE).unwrap()
}

/// The float32 beside the exact depths of numbers, on the far side.
fn farther(
    camera: &Camera,
    numbers: &[f64],
    kind: DepthKind,
    tolerance: DepthTolerance,
) -> Vec<f32> {
    let view = hiz_ref::View {
        rows: camera.rows(),
        origin: camera.origin(),
        width: SIZE.width,
        height: SIZE.height,
        reversed: camera.convention().is_reversed(),
    };
    let meaning = hiz_ref::DepthMeaning {
        kind: match kind {
            DepthKind::Distance => hiz_ref::DepthKind::Distance,
            _ => hiz_ref::DepthKind::Z,
        },
        scale: 1.0,
        invalid: &[],
        origin_is_eye: true,
    };
    let tolerance =
        hiz_ref::Tolerance { relative: tolerance.relative, absolute: tolerance.absolute };
    hiz_ref::moved_depth_bounds(&view, numbers, meaning, tolerance).unwrap().farther
}

/// For each pixel the first number from `start` on whose depth is past the next float32.
fn borderline(camera: &Camera, start: f64, kind: DepthKind, tolerance: DepthTolerance) -> Vec<f64> {
    let count = SIZE.pixels() as usize;
    let mut below: Vec<u64> =
        (0..count).map(|i| (start * 1.003_f64.powi(i as i32)).to_bits()).collect();
    let floats = |bits: &[u64]| bits.iter().copied().map(f64::from_bits).collect::<Vec<_>>();
    let first = farther(camera, &floats(&below), kind, tolerance);
    let mut above: Vec<u64> =
        below.iter().map(|bits| (1.5 * f64::from_bits(*bits)).to_bits()).collect();
    while below.iter().zip(&above).any(|(below, above)| above - below > 1) {
        let middle: Vec<u64> =
            below.iter().zip(&above).map(|(below, above)| below.midpoint(*above)).collect();
        let found = farther(camera, &floats(&middle), kind, tolerance);
        for i in 0..count {
            if found[i] == first[i] {
                below[i] = middle[i];
            } else {
                above[i] = middle[i];
            }
        }
    }
    floats(&above)
}

/// How many of the numbers come out nearer than their exact depth.
fn nearer(camera: &Camera, numbers: &[f64], exact: &[f32], quick: &Quick) -> usize {
    let mut got = vec![0.0; numbers.len()];
    quick.row(0, numbers, &[], &mut got, |_, _| unreachable!("no number is close to a plane"));
    let is_nearer = |(got, exact): &(&f32, &f32)| {
        if camera.convention().is_reversed() { got > exact } else { got < exact }
    };
    got.iter().zip(exact).filter(is_nearer).count()
}

/// The constants without one of their margins.
type Fault = fn(&mut Quick, &Lens, DepthTolerance);

/// Each margin of an image of float64.
const FAULTS: [(&str, Fault); 6] = [
    ("the share of a quotient", |quick, _, _| {
        if let Form::FromEye { numerator, .. } = &mut quick.form {
            *numerator /= 1.0 - 16.0 * ROUNDING;
        }
    }),
    ("the share of a ray's length", |quick, lens, _| {
        if let (
            Form::FromEye { numerator, length: Some(_), .. },
            Rays::FromEye { inverse, w_length, .. },
        ) = (&mut quick.form, &lens.rays)
        {
            *numerator /= 1.0 - RayLength::new(inverse, *w_length, lens.size[0]).1;
        }
    }),
    ("what the base loses", |quick, lens, _| {
        if let (Form::FromEye { of_row, of_columns: Some(_), .. }, Rays::FromEye { k, .. }) =
            (&mut quick.form, &lens.rays)
        {
            of_row[1] = k[2];
        }
    }),
    ("what the constant of parallel rays loses", |quick, lens, tolerance| {
        if let (Form::Parallel { constant, .. }, Rays::Parallel { constant: plain, slope, .. }) =
            (&mut quick.form, &lens.rays)
        {
            *constant = plain + slope * tolerance.absolute;
        }
    }),
    ("the share of a product of parallel rays", |quick, lens, tolerance| {
        if let Form::Parallel { share, .. } = &mut quick.form {
            *share = if lens.reversed { -tolerance.relative } else { tolerance.relative };
        }
    }),
    ("the tolerance", |quick, _, tolerance| match &mut quick.form {
        Form::FromEye { numerator, moved, .. } => {
            *numerator *= 1.0 + tolerance.relative;
            *moved = 0.0;
        }
        Form::Parallel { share, .. } => *share -= share.signum() * tolerance.relative,
    }),
];

/// Numbers of one row of an image, and what it is made for.
struct Case<'a> {
    camera: &'a Camera,
    kind: DepthKind,
    tolerance: DepthTolerance,
    start: f64,
    is_wide: bool,
}

impl Case<'_> {
    /// Adds in how many numbers each fault shows; without one, none may show.
    fn count(&self, shown: &mut BTreeMap<&str, usize>) {
        let Self { camera, kind, tolerance, start, is_wide } = *self;
        let lens = Lens::new(camera).unwrap();
        let plain = Quick::new(&lens, kind, 1.0, tolerance, is_wide).unwrap();
        assert!(!matches!(plain.form, Form::FromEye { is_narrow: true, .. }));
        let numbers = borderline(camera, start, kind, tolerance);
        let exact = farther(camera, &numbers, kind, tolerance);
        let count = nearer(camera, &numbers, &exact, &plain);
        assert_eq!(count, 0, "{kind:?} {tolerance:?} from {start} on");
        for (what, plant) in FAULTS {
            let mut quick = plain.clone();
            plant(&mut quick, &lens, tolerance);
            *shown.entry(what).or_default() += nearer(camera, &numbers, &exact, &quick);
        }
    }
}

#[test]
fn each_margin_of_float64_shows() {
    let mut shown: BTreeMap<&str, usize> = BTreeMap::new();
    for camera in cameras() {
        let is_parallel = matches!(Lens::new(&camera).unwrap().rays, Rays::Parallel { .. });
        for kind in [DepthKind::Z, DepthKind::Distance] {
            if is_parallel && kind == DepthKind::Distance {
                continue; // the same as view depth
            }
            for tolerance in [DepthTolerance::NONE, DepthTolerance::HALF] {
                // Near the eye a quotient is most of the depth; far away it is next to nothing.
                // A tolerance takes numbers near the near plane of parallel rays the long way.
                let is_long = is_parallel && tolerance != DepthTolerance::NONE;
                for start in [if is_long { 40.0 } else { 4.0 * NEAR }, 400.0] {
                    let case = Case { camera: &camera, kind, tolerance, start, is_wide: true };
                    case.count(&mut shown);
                }
            }
        }
    }
    // Rays of very different lengths, for which images of float64 take the long way.
    for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
        let (kind, tolerance) = (DepthKind::Distance, DepthTolerance::NONE);
        let camera = camera_aside(convention);
        for start in [900.0, 4000.0] {
            let case = Case { camera: &camera, kind, tolerance, start, is_wide: false };
            case.count(&mut shown);
        }
    }
    println!("{shown:?}");
    for (what, _) in FAULTS {
        assert!(shown[what] > 0, "{what} shows nowhere: {shown:?}");
    }
}
