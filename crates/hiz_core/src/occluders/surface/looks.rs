//! The meshlets that one image looks at, with their triangles in the rounded image.
//!
//! What is outside of the view, or behind every depth that is tried, is left out.
//! That needs no proof: a triangle that is left out makes its neighbours' edges borders.

use crate::host::linear::{Vec3, dot};
use crate::host::threads::{cores, on_threads};
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::input::mesh::FaceCull;
use crate::occluders::placement::{Placement, box_corner};
use crate::occluders::shapes::Shapes;
use crate::occluders::surface::coverage::pixels;
use crate::occluders::surface::facets::{
    Corner, Facet, REACH, Rounder, Segment, UNITS, Vertex, occludes,
};
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::planted_fault::Planted;
use crate::occluders::surface::projector::Projector;
use crate::occluders::surface::square::Point;
use crate::occluders::surface::topology::{NO_EDGE, Topology};

/// The side in pixels of the tiles by which what is hidden is found.
pub(super) const TILE: u32 = 8;
/// In [`Looks::of_copy`]: a meshlet that nobody looks at.
const NO_LOOK: u32 = u32::MAX;
/// How many meshlets a thread takes at once.
const PART: usize = 8;

/// By tile: the farthest depth that any of its pixels tries.
#[derive(Debug)]
pub(super) struct Tiles {
    columns: usize,
    last: Vec<f32>,
}

impl Tiles {
    /// From the farthest depth that each pixel tries.
    pub(super) fn new(pixels: impl Iterator<Item = f32>, size: ImageSize) -> Self {
        let columns = size.width.div_ceil(TILE) as usize;
        let mut last = vec![f32::NEG_INFINITY; columns * size.height.div_ceil(TILE) as usize];
        let (mut x, mut y) = (0, 0);
        for pixel in pixels {
            let tile = &mut last[y / TILE as usize * columns + x / TILE as usize];
            *tile = tile.max(pixel);
            x += 1;
            if x == size.width as usize {
                (x, y) = (0, y + 1);
            }
        }
        Self { columns, last }
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
    fn hide(&self, far: f64, [x0, x1]: [i32; 2], [y0, y1]: [i32; 2]) -> bool {
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

/// Open pixels of which the nearest facets are wanted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted<'a> {
    pub(super) open: &'a OpenPixels,
    /// What they hide is not wanted.
    pub(super) tiles: &'a Tiles,
    /// The first and the last row of the open pixels that count.
    pub(super) rows: [i32; 2],
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
    /// The first and the last row of pixels that its facets and their edges may meet.
    pub(super) rows: [i32; 2],
    pub(super) vertices: Vec<Vertex>,
    /// By triangle of the meshlet.
    pub(super) facets: Vec<Facet>,
    pub(super) polygons: Vec<Polygon>,
}

/// All meshlets that are looked at.
#[derive(Debug)]
pub(super) struct Looks {
    pub(super) all: Vec<Look>,
    /// By copy: where its meshlets begin in `by_meshlet`, less the number of its first meshlet.
    of_copy: Vec<u32>,
    by_meshlet: Vec<u32>,
    /// Whether a triangle was left out since float64 is not sure enough of it.
    pub(super) has_uncertain: bool,
}

/// What all of this is made from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed<'a> {
    pub(super) shapes: &'a Shapes,
    pub(super) placements: &'a [Placement],
    pub(super) topology: &'a Topology,
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
    /// Looks at what is in the view of `camera` and not behind everything that `tiles` try.
    pub(super) fn new(
        placed: &Placed<'_>,
        camera: &Camera,
        rounder: &Rounder,
        tiles: &Tiles,
    ) -> Self {
        let size = camera.size();
        let (mut all, mut of_copy) = (Vec::new(), Vec::new());
        let mut by_meshlet = Vec::new();
        for (copy, placement) in (0..).zip(placed.placements) {
            let lens = Lens::new(&rounder.projector, placement, size);
            let meshlets = &placed.shapes.meshes[placement.mesh as usize].meshlets;
            of_copy.push((by_meshlet.len() as u32).wrapping_sub(meshlets.start));
            for meshlet in meshlets.clone() {
                let it = &placed.shapes.meshlets[meshlet as usize];
                let is_seen = lens.sees(it.min, it.max, tiles);
                by_meshlet.push(if is_seen { all.len() as u32 } else { NO_LOOK });
                if is_seen {
                    let (vertices, facets, polygons) = (Vec::new(), Vec::new(), Vec::new());
                    all.push(Look { copy, meshlet, rows: [0, -1], vertices, facets, polygons });
                }
            }
        }
        on_threads(cores(), all.chunks_mut(PART), |part| {
            part.iter_mut().for_each(|look| look.fill(placed, rounder, tiles, size));
        });
        let is_uncertain = |vertex: &Vertex| matches!(vertex, Vertex::Uncertain);
        let has_uncertain = all.iter().any(|look| look.vertices.iter().any(is_uncertain));
        Self { all, of_copy, by_meshlet, has_uncertain }
    }

    /// The place of a meshlet of a copy in the list of all, if it is looked at.
    #[inline]
    pub(super) fn find(&self, copy: u32, meshlet: u32) -> Option<u32> {
        let place = self.of_copy[copy as usize].wrapping_add(meshlet);
        Some(self.by_meshlet[place as usize]).filter(|look| *look != NO_LOOK)
    }

    /// The facet of a triangle of a meshlet of a copy, if it is there.
    #[inline]
    pub(super) fn facet(&self, copy: u32, meshlet: u32, triangle: u8) -> Option<&Facet> {
        let facets = &self.all[self.find(copy, meshlet)? as usize].facets;
        facets.get(usize::from(triangle)).filter(|facet| facet.is_there())
    }

    /// What is left for the proof of some pixels.
    pub(super) fn narrowed(&self, placed: &Placed<'_>, wanted: &Wanted<'_>) -> Self {
        let mut all: Vec<Option<Look>> = (0..self.all.len()).map(|_| None).collect();
        on_threads(cores(), all.chunks_mut(PART).zip(self.all.chunks(PART)), |(to, from)| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = Some(from.narrowed(placed, wanted));
            }
        });
        Self {
            all: all.into_iter().flatten().collect(),
            of_copy: self.of_copy.clone(),
            by_meshlet: self.by_meshlet.clone(),
            has_uncertain: self.has_uncertain,
        }
    }
}

