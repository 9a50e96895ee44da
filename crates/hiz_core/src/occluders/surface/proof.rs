//! Proves for each pixel which of its slabs cover it: one pass over triangles, one over edges.
//!
//! Slab k of pixel P holds the facets that reach no farther in P than its threshold, see `is_in`.
//! Both passes decide that by the same function of the same stored numbers.
//!
//! 1. The facets that cover the centre of P add to the winding numbers of their sums.
//!    A centre on an edge counts by the top-left rule: it is moved by an infinitesimal step, the
//!    same for all facets.
//! 2. Each edge that meets P grown by [`REACH`] either cancels or leaves its sums open.
//!
//! Where a sum is not open and its winding number is not 0, its facets cover P.
//! A facet that meets P covers the centre or has an edge that meets P, so it was seen in a pass.
//! The farthest of those is the depth of P.
//!
//! Exact edges are nearer than [`REACH`] to rounded ones.
//! So as the vertices move from their rounded to their exact places, no edge that remains crosses
//! P, and the winding number stays.

use crate::host::rounding::round_up;
use crate::host::threads::{cores, on_threads};
use crate::input::image::{DepthConvention, ImageSize};
use crate::occluders::surface::chains::{AtEdge, Mask, Steps, Tally};
use crate::occluders::surface::coverage::area;
use crate::occluders::surface::facets::{Corner, Facet, REACH, Rounder, Segment, Vertex};
use crate::occluders::surface::links::Standing;
use crate::occluders::surface::looks::{Look, Looks, Placed, TILE, Tiles, Wanted};
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::squares::{Place, Squares};
use crate::occluders::surface::thresholds::{self, FRONT, SLABS, Slabs};
use crate::occluders::surface::topology::Edge;

/// What the proof is about.
#[derive(Debug, Clone, Copy)]
pub(super) struct Proof<'a> {
    pub(super) placed: Placed<'a>,
    pub(super) rounder: &'a Rounder,
    pub(super) looks: &'a Looks,
    pub(super) links: &'a Standing<'a>,
    pub(super) size: ImageSize,
    pub(super) convention: DepthConvention,
}

