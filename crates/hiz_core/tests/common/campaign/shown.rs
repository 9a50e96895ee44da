//! Rounds for the third answer: volumes that are only just not unoccluded.
//! Each has a part at the last place where the oracle still finds something before it, or a plane
//! that cuts it.
//! So every UNOCCLUDED of such a volume is false.

use hiz_core::headless::Engine;
use hiz_core::{AtlasUse, Coverage, Depths, InstanceOptions, Outputs, PyramidOptions, Verdict};
use hiz_ref::{View, Volume};

use super::{Arrays, Campaign, Class, Round, moved};
use crate::common::Random;

/// How many volumes are UNOCCLUDED, and how many of them should not be.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shown {
    pub(crate) cases: usize,
    /// Those that the oracle calls unoccluded, and that are kept.
    /// Between the samples a volume may be unoccluded and outside.
    pub(crate) exactly: usize,
    pub(crate) claimed: usize,
    /// Must be 0.
    pub(crate) false_claims: usize,
}

impl Shown {
    pub(crate) fn add(&mut self, other: Self) {
        self.cases += other.cases;
        self.exactly += other.exactly;
        self.claimed += other.claimed;
        self.false_claims += other.false_claims;
    }
}

impl Campaign {
    /// The rounds, with volumes that are only just not unoccluded.
    pub(crate) fn covered_rounds(self) -> Vec<Round> {
        self.rounds().map(Round::barely_covered).collect()
    }
}

/// Culls rounds on the device, and asks the oracle about each UNOCCLUDED.
/// The result is that of each class.
pub(crate) fn shown_by_class(
    engine: &Engine,
    rounds: &[Round],
    pipelines: Pipelines,
) -> Vec<(Class, Shown)> {
    let mut found: Vec<(Class, Shown)> = Vec::new();
    for round in rounds {
        let Some(shown) = round.shown(engine, &round.depth, pipelines) else { continue };
        match found.iter_mut().find(|(class, _)| *class == round.class) {
            Some((_, sum)) => sum.add(shown),
            None => found.push((round.class, shown)),
        }
    }
    found
}

/// All classes together.
pub(crate) fn total(found: &[(Class, Shown)]) -> Shown {
    let mut total = Shown::default();
    found.iter().for_each(|(_, shown)| total.add(*shown));
    total
}

/// In how many ways depth is held and read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pipelines {
    /// All, by turns.
    Any,
    /// One: an upload without an atlas.
    /// An engine with a planted fault compiles few pipelines then.
    Few,
}

impl Round {
    /// The oracle's answer.
    pub(crate) fn is_unoccluded(&self, volume: &Volume) -> bool {
        let coverage = match self.options.coverage {
            Coverage::Area => hiz_ref::Coverage::Area,
            Coverage::Sample => hiz_ref::Coverage::Sample,
        };
        hiz_ref::is_unoccluded(&self.view, volume, &self.depth, coverage).expect("a finite view")
    }

    /// The same with the image inside out: what was before a hole is now behind a post.
    /// Each volume is moved to the last place where the oracle does not call it unoccluded.
    pub(crate) fn barely_covered(mut self) -> Self {
        let random = &mut Random(self.seed ^ (self.number as u64) << 20);
        let far = if self.view.reversed { 0.0 } else { 1.0 };
        let near = 1.0 - far;
        let post = self.depth.iter().copied().find(|d| *d != far);
        let is_mixed = self.depth.contains(&far);
        for depth in &mut self.depth {
            *depth = match post {
                // Behind the near plane's depth nothing is.
                Some(post) if post == near => far,
                Some(post) if is_mixed && *depth == far => post,
                Some(_) if is_mixed => far,
                _ => *depth,
            };
        }
        for kind in 0..self.volumes.len() {
            for i in 0..self.volumes[kind].1.len() {
                self.volumes[kind].1[i] = self.last_covered(self.volumes[kind].1[i], random);
            }
        }
        self
    }

    /// `volume`, moved to the last place before it is unoccluded.
    /// It stays where no way out is found, and is unoccluded in a few of all cases.
    fn last_covered(&self, volume: Volume, random: &mut Random) -> Volume {
        for size in [1.0, 1.0, 0.3, 0.03, 1e-3] {
            let volume = sized(&volume, size);
            let Some(way) = self.way_out(&volume, random) else { continue };
            let at = |s: f64| moved(&volume, way.map(|x| x * s));
            if !self.is_unoccluded(&at(1.0)) {
                continue;
            }
            if random.below(8) == 0 {
                return at(1.0);
            }
            let Some(start) =
                [0.0, -1.0, -10.0, 3.0].into_iter().find(|s| !self.is_unoccluded(&at(*s)))
            else {
                return at(1.0);
            };
            let (mut covered, mut clear) = (start, 1.0);
            for _ in 0..44 {
                let middle = 0.5 * (covered + clear);
                if self.is_unoccluded(&at(middle)) { clear = middle } else { covered = middle }
            }
            return at(covered);
        }
        volume
    }