impl Look {
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

    /// Calls `each` for the facets and their triangles in the image.
    #[inline]
    pub(super) fn for_each_triangle(
        &self,
        placed: &Placed<'_>,
        mut each: impl FnMut(&Facet, [Corner; 3]),
    ) {
        let triangles = &placed.shapes.meshlets[self.meshlet as usize].triangles;
        let is_mirrored = placed.placements[self.copy as usize].mirrored;
        for (facet, corners) in self.facets.iter().zip(placed.topology.corners(triangles)) {
            if !facet.is_there() || facet.is_cut {
                continue;
            }
            let corners = corners.map(|v| self.vertices[usize::from(v)]);
            if let [Vertex::Inside(a), Vertex::Inside(b), Vertex::Inside(c)] = corners {
                each(facet, if is_mirrored { [a, c, b] } else { [a, b, c] });
            }
        }
        for polygon in &self.polygons {
            let facet = &self.facets[usize::from(polygon.triangle)];
            let corners = polygon.corners();
            if facet.is_there() {
                for pair in corners[1..].windows(2) {
                    each(facet, [corners[0], pair[0], pair[1]]);
                }
            }
        }
    }

    /// Whether it meets any row from the first to the last one.
    pub(super) fn is_in_rows(&self, [first, last]: [i32; 2]) -> bool {
        self.rows[0] <= last && self.rows[1] >= first
    }

    /// The same look with the facets alone that may meet an open pixel.
    ///
    /// No edge of the others meets one, so nothing is lost for the open pixels.
    fn narrowed(&self, placed: &Placed<'_>, wanted: &Wanted<'_>) -> Self {
        let mut rows = self.rows;
        let (mut vertices, mut facets, mut polygons) = (Vec::new(), Vec::new(), Vec::new());
        if self.is_wanted(wanted, 0..self.vertices.len()) {
            let triangles = &placed.shapes.meshlets[self.meshlet as usize].triangles;
            let corners = placed.topology.corners(triangles);
            facets.extend(self.facets.iter().zip(corners).map(|(facet, corners)| {
                let is_wanted =
                    facet.is_there() && self.is_wanted(wanted, corners.map(usize::from));
                if is_wanted { *facet } else { Facet::default() }
            }));
            vertices.clone_from(&self.vertices);
            polygons.clone_from(&self.polygons);
        }
        if !facets.iter().any(Facet::is_there) {
            rows = [0, -1];
        }
        Self { copy: self.copy, meshlet: self.meshlet, rows, vertices, facets, polygons }
    }

