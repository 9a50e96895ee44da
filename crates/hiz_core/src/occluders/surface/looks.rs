//! The meshlets that one image looks at, with their triangles in the rounded image.
//!
//! What is outside of the view, or behind every depth that is tried, is left out.
//! That needs no proof: a triangle that is left out makes its neighbours' edges borders.

use crate::host::linear::{Vec3, dot};
use crate::host::threads::{on_threads, worth_it};
use crate::host::vectors::widest;
use crate::input::camera::Camera;
use crate::input::image::{ImageSize, MAX_IMAGE_SIDE};
use crate::input::mesh::FaceCull;
use crate::occluders::placement::{Placement, box_corner};
use crate::occluders::shapes::Shapes;
use crate::occluders::surface::coverage::pixels;
use crate::occluders::surface::facets::{
    Corner, Facet, REACH, Rounder, Segment, UNITS, Vertex, occludes,
};
use crate::occluders::surface::left_out::LeftOut;
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::projector::Projector;
use crate::occluders::surface::solids::Solids;
use crate::occluders::surface::square::Point;
use crate::occluders::surface::topology::{Edge, NO_EDGE, Topology};

/// The side in pixels of the tiles by which what is hidden is found.
pub(super) const TILE: u32 = 8;
/// In [`Looks::of_copy`]: a meshlet that nobody looks at.
const NO_LOOK: u32 = u32::MAX;
/// How many meshlets a thread takes at once.
const PART: usize = 8;
/// Nanoseconds that looking at a meshlet takes.
const PER_MESHLET: u64 = 8_000;

/// By tile: the farthest depth that any of its pixels tries.
#[derive(Debug)]
pub(super) struct Tiles {
    columns: usize,
    last: Vec<f32>,
}

impl Tiles {
    /// Tiles whose pixels try nothing.
    pub(super) fn closed(size: ImageSize) -> Self {
        let [columns, rows] = [size.width, size.height].map(|side| side.div_ceil(TILE) as usize);
        Self { columns, last: vec![f32::NEG_INFINITY; columns * rows] }
    }

    /// From the farthest depths that some pixels try.
    pub(super) fn of(pixels: impl Iterator<Item = (u32, f32)>, size: ImageSize) -> Self {
        let mut tiles = Self::closed(size);
        for (pixel, last) in pixels {
            let [x, y] = [pixel % size.width, pixel / size.width].map(|v| (v / TILE) as usize);
            let tile = &mut tiles.last[y * tiles.columns + x];
            *tile = tile.max(last);
        }
        tiles
    }

    /// The rows of tiles.
    pub(super) fn lines_mut(&mut self) -> impl Iterator<Item = &mut [f32]> + Send {
        self.last.chunks_mut(self.columns)
    }

    /// Tiles that hide nothing.
    pub(super) fn open(size: ImageSize) -> Self {
        let [columns, rows] = [size.width, size.height].map(|side| side.div_ceil(TILE) as usize);
        Self { columns, last: vec![f32::INFINITY; columns * rows] }
    }

    /// Whether something as near as `far` is behind all that the pixels try.
    ///
    /// Columns and rows of pixels are the least and the greatest, both within the image.
    #[inline]
    pub(super) fn hide(&self, far: f64, [x0, x1]: [i32; 2], [y0, y1]: [i32; 2]) -> bool {
        let tile = |v: i32| v.cast_unsigned() as usize / TILE as usize;
        (tile(y0)..=tile(y1)).all(|row| {
            let line = &self.last[row * self.columns..][..self.columns];
            line[tile(x0)..=tile(x1)].iter().all(|last| far > f64::from(*last))
        })
    }

    /// The farthest depth that the tile of a pixel tries.
    #[inline]
    pub(super) fn last(&self, x: i32, y: i32) -> f32 {
        let tile = |v: i32| v.cast_unsigned() as usize / TILE as usize;
        self.last[tile(y) * self.columns + tile(x)]
    }
}

