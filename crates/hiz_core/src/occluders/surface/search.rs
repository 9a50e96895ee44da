//! How far every ray through an open pixel can get: a search for sheets of facets.
//!
//! Facets that meet at an edge which meets the square belong together.
//! A sheet is a component of what belongs together.
//! Where no border of it meets the square, and it winds about the centre, it covers the square.
//! The same integers and planes decide this as in the proof, see `proof`.
//!
//! Folds count as borders first.
//! Then sheets are joined across them, and what winds an odd number of times covers.
//!
//! Where a nearer sheet covers a part alone, the quarters are asked.
//! Before that, single facets tell how near a quarter may become at best, and which quarters they
//! cover as a whole; most squares end there.

use std::cmp::Reverse;

use crate::host::threads::{on_threads, worth_it};
use crate::occluders::surface::coverage::QUARTERS;
use crate::occluders::surface::facets::{Facet, REACH, UNITS, reach};
use crate::occluders::surface::hulls::{Hulls, Parts};
use crate::occluders::surface::meeting::{Meeting, NO_PIECE};
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::planted_fault::is_planted;
use crate::occluders::surface::proof::{band_rows, bands};
use crate::occluders::surface::walk::Walk;

/// Quarters are asked where they may bring the distance to the far plane below this share of what
/// it may be at most.
///
/// Nothing rests on it.
const WORTH: f32 = 0.98;

/// Nanoseconds that a search takes for an open pixel, and for a meshlet.
const PER_PIXEL: u64 = 600;
const PER_LOOK: u64 = 5_000;

/// Lowers the values of `far` of the open pixels: every ray through the closed square of a pixel is
/// blocked there or before.
///
/// By open pixel, `bounds` are the values at which the search stops.
/// `beyond` is the value at the far plane, and `refinement` how often a pixel is quartered.
pub(super) fn search(
    walk: &Walk<'_>,
    hulls: Option<&Hulls<'_>>,
    open: &OpenPixels,
    bounds: &[f32],
    (beyond, refinement): (f32, u32),
    far: &mut [f32],
) {
    let size = open.size();
    let part = (band_rows(size) * size.width) as usize;
    let ns = PER_PIXEL * bounds.len() as u64 + PER_LOOK * walk.looks.all.len() as u64;
    let mut parts: Vec<_> = far.chunks_mut(part).zip(bands(size)).collect();
    parts.retain(|(_, rows)| !open.of_rows(*rows).is_empty());
    // The last one to be done should be a small one.
    parts.sort_by_key(|(_, rows)| Reverse(open.of_rows(*rows).len()));
    on_threads(worth_it(ns), parts, |(far, rows)| {
        let pixels = open.of_rows(rows);
        let bounds = &bounds[open.number(0, rows[0])..][..pixels.len()];
        let place = |pixel: u32| (pixel - rows[0].cast_unsigned() * size.width) as usize;
        let parts = hulls.map(|hulls| hulls.parts(open, rows, bounds, refinement));
        let mut lowered;
        let bounds = if let Some(parts) = &parts {
            lowered = bounds.to_vec();
            for (i, (pixel, bound)) in pixels.iter().zip(&mut lowered).enumerate() {
                let found = parts.pixel(i);
                if found < *bound {
                    *bound = found;
                    far[place(*pixel)] = found;
                }
            }
            &lowered
        } else {
            bounds
        };
        if walk.looks.all.is_empty() {
            return;
        }
        let meeting = Meeting::new(walk, open, rows, bounds);
        let [covers, borders] = meeting.lists(pixels.len());
        let mut search = Search::new(walk, &meeting, beyond);
        for (i, pixel) in pixels.iter().enumerate() {
            let (column, row) = (pixel % size.width, pixel / size.width);
            let centre = [column, row].map(|v| v.cast_signed() * UNITS + UNITS / 2);
            let far = &mut far[place(*pixel)];
            search.known = parts.as_ref().map(|parts| (parts, i));
            if !search.begin(centre, covers.of(i), borders.of(i)) {
                continue;
            }
            let square = Square { centre, half: UNITS / 2 };
            let bound = (bounds[i], *far < f32::INFINITY);
            let found = search.blocked(0, (square, 0), bound, refinement);
            if found < bounds[i] {
                *far = found;
            }
        }
    });
}

