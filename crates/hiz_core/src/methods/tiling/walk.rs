//! The walk front to back: nodes behind full squares are left out, parts are tiled.
//!
//! Source: Greene (1996), sections 4 and 5.

use std::ops::Range;

use crate::error::Result;
use crate::host::linear::{Mat3, Vec3, dot, inverse3, mul3, solve3};
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::methods::seen::{Eye, Seen};
use crate::methods::tiling::bsp::{BspTree, NONE, Part, Plane};
use crate::methods::tiling::cover::{Cover, SIDE, bit};
use crate::methods::tiling::fault::is_planted;
use crate::occluders::host_raster::snapped::{Grid, Snapped};
use crate::occluders::surface::OccluderSurface;

/// What is seen of a tree.
#[derive(Debug)]
pub struct Tiled {
    size: ImageSize,
    cover: Cover,
    visible: Vec<bool>,
    /// By pixel, if it was asked for.
    owners: Option<Vec<u32>>,
    /// Nodes that were looked at.
    pub nodes: u64,
    /// Nodes that were left out with all below: behind full squares, or outside.
    pub hidden_nodes: u64,
    /// Parts that were tiled.
    pub parts: u64,
}

/// Nodes with fewer parts in and below are not tested.
const TESTED_FROM: u32 = 16;
/// A rectangle of more tiles is looked up from the coarsest level down.
const MANY_TILES: i32 = 16;
/// No pixel's owner.
const NOBODY: u32 = u32::MAX;

/// From where one looks: a point, or a direction with `w` 0.
#[derive(Clone, Copy)]
struct Viewpoint {
    point: Vec3,
    w: f64,
}

impl Viewpoint {
    fn of(camera: &Camera) -> Self {
        let rows = camera.rows();
        let linear = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
        if linear(3) == [0.0; 3] {
            // Against the way in which depth grows.
            let z = linear(2);
            let toward = if camera.convention().is_reversed() { z } else { z.map(|v| -v) };
            return Self { point: toward, w: 0.0 };
        }
        let m: Mat3 = [linear(0), linear(1), linear(3)];
        let from = solve3(&m, [-rows[0][3], -rows[1][3], -rows[3][3]]).unwrap_or([0.0; 3]);
        let origin = camera.origin();
        Self { point: std::array::from_fn(|k| origin[k] + from[k]), w: 1.0 }
    }

    fn is_before(&self, plane: &Plane) -> bool {
        dot(plane.normal, self.point) - self.w * plane.offset >= 0.0
    }
}

/// What remains to be done on the walk.
enum Step {
    Look(u32),
    Draw(u32),
}

/// A line in the image: before the plane where it is not negative.
struct Line {
    at: [f64; 3],
    is_front: bool,
}

/// The triangles of a meshlet on the grid.
#[derive(Clone, Default)]
struct Held {
    /// For each triangle of the meshlet, its pieces.
    pieces: Vec<Range<u32>>,
}

impl BspTree {
    /// What `camera` sees of the tree; `surface` is the one that it was made of.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for a camera that float32 cannot hold.
    pub fn draw(&self, surface: &OccluderSurface, camera: &Camera) -> Result<Tiled> {
        self.tiled(surface, camera, false)
    }

    /// [`BspTree::draw`], with the triangle that owns each pixel ([`Tiled::owners`]).
    ///
    /// # Errors
    /// As [`BspTree::draw`].
    pub fn draw_with_owners(&self, surface: &OccluderSurface, camera: &Camera) -> Result<Tiled> {
        self.tiled(surface, camera, true)
    }

    fn tiled(&self, surface: &OccluderSurface, camera: &Camera, owned: bool) -> Result<Tiled> {
        let size = camera.size();
        let mut walk = Walk {
            tree: self,
            grid: Grid::new(surface, &self.placements, camera)?,
            eye: Eye::new(camera),
            size,
            held: Vec::new(),
            snapped: Vec::new(),
            firsts: Vec::new(),
            seen: Tiled {
                size,
                cover: Cover::new(size, self.fault),
                visible: vec![false; self.sources.len()],
                owners: owned.then(|| vec![NOBODY; size.pixels() as usize]),
                nodes: 0,
                hidden_nodes: 0,
                parts: 0,
            },
        };
        walk.prepare(surface);
        let viewpoint = Viewpoint::of(camera);
        let mut steps = Vec::new();
        if !self.nodes.is_empty() {
            steps.push(Step::Look(0));
        }
        while let Some(step) = steps.pop() {
            match step {
                Step::Draw(number) => {
                    let own = &self.nodes[number as usize].own;
                    for part in &self.parts[own.start as usize..own.end as usize] {
                        walk.part(part);
                    }
                }
                Step::Look(number) => {
                    let node = &self.nodes[number as usize];
                    walk.seen.nodes += 1;
                    if node.parts >= TESTED_FROM && walk.is_hidden(node.min, node.max) {
                        walk.seen.hidden_nodes += 1;
                        continue;
                    }
                    let is_before =
                        viewpoint.is_before(&node.plane) != is_planted!(self.fault, BackToFront);
                    let (near, far) =
                        if is_before { (node.front, node.back) } else { (node.back, node.front) };
                    // The last one is popped first.
                    if far != NONE {
                        steps.push(Step::Look(far));
                    }
                    steps.push(Step::Draw(number));
                    if near != NONE {
                        steps.push(Step::Look(near));
                    }
                }
            }
        }
        Ok(walk.seen)
    }
}

