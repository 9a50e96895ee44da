//! Counts of pixels of many instances and of large ones, against a plain count on the host.
//!
//! Lavapipe ends all loops of eight invocations once these have taken 65,535 iterations together.
//! What is here takes more, unless the passes share their work out.

mod common;

use std::sync::Arc;

use common::{Random, camera_along_z, engine, ndc};
use hiz_core::headless::Engine;
use hiz_core::{
    Bounds, Camera, Coverage, CullOptions, DepthConvention, Depths, Floats, InstanceOptions,
    Instances, Outputs, PixelCounts, PyramidOptions, StoredLevels,
};

const PIXELS: Outputs = Outputs { pixels: true, ..Outputs::NONE };

/// The view depth of all boxes, which are flat.
const AT: f64 = 8.0;

/// A rectangle of pixels: first column, first row, columns, rows.
type Rectangle = [u32; 4];

/// An image of noise: each pixel is in front of all boxes, or behind them.
///
/// So every rectangle is counted pixel by pixel, with answers that are plain to see.
struct Noise {
    width: u32,
    height: u32,
    /// Whether a pixel is in front of the boxes.
    in_front: Vec<bool>,
    camera: Camera,
}

impl Noise {
    fn new(width: u32, height: u32) -> Self {
        let mut random = Random(9);
        let mut in_front = Vec::with_capacity((width * height) as usize + 64);
        while in_front.len() < (width * height) as usize {
            let bits = random.bits();
            in_front.extend((0..64).map(|bit| bits >> bit & 1 == 1));
        }
        in_front.truncate((width * height) as usize);
        let camera = camera_along_z(width, height, DepthConvention::Reversed);
        Self { width, height, in_front, camera }
    }

    fn depth(&self) -> Vec<f32> {
        let [near, far] = [2.0, 32.0].map(|z| ndc(z, DepthConvention::Reversed));
        self.in_front.iter().map(|in_front| if *in_front { near } else { far }).collect()
    }

    /// The counts of a box that is exactly this rectangle.
    fn truth(&self, [left, top, columns, rows]: Rectangle) -> PixelCounts {
        let hidden: usize = (top..top + rows)
            .map(|row| {
                let begin = (row * self.width + left) as usize;
                self.in_front[begin..begin + columns as usize].iter().filter(|n| **n).count()
            })
            .sum();
        let (touched, hidden) = (columns * rows, u32::try_from(hidden).expect("few pixels"));
        PixelCounts { touched, hidden, inside: 0, open: touched - hidden, undecided: 0 }
    }

    /// The corners of flat boxes over these rectangles; they end a quarter of a pixel before the
    /// centres of the pixels around.
    fn corners(&self, rectangles: &[Rectangle]) -> [Vec<f64>; 2] {
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for [left, top, columns, rows] in rectangles {
            let x = |column: f64| AT * (2.0 * column / f64::from(self.width) - 1.0);
            let y = |row: f64| AT * (1.0 - 2.0 * row / f64::from(self.height));
            let (right, bottom) = (left + columns, top + rows);
            low.extend([x(f64::from(*left) + 0.25), y(f64::from(bottom) - 0.25), AT]);
            high.extend([x(f64::from(right) - 0.25), y(f64::from(*top) + 0.25), AT]);
        }
        [low, high]
    }

    fn boxes(&self, engine: &Engine, rectangles: &[Rectangle]) -> Arc<Instances> {
        let [low, high] = self.corners(rectangles);
        let bounds = Bounds::Boxes { min: Floats::F64(&low), max: Floats::F64(&high) };
        engine.instances(&bounds, &InstanceOptions::default()).unwrap()
    }

    fn counts(
        &self,
        engine: &Engine,
        rectangles: &[Rectangle],
        pyramid: &PyramidOptions,
    ) -> Vec<PixelCounts> {
        let image = engine.upload_depth(&self.depth(), &self.camera).unwrap();
        let pyramid = engine.pyramid_with(&image, pyramid).unwrap();
        let instances = self.boxes(engine, rectangles);
        let seen = engine.cull(&instances, &self.camera, &pyramid, &options(), &PIXELS).unwrap();
        seen.pixels().unwrap()
    }

    /// How many counts are not those of the host.
    fn wrong(&self, engine: &Engine, rectangles: &[Rectangle], pyramid: &PyramidOptions) -> usize {
        let found = self.counts(engine, rectangles, pyramid);
        let truths = rectangles.iter().map(|rectangle| self.truth(*rectangle));
        let wrong: Vec<_> = found.iter().zip(truths).filter(|(a, b)| *a != b).collect();
        let nothing = found.iter().filter(|counts| counts.touched == 0).count();
        if let Some(first) = wrong.first() {
            let all = rectangles.len();
            eprintln!("{} of {all} wrong, {nothing} touch nothing; {first:?}", wrong.len());
        }
        wrong.len()
    }

    /// So many rectangles of these sizes, anywhere.
    fn anywhere(&self, sizes: &[[u32; 2]], count: usize) -> Vec<Rectangle> {
        let mut random = Random(10);
        (0..count)
            .map(|i| {
                let [columns, rows] = sizes[i % sizes.len()];
                let left = random.below(self.width - columns + 1);
                [left, random.below(self.height - rows + 1), columns, rows]
            })
            .collect()
    }
}

fn options() -> CullOptions {
    CullOptions { coverage: Coverage::Sample, ..CullOptions::default() }
}

fn planted(faults: &[(&str, &str)]) -> Engine {
    Engine::with_planted_faults(None, faults).expect("a Vulkan driver")
}

/// None of the levels that counts of pixels read.
const NO_COARSE_LEVEL: StoredLevels = StoredLevels::only(1);