impl Proof<'_> {
    /// For every pixel, rows from top to bottom: every ray through its closed square is blocked at
    /// this value of `far` or before.
    ///
    /// Infinity where that cannot be shown.
    /// The flags tell which pixels have no proof of one of their first [`FRONT`] slabs.
    pub(super) fn image(&self, slabs: &[Slabs], tiles: &Tiles) -> (Vec<f32>, Vec<bool>) {
        let mut depths = vec![f32::INFINITY; slabs.len()];
        let mut is_open = vec![false; slabs.len()];
        let part = (band_rows(self.size) * self.size.width) as usize;
        let parts = depths.chunks_mut(part).zip(is_open.chunks_mut(part));
        let bands = parts.zip(slabs.chunks(part)).zip(bands(self.size));
        on_threads(cores(), bands, |(((depths, is_open), slabs), rows)| {
            let squares = Squares::pixels(self.size.width, rows, tiles);
            let states = Band::<FRONT>::run(self, squares, slabs);
            let pixels = depths.iter_mut().zip(is_open).zip(slabs);
            for (((depth, is_open), slabs), state) in pixels.zip(&states) {
                let (far, slab) = state.depth();
                *depth = far;
                *is_open = slab >= FRONT && *slabs != Slabs::NONE;
            }
        });
        (depths, is_open)
    }

    /// Proves open pixels by their parts: 4^finer of them.
    ///
    /// Every ray through a pixel goes through a part of it, so the farthest part counts.
    ///
    /// Lowers `depths`.
    /// Returns, by open pixel, the farthest depth at the centres of its parts: no proof can find
    /// anything that is nearer.
    pub(super) fn refine(
        &self,
        open: &OpenPixels,
        tiles: &Tiles,
        finer: u32,
        depths: &mut [f32],
    ) -> Vec<f32> {
        let wanted = Wanted { open, tiles, rows: [0, self.size.height.cast_signed() - 1] };
        let looks = self.looks.narrowed(&self.placed, &wanted);
        let proof = Proof { looks: &looks, ..*self };
        let mut floors = vec![f32::INFINITY; open.pixels().len()];
        let part = (band_rows(self.size) * self.size.width) as usize;
        let mut left = &mut floors[..];
        let floors_by_band: Vec<&mut [f32]> = bands(self.size)
            .map(|rows| {
                let (own, rest) = std::mem::take(&mut left).split_at_mut(open.of_rows(rows).len());
                left = rest;
                own
            })
            .collect();
        let bands = depths.chunks_mut(part).zip(floors_by_band).zip(bands(self.size));
        on_threads(cores(), bands, |((depths, floors), rows)| {
            let pixels = open.of_rows(rows);
            if pixels.is_empty() {
                return;
            }
            let parts = 1 << (2 * finer);
            let samples = proof.samples(open, rows, finer);
            let mut slabs = vec![Slabs::NONE; samples.len()];
            let mut last = vec![f32::NEG_INFINITY; pixels.len()];
            for (i, samples) in samples.chunks_exact(parts).enumerate() {
                let slabs = &mut slabs[i * parts..][..parts];
                thresholds::of_parts(samples, 1 << finer, self.convention, slabs);
                last[i] = slabs.iter().fold(f32::NEG_INFINITY, |m, s| m.max(s.last));
                let far = |depth: f32| if self.convention.is_reversed() { -depth } else { depth };
                floors[i] = samples.iter().fold(f32::NEG_INFINITY, |m, v| m.max(far(*v)));
            }
            let states =
                Band::<SLABS>::run(&proof, Squares::parts(open, rows, finer, &last), &slabs);
            let first = rows[0] as u32 * self.size.width;
            for (pixel, states) in pixels.iter().zip(states.chunks_exact(parts)) {
                let far = states.iter().fold(f32::NEG_INFINITY, |m, state| m.max(state.depth().0));
                let depth = &mut depths[(pixel - first) as usize];
                *depth = depth.min(far);
            }
        });
        floors
    }

    /// NDC depths at the centres of the parts of open pixels; far where there is nothing.
    fn samples(&self, open: &OpenPixels, rows: [i32; 2], finer: u32) -> Vec<f32> {
        let last = vec![f32::INFINITY; open.of_rows(rows).len()];
        let squares = Squares::parts(open, rows, finer, &last);
        let mut nearest = vec![f64::INFINITY; last.len() << (2 * finer)];
        for look in self.looks.all.iter().filter(|look| look.is_in_rows(rows)) {
            look.for_each_triangle(&self.placed, |facet, corners| {
                squares.for_each_covered(facet, corners, |square| {
                    let [x, y] = square.centre;
                    let nearest = &mut nearest[square.number];
                    *nearest = nearest.min(facet.at_point(x, y));
                });
            });
        }
        #[expect(clippy::cast_possible_truncation, reason = "for choices alone")]
        let ndc = |far: f64| match (far < f64::INFINITY, self.convention.is_reversed()) {
            (false, _) => self.convention.far(),
            (true, true) => -far as f32,
            (true, false) => far as f32,
        };
        nearest.into_iter().map(ndc).collect()
    }
}

/// The rows of a band: whole rows of tiles, and some bands more than threads.
pub(super) fn band_rows(size: ImageSize) -> u32 {
    size.height.div_ceil(4 * cores() as u32).next_multiple_of(TILE)
}

/// The first and the last row of each band.
pub(super) fn bands(size: ImageSize) -> impl Iterator<Item = [i32; 2]> + Send + use<> {
    let rows = band_rows(size);
    let band = move |first: u32| [first, (first + rows).min(size.height) - 1];
    (0..size.height).step_by(rows as usize).map(move |first| band(first).map(u32::cast_signed))
}

/// What is known of a square.
#[derive(Debug, Clone, Copy)]
struct State {
    tally: Tally,
    /// By slab: the farthest of its facets.
    far: [f32; SLABS],
}

impl State {
    const START: Self = Self { tally: Tally::START, far: [f32::NEG_INFINITY; SLABS] };

    /// The nearest depth of the slabs that cover the square, and which it is.
    ///
    /// Infinity without one.
    fn depth(&self) -> (f32, usize) {
        let mut nearest = (f32::INFINITY, SLABS);
        for (slab, far) in self.far.iter().enumerate() {
            if self.tally.is_covered(slab) && *far < nearest.0 {
                nearest = (*far, slab);
            }
        }
        nearest
    }

    /// Counts the facets of `mask` as reaching as far as `far`.
    #[inline(always)]
    fn reaches<const N: usize>(&mut self, far: f32, mask: Mask) {
        for (slab, farthest) in self.far[..N].iter_mut().enumerate() {
            let far = if mask >> slab & 1 != 0 { far } else { f32::NEG_INFINITY };
            *farthest = if far > *farthest { far } else { *farthest };
        }
    }
}