/// A walk under way.
struct Walk<'a> {
    tree: &'a BspTree,
    grid: Grid<'a>,
    eye: Eye,
    size: ImageSize,
    /// By copy and meshlet, once it was needed; `firsts` says where a copy's meshlets begin.
    held: Vec<Option<Held>>,
    firsts: Vec<(u32, u32)>,
    snapped: Vec<Snapped>,
    seen: Tiled,
}

impl Walk<'_> {
    /// Room for the meshlets of each copy.
    fn prepare(&mut self, surface: &OccluderSurface) {
        let shapes = surface.shapes();
        let mut count = 0;
        for placement in &self.tree.placements {
            let meshlets = &shapes.meshes[placement.mesh as usize].meshlets;
            self.firsts.push((count, meshlets.start));
            count += meshlets.len() as u32;
        }
        self.held = vec![None; count as usize];
    }

    /// Whether a box adds nothing: it is outside, or full squares lie before it.
    fn is_hidden(&self, min: Vec3, max: Vec3) -> bool {
        let corners = std::array::from_fn(|corner: usize| {
            std::array::from_fn(|k| if corner >> k & 1 == 0 { min[k] } else { max[k] })
        });
        match self.eye.look(&corners) {
            Seen::Outside => true,
            Seen::Crossing(_) => false,
            Seen::Inside(rectangle, _) => {
                // A pixel to spare covers the rounding to the grid.
                let pixel = |v: f64, side: u32, spare: f64| {
                    #[expect(clippy::cast_possible_truncation, reason = "clamped")]
                    let pixel = (v * f64::from(side) + spare)
                        .floor()
                        .clamp(0.0, f64::from(side - 1)) as i32;
                    pixel
                };
                let ImageSize { width, height } = self.size;
                let [x0, y0, x1, y1] = rectangle;
                self.seen.cover.hides([
                    pixel(x0, width, -1.0),
                    pixel(y0, height, -1.0),
                    pixel(x1, width, 1.0),
                    pixel(y1, height, 1.0),
                ])
            }
        }
    }

    /// The pieces of a triangle on the grid, as numbers in `snapped`.
    fn pieces(&mut self, copy: u32, meshlet: u32, triangle: u32) -> Range<u32> {
        let (first, start) = self.firsts[copy as usize];
        let slot = (first + meshlet - start) as usize;
        let start_of_meshlet = self.grid.first_triangle(meshlet);
        if self.held[slot].is_none() {
            let snapped = &mut self.snapped;
            let mut found: Vec<(u32, u32)> = Vec::new();
            self.grid.meshlet(copy, meshlet, |number, piece| {
                found.push((number, snapped.len() as u32));
                snapped.push(piece);
            });
            // Triangles come in their order, the pieces of one after another.
            let mut pieces = Vec::new();
            for (number, at) in found {
                let place = (number - start_of_meshlet) as usize;
                if pieces.len() <= place {
                    pieces.resize(place + 1, 0..0);
                }
                let range: &mut Range<u32> = &mut pieces[place];
                *range = if range.start == range.end { at..at + 1 } else { range.start..at + 1 };
            }
            self.held[slot] = Some(Held { pieces });
        }
        let place = (triangle - start_of_meshlet) as usize;
        let held = self.held[slot].as_ref();
        held.and_then(|held| held.pieces.get(place).cloned()).unwrap_or(0..0)
    }

    /// Tiles one part.
    fn part(&mut self, part: &Part) {
        let tree = self.tree;
        let source = &tree.sources[part.source as usize];
        let pieces = self.pieces(source.copy, source.meshlet, source.triangle);
        if pieces.is_empty() {
            return;
        }
        self.seen.parts += 1;
        let lines = self.lines(part);
        for piece in pieces {
            let Snapped { columns, rows, .. } = &self.snapped[piece as usize];
            let tiles = [columns.0 / SIDE, rows.0 / SIDE, columns.1 / SIDE, rows.1 / SIDE];
            let count = (tiles[2] - tiles[0] + 1) * (tiles[3] - tiles[1] + 1);
            if count > MANY_TILES {
                self.square(part.source, piece, &lines, tiles, (self.seen.cover.top(), 0, 0));
                continue;
            }
            for y in tiles[1]..=tiles[3] {
                for x in tiles[0]..=tiles[2] {
                    self.tile(part.source, piece, &lines, x, y);
                }
            }
        }
    }

    /// Where the planes that have cut a part appear on its triangle.
    fn lines(&self, part: &Part) -> Vec<Line> {
        let tree = self.tree;
        let cuts = &tree.cuts[part.cuts.start as usize..part.cuts.end as usize];
        if cuts.is_empty() || is_planted!(tree.fault, CutsIgnored) {
            return Vec::new();
        }
        let source = &tree.sources[part.source as usize];
        let clip = self.grid.clip(source.copy, source.triangle);
        // On the triangle's plane the distance from the cut is linear in x, y and w.
        // A triangle that is seen from the side has no such plane, and one side takes all of it.
        let inverse = inverse3(&clip);
        cuts.iter()
            .map(|cut| {
                let plane = &tree.nodes[cut.node as usize].plane;
                let distance = source.corners.map(|p| plane.at(p));
                let at = inverse.map_or([0.0, 0.0, 1.0], |inverse| mul3(&inverse, distance));
                Line { at, is_front: cut.is_front || is_planted!(tree.fault, OneSideOfCuts) }
            })
            .collect()
    }

    /// Tiles a piece within a square of a coarser level.
    fn square(
        &mut self,
        source: u32,
        piece: u32,
        lines: &[Line],
        tiles: [i32; 4],
        (level, x, y): (usize, i32, i32),
    ) {
        if level == 0 {
            self.tile(source, piece, lines, x, y);
            return;
        }
        let below = level - 1;
        let shift = 3 * below as i32;
        let [x0, y0, x1, y1] = tiles.map(|v| v >> shift);
        for py in (SIDE * y).max(y0)..=(SIDE * y + SIDE - 1).min(y1) {
            for px in (SIDE * x).max(x0)..=(SIDE * x + SIDE - 1).min(x1) {
                if self.seen.cover.word(level, x, y) & bit(px % SIDE, py % SIDE) != 0 {
                    continue;
                }
                let side = SIDE << shift;
                if !self.snapped[piece as usize].misses(px * side, py * side, side) {
                    self.square(source, piece, lines, tiles, (below, px, py));
                }
            }
        }
    }

    fn tile(&mut self, source: u32, piece: u32, lines: &[Line], x: i32, y: i32) {
        let covered = self.seen.cover.word(0, x, y);
        if covered == u64::MAX {
            return;
        }
        let mut mask = self.snapped[piece as usize].mask(x * SIDE, y * SIDE) & !covered;
        for line in lines {
            if mask == 0 {
                return;
            }
            let front = self.front(line, x, y);
            mask &= if line.is_front { front } else { !front };
        }
        if mask == 0 {
            return;
        }
        self.seen.visible[source as usize] = true;
        self.seen.cover.add(x, y, mask);
        if let Some(owners) = &mut self.seen.owners {
            for k in 0..SIDE * SIDE {
                let (dx, dy) = (k % SIDE, k / SIDE);
                if mask & bit(dx, dy) != 0 {
                    let pixel = (y * SIDE + dy) as u32 * self.size.width + (x * SIDE + dx) as u32;
                    owners[pixel as usize] = source;
                }
            }
        }
    }

    /// The pixels of a tile that are before a cut.
    ///
    /// Both parts ask the same numbers, so each pixel belongs to one of them.
    fn front(&self, line: &Line, x: i32, y: i32) -> u64 {
        let [a, b, c] = line.at;
        let first = self.grid.centre(x * SIDE, y * SIDE);
        let mut mask = 0;
        for dx in 0..SIDE {
            for dy in 0..SIDE {
                let [px, py] = [first[0] + 256.0 * f64::from(dx), first[1] + 256.0 * f64::from(dy)];
                if a * px + b * py + c >= 0.0 {
                    mask |= bit(dx, dy);
                }
            }
        }
        mask
    }
}

impl Tiled {
    /// Whether each pixel is covered, row 0 on top.
    pub fn coverage(&self) -> impl Iterator<Item = bool> + '_ {
        let ImageSize { width, height } = self.size;
        (0..height as i32).flat_map(move |y| {
            (0..width as i32)
                .map(move |x| self.cover.word(0, x / SIDE, y / SIDE) & bit(x % SIDE, y % SIDE) != 0)
        })
    }

    /// The triangle that owns each pixel, numbered as in [`OccluderSurface::world`]; `u32::MAX`
    /// where nothing is.
    /// `None` if they were not asked for.
    pub fn owners(&self) -> Option<&[u32]> {
        self.owners.as_deref()
    }

    /// Triangles that cover a pixel before all others.
    pub fn num_visible(&self) -> usize {
        self.visible.iter().filter(|is_visible| **is_visible).count()
    }

    /// Bytes of the pyramid of coverage bits.
    pub fn bytes(&self) -> u64 {
        self.cover.bytes()
    }
}