/// A pixel or a part of one, in units.
#[derive(Debug, Clone, Copy)]
struct Square {
    centre: [i32; 2],
    half: i32,
}

impl Square {
    fn quarters(self) -> [Self; 4] {
        let half = self.half / 2;
        let [x, y] = self.centre;
        QUARTERS.map(|[dx, dy]| Self { centre: [x + dx * half, y + dy * half], half })
    }

    /// Whether an edge meets it, grown by `reach`: three separating axes.
    #[inline]
    fn is_met(self, [a, b]: [[i32; 2]; 2], reach: i32) -> bool {
        let grown = self.half + reach;
        let is_beside = |k: usize| {
            let (low, high) = if a[k] < b[k] { (a[k], b[k]) } else { (b[k], a[k]) };
            high < self.centre[k] - grown || low > self.centre[k] + grown
        };
        if is_beside(0) || is_beside(1) {
            return false;
        }
        let normal = [i64::from(a[1]) - i64::from(b[1]), i64::from(b[0]) - i64::from(a[0])];
        let from_a = [0, 1].map(|k| i64::from(self.centre[k]) - i64::from(a[k]));
        let most = (normal[0].abs() + normal[1].abs()) * i64::from(grown);
        (normal[0] * from_a[0] + normal[1] * from_a[1]).abs() <= most
    }
}

/// A piece in a square, as a member of a sheet.
#[derive(Debug, Clone, Copy)]
struct Member {
    piece: u32,
    /// Its parent among the members, for union-find; a head is its own parent.
    parent: u32,
    /// About the nearest depth in the square.
    near: f32,
    own: Sums,
    /// How it winds about the centres of the square's quarters, where they are asked about.
    quarters: [i32; 4],
    /// Whether it covers the centre or has an edge that meets the square.
    is_met: bool,
    /// Whether its sheet covers the square.
    covers: bool,
}

/// What decides about a sheet, for one member or summed over all of them.
#[derive(Debug, Clone, Copy)]
struct Sums {
    winding: i32,
    /// Whether a border meets the square, and whether a fold does.
    is_open: bool,
    is_folded: bool,
    /// The farthest depth in the square.
    far: f32,
}

impl Sums {
    const NOTHING: Self =
        Self { winding: 0, is_open: false, is_folded: false, far: f32::NEG_INFINITY };
}

/// What is known at one level of quartering.
#[derive(Debug, Default)]
struct Level {
    /// What may meet the square: pieces, and how they wind about the centres of four of these
    /// squares; for a pixel about its own centre.
    pieces: Vec<(u32, [i32; 4])>,
    edges: Vec<u32>,
    members: Vec<Member>,
    /// By member: the sums of its sheet, if it is the head.
    sheets: Vec<Sums>,
    /// The edges that meet the square, and the members at folds among them.
    met: Vec<u32>,
    folds: Vec<[u32; 2]>,
}

/// The search in the open pixels of some rows.
struct Search<'a> {
    meeting: &'a Meeting<'a>,
    beyond: f32,
    reach: i32,
    walk: &'a Walk<'a>,
    levels: Vec<Level>,
    /// What solids show of the parts of the pixel.
    known: Option<(&'a Parts, usize)>,
    /// By piece: its member, valid where `stamps` has the current stamp.
    places: Vec<u32>,
    stamps: Vec<u32>,
    stamp: u32,
}

impl<'a> Search<'a> {
    fn new(walk: &'a Walk<'a>, meeting: &'a Meeting<'a>, beyond: f32) -> Self {
        let count = meeting.pieces.len();
        Self {
            meeting,
            beyond,
            reach: reach(walk.placed.fault),
            walk,
            levels: Vec::new(),
            known: None,
            places: vec![0; count],
            stamps: vec![0; count],
            stamp: 0,
        }
    }

