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

use crate::host::threads::{on_threads, worth_it};
use crate::host::vectors::widest;
use crate::input::image::{DepthConvention, ImageSize};
use crate::occluders::surface::looks::{TILE, Tiles};

/// How many slabs a pixel has.
pub(super) const SLABS: usize = 2;
/// Distances to the far plane are compared by their ratio.
/// What is this much farther than the one before it is in the next cluster.
const STEP: f32 = 0.93;
/// How far slab 1 goes on beyond the slopes to the neighbours.
const SLOPE: f32 = 0.55;
/// How far slab 2 goes on beyond its cluster, in steps from the centre to the cluster's end.
const BEYOND: f32 = 0.3;
/// Nanoseconds that choosing takes for a pixel.
const PER_PIXEL: u64 = 4;
/// A little farther than a depth that float32 rounded.
const HAIR: f32 = 1.0 - 1e-5;
/// How much farther than all neighbours a search looks.
const ROOM: f32 = 0.5;
/// The room of slabs towards near.
const NEARER: f32 = 1.03;

/// The slabs of a pixel, in values of `far`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slabs {
    /// By slab: what reaches beyond is not in it; minus infinity for a slab without anything.
    pub(super) farthest: [f32; SLABS],
    /// What comes before is not in the second slab.
    pub(super) nearest: f32,
}

impl Slabs {
    /// A pixel at whose centre there is nothing.
    pub(super) const NONE: Self =
        Self { farthest: [f32::NEG_INFINITY; SLABS], nearest: f32::INFINITY };

    /// Whether they are not [`Slabs::NONE`].
    #[inline(always)]
    pub(super) fn is_any(&self) -> bool {
        self.nearest < f32::INFINITY
    }

    /// What comes after this is in no slab.
    #[inline(always)]
    pub(super) fn last(&self) -> f32 {
        let [a, b] = self.farthest;
        if a > b { a } else { b }
    }
}

/// NDC depths at the pixels' centres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Centres<'a> {
    pub(super) depths: &'a [f32],
    pub(super) size: ImageSize,
    pub(super) convention: DepthConvention,
}

