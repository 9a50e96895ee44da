//! Solids in one image: an outline, and a plane for each face that looks at the eye.
//!
//! The faces of a solid that look at the eye are a set G of their own.
//! Rims between two of them cancel, so what is left is the outline.
//! Let a square grown by [`REACH`] be on the inner side of all of its lines.
//! Then no edge of the outline meets the square.
//! Seen from the centre, each edge runs round it in the same sense, by an angle between 0 and pi.
//! The outline is closed, so these angles sum up to a whole number of turns, which is not 0.
//! So the outline winds about the centre, and G covers the square.
//!
//! The depth is the farthest that any plane of G has in the square.
//! A convex surface is nowhere before any of its planes, so this is what it reaches there.
//!
//! Nothing rests on a solid being convex, nor on which faces are taken for G.
//!
//! [`REACH`]: crate::occluders::surface::facets::REACH

use std::ops::Range;

use crate::host::threads::{on_threads, worth_it};
use crate::host::vectors::widest;
use crate::input::camera::Camera;
use crate::input::mesh::FaceCull;
use crate::occluders::surface::alone::Alone;
use crate::occluders::surface::coverage::{QUARTERS, area, pixels};
use crate::occluders::surface::facets::{Corner, Facet, REACH, Rounder, UNITS, Vertex, reach};
use crate::occluders::surface::left_out::LeftOut;
use crate::occluders::surface::links::Standing;
use crate::occluders::surface::looks::{Lens, Placed, Sought, TILE};
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::solids::{Group, MAX_VERTICES, Solids};

/// How often a pixel is quartered at most.
const LEVELS: u32 = 2;
/// The parts of a pixel at the last level.
const PARTS: usize = 1 << (2 * LEVELS);
/// Nanoseconds that a group takes.
const PER_GROUP: u64 = 6_000;

/// A line of an outline: `right * x + down * y + at` is positive inside of it, x and y in units.
#[derive(Debug, Clone, Copy)]
struct Side {
    right: i64,
    down: i64,
    at: i64,
}

impl Side {
    /// The line from a to b, with its inner side on the right hand as rows run downwards.
    fn new(a: Corner, b: Corner) -> Self {
        let (right, down) = (i64::from(a.y) - i64::from(b.y), i64::from(b.x) - i64::from(a.x));
        Self { right, down, at: -(right * i64::from(a.x) + down * i64::from(a.y)) }
    }

    /// Its value at a point, less the most by which it falls in a square around that.
    ///
    /// It is not negative if all of the square is inside.
    #[inline(always)]
    fn within(&self, [x, y]: [i32; 2], half: i64) -> i64 {
        self.right * i64::from(x) + self.down * i64::from(y) + self.at
            - (self.right.abs() + self.down.abs()) * half
            - 1
    }
}

/// A solid in the image.
#[derive(Debug, Clone)]
struct Hull {
    /// The first and the last column and row of pixels that it may meet.
    columns: [i32; 2],
    rows: [i32; 2],
    nearest: f64,
    /// In the lists of its cluster.
    sides: Range<u32>,
    planes: Range<u32>,
}

/// Neighbouring solids in the image.
#[derive(Debug, Default)]
struct Cluster {
    hulls: Vec<Hull>,
    sides: Vec<Side>,
    planes: Vec<Facet>,
    /// The first and the last row of pixels that they may meet.
    rows: [i32; 2],
    /// Solids that are cut, and are left to the triangles.
    cut: Vec<u32>,
    /// Solids that are done, with the sets of their faces that look at the eye.
    done: Vec<(u32, u32)>,
}

/// What a square is asked about: half of its side, and by how much it is grown for lines.
#[derive(Debug, Clone, Copy)]
struct Asked {
    /// Half the side and the reach, for depths.
    half: f64,
    /// The same for lines.
    grown: i64,
}