/// What is looked at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sought<'a> {
    /// What they hide is not.
    pub(super) tiles: &'a Tiles,
    /// Only what may meet one of these pixels is, if there are any.
    pub(super) open: Option<&'a OpenPixels>,
    /// What stands for triangles is not, either.
    pub(super) left_out: Option<&'a LeftOut<'a>>,
}

impl Sought<'_> {
    /// Whether something as near as `far` is left out.
    ///
    /// Columns and rows of pixels are the least and the greatest, both within the image.
    #[inline]
    pub(super) fn excludes(&self, far: f64, columns: [i32; 2], rows: [i32; 2]) -> bool {
        self.open.is_some_and(|open| !open.any(columns, rows))
            || self.tiles.hide(far, columns, rows)
    }
}

/// Open pixels of which the nearest facets are wanted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted<'a> {
    pub(super) open: &'a OpenPixels,
    /// What they hide is not wanted.
    pub(super) tiles: &'a Tiles,
    /// The first and the last row of the open pixels that count.
    pub(super) rows: [i32; 2],
}

/// The first and the last column and row of pixels that something may meet.
///
/// The first is after the last if there are none.
#[derive(Debug, Clone, Copy)]
pub(super) struct PixelBox {
    columns: [u16; 2],
    rows: [u16; 2],
}

const _: () = assert!(MAX_IMAGE_SIDE <= 1 << u16::BITS);

impl PixelBox {
    const NOTHING: Self = Self { columns: [1, 0], rows: [1, 0] };

    /// From columns and rows within an image.
    #[inline]
    fn new(columns: [i32; 2], rows: [i32; 2]) -> Self {
        if columns[0] > columns[1] || rows[0] > rows[1] {
            return Self::NOTHING;
        }
        let [columns, rows] = [columns, rows].map(|range| range.map(|place| place as u16));
        Self { columns, rows }
    }

    #[inline(always)]
    pub(super) fn columns(&self) -> [i32; 2] {
        self.columns.map(i32::from)
    }

    #[inline(always)]
    pub(super) fn rows(&self) -> [i32; 2] {
        self.rows.map(i32::from)
    }
}

/// A triangle that was cut, in the rounded image.
#[derive(Debug, Clone)]
pub(super) struct Polygon {
    /// The triangle, by its number in the meshlet.
    pub(super) triangle: u8,
    count: u8,
    corners: [Corner; 6],
    /// Bit k: the side from corner k to the next one is a part of a side of the triangle.
    /// The others are cuts, which have no neighbour.
    shared: u8,
}

impl Polygon {
    pub(super) fn corners(&self) -> &[Corner] {
        &self.corners[..usize::from(self.count)]
    }

    /// Its triangles.
    pub(super) fn fan(&self) -> impl Iterator<Item = [Corner; 3]> {
        let corners = self.corners();
        corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]])
    }

    /// The sides without a neighbour.
    pub(super) fn cuts(&self) -> impl Iterator<Item = [Corner; 2]> {
        let count = usize::from(self.count);
        (0..count)
            .filter(|k| self.shared >> k & 1 == 0)
            .map(move |k| [self.corners[k], self.corners[(k + 1) % count]])
    }
}

/// A meshlet in the image.
#[derive(Debug)]
pub(super) struct Look {
    /// The copy of a mesh, by its place in the list of placements.
    pub(super) copy: u32,
    pub(super) meshlet: u32,
    /// The first and the last column and row of pixels that its facets and their edges may meet.
    pub(super) columns: [i32; 2],
    pub(super) rows: [i32; 2],
    pub(super) vertices: Vec<Vertex>,
    /// By triangle of the meshlet.
    pub(super) facets: Vec<Facet>,
    /// By triangle of the meshlet: the pixels that its facet and its edges may meet.
    boxes: Vec<PixelBox>,
    /// Bit k: facet k is there.
    there: u128,
    /// Bit k: facet k is there, and was cut.
    cut: u128,
    pub(super) polygons: Vec<Polygon>,
}

