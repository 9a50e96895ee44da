//! Random and adversarial culls against the oracle.
//!
//! A round is a camera, a depth image and a few dozen volumes of each kind, of one [`Class`].
//! Each round is made so that some verdict is nearly the opposite:
//!
//! - the nearest points of the volumes share a depth that the image repeats;
//! - their silhouettes end on pixel borders beside holes, or at the frustum's planes;
//! - most are moved by bisection to where the last bits decide the oracle's verdict.
//!
//! The oracle decides exactly.
//! A volume that is culled although the oracle calls it visible is a false cull.
#![allow(dead_code, unused_imports, reason = "each test binary uses its own part")]

mod arrays;
mod checkpoint;
mod class;
mod fitted;
mod grouped;
mod report;
mod scene;
mod shown;
mod volume;

use hiz_core::headless::{DepthImage, Engine};
use hiz_core::{
    AtlasUse, BoundsKind, Camera, Coverage, CullOptions, Fit, Footprint, Hierarchy,
    InstanceOptions, Outputs, PyramidOptions, StoredLevels,
};
use hiz_ref::{Options, Outcome, OwnDepth, Verdict, View, Volume};

use crate::common::{Random, soak_times};
use scene::Scene;

pub(crate) use arrays::Arrays;
pub(crate) use checkpoint::Checkpoint;
pub(crate) use class::Class;
pub(crate) use grouped::Tested;
pub(crate) use report::{HEADER, Report, Tally};
pub(crate) use shown::{Pipelines, Shown, center_of, shown_by_class, total};
pub(crate) use volume::moved;

/// Every kind of bounds.
pub(crate) const KINDS: [BoundsKind; 3] =
    [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox];

/// Points, whose oracle is that of spheres with radius 0.
pub(crate) const POINTS: [BoundsKind; 2] = [BoundsKind::Point, BoundsKind::WidePoint];

/// The footprint and descent of a default cull.
pub(crate) const PLAIN: &[(Footprint, u32)] = &[(Footprint::Two, 0)];

/// Pyramids that lack fine levels, coarse levels, or all but one.
pub(crate) const MISSING_LEVELS: &[StoredLevels] = &[
    StoredLevels::from(2),
    StoredLevels::from(3),
    StoredLevels::from(5),
    StoredLevels::only(1),
    StoredLevels::only(2),
    StoredLevels::only(4),
    StoredLevels { first: 2, last: 3 },
];

/// How to run a campaign.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Campaign {
    pub(crate) seed: u64,
    /// Taken in turn, one per round.
    pub(crate) classes: &'static [Class],
    /// Rounds of each class.
    pub(crate) rounds: usize,
    /// Volumes of each kind in a round.
    pub(crate) volumes: usize,
    pub(crate) kinds: &'static [BoundsKind],
    pub(crate) coverage: Coverage,
    /// Footprints and descent budgets to choose from.
    /// Each needs pipelines of its own, which take time to compile.
    pub(crate) modes: &'static [(Footprint, u32)],
    pub(crate) fit: Fit,
    /// Which levels are stored, to choose from.
    pub(crate) levels: &'static [StoredLevels],
    /// Sizes of images to choose from.
    /// If empty: up to 48 pixels a side, or what the class wants.
    pub(crate) sizes: &'static [(u32, u32)],
    /// The greatest number of chunks of the stored levels: 1 to 3.
    pub(crate) chunks: u64,
    /// Whether to cull in groups, in a random stored order, and to compare with the flat cull.
    pub(crate) groups: bool,
    /// Whether guards and slacks are random.
    pub(crate) any_slack: bool,
    /// Whether to count false keeps, too, which asks the oracle about every volume.
    pub(crate) count_keeps: bool,
}

impl Default for Campaign {
    fn default() -> Self {
        Self {
            seed: 1,
            classes: &Class::ALL,
            rounds: 10,
            volumes: 32,
            kinds: &KINDS,
            coverage: Coverage::Area,
            modes: PLAIN,
            fit: Fit::Rectangle,
            levels: &[StoredLevels::ALL],
            sizes: &[],
            chunks: 1,
            groups: false,
            any_slack: false,
            count_keeps: false,
        }
    }
}