impl Asked {
    fn new(half: i32, fault: Planted) -> Self {
        // Lists, because all faults are the same `false` where none can be planted.
        let faults = [is_planted!(fault, PlaneWithoutReach), is_planted!(fault, DepthAtCentre)];
        let is_point = faults.contains(&true);
        let faults = [is_planted!(fault, CentreForQuarter), is_planted!(fault, CentreForSquare)];
        let is_centre = faults[usize::from(half == UNITS / 2)];
        Self {
            half: if is_point { 0.0 } else { f64::from(half + REACH) },
            grown: if is_centre { 0 } else { i64::from(half + reach(fault)) },
        }
    }
}

/// The solids that one image looks at.
#[derive(Debug)]
pub(super) struct Hulls<'a> {
    solids: &'a Solids,
    placed: Placed<'a>,
    left_out: LeftOut<'a>,
    /// By solid of a copy: whether it is done, and the set of its faces that look at the eye.
    is_done: Vec<bool>,
    fronts: Vec<u32>,
    clusters: Vec<Cluster>,
}

impl<'a> Hulls<'a> {
    /// Nothing is looked at yet; `None` where no solid is of use.
    pub(super) fn new(placed: Placed<'a>, links: &Standing<'_>, refinement: u32) -> Option<Self> {
        let solids = placed.solids;
        // Else the faces would have to look at the eye for certain.
        let is_culled = placed.culled != FaceCull::None;
        if solids.is_empty() || is_culled || refinement > LEVELS {
            return None;
        }
        let left_out = LeftOut::new(solids, placed.placements, |copy| links.has_any(copy));
        let is_done = vec![false; left_out.num_solids()];
        let fronts = vec![0; left_out.num_solids()];
        Some(Self { solids, placed, left_out, is_done, fronts, clusters: Vec::new() })
    }