/// The proof of some squares, by their first N slabs.
struct Band<'a, const N: usize> {
    proof: &'a Proof<'a>,
    squares: Squares<'a>,
    /// By square.
    slabs: &'a [Slabs],
    states: Vec<State>,
    /// Half the side of a square, and [`REACH`], in units.
    half: f64,
    /// The facets at an edge where more than two meet.
    around: Vec<(Facet, bool)>,
}

impl<'a, const N: usize> Band<'a, N> {
    /// Both passes.
    fn run(proof: &'a Proof<'a>, squares: Squares<'a>, slabs: &'a [Slabs]) -> Vec<State> {
        let half = squares.half();
        let half = if is_planted!(proof.placed.fault, PlaneWithoutReach) { 0.0 } else { half };
        let (states, around) = (vec![State::START; slabs.len()], Vec::new());
        let mut band = Self { proof, squares, slabs, states, half, around };
        for (number, look) in (0..).zip(&proof.looks.all) {
            if look.is_in_rows(band.squares.rows()) {
                look.for_each_triangle(&proof.placed, |facet, corners| band.cover(facet, corners));
                for polygon in &look.polygons {
                    let facet = look.facets[usize::from(polygon.triangle)];
                    for [a, b] in polygon.cuts() {
                        band.border(a, b, &facet, &Facet::default(), false);
                    }
                }
                for edge in proof.placed.topology.edges(look.meshlet) {
                    band.edge(number, look, edge);
                }
            }
        }
        band.states
    }

    /// Adds a triangle to the windings of the squares whose centres it covers.
    ///
    /// It is a facet, or a part of one.
    fn cover(&mut self, facet: &Facet, corners: [Corner; 3]) {
        let own = if area(corners) < 0 { -1 } else { 1 };
        let steps = Steps::of(facet.sign, own);
        let (slabs, states, half) = (self.slabs, &mut self.states, self.half);
        self.squares.for_each_covered(facet, corners, |square| {
            let slabs = &slabs[square.number];
            if facet.nearest <= last_of::<N>(slabs) {
                let (mask, far) = is_in::<N>(facet, &square, half, slabs);
                let state = &mut states[square.number];
                state.tally.cover(steps, mask);
                state.reaches::<N>(far, mask);
            }
        });
    }

    /// Finds the facets at an edge.
    fn edge(&mut self, number: u32, look: &Look, edge: &Edge) {
        let proof = self.proof;
        let placed = &proof.placed;
        let facet = &look.facets[usize::from(edge.triangle)];
        let neighbours = placed.topology.neighbours(edge);
        let is_linked = proof.links.number(look.copy, edge.id).is_some();
        if let ([], false) = (neighbours, is_linked) {
            self.sides(look, edge, facet, &Facet::default(), false);
        } else if let ([neighbour], false) = (neighbours, is_linked) {
            let mut other = Facet::default();
            if neighbour.meshlet == look.meshlet {
                other = look.facets[usize::from(neighbour.triangle)];
            } else if let Some(place) = proof.looks.find(look.copy, neighbour.meshlet) {
                let facets = &proof.looks.all[place as usize].facets;
                if let Some(facet) = facets.get(usize::from(neighbour.triangle)) {
                    other = *facet;
                }
                // That meshlet has the edge in its list, too.
                if place < number && other.is_there() {
                    return;
                }
            }
            if is_planted!(placed.fault, LeftOutNeighboursIgnored) && !other.is_there() {
                return;
            }
            self.sides(look, edge, facet, &other, neighbour.is_along);
        } else {
            self.many(look, edge, facet);
        }
    }

    /// An edge that two facets share.
    #[inline]
    fn sides(&mut self, look: &Look, edge: &Edge, one: &Facet, other: &Facet, is_along: bool) {
        if !(one.is_there() || other.is_there()) {
            return;
        }
        if let Some([a, b]) = self.ends(look, edge) {
            self.border(a, b, one, other, is_along);
        }
    }

    /// What is left of an edge: the same two points for all its triangles.
    #[inline]
    fn ends(&self, look: &Look, edge: &Edge) -> Option<[Corner; 2]> {
        match edge.ends.map(|v| look.vertices[usize::from(v)]) {
            [Vertex::Inside(a), Vertex::Inside(b)] => Some([a, b]),
            // Then none of the edge's triangles is there.
            [Vertex::Uncertain, _] | [_, Vertex::Uncertain] => None,
            _ => {
                let placed = &self.proof.placed;
                let vertices = placed.topology.vertices(look.meshlet);
                let [a, b] = edge.ends.map(|v| placed.world(look.copy, vertices[usize::from(v)]));
                match self.proof.rounder.segment(a, b) {
                    Segment::Between(a, b) => Some([a, b]),
                    Segment::Nothing | Segment::Uncertain => None,
                }
            }
        }
    }

