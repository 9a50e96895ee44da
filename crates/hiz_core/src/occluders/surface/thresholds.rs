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
    /// What comes before is not in the second slab.
    pub(super) nearest: f32,
}

impl Slabs {
    /// A pixel at whose centre there is nothing.
    pub(super) const NONE: Self =
        Self { farthest: [f32::NEG_INFINITY; SLABS], nearest: f32::INFINITY };

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
        on_threads(cores(), parts.zip((0..).step_by(TILE as usize)), |((part, tiles), first)| {
            for (slabs, y) in part.chunks_exact_mut(width).zip(first..) {
                self.choose(y, slabs);
                for (slabs, tile) in slabs.chunks(TILE as usize).zip(tiles.iter_mut()) {
                    for last in slabs.iter().map(Slabs::last) {
                        *tile = if last > *tile { last } else { *tile };
                    }
                }
            }
        });
        (slabs, tiles)
    }

    /// What comes after the first value seldom covers an open pixel, and nearly never what comes
    /// after the second one.
    pub(super) fn bounds(&self, pixel: u32, slabs: &Slabs) -> [f32; 2] {
        let (x, y) = (pixel % self.size.width, pixel / self.size.width);
        let lines = self.lines(y as usize);
        let nine = self.nine(lines, x as usize);
        let there = nine.into_iter().filter(|near| *near > 0.0);
        let farthest = |room: f32| {
            let least = there.clone().fold(f32::INFINITY, f32::min);
            self.far(room * least).max(slabs.last())
        };
        let sees_nothing = nine.iter().any(|near| *near <= 0.0);
        [farthest(LIKELY), if sees_nothing { f32::INFINITY } else { farthest(ROOM) }]
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

    /// Chooses the slabs of a row of pixels, which have nothing so far.
    fn choose(&self, y: usize, slabs: &mut [Slabs]) {
        let lines = self.lines(y);
        for (x, slabs) in slabs.iter_mut().enumerate() {
            let centre = self.near(lines[1][x]);
            if centre <= 0.0 {
                continue;
            }
            let mut nine = self.nine(lines, x);
            let slope = |a: f32, b: f32| {
                let (a, b) = ((a - centre).abs(), (b - centre).abs());
                if a < b { a } else { b }
            };
            let slopes = slope(nine[3], nine[5]) + slope(nine[1], nine[7]);
            let cluster = Cluster::new(&mut nine, centre);
            let farthest = |near: f32| if near > 0.0 { self.far(near) } else { f32::NEG_INFINITY };
            let room = (cluster.end - BEYOND * (centre - cluster.end)) * HAIR;
            slabs.farthest = [farthest((centre - SLOPE * slopes) * HAIR), farthest(room)];
            slabs.nearest = if cluster.first < f32::INFINITY {
                self.far(NEARER * cluster.first)
            } else {
                f32::NEG_INFINITY
            };
        }
    }
}

/// Of nine depths with more for nearer: those of one surface.
struct Cluster {
    /// The nearest, or infinity where nothing comes before it, and the farthest.
    first: f32,
    end: f32,
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
            return Self { first: f32::INFINITY, end: least };
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
        }
        Self { first, end }
    }
}