    /// The triangles that need not be looked at.
    pub(super) fn left_out(&self) -> &LeftOut<'a> {
        &self.left_out
    }

    #[inline]
    fn place(&self, copy: u32, solid: u32) -> usize {
        self.left_out.place(copy, solid)
    }

    /// Looks at the solids that are sought and not there.
    pub(super) fn add(&mut self, camera: &Camera, rounder: &Rounder, sought: &Sought<'_>) {
        let mut seen: Vec<(u32, &Group)> = Vec::new();
        for (copy, placement) in (0..).zip(self.placed.placements) {
            let groups = self.solids.groups(placement.mesh);
            if groups.is_empty() {
                continue;
            }
            let lens = Lens::new(&rounder.projector, placement, camera.size());
            let groups = groups.iter().filter(|group| lens.sees(group.min, group.max, sought));
            seen.extend(groups.map(|group| (copy, group)));
        }
        let mut made: Vec<Cluster> = Vec::new();
        made.resize_with(seen.len(), Cluster::default);
        let threads = worth_it(PER_GROUP * seen.len() as u64);
        let part = seen.len().div_ceil(4 * threads).max(1);
        on_threads(threads, made.chunks_mut(part).zip(seen.chunks(part)), |(made, seen)| {
            for (cluster, (copy, group)) in made.iter_mut().zip(seen) {
                self.fill(cluster, (*copy, group), camera, rounder, sought);
            }
        });
        for (cluster, (copy, _)) in made.iter().zip(&seen) {
            for solid in &cluster.cut {
                let place = self.place(*copy, *solid);
                self.is_done[place] = true;
                self.left_out.keep(*copy, *solid);
            }
            for (solid, fronts) in &cluster.done {
                let place = self.place(*copy, *solid);
                self.is_done[place] = true;
                self.fronts[place] = *fronts;
            }
        }
        self.keep_seams();
        self.left_out.sort();
        made.retain(|cluster| !cluster.hulls.is_empty());
        self.clusters.extend(made);
    }

    /// Leaves solids to their triangles that show a face each at an edge that they share.
    ///
    /// Across such an edge two of these faces may go on as one surface.
    fn keep_seams(&mut self) {
        let (solids, placements) = (self.solids, self.placed.placements);
        for (copy, placement) in (0..).zip(placements) {
            for seam in solids.seams(placement.mesh) {
                let shows = |hulls: &Self, (solid, faces)| {
                    hulls.fronts[hulls.place(copy, solid)] & faces != 0
                };
                if seam.iter().filter(|member| shows(self, **member)).count() > 1 {
                    let showing = seam.iter().filter(|member| shows(self, **member));
                    let showing: Vec<u32> = showing.map(|(solid, _)| *solid).collect();
                    showing.into_iter().for_each(|solid| self.left_out.keep(copy, solid));
                }
            }
        }
    }

    /// Looks at the solids of a group.
    fn fill(
        &self,
        cluster: &mut Cluster,
        (copy, group): (u32, &Group),
        camera: &Camera,
        rounder: &Rounder,
        sought: &Sought<'_>,
    ) {
        let size = camera.size();
        let placement = &self.placed.placements[copy as usize];
        let size = [size.width, size.height].map(u32::cast_signed);
        cluster.rows = [i32::MAX, i32::MIN];
        for solid in group.solids.clone().filter(|solid| !self.is_done[self.place(copy, *solid)]) {
            let (mut corners, mut is_cut) = ([Corner::default(); MAX_VERTICES], false);
            let vertices = self.solids.vertices(solid);
            widest(
                #[inline(always)]
                || {
                    for (corner, v) in corners.iter_mut().zip(vertices) {
                        let p = placement.world(self.placed.shapes.positions[*v as usize]);
                        match rounder.vertex(p).0 {
                            Vertex::Inside(inside) => *corner = inside,
                            _ => is_cut = true,
                        }
                    }
                },
            );
            if is_cut {
                // Far outside of the view there is nothing to look at.
                let (min, max) = self.solids.box_of(solid, &self.placed.shapes.positions);
                let lens = Lens::new(&rounder.projector, placement, camera.size());
                if lens.sees(min, max, sought) {
                    cluster.cut.push(solid);
                }
                continue;
            }
            let corners = &corners[..vertices.len()];
            let (mut x, mut y) = ([i32::MAX, i32::MIN], [i32::MAX, i32::MIN]);
            let mut nearest = f64::INFINITY;
            for corner in corners {
                x = [x[0].min(corner.x), x[1].max(corner.x)];
                y = [y[0].min(corner.y), y[1].max(corner.y)];
                nearest = nearest.min(corner.far);
            }
            let columns = pixels(x[0], x[1], size[0]);
            let rows = pixels(y[0], y[1], size[1]);
            let is_out = columns[0] > columns[1] || rows[0] > rows[1];
            if is_out || sought.excludes(nearest, columns, rows) {
                continue;
            }
            let (fronts, thin) = self.fronts(solid, corners, placement.mirrored);
            cluster.done.push((solid, fronts));
            let hull = Hull { columns, rows, nearest, sides: 0..0, planes: 0..0 };
            let is_mirrored = placement.mirrored;
            let mut push = |faces| {
                self.push(cluster, (solid, faces), corners, is_mirrored, size, hull.clone());
            };
            push(fronts);
            // The planes of thin faces are steep, and spoil the depths beside them.
            if thin != 0 && thin != fronts {
                push(fronts & !thin);
            }
        }
    }

    /// The faces of a solid that look at the eye, and those of them that are thin in the image.
    ///
    /// Both are sets: bit k for face k.
    fn fronts(&self, solid: u32, corners: &[Corner], is_mirrored: bool) -> (u32, u32) {
        let (mut fronts, mut thin) = (0, 0);
        for (number, face) in self.solids.faces(solid).iter().enumerate() {
            let triangle = face.triangle.map(|v| corners[usize::from(v)]);
            // What is counter-clockwise with y up has a negative area.
            let own = area(triangle);
            if own == 0 || (own < 0) == is_mirrored {
                continue;
            }
            fronts |= 1 << number;
            let [a, b, c] = triangle;
            let side = |p: Corner, q: Corner| (p.x - q.x).abs().max((p.y - q.y).abs());
            let longest = side(a, b).max(side(b, c)).max(side(c, a));
            // Less than a pixel.
            if own.abs() < i64::from(longest) * i64::from(UNITS) {
                thin |= 1 << number;
            }
        }
        (fronts, thin)
    }

    /// Adds the hull of some faces of a solid with these corners, if it is of use.
    fn push(
        &self,
        cluster: &mut Cluster,
        (solid, fronts): (u32, u32),
        corners: &[Corner],
        is_mirrored: bool,
        size: [i32; 2],
        hull: Hull,
    ) {
        let at = |v: u8| corners[usize::from(v)];
        let (first, planes) = (cluster.sides.len(), cluster.planes.len());
        // Ends of lines, and points to which edges have shrunk.
        let (mut ends, mut points) = (0_u32, 0_u32);
        for rim in self.solids.rims(solid) {
            let is_front = rim.faces.map(|face| fronts >> face & 1 != 0);
            if is_front[0] == is_front[1] {
                continue;
            }
            let own = rim.ends.map(|v| 1 << v);
            let [a, b] = rim.ends.map(at);
            if (a.x, a.y) == (b.x, b.y) {
                points |= own[0] | own[1];
                continue;
            }
            ends |= own[0] | own[1];
            // Fronts run counter-clockwise with y up, so their lines are taken back to front.
            let is_back = is_front[0] != is_mirrored;
            cluster.sides.push(if is_back { Side::new(b, a) } else { Side::new(a, b) });
        }
        if is_planted!(self.placed.fault, SideOfOutlineIgnored) {
            cluster.sides.truncate(cluster.sides.len().saturating_sub(1).max(first));
        }
        // A point that is the end of a line is outside of every square that is inside of the lines.
        if cluster.sides.len() == first || points & !ends != 0 {
            cluster.sides.truncate(first);
            return;
        }
        let faces = self.solids.faces(solid).iter().enumerate();
        for (_, face) in faces.filter(|(number, _)| fronts >> number & 1 != 0) {
            let (mut polygon, mut count) = ([Corner::default(); MAX_VERTICES], 0);
            for v in self.solids.corners(face) {
                polygon[count] = at(*v);
                count += 1;
            }
            cluster.planes.push(Facet::new(&polygon[..count], size));
        }
        if is_planted!(self.placed.fault, OnePlaneOfSolid) {
            cluster.planes.truncate(planes + 1);
        }
        cluster.rows = [cluster.rows[0].min(hull.rows[0]), cluster.rows[1].max(hull.rows[1])];
        cluster.hulls.push(Hull {
            sides: first as u32..cluster.sides.len() as u32,
            planes: planes as u32..cluster.planes.len() as u32,
            ..hull
        });
    }

    /// Lowers the depths of the pixels that one solid covers as a whole.
    pub(super) fn cover(&self, alone: &mut Alone<'_>) {
        widest(
            #[inline(always)]
            || self.cover_all(alone),
        );
    }

    #[inline(always)]
    fn cover_all(&self, alone: &mut Alone<'_>) {
        let Alone { grid, tiles, fault, .. } = *alone;
        let asked = Asked::new(UNITS / 2, fault);
        let mut values: Vec<[i64; 3]> = Vec::new();
        for (cluster, hull, rows) in self.in_rows(grid.rows) {
            let first = [grid.centre(hull.columns[0]), grid.centre(rows[0])];
            // As in `for_each_centre`, whole steps of pixels.
            values.clear();
            values.extend(cluster.sides(hull).iter().map(
                #[inline(always)]
                |side| [side.within(first, asked.grown) >> grid.log2, side.right, side.down],
            ));
            let planes = cluster.planes(hull);
            for y in rows[0]..=rows[1] {
                let steps = steps_inside(&mut values, hull.columns[1] - hull.columns[0]);
                let [mut begin, last] = steps.map(|steps| hull.columns[0] + steps);
                let line = ((y - grid.rows[0]) * (grid.columns[1] + 1)).cast_unsigned() as usize;
                while begin <= last {
                    let end = (begin | (TILE.cast_signed() - 1)).min(last);
                    if hull.nearest <= f64::from(tiles.last(begin, y)) {
                        // All eight, since a loop of fixed length becomes vectors.
                        let mut all = [f64::NEG_INFINITY; TILE as usize];
                        for plane in planes {
                            for (far, x) in all.iter_mut().zip(begin..) {
                                let own = plane.range(grid.centre(x), grid.centre(y), asked.half).0;
                                *far = if own > *far { own } else { *far };
                            }
                        }
                        let run = line + begin as usize..=line + end as usize;
                        for (depth, far) in alone.depths[run].iter_mut().zip(all) {
                            let far = Facet::rounded(far, fault);
                            *depth = if far < *depth { far } else { *depth };
                        }
                    }
                    begin = end + 1;
                }
            }
        }
    }

    /// The hulls that may meet some rows, and those of the rows that they may meet.
    #[inline(always)]
    fn in_rows(
        &self,
        [first, last]: [i32; 2],
    ) -> impl Iterator<Item = (&Cluster, &Hull, [i32; 2])> {
        let meets = move |rows: [i32; 2]| rows[0] <= last && rows[1] >= first;
        let clusters = self.clusters.iter().filter(move |cluster| meets(cluster.rows));
        clusters.flat_map(move |cluster| {
            let hulls = cluster.hulls.iter().filter(move |hull| meets(hull.rows));
            hulls
                .map(move |hull| (cluster, hull, [hull.rows[0].max(first), hull.rows[1].min(last)]))
        })
    }

    /// What single solids show of the parts of the open pixels of some rows.
    ///
    /// By open pixel, `bounds` are the depths from which on nothing is looked at.
    pub(super) fn parts(
        &self,
        open: &OpenPixels,
        rows: [i32; 2],
        bounds: &[f32],
        refinement: u32,
    ) -> Parts {
        let levels = refinement.min(LEVELS);
        let mut parts = Parts { levels, depths: vec![Parts::NOTHING; bounds.len()] };
        widest(
            #[inline(always)]
            || match levels {
                0 => self.cover_parts::<1>((open, rows), bounds, &mut parts.depths),
                1 => self.cover_parts::<2>((open, rows), bounds, &mut parts.depths),
                _ => self.cover_parts::<4>((open, rows), bounds, &mut parts.depths),
            },
        );
        parts
    }

    #[inline(always)]
    fn cover_parts<const SIDE: usize>(
        &self,
        (open, rows): (&OpenPixels, [i32; 2]),
        bounds: &[f32],
        depths: &mut [[f32; PARTS]],
    ) {
        let fault = self.placed.fault;
        let half = UNITS / 2 / SIDE as i32;
        let asked = Asked::new(half, fault);
        let from_centre: [i32; SIDE] =
            std::array::from_fn(|i| (2 * i as i32 + 1) * half - UNITS / 2);
        let first = open.number(0, rows[0]);
        for (cluster, hull, rows) in self.in_rows(rows) {
            for y in rows[0]..=rows[1] {
                for (number, x) in open.of_row(y, hull.columns) {
                    let number = number - first;
                    if hull.nearest >= f64::from(bounds[number]) {
                        continue;
                    }
                    let centre = [x, y].map(|place| place * UNITS + UNITS / 2);
                    let mut outside = [[0_i64; SIDE]; SIDE];
                    let mut is_out = false;
                    for side in cluster.sides(hull) {
                        let value = side.within(centre, asked.grown);
                        let right = from_centre.map(|d| side.right * i64::from(d));
                        let down = from_centre.map(|d| side.down * i64::from(d));
                        for (row, down) in outside.iter_mut().zip(down) {
                            for (out, right) in row.iter_mut().zip(right) {
                                *out |= value + right + down;
                            }
                        }
                        let most = right[0].abs() + down[0].abs();
                        is_out |= value + most < 0;
                        if is_out {
                            break;
                        }
                    }
                    if is_out || outside.as_flattened().iter().all(|out| *out < 0) {
                        continue;
                    }
                    let mut far = [[f64::NEG_INFINITY; SIDE]; SIDE];
                    for plane in cluster.planes(hull) {
                        for (row, dy) in far.iter_mut().zip(from_centre) {
                            for (far, dx) in row.iter_mut().zip(from_centre) {
                                let own = plane.range(centre[0] + dx, centre[1] + dy, asked.half).0;
                                *far = if own > *far { own } else { *far };
                            }
                        }
                    }
                    let both = far.as_flattened().iter().zip(outside.as_flattened());
                    for (known, (far, out)) in depths[number].iter_mut().zip(both) {
                        let far = Facet::rounded(*far, fault);
                        *known = if *out >= 0 && far < *known { far } else { *known };
                    }
                }
            }
        }
    }
}