    /// Takes the pieces that cover a pixel's centre, and the edges that meet the pixel.
    ///
    /// Returns whether anything covers the centre, or a solid a part of the pixel.
    /// A sheet that covers the pixel covers its centre.
    fn begin(&mut self, centre: [i32; 2], covers: &[u32], borders: &[u32]) -> bool {
        let is_in_part = || {
            let parts = self.known.is_some_and(|(parts, number)| parts.is_any(number));
            parts && !borders.is_empty()
        };
        if covers.is_empty() && !is_in_part() {
            return false;
        }
        if self.levels.is_empty() {
            self.levels.push(Level::default());
        }
        self.stamp += 1;
        let level = &mut self.levels[0];
        level.pieces.clear();
        level.edges.clear();
        level.edges.extend_from_slice(borders);
        let at_edges = borders.iter().flat_map(|e| self.meeting.edges[*e as usize].pieces);
        let at_edges = at_edges.filter(|piece| *piece != NO_PIECE).map(|piece| (piece, 0));
        for (piece, winding) in covers.iter().map(|piece| (*piece, 1)).chain(at_edges) {
            let stamp = &mut self.stamps[piece as usize];
            if *stamp != self.stamp {
                *stamp = self.stamp;
                // A triangle that is turned to the sense +1 winds once about what it covers.
                let winding = if self.meeting.pieces[piece as usize].has_more {
                    self.meeting.winding(piece, centre)
                } else {
                    winding
                };
                level.pieces.push((piece, [winding; 4]));
            }
        }
        true
    }

    /// The value of `far` at or before which every ray through `square` is blocked.
    ///
    /// `which` of the four squares of its level it is.
    /// The result is at most `bound`, which the caller knows to hold.
    /// `is_found`: something that is as far as `bound` covers the square.
    fn blocked(
        &mut self,
        depth: usize,
        (square, which): (Square, usize),
        (bound, is_found): (f32, bool),
        refinement: u32,
    ) -> f32 {
        let mut level = std::mem::take(&mut self.levels[depth]);
        // A quarter has sides of 2 units at least.
        let splits = refinement > 0 && square.half > 1;
        let known = if splits && self.known.is_some() {
            self.known(depth, which)
        } else {
            Quarters::NOTHING
        };
        let quarters = self.find_members(&mut level, (square, which), bound, known, splits);
        let alone = quarters.farthest();
        let (bound, is_found) = (bound.min(alone), is_found || alone < bound);
        let mut best = bound;
        if !splits || self.is_worth_it(quarters.floor(), best, is_found) {
            self.join_members(&mut level, square);
            best = level.nearest_sheet(bound);
            let is_found = is_found || best < bound;
            if splits && self.is_worth_it(quarters.floor(), best, is_found) {
                let so_far = (best, is_found);
                best = self.by_quarters(depth, (&level, &quarters), square, so_far, refinement);
            }
        }
        self.levels[depth] = level;
        best
    }

    /// What solids show of the quarters of a square.
    #[cold]
    fn known(&self, depth: usize, which: usize) -> Quarters {
        let pick = |pick: fn(f32, f32) -> f32| match (self.known, depth) {
            (Some((parts, number)), 0) => parts.quarters(number, pick),
            (Some((parts, number)), 1) => parts.quarters_of(number, which),
            _ => [f32::INFINITY; 4],
        };
        // A quarter of which a part is shown may become as near as that part.
        Quarters { floors: pick(f32::min), alone: pick(f32::max) }
    }

    /// Whether a square may become so much nearer than `best` that it is looked at any closer.
    ///
    /// Nothing is shown that is nearer than `floor`.
    #[inline]
    fn is_worth_it(&self, floor: f32, best: f32, is_found: bool) -> bool {
        floor < best && (!is_found || self.beyond - best < WORTH * (self.beyond - floor))
    }