    /// From the volume's centre to a point in the view, as deep as it or less.
    fn way_out(&self, volume: &Volume, random: &mut Random) -> Option<[f64; 3]> {
        let View { rows, origin, .. } = &self.view;
        let center = center_of(volume);
        let from = [0, 1, 2].map(|k| center[k] - origin[k]);
        let at = |r: usize| (0..3).map(|k| rows[r][k] * from[k]).sum::<f64>() + rows[r][3];
        let [x, y, z, w] = [0, 1, 2, 3].map(at);
        let straight = random.below(2) == 0 && x.abs() < w && y.abs() < w;
        let nearer = random.pick(&[1.0, 1.0 - 1e-6, 0.999, 0.9, 0.5]);
        let [tx, ty] =
            if straight { [x / w, y / w] } else { [0; 2].map(|_| random.range(-0.95, 0.95)) };
        let beside = |r: usize, t: f64| {
            let row = [0, 1, 2, 3].map(|k| rows[r][k] - t * rows[3][k]);
            ([row[0], row[1], row[2]], -row[3])
        };
        let depth = if rows[3][..3] == [0.0; 3] {
            let near = if self.view.reversed { rows[3][3] } else { 0.0 };
            ([rows[2][0], rows[2][1], rows[2][2]], near + nearer * (z - near) - rows[2][3])
        } else {
            ([rows[3][0], rows[3][1], rows[3][2]], nearer * w.abs() - rows[3][3])
        };
        let to = solved([beside(0, tx), beside(1, ty), depth])?;
        Some([0, 1, 2].map(|k| to[k] - from[k]))
    }

    /// The verdicts that the device gives with both ends of `image`, for each kind.
    /// `None` for a camera that is refused.
    pub(crate) fn verdicts(
        &self,
        engine: &Engine,
        image: &[f32],
        depths: Depths,
        pipelines: Pipelines,
    ) -> Option<Vec<Vec<Verdict>>> {
        let round = Self { depth: image.to_vec(), volumes: Vec::new(), ..self.copied() };
        let (image, options) = match pipelines {
            Pipelines::Any => (round.upload(engine), self.pyramid_options(engine)),
            Pipelines::Few => (
                engine.upload_depth(image, &self.camera).expect("upload"),
                PyramidOptions { atlas: AtlasUse::Never, ..PyramidOptions::default() },
            ),
        };
        let options = PyramidOptions { depths, ..options };
        let pyramid = engine.pyramid_with(&image, &options).expect("pyramid");
        let mut verdicts = Vec::new();
        for (kind, volumes) in &self.volumes {
            let arrays = Arrays::new(volumes);
            let instances = engine
                .instances(&arrays.bounds(*kind), &InstanceOptions::default())
                .expect("instances");
            let outputs = Outputs::default();
            match engine.cull(&instances, &self.camera, &pyramid, &self.options, &outputs) {
                Ok(culling) => verdicts.push(culling.verdicts().expect("verdicts")),
                Err(hiz_core::Error::Invalid { .. }) => return None,
                Err(error) => panic!("{error}"),
            }
        }
        Some(verdicts)
    }

    pub(crate) fn copied(&self) -> Self {
        Self {
            camera: self.camera.clone(),
            view: self.view.clone(),
            depth: self.depth.clone(),
            options: self.options.clone(),
            volumes: self.volumes.clone(),
            away: self.away.clone(),
            ..*self
        }
    }

    /// What the device says of this round's volumes, against `image`, and the oracle against the
    /// round's own.
    pub(crate) fn shown(
        &self,
        engine: &Engine,
        image: &[f32],
        pipelines: Pipelines,
    ) -> Option<Shown> {
        let mut shown = Shown::default();
        let verdicts = self.verdicts(engine, image, Depths::Both, pipelines)?;
        for ((kind, volumes), verdicts) in self.volumes.iter().zip(&verdicts) {
            for (volume, verdict) in volumes.iter().zip(verdicts) {
                let is_claimed = *verdict == Verdict::Unoccluded;
                let is_it = self.is_unoccluded(volume);
                shown.add(Shown {
                    cases: 1,
                    exactly: usize::from(is_it && verdict.is_kept()),
                    claimed: usize::from(is_claimed),
                    false_claims: usize::from(is_claimed && !is_it),
                });
                if is_claimed && !is_it && pipelines == Pipelines::Any {
                    eprintln!("not unoccluded: {}", self.describe(*kind, volume));
                }
            }
        }
        Some(shown)
    }
}

pub(crate) fn center_of(volume: &Volume) -> [f64; 3] {
    match volume {
        Volume::Sphere { center, .. } | Volume::OrientedBox { center, .. } => *center,
        Volume::Box { min, max } => [0, 1, 2].map(|k| 0.5 * (min[k] + max[k])),
    }
}

/// `volume` about its centre, `factor` times as large.
fn sized(volume: &Volume, factor: f64) -> Volume {
    if factor == 1.0 {
        return *volume;
    }
    let c = center_of(volume);
    match *volume {
        Volume::Sphere { center, radius } => Volume::Sphere { center, radius: factor * radius },
        Volume::Box { min, max } => {
            let [min, max] = [min, max].map(|p| [0, 1, 2].map(|k| c[k] + factor * (p[k] - c[k])));
            Volume::Box { min, max }
        }
        Volume::OrientedBox { center, half_sizes, axes } => {
            Volume::OrientedBox { center, half_sizes: half_sizes.map(|h| factor * h), axes }
        }
    }
}

/// The point on three planes `a . p = b`.
fn solved([(a, d), (b, e), (c, f)]: [([f64; 3], f64); 3]) -> Option<[f64; 3]> {
    let cross = |u: [f64; 3], v: [f64; 3]| {
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    };
    let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
    let scale: f64 = (0..3).map(|k| a[k] * bc[k]).sum();
    let point = [0, 1, 2].map(|k| (d * bc[k] + e * ca[k] + f * ab[k]) / scale);
    point.iter().all(|x| x.is_finite()).then_some(point)
}
