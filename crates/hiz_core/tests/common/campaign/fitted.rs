//! Depth images that fit a volume, as tests of `Fit::Volume`.
//! Each pixel holds almost exactly the depth at which it begins to show the volume.
//! So an ulp, or a single pixel, decides the verdict.

use hiz_core::{BoundsKind, Coverage};
use hiz_ref::{Verdict, View, Volume};

use super::{Campaign, Round, moved};
use crate::common::Random;

/// `depth` moved by a number of float32 steps: nearer below 0, else farther; within 0..=1.
fn stepped(depth: f32, steps: i64, reversed: bool) -> f32 {
    let steps = if reversed { -steps } else { steps };
    f32::from_bits(
        (i64::from(depth.to_bits()) + steps).clamp(0, i64::from(1.0_f32.to_bits())) as u32
    )
}

/// Depth that is nearer than the volume in each pixel.
/// It is nearer by a few ulps, or by a share of the way to the volume's nearest depth.
/// Often one pixel is spoilt.
fn tight_image(
    random: &mut Random,
    view: &View,
    volume: &Volume,
    coverage: hiz_ref::Coverage,
) -> Vec<f32> {
    let own: Vec<Option<f32>> = (0..view.height)
        .flat_map(|y| (0..view.width).map(move |x| [x, y]))
        .map(|pixel| hiz_ref::own_depth(view, volume, coverage, pixel).expect("a finite view"))
        .collect();
    let nearest =
        own.iter().flatten().copied().reduce(if view.reversed { f32::max } else { f32::min });
    let ulps = random.pick(&[0, 1, 20, 1000, 30_000]);
    let share = random.pick(&[0.0, 0.0, 0.02, 0.2, 0.6]);
    // Pixels that the volume does not touch are far beyond it, or in front of it.
    // The cull has to recognise those that are far as outside the volume.
    let outside = random.pick(&[0.0, 1.0]);
    let mut depth: Vec<f32> = own
        .iter()
        .map(|own| match (own, nearest) {
            (Some(own), Some(nearest)) => {
                stepped(own + share * (nearest - own), -ulps, view.reversed)
            }
            _ => outside,
        })
        .collect();
    if random.below(2) == 0 {
        let pixel = random.below(view.width * view.height) as usize;
        depth[pixel] = stepped(
            own[pixel].unwrap_or(outside),
            random.pick(&[0, 1, 20, 1000, 30_000]),
            view.reversed,
        );
    }
    depth
}

/// Boxes at every angle, and plates that recede from the eye.
/// The fit exists for faces that recede.
fn tilted(random: &mut Random, round: &Round, volume: &Volume) -> Volume {
    let Volume::OrientedBox { center, half_sizes, .. } = *volume else { return *volume };
    let (a, b) = (unit(any_vector(random)), any_vector(random));
    let to_eye = minus(round.camera.origin(), center);
    if random.below(2) == 0 || length(to_eye) == 0.0 {
        let c = unit(cross(a, b));
        return Volume::OrientedBox { center, half_sizes, axes: [a, cross(c, a), c] };
    }
    // A thin or flat plate, whose normal is up to 60 degrees off the line to the eye.
    let toward = unit(to_eye);
    let normal = unit([0, 1, 2].map(|k| toward[k] + 0.8 * a[k]));
    let side = unit(cross(normal, b));
    let up = cross(normal, side);
    let wide = 0.3 * length(to_eye);
    Volume::OrientedBox {
        center,
        half_sizes: [wide, wide, random.pick(&[0.0, 0.01]) * wide],
        axes: [0, 1, 2].map(|k| [side[k], up[k], normal[k]]),
    }
}

