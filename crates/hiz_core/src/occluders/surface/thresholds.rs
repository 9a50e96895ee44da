//! Which depths to try for each pixel, from the depths at the pixels' centres.
//!
//! Nothing here needs a proof.
//! A bad choice proves nothing, and the pixel is left to the search.
//!
//! A pixel and its eight neighbours tell which surfaces may cover it.
//! Sorted by depth, the nine fall apart where the next is much farther: into clusters, about one
//! for each surface.
//! Two slabs of depth are tried, each from a nearest to a farthest depth:
//!
//! 1. down to the plane through the centre, as its neighbours continue it;
//! 2. the cluster of the centre, with some room.

use crate::host::threads::{cores, on_threads};
use crate::input::image::{DepthConvention, ImageSize};

/// How many rows of pixels a thread takes at once.
const PART: usize = 16;
/// How many slabs a pixel has.
pub(super) const SLABS: usize = 2;
/// Distances to the far plane are compared by their ratio.
/// What is this much farther than the one before it is in the next cluster.
const STEP: f32 = 0.93;
/// How far slab 1 goes on beyond the slopes to the neighbours.
const SLOPE: f32 = 0.55;
/// How far slab 2 goes on beyond its cluster, in steps from the centre to the cluster's end.
const BEYOND: f32 = 0.3;
/// A little farther than a depth that float32 rounded.
const HAIR: f32 = 1.0 - 1e-5;
/// How much farther than all neighbours a search looks at first, and then.
const LIKELY: f32 = 0.9;
const ROOM: f32 = 0.5;
/// The room of slabs towards near.
const NEARER: f32 = 1.03;

/// The slabs of a pixel, in values of `far`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slabs {
    /// By slab: what reaches beyond is not in it; minus infinity for a slab without anything.
    pub(super) farthest: [f32; SLABS],
    /// By slab: what comes before is not in it.
    pub(super) nearest: [f32; SLABS],
    /// The greatest of `farthest`.
    pub(super) last: f32,
    /// What comes after these is searched only if nothing else covers, or never.
    pub(super) likely: f32,
    pub(super) searched: f32,
}

impl Slabs {
    /// A pixel at whose centre there is nothing.
    pub(super) const NONE: Self = Self {
        farthest: [f32::NEG_INFINITY; SLABS],
        nearest: [f32::INFINITY; SLABS],
        last: f32::NEG_INFINITY,
        likely: f32::NEG_INFINITY,
        searched: f32::NEG_INFINITY,
    };
}

/// The slabs of all pixels, from NDC depths at their centres.
pub(super) fn image(centres: &[f32], size: ImageSize, convention: DepthConvention) -> Vec<Slabs> {
    let width = size.width as usize;
    let mut slabs = vec![Slabs::NONE; centres.len()];
    let last = size.height as usize - 1;
    let row = |y: usize| &centres[y * width..][..width];
    on_threads(
        cores(),
        slabs.chunks_mut(PART * width).zip((0_usize..).step_by(PART)),
        |(rows, first)| {
            for (slabs, y) in rows.chunks_exact_mut(width).zip(first..) {
                let lines = [row(y.saturating_sub(1)), row(y), row((y + 1).min(last))];
                choose(lines, convention, slabs);
            }
        },
    );
    slabs
}

/// Chooses the slabs of a row of pixels.
///
/// `above`, `row` and `below` are NDC depths at the centres; at the image's border a row repeats.
fn choose([above, row, below]: [&[f32]; 3], convention: DepthConvention, slabs: &mut [Slabs]) {
    let reversed = convention.is_reversed();
    // With more for nearer, and 0 at the far plane.
    let near = |depth: f32| if reversed { depth } else { 1.0 - depth };
    let far = |near: f32| if reversed { -near } else { 1.0 - near };
    let last = row.len() - 1;
    for (x, slabs) in slabs.iter_mut().enumerate() {
        let centre = near(row[x]);
        if centre <= 0.0 {
            *slabs = Slabs::NONE;
            continue;
        }
        let columns = [x.saturating_sub(1), x, (x + 1).min(last)];
        let mut nine = [0.0; 9];
        for (k, line) in [above, row, below].into_iter().enumerate() {
            for (j, column) in columns.into_iter().enumerate() {
                nine[3 * k + j] = near(line[column]);
            }
        }
        let slope = |a: f32, b: f32| (a - centre).abs().min((b - centre).abs());
        let slopes = slope(nine[3], nine[5]) + slope(nine[1], nine[7]);
        let cluster = Cluster::new(&mut nine, centre);
        let slab = |farthest: f32, nearest: f32| {
            let nearest = if nearest.is_finite() { far(NEARER * nearest) } else { -nearest };
            if farthest > 0.0 { (far(farthest), nearest) } else { (f32::NEG_INFINITY, nearest) }
        };
        let room = (cluster.end - BEYOND * (centre - cluster.end)) * HAIR;
        let chosen =
            [slab((centre - SLOPE * slopes) * HAIR, f32::INFINITY), slab(room, cluster.first)];
        slabs.farthest = chosen.map(|slab| slab.0);
        slabs.nearest = chosen.map(|slab| slab.1);
        slabs.last = if chosen[0].0 > chosen[1].0 { chosen[0].0 } else { chosen[1].0 };
        slabs.likely = far(LIKELY * cluster.least).max(slabs.last);
        let sees_nothing = nine.iter().any(|v| *v <= 0.0);
        slabs.searched =
            if sees_nothing { f32::INFINITY } else { far(ROOM * cluster.least).max(slabs.last) };
    }
}

/// Of nine depths with more for nearer: those of one surface.
struct Cluster {
    /// The nearest, or infinity where nothing comes before it, and the farthest.
    first: f32,
    end: f32,
    /// The farthest of all nine where there is anything.
    least: f32,
}

impl Cluster {
    /// The cluster of one of the nine, `centre`; they are sorted.
    fn new(nine: &mut [f32; 9], centre: f32) -> Self {
        let (mut least, mut most) = (centre, centre);
        for v in nine.iter() {
            least = if *v < least { *v } else { least };
            most = if *v > most { *v } else { most };
        }
        if least >= STEP * most {
            return Self { first: f32::INFINITY, end: least, least };
        }
        nine.sort_unstable_by(|a, b| b.total_cmp(a));
        let (mut first, mut end) = (f32::INFINITY, centre);
        let mut start = f32::INFINITY;
        for (i, v) in nine.iter().enumerate() {
            if i > 0 && *v < STEP * nine[i - 1] {
                start = *v;
            }
            if *v >= centre {
                first = start;
            } else if start >= centre {
                end = *v;
            }
            if *v > 0.0 {
                least = *v;
            }
        }
        Self { first, end, least }
    }
}