impl Cluster {
    #[inline(always)]
    fn sides(&self, hull: &Hull) -> &[Side] {
        &self.sides[hull.sides.start as usize..hull.sides.end as usize]
    }

    #[inline(always)]
    fn planes(&self, hull: &Hull) -> &[Facet] {
        &self.planes[hull.planes.start as usize..hull.planes.end as usize]
    }
}

/// The first and the last of the steps right, up to `most`, at which no value is negative.
///
/// Of each value there is what it grows by per step right and down.
/// Then it goes down by a step.
#[inline(always)]
fn steps_inside(values: &mut [[i64; 3]], most: i32) -> [i32; 2] {
    let (mut first, mut last) = (0, i64::from(most));
    for [value, right, down] in values {
        match right.signum() {
            1 if *value < 0 => first = first.max((-*value + *right - 1) / *right),
            -1 if *value >= 0 => last = last.min(*value / -*right),
            0 | -1 if *value < 0 => last = -1,
            _ => {}
        }
        *value += *down;
    }
    // An empty run, where the steps may be many.
    if first > last { [0, -1] } else { [first, last].map(|steps| steps as i32) }
}

/// By open pixel: the depths at which each part of it is blocked by one solid.
#[derive(Debug)]
pub(super) struct Parts {
    /// How often pixels are quartered.
    levels: u32,
    /// In rows from top to bottom; infinity where nothing is shown.
    depths: Vec<[f32; PARTS]>,
}