    /// An edge at which more than two triangles may meet.
    #[cold]
    fn many(&mut self, look: &Look, edge: &Edge, facet: &Facet) {
        let proof = self.proof;
        let mut around = std::mem::take(&mut self.around);
        around.clear();
        around.push((*facet, true));
        let mut add = |copy: u32, meshlet: u32, triangle: u8, is_along: bool| {
            if let Some(facet) = proof.looks.facet(copy, meshlet, triangle) {
                around.push((*facet, is_along));
            }
        };
        for neighbour in proof.placed.topology.neighbours(edge) {
            add(look.copy, neighbour.meshlet, neighbour.triangle, neighbour.is_along);
        }
        proof.links.for_each(look, edge, &proof.placed, &mut add);
        if let Some(ends) = self.ends(look, edge) {
            let mut triangles = Vec::with_capacity(around.len());
            let (half, fault) = (self.half, proof.placed.fault);
            let (all_slabs, states) = (self.slabs, &mut self.states);
            self.squares.for_each_met(ends, reach(fault), |square| {
                triangles.clear();
                let state = &mut states[square.number];
                for (facet, is_along) in &around {
                    let (mask, far) = if is_planted!(fault, MembershipInFloat32) {
                        is_in::<N>(&facet.in_float32(), &square, half, &all_slabs[square.number])
                    } else {
                        is_in::<N>(facet, &square, half, &all_slabs[square.number])
                    };
                    state.reaches::<N>(far, mask);
                    triangles.push(AtEdge { sign: facet.sign, is_along: *is_along, mask });
                }
                state.tally.meet_many(&triangles, fault);
            });
        }
        self.around = around;
    }

    /// Notes an edge of one or two facets in the squares that it meets.
    fn border(&mut self, a: Corner, b: Corner, one: &Facet, other: &Facet, is_along: bool) {
        let (half, fault) = (self.half, self.proof.placed.fault);
        let (all_slabs, states) = (self.slabs, &mut self.states);
        let float32;
        let [one, other] = if is_planted!(fault, MembershipInFloat32) {
            float32 = [one, other].map(Facet::in_float32);
            float32.each_ref()
        } else {
            [one, other]
        };
        let depth = |facet: &Facet| if facet.is_there() { facet.nearest } else { f64::INFINITY };
        let nearest = depth(one).min(depth(other));
        self.squares.for_each_met([a, b], reach(fault), |square| {
            let slabs = &all_slabs[square.number];
            if nearest > last_of::<N>(slabs) {
                return;
            }
            let (first, far) = is_in::<N>(one, &square, half, slabs);
            let (second, other_far) = is_in::<N>(other, &square, half, slabs);
            let state = &mut states[square.number];
            state.reaches::<N>(far, first);
            state.reaches::<N>(other_far, second);
            state.tally.meet(
                AtEdge { sign: one.sign, is_along: true, mask: first },
                AtEdge { sign: other.sign, is_along, mask: second },
                fault,
            );
        });
    }
}

/// What is nearest to the eye in a facet and beyond this is in none of the first N slabs.
#[inline(always)]
fn last_of<const N: usize>(slabs: &Slabs) -> f64 {
    f64::from(if N <= FRONT { slabs.front } else { slabs.last })
}

/// How far squares are grown where edges are tested, in units.
fn reach(fault: Planted) -> i32 {
    if is_planted!(fault, NoEdgeMargin) { 0 } else { REACH }
}

/// The slabs of a square that a facet is in, and how far it reaches there.
///
/// What is not there is in none.
#[inline(always)]
fn is_in<const N: usize>(facet: &Facet, square: &Place, half: f64, slabs: &Slabs) -> (Mask, f32) {
    if !facet.is_there() {
        return (0, f32::NEG_INFINITY);
    }
    let (far, near) = facet.range(square.centre[0], square.centre[1], half);
    #[expect(clippy::cast_possible_truncation, reason = "for a choice alone")]
    let (far, near) = (round_up(far), near as f32);
    let mut mask = 0;
    for slab in 0..N {
        mask |= Mask::from(far <= slabs.farthest[slab] && near >= slabs.nearest[slab]) << slab;
    }
    (mask, far)
}