/// All meshlets that are looked at.
#[derive(Debug)]
pub(super) struct Looks {
    pub(super) all: Vec<Look>,
    /// By copy: where its meshlets begin in `by_meshlet`, less the number of its first meshlet.
    of_copy: Vec<u32>,
    by_meshlet: Vec<u32>,
    /// By look: the number of its first facet; one more entry for all of them.
    first_facet: Vec<u32>,
    /// Whether a triangle was left out since float64 is not sure enough of it.
    pub(super) has_uncertain: bool,
}

/// What all of this is made from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed<'a> {
    pub(super) shapes: &'a Shapes,
    pub(super) placements: &'a [Placement],
    pub(super) topology: &'a Topology,
    pub(super) solids: &'a Solids,
    /// The faces that do not occlude, as this camera sees them.
    pub(super) culled: FaceCull,
    pub(super) fault: Planted,
}

impl Placed<'_> {
    /// The world position of a vertex of a copy's mesh.
    #[inline]
    pub(super) fn world(&self, copy: u32, vertex: u32) -> Vec3 {
        self.placements[copy as usize].world(self.shapes.positions[vertex as usize])
    }
}

impl Looks {
    /// Looks at what is in the view of `camera` and sought.
    pub(super) fn new(
        placed: &Placed<'_>,
        camera: &Camera,
        rounder: &Rounder,
        sought: &Sought<'_>,
    ) -> Self {
        let mut looks = Self {
            all: Vec::new(),
            of_copy: Vec::new(),
            by_meshlet: Vec::new(),
            first_facet: vec![0],
            has_uncertain: false,
        };
        for placement in placed.placements {
            let meshlets = &placed.shapes.meshes[placement.mesh as usize].meshlets;
            let before = looks.by_meshlet.len();
            looks.of_copy.push((before as u32).wrapping_sub(meshlets.start));
            looks.by_meshlet.resize(before + meshlets.len(), NO_LOOK);
        }
        looks.add(placed, camera, rounder, sought);
        looks
    }

    /// Looks at what is sought besides.
    ///
    /// What is there stays, and so do the numbers of the facets.
    pub(super) fn add(
        &mut self,
        placed: &Placed<'_>,
        camera: &Camera,
        rounder: &Rounder,
        sought: &Sought<'_>,
    ) {
        let size = camera.size();
        let mut is_asked = vec![false; self.all.len()];
        let mut slots = self.by_meshlet.iter_mut();
        for (copy, placement) in (0..).zip(placed.placements) {
            let lens = Lens::new(&rounder.projector, placement, size);
            let meshlets = &placed.shapes.meshes[placement.mesh as usize].meshlets;
            for (meshlet, slot) in meshlets.clone().zip(&mut slots) {
                let it = &placed.shapes.meshlets[meshlet as usize];
                let is_replaced = sought.left_out.is_some_and(|all| all.has_all_of(copy, meshlet));
                if is_replaced || !lens.sees(it.min, it.max, sought) {
                    continue;
                }
                if *slot == NO_LOOK {
                    let count = self.all.len();
                    *slot = count as u32;
                    self.first_facet.push(self.first_facet[count] + it.triangles.len() as u32);
                    self.all.push(Look::new(copy, meshlet));
                    is_asked.push(true);
                } else {
                    is_asked[*slot as usize] = true;
                }
            }
        }
        let count = is_asked.iter().filter(|is_asked| **is_asked).count() as u64;
        on_threads(
            worth_it(PER_MESHLET * count),
            self.all.chunks_mut(PART).zip(is_asked.chunks(PART)),
            |(part, asked)| {
                for (look, _) in part.iter_mut().zip(asked).filter(|(_, is_asked)| **is_asked) {
                    look.fill(placed, rounder, sought, size);
                }
            },
        );
        let is_uncertain = |vertex: &Vertex| matches!(vertex, Vertex::Uncertain);
        self.has_uncertain = self.all.iter().any(|look| look.vertices.iter().any(is_uncertain));
    }

    /// The place of a meshlet of a copy in the list of all, if it is looked at.
    #[inline]
    pub(super) fn find(&self, copy: u32, meshlet: u32) -> Option<u32> {
        let place = self.of_copy[copy as usize].wrapping_add(meshlet);
        Some(self.by_meshlet[place as usize]).filter(|look| *look != NO_LOOK)
    }