    /// Finds the members in a square that are nearer than `bound`.
    ///
    /// Returns what single members tell of its quarters, if it `splits`.
    fn find_members(
        &mut self,
        level: &mut Level,
        (square, which): (Square, usize),
        bound: f32,
        known: Quarters,
        splits: bool,
    ) -> Quarters {
        let Level { pieces, members, .. } = level;
        members.clear();
        self.stamp += 1;
        let fault = self.walk.placed.fault;
        let grown = |half: i32| {
            let points = [is_planted!(fault, DepthAtCentre), is_planted!(fault, PlaneWithoutReach)];
            if points.contains(&true) { 0.0 } else { f64::from(half + REACH) }
        };
        let (half, half_of_quarter) = (grown(square.half), grown(square.half / 2));
        let squares = square.quarters();
        let size = (square.half / 2, square.half / 2 + self.reach);
        let mut found = known;
        for (piece, windings) in pieces.iter().copied() {
            let facet = &self.meeting.pieces[piece as usize].facet;
            if facet.nearest >= f64::from(bound) {
                continue;
            }
            let (far, near) = facet.range(square.centre[0], square.centre[1], half);
            #[expect(clippy::cast_possible_truncation, reason = "for a choice alone")]
            let near = near as f32;
            if near >= bound {
                continue;
            }
            let winding = windings[which];
            let mut quarters = [0; 4];
            if splits {
                let inside;
                (quarters, inside) = self.meeting.around(piece, square.centre, size);
                for k in 0..4 {
                    let [x, y] = squares[k].centre;
                    if quarters[k] != 0 {
                        #[expect(clippy::cast_possible_truncation, reason = "for a choice alone")]
                        let at = facet.at_point(x, y) as f32;
                        found.floors[k] = found.floors[k].min(at);
                    }
                    let is_alone = if is_planted!(fault, CentreForQuarter) {
                        quarters[k] != 0
                    } else {
                        inside[k]
                    };
                    if is_alone {
                        let far = Facet::rounded(facet.range(x, y, half_of_quarter).0, fault);
                        found.alone[k] = found.alone[k].min(far);
                    }
                }
            }
            let own = Sums { winding, far: Facet::rounded(far, fault), ..Sums::NOTHING };
            let parent = members.len() as u32;
            self.places[piece as usize] = parent;
            self.stamps[piece as usize] = self.stamp;
            let is_met = winding != 0;
            members.push(Member { piece, parent, near, own, quarters, is_met, covers: false });
        }
        found
    }

    /// Joins the members that meet at an edge in a square.
    fn join_members(&mut self, level: &mut Level, square: Square) {
        let Level { edges, members, met, folds, .. } = level;
        met.clear();
        folds.clear();
        let fault = self.walk.placed.fault;
        // All that is here meets the pixel itself, but not each part of it.
        let is_part = square.half != UNITS / 2;
        for number in edges.iter().copied() {
            let edge = &self.meeting.edges[number as usize];
            let known = |piece: u32| piece != NO_PIECE && self.stamps[piece as usize] == self.stamp;
            let is_known = edge.pieces.map(known);
            if is_known == [false; 2] || (is_part && !square.is_met(edge.ends, self.reach)) {
                continue;
            }
            met.push(number);
            let place = |k: usize| self.places[edge.pieces[k] as usize];
            if is_known == [true; 2] {
                let both = [place(0), place(1)];
                both.iter().for_each(|i| members[*i as usize].is_met = true);
                if !edge.is_fold || is_planted!(fault, FoldsIgnored) {
                    unite(members, both);
                } else {
                    both.iter().for_each(|i| members[*i as usize].own.is_folded = true);
                    folds.push(both);
                }
            } else {
                let member = &mut members[place(usize::from(is_known[1])) as usize];
                member.is_met = true;
                member.own.is_open |= !is_planted!(fault, ContoursIgnored);
            }
        }
    }