/// Moves the round's one volume to where the oracle's verdict changes.
/// It is the last place that the oracle still calls visible, to within 1e-10 of its distance.
/// The round is unchanged where there is no such place nearby.
fn on_the_edge(mut round: Round, random: &mut Random) -> Round {
    let volume = round.volumes[0].1[0];
    let distance = length(round.away[0][0]);
    let line_of_sight = match volume {
        Volume::Sphere { center, .. } | Volume::OrientedBox { center, .. } => {
            minus(center, round.camera.origin())
        }
        Volume::Box { min, max } => {
            minus([0, 1, 2].map(|k| 0.5 * (min[k] + max[k])), round.camera.origin())
        }
    };
    let way = match random.below(3) {
        0 => round.away[0][0],
        1 if length(line_of_sight) > 0.0 => unit(line_of_sight).map(|x| x * distance),
        _ => unit(any_vector(random)).map(|x| x * distance),
    };
    let at = |s: f64| moved(&volume, way.map(|x| x * s));
    let visible = |s: f64| round.outcome(&at(s)).verdict == Verdict::Visible;
    let start = visible(0.0);
    let sign = if random.below(2) == 0 { 1.0 } else { -1.0 };
    let Some(first) = [1e-9, 1e-7, 1e-5, 1e-3, 0.1]
        .iter()
        .flat_map(|s| [sign * s, -sign * s])
        .find(|s| visible(*s) != start)
    else {
        return round;
    };
    let (mut seen, mut hidden) = if start { (0.0, first) } else { (first, 0.0) };
    for _ in 0..24 {
        if (seen - hidden).abs() <= 1e-10 {
            break;
        }
        let middle = 0.5 * (seen + hidden);
        if visible(middle) { seen = middle } else { hidden = middle }
    }
    let volume = at(seen);
    round.volumes[0].1[0] = volume;
    round
}

impl Campaign {
    /// Rounds of one volume each, with a depth image that fits it.
    /// With `sharp` the volume is then moved to where the oracle's verdict changes.
    /// Only small images: the depth of each pixel is found by a search.
    pub(crate) fn fitted(
        self,
        kinds: &'static [BoundsKind],
        sharp: bool,
    ) -> impl Iterator<Item = Round> {
        let coverage = match self.coverage {
            Coverage::Area => hiz_ref::Coverage::Area,
            Coverage::Sample => hiz_ref::Coverage::Sample,
        };
        let small = self.rounds().filter(|round| round.view.width * round.view.height <= 400);
        small.flat_map(move |round| {
            let mut random = Random(self.seed ^ round.number as u64);
            let mut fitted = Vec::new();
            for ((kind, volumes), ways) in
                round.volumes.iter().zip(&round.away).filter(|((k, _), _)| kinds.contains(k))
            {
                for (volume, away) in volumes.iter().zip(ways) {
                    let volume = tilted(&mut random, &round, volume);
                    let depth = tight_image(&mut random, &round.view, &volume, coverage);
                    let one = round.alone(*kind, volume, *away, depth);
                    fitted.push(if sharp { on_the_edge(one, &mut random) } else { one });
                }
            }
            fitted
        })
    }

    /// Rounds of one volume each, with the depth image of the original round.
    pub(crate) fn loose(self, kinds: &'static [BoundsKind]) -> impl Iterator<Item = Round> {
        self.rounds().flat_map(move |round| {
            let mut random = Random(self.seed ^ round.number as u64);
            let each =
                round.volumes.iter().zip(&round.away).filter(|((k, _), _)| kinds.contains(k));
            each.flat_map(|((kind, volumes), ways)| {
                volumes.iter().zip(ways).map(move |(v, away)| (*kind, v, away))
            })
            .map(|(kind, v, away)| {
                round.alone(kind, tilted(&mut random, &round, v), *away, round.depth.clone())
            })
            .collect::<Vec<_>>()
        })
    }
}

impl Round {
    /// The same round with one volume and a depth image of its own.
    fn alone(&self, kind: BoundsKind, volume: Volume, away: [f64; 3], depth: Vec<f32>) -> Self {
        Self {
            depth,
            volumes: vec![(kind, vec![volume])],
            away: vec![vec![away]],
            camera: self.camera.clone(),
            view: self.view.clone(),
            options: self.options.clone(),
            ..*self
        }
    }
}

fn any_vector(random: &mut Random) -> [f64; 3] {
    [0; 3].map(|_| random.range(-1.0, 1.0))
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    v.map(|x| x / length(v))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