    /// The number of the facet of a triangle of a look.
    #[inline]
    pub(super) fn number(&self, look: u32, triangle: u8) -> u32 {
        self.first_facet[look as usize] + u32::from(triangle)
    }

    /// How many numbers there are.
    pub(super) fn num_facets(&self) -> usize {
        self.first_facet[self.all.len()] as usize
    }
}

impl Look {
    fn new(copy: u32, meshlet: u32) -> Self {
        let (vertices, facets, boxes, polygons) = Default::default();
        Self {
            copy,
            meshlet,
            columns: [0, -1],
            rows: [0, -1],
            vertices,
            facets,
            boxes,
            polygons,
            there: 0,
            cut: 0,
        }
    }

    /// Whether what is spanned by some vertices is wanted.
    pub(super) fn is_wanted(
        &self,
        wanted: &Wanted<'_>,
        vertices: impl IntoIterator<Item = usize>,
    ) -> bool {
        let mut nearest = f64::INFINITY;
        let mut extent = [i32::MAX, i32::MIN, i32::MAX, i32::MIN];
        for vertex in vertices.into_iter().map(|v| self.vertices[v]) {
            // What is cut or uncertain may meet anything.
            let Vertex::Inside(corner) = vertex else { return true };
            extent = [
                extent[0].min(corner.x),
                extent[1].max(corner.x),
                extent[2].min(corner.y),
                extent[3].max(corner.y),
            ];
            nearest = nearest.min(corner.far);
        }
        let ImageSize { width, height } = wanted.open.size();
        let columns = pixels(extent[0], extent[1], width.cast_signed());
        let rows = pixels(extent[2], extent[3], height.cast_signed());
        let rows = [rows[0].max(wanted.rows[0]), rows[1].min(wanted.rows[1])];
        wanted.open.any(columns, rows) && !wanted.tiles.hide(nearest, columns, rows)
    }

    /// Which facets that are there have pixels that are `wanted`: bit k for facet k.
    #[inline(always)]
    pub(super) fn within(&self, wanted: impl Fn(&PixelBox) -> bool) -> u128 {
        let (mut left, mut found) = (self.there, 0);
        while left != 0 {
            let triangle = left.trailing_zeros();
            left &= left - 1;
            found |= u128::from(wanted(&self.boxes[triangle as usize])) << triangle;
        }
        found
    }

    /// Calls `each` for the triangles of some facets that are there: bit k for facet k.
    ///
    /// A facet is told by its triangle in the meshlet.
    #[inline(always)]
    pub(super) fn for_each_triangle(
        &self,
        placed: &Placed<'_>,
        facets: u128,
        mut each: impl FnMut(u8, &Facet, [Corner; 3]),
    ) {
        let triangles = &placed.shapes.meshlets[self.meshlet as usize].triangles;
        let is_mirrored = placed.placements[self.copy as usize].mirrored;
        let corners = placed.topology.corners(triangles);
        let mut left = facets;
        while left != 0 {
            let triangle = left.trailing_zeros() as u8;
            left &= left - 1;
            let facet = &self.facets[usize::from(triangle)];
            if facet.is_cut {
                continue;
            }
            if let Some(corners) = self.corners(corners[usize::from(triangle)], is_mirrored) {
                each(triangle, facet, corners);
            }
        }
        for polygon in &self.polygons {
            let facet = &self.facets[usize::from(polygon.triangle)];
            if facets >> (polygon.triangle & 127) & 1 != 0 {
                polygon.fan().for_each(|corners| each(polygon.triangle, facet, corners));
            }
        }
    }

    /// As [`Look::for_each_triangle`], for one facet that is there.
    pub(super) fn for_each_part(
        &self,
        placed: &Placed<'_>,
        triangle: u8,
        mut each: impl FnMut([Corner; 3]),
    ) {
        if self.facets[usize::from(triangle)].is_cut {
            let own = self.polygons.iter().filter(|polygon| polygon.triangle == triangle);
            own.for_each(|polygon| polygon.fan().for_each(&mut each));
            return;
        }
        let triangles = &placed.shapes.meshlets[self.meshlet as usize].triangles;
        let corners = placed.topology.corners(triangles)[usize::from(triangle)];
        let is_mirrored = placed.placements[self.copy as usize].mirrored;
        self.corners(corners, is_mirrored).into_iter().for_each(each);
    }