/// All pixels of an image, so many times.
fn whole(noise: &Noise, times: usize) -> Vec<Rectangle> {
    vec![[0, 0, noise.width, noise.height]; times]
}

/// A pyramid of both ends.
fn both() -> PyramidOptions {
    PyramidOptions { depths: Depths::Both, ..PyramidOptions::default() }
}

#[test]
fn many_medium_rectangles_are_all_counted() {
    let noise = Noise::new(1280, 720);
    for sizes in [&[[60, 60]][..], &[[1, 720]], &[[60, 60], [1, 720], [30, 3], [4, 200], [2, 1]]] {
        let rectangles = noise.anywhere(sizes, 6000);
        assert_eq!(noise.wrong(&engine(), &rectangles, &PyramidOptions::default()), 0);
        assert_eq!(noise.wrong(&engine(), &rectangles, &both()), 0);
    }
}

#[test]
fn many_large_rectangles_are_all_counted() {
    let noise = Noise::new(1280, 720);
    let mut rectangles = noise.anywhere(&[[1280, 720], [1280, 5], [3, 720], [640, 360]], 64);
    rectangles.extend(whole(&noise, 64));
    assert_eq!(noise.wrong(&engine(), &rectangles, &PyramidOptions::default()), 0);
    assert_eq!(noise.wrong(&engine(), &rectangles, &both()), 0);
    // Some levels are missing, or all but level 0.
    for levels in [StoredLevels::from(5), NO_COARSE_LEVEL] {
        let options = PyramidOptions { levels, ..PyramidOptions::default() };
        assert_eq!(noise.wrong(&engine(), &rectangles[32..72], &options), 0);
    }
}

#[test]
fn rectangles_of_4k_are_counted_in_full() {
    let noise = Noise::new(3840, 2160);
    assert_eq!(noise.wrong(&engine(), &whole(&noise, 4), &PyramidOptions::default()), 0);
    assert_eq!(noise.wrong(&engine(), &whole(&noise, 2), &both()), 0);
}

/// Where one looks at less than all of it, nothing is claimed about the rest.
#[test]
fn what_loops_cannot_take_is_undecided() {
    let noise = Noise::new(1280, 720);
    let mut rectangles = noise.anywhere(&[[60, 60], [1, 720], [640, 360]], 300);
    rectangles.extend(whole(&noise, 2));
    let mut undecided = Vec::new();
    for most in ["min(counting.iterations, 20u)", "min(counting.iterations, 1000u)"] {
        let engine = planted(&[
            ("var left = counting.iterations;", &format!("var left = {most};")),
            ("var iterations = most;", &format!("var iterations = {most};")),
        ]);
        for levels in [1, 2, 5, 7].map(StoredLevels::from).into_iter().chain([NO_COARSE_LEVEL]) {
            for depths in [Depths::Farthest, Depths::Both] {
                let options = PyramidOptions { levels, depths, ..PyramidOptions::default() };
                let found = noise.counts(&engine, &rectangles, &options);
                for (rectangle, counts) in rectangles.iter().zip(&found) {
                    let truth = noise.truth(*rectangle);
                    let PixelCounts { touched, hidden, inside, open, undecided } = *counts;
                    assert_eq!((touched, inside), (truth.touched, undecided), "{counts:?}");
                    assert_eq!(hidden + inside + open, touched, "{counts:?}");
                    assert!(hidden <= truth.hidden && open <= truth.open, "{counts:?} {truth:?}");
                }
                undecided.push(found.iter().filter(|counts| !counts.is_decided()).count());
            }
        }
    }
    // With the fewest iterations nearly all have some, and the two whole images always do.
    assert!(undecided[0] > 200 && undecided.iter().all(|count| *count >= 2), "{undecided:?}");
}

/// The bits of what is not negligible come from the same counts.
#[test]
fn nothing_of_many_is_lost() {
    let noise = Noise::new(1280, 720);
    let engine = engine();
    let (instances, pyramid) = {
        let image = engine.upload_depth(&noise.depth(), &noise.camera).unwrap();
        let rectangles = noise.anywhere(&[[60, 60], [1, 720], [1280, 5], [640, 360]], 6000);
        (noise.boxes(&engine, &rectangles), engine.pyramid(&image).unwrap())
    };
    let outputs = Outputs { mask: true, ..Outputs::NONE };
    let seen = engine
        .cull_approximate(&instances, &noise.camera, &pyramid, &options(), &outputs, 10)
        .unwrap();
    assert!(seen.culling().mask().unwrap().iter().all(|kept| *kept));
    assert_eq!(seen.pixels_lost().unwrap(), 0);
}

#[test]
fn planted_faults_turn_it_red() {
    if !engine().adapter().to_string().to_lowercase().contains("llvmpipe") {
        return;
    }
    let noise = Noise::new(1280, 720);
    let medium = noise.anywhere(&[[60, 60]], 6000);
    let engine = planted(&[("first = select(first, round, needed <= left);", "first = round;")]);
    let wrong = noise.wrong(&engine, &medium, &PyramidOptions::default());
    assert!(wrong > 0, "all are counted here: stayed green");
    let large = whole(&noise, 256);
    for (name, fault) in [
        (
            "a workgroup for four",
            ("atomicMax(&teams[first], min(number,", "atomicMax(&teams[first], min(4u,"),
        ),
        ("no workgroup for the last", ("min(number, FEW_TEAMS)));", "0u) / 16u);")),
    ] {
        let wrong = noise.wrong(&planted(&[fault]), &large, &PyramidOptions::default());
        assert!(wrong > 0, "{name}: stayed green");
    }
}