    /// Rounds the vertices and makes the facets.
    fn fill(&mut self, placed: &Placed<'_>, rounder: &Rounder, tiles: &Tiles, size: ImageSize) {
        let placement = &placed.placements[self.copy as usize];
        let size = [size.width, size.height].map(u32::cast_signed);
        let world = |v: &u32| placement.world(placed.shapes.positions[*v as usize]);
        let vertices = placed.topology.vertices(self.meshlet);
        let mut points: Vec<Point> = Vec::new();
        self.vertices.reserve_exact(vertices.len());
        for vertex in vertices.iter().map(world) {
            let (vertex, point) = rounder.vertex(vertex);
            self.vertices.push(vertex);
            if placed.culled != FaceCull::None {
                points.push(point);
            }
        }
        let triangles = &placed.shapes.meshlets[self.meshlet as usize].triangles;
        let sides = placed.topology.sides(triangles);
        self.facets.reserve_exact(sides.len());
        let mut rows = [i32::MAX, i32::MIN];
        for (t, (corners, sides)) in
            placed.topology.corners(triangles).iter().zip(sides).enumerate()
        {
            let [a, b, c] = *corners;
            let [a, b, c] = if placement.mirrored { [a, c, b] } else { [a, b, c] }.map(usize::from);
            let mut facet = Facet::default();
            match [a, b, c].map(|v| self.vertices[v]) {
                _ if sides[0] == NO_EDGE => {}
                [Vertex::Inside(p), Vertex::Inside(q), Vertex::Inside(r)] => {
                    let faces = || {
                        placed.culled == FaceCull::None
                            || occludes([a, b, c].map(|v| &points[v]), placed.culled, placed.fault)
                    };
                    if is_met([p, q, r], size, tiles, &mut rows) && faces() {
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
                        for corner in polygon.corners() {
                            rows = [rows[0].min(corner.y), rows[1].max(corner.y)];
                        }
                        self.polygons.push(polygon);
                    }
                }
            }
            self.facets.push(facet);
        }
        if rows[0] <= rows[1] {
            self.rows = pixels(rows[0], rows[1], size[1]);
        }
    }
}

/// Whether a triangle may meet the image where it is not hidden; notes its rows then.
#[inline]
fn is_met(corners: [Corner; 3], size: [i32; 2], tiles: &Tiles, rows: &mut [i32; 2]) -> bool {
    let [p, q, r] = corners;
    let (y0, y1) = (p.y.min(q.y).min(r.y), p.y.max(q.y).max(r.y));
    let x = pixels(p.x.min(q.x).min(r.x), p.x.max(q.x).max(r.x), size[0]);
    let y = pixels(y0, y1, size[1]);
    if x[0] > x[1] || y[0] > y[1] || tiles.hide(p.far.min(q.far).min(r.far), x, y) {
        return false;
    }
    *rows = [rows[0].min(y0), rows[1].max(y1)];
    true
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
        let ((a, from), (b, to)) = (ends[k], ends[(k + 1) % 3]);
        let segment = match (a, b) {
            (Vertex::Inside(p), Vertex::Inside(q)) => Segment::Between(p, q),
            _ => rounder.segment(from, to),
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
struct Lens {
    /// `clip = rows * (p, 1)` with x, y, far and w.
    rows: [[f64; 4]; 4],
    near: f64,
    half: [f64; 2],
    size: [i32; 2],
}

impl Lens {
    fn new(projector: &Projector, placement: &Placement, size: ImageSize) -> Self {
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

    /// Whether something in a box may be seen in front of what `tiles` try.
    fn sees(&self, min: Vec3, max: Vec3, tiles: &Tiles) -> bool {
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
            && !tiles.hide(
                nearest - 1e-9 * nearest.abs(),
                [pixel(extent[0] - room, columns - 1), pixel(extent[1] + room, columns - 1)],
                [pixel(extent[2] - room, rows - 1), pixel(extent[3] + room, rows - 1)],
            )
    }
}
