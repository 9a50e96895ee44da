//! A walk over the triangles and the edges of the meshlets that are looked at.
//!
//! The proof and the search are two visitors.
//! Each edge is handed out with the facets that meet there, so both of them see the same borders.

use crate::occluders::surface::facets::{Corner, Facet, Rounder, Segment, Vertex};
use crate::occluders::surface::links::Standing;
use crate::occluders::surface::looks::{Look, Looks, PixelBox, Placed};
use crate::occluders::surface::planted_fault::is_planted;
use crate::occluders::surface::topology::Edge;

/// What is walked over.
#[derive(Debug, Clone, Copy)]
pub(super) struct Walk<'a> {
    pub(super) placed: Placed<'a>,
    pub(super) rounder: &'a Rounder,
    pub(super) looks: &'a Looks,
    pub(super) links: &'a Standing<'a>,
}

/// A facet, with its look and its triangle in there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Met<'a> {
    pub(super) facet: &'a Facet,
    pub(super) look: u32,
    pub(super) triangle: u8,
}

impl Met<'_> {
    /// A triangle that is left out.
    pub(super) const NOTHING: Self = Self { facet: &Facet::NOTHING, look: u32::MAX, triangle: 0 };

    #[inline]
    pub(super) fn is_there(&self) -> bool {
        self.facet.is_there()
    }
}

/// What is done with them.
pub(super) trait Visitor {
    /// Whether any pixel in a box is asked about.
    fn asks(&self, around: &PixelBox) -> bool;

    /// Whether an edge with these ends is asked for.
    fn wants(&self, ends: &[Corner; 2]) -> bool;

    /// A triangle of a facet: the whole, or a part of what is left of it.
    fn cover(&mut self, met: Met<'_>, corners: [Corner; 3]);

    /// An edge of one facet or two, of which at least one is there.
    ///
    /// `is_along`: the other one runs along the edge in the same direction.
    fn border(&mut self, ends: [Corner; 2], one: Met<'_>, other: Met<'_>, is_along: bool);

    /// An edge of any number of facets, all of which are there.
    ///
    /// The flags tell whether they run along the edge in one direction or in the other.
    fn many(&mut self, ends: [Corner; 2], around: &[(Met<'_>, bool)]);
}

impl<'a> Walk<'a> {
    /// Hands out the triangles and the edges of the looks that are `wanted`.
    pub(super) fn visit(&self, wanted: impl Fn(&Look) -> bool, visitor: &mut impl Visitor) {
        let mut around = Vec::new();
        for (place, look) in (0..).zip(&self.looks.all).filter(|(_, look)| wanted(look)) {
            let near = look.within(|around| visitor.asks(around));
            look.for_each_triangle(&self.placed, near, |triangle, facet, corners| {
                visitor.cover(Met { facet, look: place, triangle }, corners);
            });
            for polygon in &look.polygons {
                let one = self.met(place, look, polygon.triangle);
                if one.is_there() {
                    polygon.cuts().for_each(|ends| visitor.border(ends, one, Met::NOTHING, false));
                }
            }
            let (has_links, beyond) = (self.links.has_any(look.copy), look.beyond(near));
            for edge in self.placed.topology.edges(look.meshlet) {
                if beyond >> (edge.triangle & 127) & 1 != 0 {
                    debug_assert!(
                        is_planted!(self.placed.fault, BoxesTooSmall)
                            || look.inside(edge).is_some_and(|ends| !visitor.wants(&ends))
                    );
                    continue;
                }
                self.edge((place, look, has_links), edge, &mut around, visitor);
            }
        }
    }

    /// Finds the facets at an edge.
    #[inline]
    fn edge(
        &self,
        (place, look, has_links): (u32, &'a Look, bool),
        edge: &Edge,
        around: &mut Vec<(Met<'a>, bool)>,
        visitor: &mut impl Visitor,
    ) {
        let ends = look.inside(edge);
        // Most edges are dropped here, before it is known what meets there.
        if ends.is_some_and(|ends| !visitor.wants(&ends)) {
            return;
        }
        let neighbours = self.placed.topology.neighbours(edge);
        let is_linked = has_links && self.links.number(look.copy, edge.id).is_some();
        let one = self.met(place, look, edge.triangle);
        let (other, is_along) = match (neighbours, is_linked) {
            ([], false) => (Met::NOTHING, false),
            ([neighbour], false) => {
                let mut other = Met::NOTHING;
                if neighbour.meshlet == look.meshlet {
                    other = self.met(place, look, neighbour.triangle);
                } else if let Some(its) = self.looks.find(look.copy, neighbour.meshlet) {
                    other = self.met(its, &self.looks.all[its as usize], neighbour.triangle);
                    // That meshlet has the edge in its list, too.
                    if other.is_there() && (its < place || !one.is_there()) {
                        return;
                    }
                }
                if is_planted!(self.placed.fault, LeftOutNeighboursIgnored) && !other.is_there() {
                    return;
                }
                (other, neighbour.is_along)
            }
            _ => return self.many(look, edge, one, around, visitor),
        };
        if (one.is_there() || other.is_there())
            && let Some(ends) = ends.or_else(|| self.ends(look, edge))
        {
            visitor.border(ends, one, other, is_along);
        }
    }

    /// The facet of a triangle of a look.
    #[inline]
    fn met(&self, place: u32, look: &'a Look, triangle: u8) -> Met<'a> {
        if !look.has(triangle) {
            return Met::NOTHING;
        }
        let facet = &look.facets[usize::from(triangle)];
        Met { facet, look: place, triangle }
    }

    /// An edge at which more than two triangles may meet.
    #[cold]
    fn many(
        &self,
        look: &'a Look,
        edge: &Edge,
        one: Met<'a>,
        around: &mut Vec<(Met<'a>, bool)>,
        visitor: &mut impl Visitor,
    ) {
        around.clear();
        let mut push = |met: Met<'a>, is_along| {
            if met.is_there() {
                around.push((met, is_along));
            }
        };
        push(one, true);
        let mut add = |copy: u32, meshlet: u32, triangle: u8, is_along: bool| {
            if let Some(place) = self.looks.find(copy, meshlet) {
                push(self.met(place, &self.looks.all[place as usize], triangle), is_along);
            }
        };
        for neighbour in self.placed.topology.neighbours(edge) {
            add(look.copy, neighbour.meshlet, neighbour.triangle, neighbour.is_along);
        }
        self.links.for_each(look, edge, &self.placed, &mut add);
        if !around.is_empty()
            && let Some(ends) = self.ends(look, edge)
        {
            visitor.many(ends, around);
        }
    }

    /// What is left of an edge: the same two points for all its triangles.
    #[inline]
    fn ends(&self, look: &Look, edge: &Edge) -> Option<[Corner; 2]> {
        match edge.ends.map(|v| &look.vertices[usize::from(v)]) {
            [Vertex::Inside(a), Vertex::Inside(b)] => Some([*a, *b]),
            // Then none of the edge's triangles is there.
            [Vertex::Uncertain, _] | [_, Vertex::Uncertain] => None,
            _ => {
                let vertices = self.placed.topology.vertices(look.meshlet);
                let end = |v: u8| {
                    let v = usize::from(v);
                    (look.vertices[v], self.placed.world(look.copy, vertices[v]))
                };
                match self.rounder.segment(end(edge.ends[0]), end(edge.ends[1])) {
                    Segment::Between(a, b) => Some([a, b]),
                    Segment::Nothing | Segment::Uncertain => None,
                }
            }
        }
    }
}
