//! Which depths to try for each pixel, from the depths at the pixels' centres.
//!
//! Nothing here needs a proof.
//! A bad choice proves nothing, and the pixel is left to the search.
//!
//! A pixel and its eight neighbours tell which surfaces may cover it.
//! Sorted by depth, the nine fall apart where the next is much farther: into clusters, about one
//! for each surface.
//! Four slabs of depth are tried, each from a nearest to a farthest depth:
//!
//! 1. down to the plane through the centre, as its neighbours continue it;
//! 2. the cluster of the centre, with some room;
//! 3. the next cluster behind it;
//! 4. the farthest cluster, with more room.

use crate::host::threads::{cores, on_threads};
use crate::input::image::{DepthConvention, ImageSize};

/// How many rows of pixels a thread takes at once.
const PART: usize = 16;
/// How many slabs a pixel has.
pub(super) const SLABS: usize = 4;
/// The first slabs, which are as near as a pixel's depth can be.
pub(super) const FRONT: usize = 2;
/// Distances to the far plane are compared by their ratio.
/// What is this much farther than the one before it is in the next cluster.
///
/// The first number is for pixels, the second one for their parts.
const STEPS: [f32; 2] = [0.93, 0.98];
/// How far slab 1 goes on beyond the slopes to the neighbours.
const SLOPE: f32 = 0.55;
/// How far slab 2 goes on beyond its cluster, in steps from the centre to the cluster's end.
const BEYOND: f32 = 0.3;
/// A little farther than a depth that float32 rounded.
const HAIR: f32 = 1.0 - 1e-5;
/// The room of slabs 3 and 4 towards far.
const ROOMS: [f32; 2] = [0.998, 0.95];
/// The room of slabs towards near.
const NEARER: f32 = 1.03;

/// The slabs of a pixel, in values of `far`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slabs {
    /// By slab: what reaches beyond is not in it; minus infinity for a slab without anything.
    pub(super) farthest: [f32; SLABS],
    /// By slab: what comes before is not in it.
    pub(super) nearest: [f32; SLABS],
    /// The greatest of `farthest`, and of its first [`FRONT`].
    pub(super) last: f32,
    pub(super) front: f32,
}

impl Slabs {
    /// A pixel at whose centre there is nothing.
    pub(super) const NONE: Self = Self {
        farthest: [f32::NEG_INFINITY; SLABS],
        nearest: [f32::INFINITY; SLABS],
        last: f32::NEG_INFINITY,
        front: f32::NEG_INFINITY,
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
                choose(lines, convention, STEPS[0], slabs);
            }
        },
    );
    slabs
}

/// The slabs of the parts of a pixel, from depths at the parts' centres, in rows of `width`.
pub(super) fn of_parts(
    centres: &[f32],
    width: usize,
    convention: DepthConvention,
    slabs: &mut [Slabs],
) {
    let last = centres.len() / width - 1;
    let row = |y: usize| &centres[y * width..][..width];
    for (y, slabs) in slabs.chunks_exact_mut(width).enumerate() {
        let lines = [row(y.saturating_sub(1)), row(y), row((y + 1).min(last))];
        choose(lines, convention, STEPS[1], slabs);
    }
}

/// Chooses the slabs of a row of pixels.
///
/// `above`, `row` and `below` are NDC depths at the centres; at the image's border a row repeats.
fn choose(
    [above, row, below]: [&[f32]; 3],
    convention: DepthConvention,
    step: f32,
    slabs: &mut [Slabs],
) {
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
        let clusters = Clusters::new(&mut nine, centre, step);
        let slab = |farthest: f32, nearest: f32| {
            let nearest = if nearest.is_finite() { far(NEARER * nearest) } else { -nearest };
            if farthest > 0.0 { (far(farthest), nearest) } else { (f32::NEG_INFINITY, nearest) }
        };
        let ((first, end), (next, next_end), (last, last_end)) =
            (clusters.own, clusters.next, clusters.last);
        let room = (end - BEYOND * (centre - end)) * HAIR;
        let chosen = [
            slab((centre - SLOPE * slopes) * HAIR, f32::INFINITY),
            slab(room, first),
            slab((ROOMS[0] * next_end).min(HAIR * room), next),
            slab(ROOMS[1] * last_end, last),
        ];
        slabs.farthest = chosen.map(|slab| slab.0);
        slabs.nearest = chosen.map(|slab| slab.1);
        slabs.front = chosen[0].0.max(chosen[1].0);
        slabs.last = chosen.iter().fold(f32::NEG_INFINITY, |m, s| if s.0 > m { s.0 } else { m });
    }
}

/// The nearest and the farthest depth of three clusters; more is nearer.
///
/// The nearest is infinite where nothing of the nine comes before the cluster.
struct Clusters {
    own: (f32, f32),
    next: (f32, f32),
    last: (f32, f32),
}

impl Clusters {
    /// Sorts nine depths, of which one is `centre`.
    fn new(nine: &mut [f32; 9], centre: f32, step: f32) -> Self {
        let (least, most) = nine.iter().fold((centre, centre), |(least, most), v| {
            (if *v < least { *v } else { least }, if *v > most { *v } else { most })
        });
        if least >= step * most {
            let all = (f32::INFINITY, least);
            return Self { own: all, next: all, last: all };
        }
        nine.sort_unstable_by(|a, b| b.total_cmp(a));
        let (mut own, mut next, mut last) = ((f32::INFINITY, centre), None, None);
        let mut start = f32::INFINITY;
        for (i, v) in nine.iter().enumerate() {
            if i > 0 && *v < step * nine[i - 1] {
                start = *v;
            }
            if *v >= centre {
                own = (start, centre);
            } else if start >= centre {
                own.1 = *v;
            } else if next.is_none_or(|(first, _)| first == start) {
                next = Some((start, *v));
            }
            last = Some((start, *v));
        }
        let last = last.unwrap_or(own);
        Self { own, next: next.unwrap_or(own), last }
    }
}