    /// The corners of a triangle, none of which is cut off.
    #[inline(always)]
    fn corners(&self, corners: [u8; 3], is_mirrored: bool) -> Option<[Corner; 3]> {
        match corners.map(|v| &self.vertices[usize::from(v)]) {
            [Vertex::Inside(a), Vertex::Inside(b), Vertex::Inside(c)] => {
                Some(if is_mirrored { [*a, *c, *b] } else { [*a, *b, *c] })
            }
            _ => None,
        }
    }

    /// Whether the facet of a triangle of the meshlet is there.
    #[inline]
    pub(super) fn has(&self, triangle: u8) -> bool {
        self.there >> (triangle & 127) & 1 != 0
    }

    /// The facets that are there, whole, and not some of `near`: bit k for facet k.
    ///
    /// The ends of their edges are their corners, so the edges meet no pixel that the facets' boxes
    /// have not.
    #[inline(always)]
    pub(super) fn beyond(&self, near: u128) -> u128 {
        self.there & !near & !self.cut
    }

    /// The ends of an edge, if none is cut off.
    #[inline(always)]
    pub(super) fn inside(&self, edge: &Edge) -> Option<[Corner; 2]> {
        match edge.ends.map(|v| &self.vertices[usize::from(v)]) {
            [Vertex::Inside(a), Vertex::Inside(b)] => Some([*a, *b]),
            _ => None,
        }
    }

    /// Whether it meets any row from the first to the last one.
    pub(super) fn is_in_rows(&self, [first, last]: [i32; 2]) -> bool {
        self.rows[0] <= last && self.rows[1] >= first
    }

    /// Rounds the vertices and makes the facets that are sought and not there.
    fn fill(
        &mut self,
        placed: &Placed<'_>,
        rounder: &Rounder,
        sought: &Sought<'_>,
        size: ImageSize,
    ) {
        let placement = &placed.placements[self.copy as usize];
        let size = [size.width, size.height].map(u32::cast_signed);
        let world = |v: &u32| placement.world(placed.shapes.positions[*v as usize]);
        let vertices = placed.topology.vertices(self.meshlet);
        let mut points: Vec<Point> = Vec::new();
        if self.vertices.is_empty() || placed.culled != FaceCull::None {
            self.vertices.clear();
            self.vertices.reserve_exact(vertices.len());
            widest(
                #[inline(always)]
                || {
                    for vertex in vertices {
                        let (vertex, point) = rounder.vertex(world(vertex));
                        self.vertices.push(vertex);
                        if placed.culled != FaceCull::None {
                            points.push(point);
                        }
                    }
                },
            );
        }
        let triangles = &placed.shapes.meshlets[self.meshlet as usize].triangles;
        let sides = placed.topology.sides(triangles);
        self.facets.resize(sides.len(), Facet::NOTHING);
        self.boxes.resize(sides.len(), PixelBox::NOTHING);
        let left_out = sought.left_out.map_or(0, |all| all.among(self.copy, triangles));
        let mut extent = Extent::NOTHING;
        for (t, (corners, sides)) in
            placed.topology.corners(triangles).iter().zip(sides).enumerate()
        {
            if (self.there | left_out) >> t & 1 != 0 {
                continue;
            }
            let [a, b, c] = *corners;
            let [a, b, c] = if placement.mirrored { [a, c, b] } else { [a, b, c] }.map(usize::from);
            let (mut facet, mut around) = (Facet::NOTHING, Extent::NOTHING);
            match [a, b, c].map(|v| self.vertices[v]) {
                _ if sides[0] == NO_EDGE => {}
                [Vertex::Inside(p), Vertex::Inside(q), Vertex::Inside(r)] => {
                    let faces = || {
                        placed.culled == FaceCull::None
                            || occludes([a, b, c].map(|v| &points[v]), placed.culled, placed.fault)
                    };
                    if is_met([p, q, r], size, sought) && faces() {
                        around.add(&[p, q, r]);
                        facet = Facet::new(&[p, q, r], size);
                    }
                }
                [Vertex::Uncertain, ..] | [_, Vertex::Uncertain, _] | [.., Vertex::Uncertain] => {}
                _ => {
                    let ends = [a, b, c].map(|v| (self.vertices[v], world(&vertices[v])));
                    if let Some(polygon) = cut(ends, t as u8, rounder, placed.culled, placed.fault)
                    {
                        facet = Facet::new(polygon.corners(), size);
                        facet.is_cut = true;
                        around.add(polygon.corners());
                        self.polygons.push(polygon);
                    }
                }
            }
            if facet.is_there() {
                self.there |= 1 << t;
                self.cut |= u128::from(facet.is_cut) << t;
                self.facets[t] = facet;
                let (columns, rows) = around.pixels(size);
                let is_whole = !is_planted!(placed.fault, BoxesTooSmall);
                let last = |[first, last]: [i32; 2]| {
                    [first, if is_whole { last } else { first.min(last) }]
                };
                self.boxes[t] = PixelBox::new(last(columns), last(rows));
                extent.join(&around);
            }
        }
        if extent.x[0] <= extent.x[1] {
            let (columns, rows) = extent.pixels(size);
            self.columns = joined(self.columns, columns);
            self.rows = joined(self.rows, rows);
        }
    }
}

