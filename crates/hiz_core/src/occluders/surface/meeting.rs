//! Which facets and edges meet the open pixels of some rows.

use crate::occluders::surface::coverage::Sides;
use crate::occluders::surface::facets::{Corner, Facet, reach};
use crate::occluders::surface::looks::PixelBox;
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::squares::Squares;
use crate::occluders::surface::walk::{Met, Visitor, Walk};

/// In [`Edge::pieces`]: no facet.
pub(super) const NO_PIECE: u32 = u32::MAX;

/// A facet that meets an open pixel.
#[derive(Debug)]
pub(super) struct Piece {
    pub(super) facet: Facet,
    /// Its first triangle; most have no other.
    corners: [[i32; 2]; 3],
    /// Whether there are more in `Meeting::more`.
    pub(super) has_more: bool,
}

/// An edge that meets an open pixel, of one facet or two.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) ends: [[i32; 2]; 2],
    /// One of them may be [`NO_PIECE`].
    pub(super) pieces: [u32; 2],
    /// Whether both lie on the same side of it.
    pub(super) is_fold: bool,
}

/// What meets the open pixels of some rows.
#[derive(Debug)]
pub(super) struct Meeting<'a> {
    walk: &'a Walk<'a>,
    squares: Squares<'a>,
    /// By pixel: what comes after this is left out.
    bounds: &'a [f32],
    /// By the number of a facet: its piece, or [`NO_PIECE`].
    by_number: Vec<u32>,
    pub(super) pieces: Vec<Piece>,
    /// Further triangles of pieces, sorted by piece.
    more: Vec<(u32, [[i32; 2]; 3])>,
    pub(super) edges: Vec<Edge>,
    /// Pixels and the pieces that cover their centres, and pixels and the edges that meet them.
    covers: Vec<(u32, u32)>,
    borders: Vec<(u32, u32)>,
    /// Half-edges at an edge of more than two facets, in the one direction and in the other.
    halves: [Vec<u32>; 2],
}

/// Lists by pixel.
#[derive(Debug, Default)]
pub(super) struct Lists {
    first: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// Sorts pairs of a pixel and an item by pixel, in one counting pass.
    fn new(pairs: &[(u32, u32)], num_pixels: usize) -> Self {
        let mut first = vec![0; num_pixels + 2];
        for (pixel, _) in pairs {
            first[*pixel as usize + 2] += 1;
        }
        for i in 2..first.len() {
            first[i] += first[i - 1];
        }
        let mut items = vec![0; pairs.len()];
        for (pixel, item) in pairs {
            let next = &mut first[*pixel as usize + 1];
            items[*next as usize] = *item;
            *next += 1;
        }
        Self { first, items }
    }

    pub(super) fn of(&self, pixel: usize) -> &[u32] {
        &self.items[self.first[pixel] as usize..self.first[pixel + 1] as usize]
    }
}

impl<'a> Meeting<'a> {
    /// Finds what meets the open pixels from the first to the last row, and is not beyond the
    /// bounds of these pixels.
    pub(super) fn new(
        walk: &'a Walk<'a>,
        open: &'a OpenPixels,
        rows: [i32; 2],
        bounds: &'a [f32],
    ) -> Self {
        let mut meeting = Self {
            walk,
            bounds,
            squares: Squares::open(open, rows),
            by_number: vec![NO_PIECE; walk.looks.num_facets()],
            pieces: Vec::new(),
            more: Vec::new(),
            edges: Vec::new(),
            covers: Vec::new(),
            borders: Vec::new(),
            halves: Default::default(),
        };
        let is_wanted = |columns, [first, last]: [i32; 2]| {
            open.any(columns, [first.max(rows[0]), last.min(rows[1])])
        };
        walk.visit(|look| is_wanted(look.columns, look.rows), &mut meeting);
        meeting
    }

    /// The pieces that cover the pixels' centres, and the edges that meet the pixels.
    pub(super) fn lists(&self, num_pixels: usize) -> [Lists; 2] {
        [&self.covers, &self.borders].map(|pairs| Lists::new(pairs, num_pixels))
    }

    /// How often a piece winds about a point, if it is turned to the sense +1.
    pub(super) fn winding(&self, piece: u32, point: [i32; 2]) -> i32 {
        let own = &self.pieces[piece as usize];
        let all = std::iter::once(&own.corners).chain(self.more_of(piece));
        let sum: i32 = all.map(|corners| Sides::new(corners, point).winding()).sum();
        sum * i32::from(own.facet.sign)
    }

    /// The same for four points around it, and whether it covers the squares around these as a
    /// whole, see [`Sides::around`].
    #[inline]
    pub(super) fn around(
        &self,
        piece: u32,
        point: [i32; 2],
        (units, half): (i32, i32),
    ) -> ([i32; 4], [bool; 4]) {
        let own = &self.pieces[piece as usize];
        let (mut sums, mut inside) = Sides::new(&own.corners, point).around(units, half);
        if own.has_more {
            // What one part covers, another one may cover turned round.
            inside = [false; 4];
            for corners in self.more_of(piece) {
                let more = Sides::new(corners, point).around(units, half).0;
                sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
            }
        }
        let sign = i32::from(own.facet.sign);
        (sums.map(|sum| sum * sign), inside)
    }