impl Centres<'_> {
    /// The slabs of all pixels, and what their tiles try.
    pub(super) fn slabs(&self) -> (Vec<Slabs>, Tiles) {
        let width = self.size.width as usize;
        let mut slabs = vec![Slabs::NONE; self.depths.len()];
        let mut tiles = Tiles::closed(self.size);
        let rows = TILE as usize * width;
        let parts = slabs.chunks_mut(rows).zip(tiles.lines_mut());
        let threads = worth_it(PER_PIXEL * self.depths.len() as u64);
        on_threads(threads, parts.zip((0..).step_by(TILE as usize)), |((part, tiles), first)| {
            let mut around = Around::default();
            for (slabs, y) in part.chunks_exact_mut(width).zip(first..) {
                widest(
                    #[inline(always)]
                    || self.choose(y, slabs, &mut around),
                );
                self.divide(slabs, &around);
                for (slabs, tile) in slabs.chunks(TILE as usize).zip(tiles.iter_mut()) {
                    for last in slabs.iter().map(Slabs::last) {
                        *tile = if last > *tile { last } else { *tile };
                    }
                }
            }
        });
        (slabs, tiles)
    }

    /// What comes after this nearly never covers an open pixel.
    pub(super) fn bound(&self, pixel: u32, slabs: &Slabs) -> f32 {
        let (x, y) = (pixel % self.size.width, pixel / self.size.width);
        let nine = self.nine(self.lines(y as usize), x as usize);
        let least = nine.into_iter().fold(f32::INFINITY, f32::min);
        // A neighbour sees nothing, so anything may be there.
        if least <= 0.0 { f32::INFINITY } else { self.far(ROOM * least).max(slabs.last()) }
    }

    /// With more for nearer, and 0 at the far plane.
    #[inline(always)]
    fn near(&self, depth: f32) -> f32 {
        if self.convention.is_reversed() { depth } else { 1.0 - depth }
    }

    #[inline(always)]
    fn far(&self, near: f32) -> f32 {
        if self.convention.is_reversed() { -near } else { 1.0 - near }
    }

    /// The row above, a row, and the row below; at the image's border a row repeats.
    fn lines(&self, y: usize) -> [&[f32]; 3] {
        let (width, last) = (self.size.width as usize, self.size.height as usize - 1);
        let row = |y: usize| &self.depths[y * width..][..width];
        [row(y.saturating_sub(1)), row(y), row((y + 1).min(last))]
    }

    /// How near a pixel and its neighbours are.
    #[inline(always)]
    fn nine(&self, lines: [&[f32]; 3], x: usize) -> [f32; 9] {
        let last = lines[1].len() - 1;
        let columns = [x.saturating_sub(1), x, (x + 1).min(last)];
        let mut nine = [0.0; 9];
        for (k, line) in lines.into_iter().enumerate() {
            for (j, column) in columns.into_iter().enumerate() {
                nine[3 * k + j] = self.near(line[column]);
            }
        }
        nine
    }

    /// Chooses the slabs of a row of pixels, as if each and its neighbours were one cluster.
    #[inline(always)]
    fn choose(&self, y: usize, slabs: &mut [Slabs], around: &mut Around) {
        around.fill(self.lines(y).map(
            #[inline(always)]
            |line| {
                line.iter().map(
                    #[inline(always)]
                    |depth| self.near(*depth),
                )
            },
        ));
        let Around { lines, least, slopes, .. } = &*around;
        let columns = lines[1][1..].iter().zip(least).zip(slopes);
        for (slabs, ((centre, least), slopes)) in slabs.iter_mut().zip(columns) {
            let first = self.farthest((centre - SLOPE * slopes) * HAIR);
            let farthest = [first, self.farthest(room(*centre, *least))];
            let is_there = *centre > 0.0;
            *slabs = Slabs {
                farthest: farthest.map(
                    #[inline(always)]
                    |far| if is_there { far } else { f32::NEG_INFINITY },
                ),
                nearest: if is_there { f32::NEG_INFINITY } else { f32::INFINITY },
            };
        }
    }

    /// Gives the pixels of a row whose neighbours are more than one cluster that of their centre.
    fn divide(&self, slabs: &mut [Slabs], around: &Around) {
        let columns = around.lines[1][1..].iter().zip(&around.least).zip(&around.most).enumerate();
        for (slabs, (x, ((centre, least), most))) in slabs.iter_mut().zip(columns) {
            if *least >= STEP * most || *centre <= 0.0 {
                continue;
            }
            let cluster = Cluster::of(&around.nine(x), *centre, *most);
            slabs.farthest[1] = self.farthest(room(*centre, cluster.end));
            if cluster.first < f32::INFINITY {
                slabs.nearest = self.far(NEARER * cluster.first);
            }
        }
    }

    /// The value of `far` for how near something is; minus infinity beyond the far plane.
    #[inline(always)]
    fn farthest(&self, near: f32) -> f32 {
        if near > 0.0 { self.far(near) } else { f32::NEG_INFINITY }
    }
}

/// Some room beyond the end of the cluster of a pixel's centre, with more for nearer.
#[inline(always)]
fn room(centre: f32, end: f32) -> f32 {
    (end - BEYOND * (centre - end)) * HAIR
}

/// What is around the pixels of a row, with more for nearer.
///
/// Each list is filled by a loop without branches, which becomes vectors.
#[derive(Debug, Default)]
struct Around {
    /// The row above, the row and the row below, with one more pixel at each end.
    lines: [Vec<f32>; 3],
    /// The least and the greatest of a pixel and those above and below it.
    columns: [Vec<f32>; 2],
    /// By pixel: the least and the greatest of the nine.
    least: Vec<f32>,
    most: Vec<f32>,
    /// By pixel: the steps to a neighbour in the row and to one in the column, the smaller ones.
    slopes: Vec<f32>,
}

impl Around {
    /// Fills all lists, for rows of how near pixels are.
    #[inline(always)]
    fn fill(&mut self, rows: [impl Iterator<Item = f32>; 3]) {
        for (line, row) in self.lines.iter_mut().zip(rows) {
            line.clear();
            line.push(0.0);
            line.extend(row);
            // At the image's border a column repeats.
            line[0] = line[1];
            line.push(line[line.len() - 1]);
        }
        let [above, row, below] = &self.lines;
        let min = |a: f32, b: f32| if a < b { a } else { b };
        let max = |a: f32, b: f32| if a > b { a } else { b };
        for (columns, pick) in self.columns.iter_mut().zip([min, max]) {
            columns.clear();
            let three = above.iter().zip(row).zip(below);
            columns.extend(three.map(|((a, b), c)| pick(pick(*a, *b), *c)));
        }
        let [least, most] = &self.columns;
        self.least.clear();
        self.least.extend(least.windows(3).map(|w| min(min(w[0], w[1]), w[2])));
        self.most.clear();
        self.most.extend(most.windows(3).map(|w| max(max(w[0], w[1]), w[2])));
        let step = |a: f32, centre: f32, b: f32| min((a - centre).abs(), (b - centre).abs());
        let columns = above[1..].iter().zip(&below[1..]);
        self.slopes.clear();
        self.slopes.extend(
            row.windows(3)
                .zip(columns)
                .map(|(w, (above, below))| step(w[0], w[1], w[2]) + step(*above, w[1], *below)),
        );
    }