/// The least range around two, of which the first is after the last in one that is empty.
fn joined(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    if a[0] > a[1] {
        b
    } else if b[0] > b[1] {
        a
    } else {
        [a[0].min(b[0]), a[1].max(b[1])]
    }
}

/// The least and the greatest coordinates of some corners.
#[derive(Debug, Clone, Copy)]
struct Extent {
    x: [i32; 2],
    y: [i32; 2],
}

impl Extent {
    const NOTHING: Self = Self { x: [i32::MAX, i32::MIN], y: [i32::MAX, i32::MIN] };

    #[inline]
    fn add(&mut self, corners: &[Corner]) {
        for corner in corners {
            self.x = [self.x[0].min(corner.x), self.x[1].max(corner.x)];
            self.y = [self.y[0].min(corner.y), self.y[1].max(corner.y)];
        }
    }

    #[inline]
    fn join(&mut self, other: &Self) {
        self.x = [self.x[0].min(other.x[0]), self.x[1].max(other.x[1])];
        self.y = [self.y[0].min(other.y[0]), self.y[1].max(other.y[1])];
    }

    /// The columns and rows of an image of this size that it may meet.
    #[inline]
    fn pixels(&self, size: [i32; 2]) -> ([i32; 2], [i32; 2]) {
        (pixels(self.x[0], self.x[1], size[0]), pixels(self.y[0], self.y[1], size[1]))
    }
}

/// Whether a triangle may meet the image where it is not hidden.
#[inline]
fn is_met([p, q, r]: [Corner; 3], size: [i32; 2], sought: &Sought<'_>) -> bool {
    let x = pixels(p.x.min(q.x).min(r.x), p.x.max(q.x).max(r.x), size[0]);
    let y = pixels(p.y.min(q.y).min(r.y), p.y.max(q.y).max(r.y), size[1]);
    x[0] <= x[1] && y[0] <= y[1] && !sought.excludes(p.far.min(q.far).min(r.far), x, y)
}