    /// The further triangles of a piece.
    #[inline]
    fn more_of(&self, piece: u32) -> impl Iterator<Item = &[[i32; 2]; 3]> {
        let more = if self.pieces[piece as usize].has_more {
            &self.more[self.more.partition_point(|(of, _)| *of < piece)..]
        } else {
            &[]
        };
        more.iter().take_while(move |(of, _)| *of == piece).map(|(_, corners)| corners)
    }

    /// The piece of a facet.
    fn piece(&mut self, met: Met<'_>) -> u32 {
        if !met.is_there() {
            return NO_PIECE;
        }
        let number = self.walk.looks.number(met.look, met.triangle) as usize;
        let known = self.by_number[number];
        if known != NO_PIECE {
            return known;
        }
        let own = self.pieces.len() as u32;
        self.by_number[number] = own;
        let (look, triangle) = (&self.walk.looks.all[met.look as usize], met.triangle);
        let (mut first, before) = (None, self.more.len());
        look.for_each_part(&self.walk.placed, triangle, |corners| {
            let corners = corners.map(|c| [c.x, c.y]);
            if first.is_none() {
                first = Some(corners);
            } else {
                self.more.push((own, corners));
            }
        });
        let has_more = before < self.more.len();
        // A facet that is there has a triangle.
        let corners = first.unwrap_or_default();
        let facet = look.facets[usize::from(triangle)];
        self.pieces.push(Piece { facet, corners, has_more });
        own
    }

    fn fault(&self) -> Planted {
        self.walk.placed.fault
    }

    /// Notes an edge in the pixels that it meets.
    fn meet(&mut self, [a, b]: [Corner; 2], one: Met<'_>, other: Met<'_>, is_fold: bool) {
        let first = self.borders.len();
        let (number, borders) = (self.edges.len() as u32, &mut self.borders);
        let (bounds, nearest) = (self.bounds, one.facet.nearest.min(other.facet.nearest));
        self.squares.for_each_met([a, b], reach(self.walk.placed.fault), |square| {
            if nearest < f64::from(bounds[square.number]) {
                borders.push((square.number as u32, number));
            }
        });
        if first < self.borders.len() {
            let pieces = [self.piece(one), self.piece(other)];
            let is_fold = is_fold && !is_planted!(self.fault(), FoldsCancel);
            self.edges.push(Edge { ends: [[a.x, a.y], [b.x, b.y]], pieces, is_fold });
        }
    }
}

impl Visitor for Meeting<'_> {
    #[inline]
    fn asks(&self, around: &PixelBox) -> bool {
        self.squares.any_of(around)
    }

    #[inline]
    fn wants(&self, ends: &[Corner; 2]) -> bool {
        self.squares.any(ends)
    }

    #[inline]
    fn cover(&mut self, met: Met<'_>, corners: [Corner; 3]) {
        let first = self.covers.len();
        let (covers, bounds, nearest) = (&mut self.covers, self.bounds, met.facet.nearest);
        let is_wanted = |number: usize| nearest < f64::from(bounds[number]);
        self.squares.for_each_covered(corners, is_wanted, |square| {
            covers.push((square.number as u32, 0));
        });
        if first < self.covers.len() {
            let piece = self.piece(met);
            self.covers[first..].iter_mut().for_each(|pair| pair.1 = piece);
        }
    }

    #[inline]
    fn border(&mut self, ends: [Corner; 2], one: Met<'_>, other: Met<'_>, is_along: bool) {
        // Turned to the same sense, facets on different sides run in opposite directions.
        let is_fold = (one.facet.sign == other.facet.sign) == is_along;
        self.meet(ends, one, other, is_fold);
    }

    /// Pairs the facets: those on different sides first, then the rest by twos.
    ///
    /// Any pairing is valid, and what is left over has the edge as a border.
    #[cold]
    fn many(&mut self, ends: [Corner; 2], around: &[(Met<'_>, bool)]) {
        let mut sides = std::mem::take(&mut self.halves);
        sides.iter_mut().for_each(Vec::clear);
        for (i, (met, is_along)) in (0..).zip(around) {
            sides[usize::from(*is_along == (met.facet.sign > 0))].push(i);
        }
        let met = |i: u32| around[i as usize].0;
        let [left, right] = &sides;
        let both = left.len().min(right.len());
        for (one, other) in left.iter().zip(right) {
            self.meet(ends, met(*one), met(*other), false);
        }
        for rest in left[both..].chunks(2).chain(right[both..].chunks(2)) {
            let other = rest.get(1).map_or(Met::NOTHING, |i| met(*i));
            self.meet(ends, met(rest[0]), other, true);
        }
        self.halves = sides;
    }
}