impl Parts {
    const NOTHING: [f32; PARTS] = [f32::INFINITY; PARTS];

    /// Whether anything is shown of a pixel.
    pub(super) fn is_any(&self, number: usize) -> bool {
        self.depths[number].iter().any(|far| *far < f32::INFINITY)
    }

    /// The depth at which every ray through a pixel is blocked.
    pub(super) fn pixel(&self, number: usize) -> f32 {
        let all = &self.depths[number][..1 << (2 * self.levels)];
        all.iter().fold(f32::NEG_INFINITY, |far, own| far.max(*own))
    }

    /// The same for the quarters of a pixel, in the order of [`QUARTERS`].
    ///
    /// `pick` chooses among two parts of a quarter: the farther one holds for the quarter.
    pub(super) fn quarters(&self, number: usize, pick: fn(f32, f32) -> f32) -> [f32; 4] {
        match self.levels {
            0 => [f32::INFINITY; 4],
            1 => std::array::from_fn(|k| self.depths[number][k]),
            _ => std::array::from_fn(|k| {
                let [a, b, c, d] = self.quarters_of(number, k);
                pick(pick(a, b), pick(c, d))
            }),
        }
    }

    /// The same for the quarters of a quarter.
    pub(super) fn quarters_of(&self, number: usize, quarter: usize) -> [f32; 4] {
        if self.levels < LEVELS {
            return [f32::INFINITY; 4];
        }
        std::array::from_fn(|k| {
            let [column, row] = [0, 1].map(|axis| (quarter >> axis & 1) * 2 + (k >> axis & 1));
            self.depths[number][4 * row + column]
        })
    }
}

const _: () = assert!(QUARTERS[1][0] == 1 && QUARTERS[1][1] == -1 && QUARTERS[2][1] == 1);