/// What is left of a triangle with corners outside, from what is left of its sides.
fn cut(
    ends: [(Vertex, Vec3); 3],
    triangle: u8,
    rounder: &Rounder,
    culled: FaceCull,
    fault: Planted,
) -> Option<Polygon> {
    let mut polygon = Polygon { triangle, count: 0, corners: Default::default(), shared: 0 };
    let mut push = |corner, is_shared: bool| {
        polygon.corners[usize::from(polygon.count)] = corner;
        polygon.shared |= u8::from(is_shared) << polygon.count;
        polygon.count += 1;
    };
    for k in 0..3 {
        let (a, b) = (ends[k].0, ends[(k + 1) % 3].0);
        let segment = match (a, b) {
            (Vertex::Inside(p), Vertex::Inside(q)) => Segment::Between(p, q),
            _ => rounder.segment(ends[k], ends[(k + 1) % 3]),
        };
        match segment {
            Segment::Uncertain => return None,
            Segment::Nothing => {}
            Segment::Between(p, q) => {
                push(p, true);
                if !matches!(b, Vertex::Inside(_)) {
                    push(q, false);
                }
            }
        }
    }
    if polygon.count < 3 {
        return None;
    }
    let unit = 1.0 / f64::from(UNITS);
    let point = |c: &Corner| Point {
        x: f64::from(c.x) * unit,
        y: f64::from(c.y) * unit,
        far: c.far,
        margin: unit * f64::from(REACH),
        far_error: 0.0,
    };
    let points: Vec<Point> = polygon.corners().iter().map(point).collect();
    let faces = points[1..]
        .windows(2)
        .any(|pair| occludes([&points[0], &pair[0], &pair[1]], culled, fault));
    faces.then_some(polygon)
}

/// A camera in the space of one copy of a mesh, in float64 without a proof.
pub(super) struct Lens {
    /// `clip = rows * (p, 1)` with x, y, far and w.
    rows: [[f64; 4]; 4],
    near: f64,
    half: [f64; 2],
    size: [i32; 2],
}

impl Lens {
    pub(super) fn new(projector: &Projector, placement: &Placement, size: ImageSize) -> Self {
        let rows = projector.rows().map(|row| {
            let linear = [row[0], row[1], row[2]];
            let along = |k: usize| match &placement.matrix {
                None => linear[k],
                Some(m) => dot(linear, [m[k], m[4 + k], m[8 + k]]),
            };
            let origin = placement.world([0.0; 3]);
            let from_origin = std::array::from_fn(|k| origin[k] - projector.origin()[k]);
            [along(0), along(1), along(2), dot(linear, from_origin) + row[3]]
        });
        let size = [size.width, size.height].map(u32::cast_signed);
        Self { rows, near: projector.clipped(), half: projector.half, size }
    }

    /// Whether something in a box may be seen and is sought.
    pub(super) fn sees(&self, min: Vec3, max: Vec3, sought: &Sought<'_>) -> bool {
        let mut outside = [0_u32; 5];
        let mut extent = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        let (mut nearest, mut is_cut) = (f64::INFINITY, false);
        for corner in 0..8 {
            let p = box_corner(min, max, corner);
            let [x, y, far, w] = self.rows.map(|r| dot([r[0], r[1], r[2]], p) + r[3]);
            let is_before = far <= self.near * w || w <= 0.0;
            for (count, is_out) in outside.iter_mut().zip([x < -w, x > w, y < -w, y > w, is_before])
            {
                *count += u32::from(is_out);
            }
            is_cut |= is_before;
            let (px, py) = ((x / w + 1.0) * self.half[0], (1.0 - y / w) * self.half[1]);
            extent = [extent[0].min(px), extent[1].max(px), extent[2].min(py), extent[3].max(py)];
            nearest = nearest.min(far / w);
        }
        if is_cut {
            return !outside.contains(&8);
        }
        let [columns, rows] = self.size;
        let room = 1.0;
        #[expect(clippy::cast_possible_truncation, reason = "`as` saturates")]
        let pixel = |v: f64, last: i32| (v.floor() as i32).clamp(0, last);
        extent[1] > -room
            && extent[0] < f64::from(columns) + room
            && extent[3] > -room
            && extent[2] < f64::from(rows) + room
            && !sought.excludes(
                nearest - 1e-9 * nearest.abs(),
                [pixel(extent[0] - room, columns - 1), pixel(extent[1] + room, columns - 1)],
                [pixel(extent[2] - room, rows - 1), pixel(extent[3] + room, rows - 1)],
            )
    }
}