/// One camera, one depth image, and volumes of each kind.
#[derive(Debug)]
pub(crate) struct Round {
    pub(crate) seed: u64,
    pub(crate) number: usize,
    pub(crate) class: Class,
    pub(crate) camera: Camera,
    pub(crate) view: View,
    pub(crate) depth: Vec<f32>,
    pub(crate) options: CullOptions,
    pub(crate) levels: StoredLevels,
    pub(crate) chunks: u64,
    pub(crate) volumes: Vec<(BoundsKind, Vec<Volume>)>,
    /// For each volume the direction in which it becomes hidden, as long as the scene's distance.
    pub(crate) away: Vec<Vec<[f64; 3]>>,
}

impl Campaign {
    /// The rounds, made as they are asked for.
    /// Leaves out those whose camera float64 or float32 cannot hold.
    pub(crate) fn rounds(self) -> impl Iterator<Item = Round> {
        (0..self.rounds * self.classes.len()).filter_map(move |number| self.round(number))
    }

    /// Round `number`, the same whenever it is asked for.
    pub(crate) fn round(&self, number: usize) -> Option<Round> {
        let random = &mut Random(self.seed.wrapping_mul(1_000_003).wrapping_add(number as u64));
        let class = self.classes[number % self.classes.len()];
        let scene = Scene::new(class, self.coverage, self.sizes, random)?;
        let (footprint, descent) = random.pick(self.modes);
        let mut options = CullOptions {
            coverage: self.coverage,
            // No slack and no guard, which would hide a margin that is too small.
            guard_px: Some(0.0),
            depth_slack: 0.0,
            footprint,
            descent,
            fit: self.fit,
            hierarchy: Hierarchy::Never,
            statistics: false,
            ..CullOptions::default()
        };
        if self.any_slack {
            options.guard_px =
                random.pick(&[Some(0.0), Some(1.0 / 64.0), Some(0.5), Some(3.0), None]);
            options.depth_slack = random.pick(&[0.0, 1e-6, 1e-3]);
            options.transform_slack = random.pick(&[0.0, 4.0]);
        }
        let mut volumes = Vec::new();
        let mut away = Vec::new();
        for kind in self.kinds.iter().copied() {
            let (these, ways) =
                (0..self.volumes).map(|_| scene.volume(class, kind, random)).unzip();
            volumes.push((kind, these));
            away.push(ways);
        }
        let Scene { camera, view, depth, .. } = scene;
        // Drawn last, so that a round is the same whatever levels are stored.
        let levels = random.pick(self.levels);
        let (seed, chunks) = (self.seed, self.chunks);
        Some(Round {
            seed,
            number,
            class,
            camera,
            view,
            depth,
            options,
            levels,
            chunks,
            volumes,
            away,
        })
    }

    /// Culls every round on the device and asks the oracle.
    pub(crate) fn run(self, engine: &Engine) -> Report {
        self.run_while(engine, |_| true)
    }

    /// The rounds up to the first false cull, which is all that a planted fault has to show.
    /// In `make soak` all rounds, to see which classes show it.
    pub(crate) fn run_until_red(self, engine: &Engine) -> Report {
        self.run_while(engine, |report| soak_times() > 1 || report.total().false_culls == 0)
    }

    /// Culls one round after the other and asks the oracle, as long as `goes_on` says so.
    pub(crate) fn run_while(self, engine: &Engine, goes_on: impl Fn(&Report) -> bool) -> Report {
        let mut report = Report::new(self.classes, self.count_keeps);
        let mut told = false;
        for round in self.rounds() {
            if !goes_on(&report) {
                break;
            }
            let masks = if self.groups {
                round.grouped_masks(engine).map(|(masks, tested)| {
                    report.tested.add(tested);
                    masks
                })
            } else {
                round.masks(engine)
            };
            let Some(masks) = masks else { continue };
            for ((kind, volumes), mask) in round.volumes.iter().zip(&masks) {
                for (volume, kept) in volumes.iter().zip(mask) {
                    let tally = round.tally(volume, *kept, self.count_keeps);
                    if tally.false_culls > 0 && !told {
                        told = true;
                        eprintln!("first false cull: {}", round.describe(*kind, volume));
                    }
                    report.add(round.class, tally);
                }
            }
        }
        report
    }
}