    /// How near a pixel and its neighbours are.
    #[inline]
    fn nine(&self, x: usize) -> [f32; 9] {
        std::array::from_fn(|k| self.lines[k / 3][x + k % 3])
    }
}

/// Of nine depths with more for nearer: those of one surface.
struct Cluster {
    /// The nearest, or infinity where nothing comes before it, and the farthest.
    first: f32,
    end: f32,
}

impl Cluster {
    /// The cluster of one of the nine, `centre`; `most` is the greatest of them.
    ///
    /// What is not much farther than the end of the cluster goes on with it, and what is not much
    /// nearer than its beginning comes before that.
    fn of(nine: &[f32; 9], centre: f32, most: f32) -> Self {
        let (mut first, mut end) = (centre, centre);
        loop {
            let (mut nearest, mut farthest) = (first, end);
            for v in nine {
                let (goes_on, comes_before) = (*v >= STEP * end, first >= STEP * *v);
                farthest = if goes_on && *v < farthest { *v } else { farthest };
                nearest = if comes_before && *v > nearest { *v } else { nearest };
            }
            if nearest == first && farthest == end {
                break;
            }
            (first, end) = (nearest, farthest);
        }
        Self { first: if first < most { first } else { f32::INFINITY }, end }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wider_vectors_choose_the_same_slabs() {
        let mut state = 1_u32;
        let mut below = |n: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % n
        };
        let size = ImageSize::new(67, 21);
        for convention in [DepthConvention::Reversed, DepthConvention::Standard] {
            let mut depth = || [0.0, 1.0, below(1000) as f32 / 1000.0][below(20).min(2) as usize];
            let depths: Vec<f32> = (0..67 * 21).map(|_| depth()).collect();
            let centres = Centres { depths: &depths, size, convention };
            let (found, mut around) = (centres.slabs().0, Around::default());
            for (y, found) in found.chunks(67).enumerate() {
                let mut slabs = [Slabs::NONE; 67];
                centres.choose(y, &mut slabs, &mut around);
                centres.divide(&mut slabs, &around);
                assert_eq!(found, slabs, "{y} {convention:?}");
                for (slabs, depth) in slabs.iter().zip(&depths[y * 67..]) {
                    assert_eq!(slabs.is_any(), *slabs != Slabs::NONE);
                    assert_eq!(slabs.is_any(), centres.near(*depth) > 0.0);
                }
            }
        }
    }

    /// By sorting, and looking for gaps.
    fn sorted(mut nine: [f32; 9], centre: f32) -> (f32, f32) {
        nine.sort_unstable_by(|a, b| b.total_cmp(a));
        let mut starts = (0..9).filter(|i| *i == 0 || nine[*i] < STEP * nine[*i - 1]);
        let start = starts.rfind(|i| nine[*i] >= centre).unwrap();
        let end = (start + 1..9).find(|i| nine[*i] < STEP * nine[*i - 1]).unwrap_or(9);
        (if start == 0 { f32::INFINITY } else { nine[start] }, nine[end - 1])
    }

    #[test]
    fn clusters_are_what_no_gap_divides() {
        let mut state = 1_u32;
        let mut below = |n: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % n
        };
        let mut inner = 0;
        for _ in 0..20_000 {
            let room = 1 + below(20);
            let nine: [f32; 9] = std::array::from_fn(|_| STEP.powf(below(room) as f32 * 0.45));
            let most = nine.iter().copied().fold(0.0, f32::max);
            let Cluster { first, end } = Cluster::of(&nine, nine[4], most);
            assert_eq!((first, end), sorted(nine, nine[4]), "{nine:?}");
            inner += u32::from(first < f32::INFINITY);
        }
        assert!(inner > 5_000, "{inner}");
    }
}