    /// The farthest of the quarters, if that is nearer than `best`, which holds for all of them.
    fn by_quarters(
        &mut self,
        depth: usize,
        (level, quarters): (&Level, &Quarters),
        square: Square,
        (best, is_found): (f32, bool),
        refinement: u32,
    ) -> f32 {
        let hopeful = level.members.iter().filter(|m| m.is_met && m.near < best);
        // What solids show may be nearer than what covers all of the square.
        let is_known = self.known.is_some() && quarters.alone.iter().any(|alone| *alone < best);
        if !is_known && hopeful.clone().all(|m| m.covers) {
            return best;
        }
        if self.levels.len() == depth + 1 {
            self.levels.push(Level::default());
        }
        let next = &mut self.levels[depth + 1];
        next.pieces.clear();
        next.pieces.extend(hopeful.map(|m| (m.piece, m.quarters)));
        next.edges.clone_from(&level.met);
        // The farthest comes first, since it decides.
        let mut order = [0, 1, 2, 3];
        let Quarters { floors, alone } = quarters;
        order.sort_unstable_by(|a, b| floors[*b].total_cmp(&floors[*a]));
        let squares = square.quarters();
        let mut most = f32::NEG_INFINITY;
        for k in order {
            // What is nearer than the farthest quarter gains nothing.
            let (bound, is_found) = (best.min(alone[k]), is_found || alone[k] < best);
            let far = if bound <= most || !self.is_worth_it(floors[k], bound, is_found) {
                bound
            } else {
                let quarter = (squares[k], k);
                self.blocked(depth + 1, quarter, (bound, is_found), refinement - 1)
            };
            if far >= best {
                return best;
            }
            most = most.max(far);
        }
        most
    }
}

/// What single facets tell of the quarters of a square.
#[derive(Debug, Clone, Copy)]
struct Quarters {
    /// About the nearest depths at their centres.
    ///
    /// What covers a square or a quarter of it covers the quarter's centre.
    /// So nothing is shown that is nearer than the farthest of them.
    floors: [f32; 4],
    /// Every ray through a quarter is blocked at this depth or before, by one facet that covers the
    /// quarter as a whole.
    alone: [f32; 4],
}

impl Quarters {
    const NOTHING: Self = Self { floors: [f32::INFINITY; 4], alone: [f32::INFINITY; 4] };

    fn floor(&self) -> f32 {
        self.floors.into_iter().fold(f32::NEG_INFINITY, f32::max)
    }

    fn farthest(&self) -> f32 {
        self.alone.into_iter().fold(f32::NEG_INFINITY, f32::max)
    }
}

impl Level {
    /// The depth of the nearest sheet that covers the square, if it is nearer than `bound`.
    fn nearest_sheet(&mut self, bound: f32) -> f32 {
        let closed = |sums: &Sums| !sums.is_open && !sums.is_folded && sums.winding != 0;
        let best = bound.min(self.nearest(closed));
        if self.folds.is_empty() {
            return best;
        }
        for pair in &self.folds {
            unite(&mut self.members, *pair);
        }
        // Across folds the senses disagree, so only the winding's parity is constant.
        best.min(self.nearest(|sums| !sums.is_open && sums.winding % 2 != 0))
    }

    /// The least depth of the sheets for which `covers` holds; marks their members.
    fn nearest(&mut self, covers: impl Fn(&Sums) -> bool) -> f32 {
        let members = &mut self.members;
        self.sheets.clear();
        for i in 0..members.len() {
            // Parents come before their children, so the parent's parent is its head.
            let head = members[members[i].parent as usize].parent;
            members[i].parent = head;
            let own = members[i].own;
            self.sheets.push(own);
            if head as usize == i {
                continue;
            }
            let sum = &mut self.sheets[head as usize];
            sum.winding += own.winding;
            sum.is_open |= own.is_open;
            sum.is_folded |= own.is_folded;
            sum.far = sum.far.max(own.far);
        }
        let mut least = f32::INFINITY;
        for member in members {
            let sheet = &self.sheets[member.parent as usize];
            if covers(sheet) {
                member.covers = true;
                least = least.min(sheet.far);
            }
        }
        least
    }
}

/// The head of a member's sheet; shortens the way to it.
fn head(members: &mut [Member], mut i: u32) -> u32 {
    loop {
        let parent = members[i as usize].parent;
        if parent == i {
            return i;
        }
        let next = members[parent as usize].parent;
        members[i as usize].parent = next;
        i = next;
    }
}

/// The lower index becomes the head; lists are too short to need ranks.
fn unite(members: &mut [Member], pair: [u32; 2]) {
    let [a, b] = pair.map(|i| head(members, i));
    members[a.max(b) as usize].parent = a.min(b);
}