impl Round {
    /// One of four ways to hold depth, independent of the class.
    fn way(&self) -> u64 {
        (self.number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 62
    }

    /// The depth image.
    /// Two of the four ways use a texture that is gathered from, like a depth texture.
    pub(crate) fn upload(&self, engine: &Engine) -> DepthImage {
        let upload =
            if self.way() % 2 == 1 { Engine::upload_depth_sampled } else { Engine::upload_depth };
        upload(engine, &self.depth, &self.camera).expect("upload")
    }

    /// The levels of this round.
    /// In two of the four ways, one for each kind of image, culls read all levels from one atlas.
    /// A pyramid of more than one chunk has no atlas.
    pub(crate) fn pyramid_options(&self, engine: &Engine) -> PyramidOptions {
        let atlas = if self.way() < 2 { AtlasUse::Always } else { AtlasUse::Never };
        let options = PyramidOptions { levels: self.levels, atlas, ..PyramidOptions::default() };
        if self.chunks == 1 {
            return options;
        }
        let whole = engine.context().create_pyramid(self.camera.size(), &options).expect("pyramid");
        // The smallest chunks of a power of two of which `chunks` are enough.
        let shift = (2..30)
            .find(|shift| whole.device_bytes() / 4 <= self.chunks << shift)
            .expect("a small pyramid");
        PyramidOptions { chunk_shift: Some(shift), ..options }
    }

    /// The masks that the device gives, for each kind.
    /// `None` for a camera that is refused because float32 cannot hold its rows.
    pub(crate) fn masks(&self, engine: &Engine) -> Option<Vec<Vec<bool>>> {
        let image = self.upload(engine);
        let pyramid = engine.pyramid_with(&image, &self.pyramid_options(engine)).expect("pyramid");
        let mut masks = Vec::new();
        for (kind, volumes) in &self.volumes {
            let arrays = Arrays::new(volumes);
            let instances = engine
                .instances(&arrays.bounds(*kind), &InstanceOptions::default())
                .expect("instances");
            match engine.cull(
                &instances,
                &self.camera,
                &pyramid,
                &self.options,
                &Outputs::default(),
            ) {
                Ok(culling) => masks.push(culling.mask().expect("mask")),
                Err(hiz_core::Error::Invalid { .. }) => return None,
                Err(error) => panic!("{error}"),
            }
        }
        Some(masks)
    }

    /// The oracle's answer.
    pub(crate) fn outcome(&self, volume: &Volume) -> Outcome {
        let own_depth = match self.options.fit {
            Fit::Rectangle => OwnDepth::Nearest,
            Fit::Volume => OwnDepth::PerPixel,
        };
        self.outcome_as(volume, own_depth)
    }

    /// The oracle's answer, with another own depth of the volume than the options say.
    pub(crate) fn outcome_as(&self, volume: &Volume, own_depth: OwnDepth) -> Outcome {
        let coverage = match self.options.coverage {
            Coverage::Area => hiz_ref::Coverage::Area,
            Coverage::Sample => hiz_ref::Coverage::Sample,
        };
        let options = Options { coverage, own_depth, ..Options::default() };
        hiz_ref::classify_with(&self.view, volume, &self.depth, options).expect("a finite view")
    }

    /// Counts one verdict.
    /// A volume that is kept counts as right unless false keeps are asked for.
    pub(crate) fn tally(&self, volume: &Volume, kept: bool, count_keeps: bool) -> Tally {
        let mut tally = Tally { cases: 1, culled: usize::from(!kept), ..Tally::default() };
        if !kept || count_keeps {
            let hidden = self.outcome(volume).verdict == Verdict::Hidden;
            tally.false_culls = usize::from(!kept && !hidden);
            tally.false_keeps = usize::from(kept && hidden);
        }
        tally
    }

    /// Everything that is needed to reproduce the case.
    pub(crate) fn describe(&self, kind: BoundsKind, volume: &Volume) -> String {
        let (seed, number, class) = (self.seed, self.number, self.class);
        let outcome = self.outcome(volume);
        let levels = self.levels;
        format!(
            "seed {seed} round {number} {class:?} {kind:?} {levels:?}: {volume:?}\n{:?}\n\
             oracle {outcome:?}",
            self.view
        )
    }
}
