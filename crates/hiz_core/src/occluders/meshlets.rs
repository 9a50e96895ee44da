//! Meshlets: clusters of neighbouring triangles, with a box around each.
//!
//! A rasteriser looks at the box first: what is outside the view or hidden costs no vertex.
//! So the clusters are small, and their triangles lie close together: neighbours on the Morton
//! curve through the triangles' centroids.
//!
//! A meshlet has its own block of vertices, which its triangles name by one byte.
//! Blocks are padded to whole groups of [`LANES`], so that loops over them have no rest.

use std::ops::Range;

use crate::error::Result;
use crate::host::curve::spread;
use crate::host::linear::{Vec3, cross, sub};
use crate::host::memory;
use crate::host::rounding::split;
use crate::host::threads::{on_threads, worth_it};
use crate::occluders::closed::{ClosedPart, ClosedParts};

/// The most triangles of a meshlet.
pub(crate) const MAX_TRIANGLES: usize = 128;
/// The most vertices of a meshlet.
pub(crate) const MAX_VERTICES: usize = 128;
/// How many vertices or triangles a loop treats at once: what a compiler turns into vectors.
pub(crate) const LANES: usize = 8;
/// A part of a meshlet: so many of its triangles, in groups of [`LANES`].
///
/// Parts have boxes of their own, for views where the meshlet takes much of the image.
pub(crate) const PART_GROUPS: usize = 2;

/// A cluster of triangles of one mesh.
#[derive(Debug, Clone)]
#[allow(dead_code, reason = "the rasteriser on the host is being built on it")]
pub(crate) struct Meshlet {
    /// The box around its vertices, in mesh coordinates.
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
    /// Its triangles, in the order of [`Shapes::triangles`](super::shapes::Shapes::triangles).
    pub(crate) triangles: Range<u32>,
    /// Where its block begins in the arrays of [`Blocks`], and how many vertices are in use.
    pub(crate) first_vertex: u32,
    pub(crate) num_vertices: u32,
    /// Where its triangles begin in [`Blocks::corners`], in groups of [`LANES`].
    pub(crate) first_group: u32,
    /// Where the boxes of its parts begin in [`Blocks::parts`].
    pub(crate) first_part: u32,
    /// Where its low halves begin, if any is not 0.
    pub(crate) first_low: Option<u32>,
    /// The areas of its triangles as seen along each axis, added up.
    pub(crate) facing: [f32; 3],
    /// Which of [`Blocks::closed`] is about it, if some of its triangles are of closed parts.
    pub(crate) closed: Option<u32>,
}

/// A part of a meshlet: [`PART_GROUPS`] of its triangles.
#[derive(Debug)]
pub(crate) struct Part {
    /// The box around them, in mesh coordinates.
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
    /// A bit for each group of [`LANES`] vertices of the meshlet's block that they name some of.
    pub(crate) vertices: u16,
}
const _: () = assert!(MAX_VERTICES / LANES <= u16::BITS as usize, "a bit for each group");

/// What a meshlet has of closed parts of its mesh.
#[derive(Debug, Clone)]
pub(crate) struct ClosedOf {
    /// The box around all of these parts, in mesh coordinates.
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
    /// The parts, in [`Blocks::closed_parts`].
    pub(crate) parts: Range<u32>,
    /// Where its triangles begin in [`Blocks::senses`], in groups of [`LANES`].
    pub(crate) first_group: u32,
}

impl Meshlet {
    /// Its triangles in groups of [`LANES`], from 0 on.
    pub(crate) fn groups(&self) -> Range<u32> {
        0..(self.triangles.len().div_ceil(LANES)) as u32
    }
}

/// The vertices and triangles of all meshlets, as a rasteriser reads them.
#[derive(Debug, Default)]
pub(crate) struct Blocks {
    /// Positions in mesh coordinates, rounded to float32: x, y and z apart.
    pub(crate) high: [Vec<f32>; 3],
    /// What the rounding left over, for the meshlets that have [`Meshlet::first_low`].
    pub(crate) low: [Vec<f32>; 3],
    /// Corners of [`LANES`] triangles, as vertices of the meshlet's block.
    pub(crate) corners: Vec<[[u8; LANES]; 3]>,
    pub(crate) parts: Vec<Part>,
    /// For the meshlets that have [`Meshlet::closed`].
    pub(crate) closed: Vec<ClosedOf>,
    pub(crate) closed_parts: Vec<ClosedPart>,
    /// By triangle of theirs: the sense of its part ([`ClosedPart::sense`]), 0 if it is not closed.
    pub(crate) senses: Vec<[i8; LANES]>,
    /// By triangle of theirs: its part, from [`ClosedOf::parts`] on, if it is closed.
    pub(crate) part_of: Vec<[u8; LANES]>,
}

impl Blocks {
    /// Bytes on the host.
    pub(crate) fn bytes(&self) -> u64 {
        let floats = self.high.iter().chain(&self.low).map(Vec::len).sum::<usize>();
        let triangles = size_of_val(&self.corners[..]) + size_of_val(&self.parts[..]);
        let closed = size_of_val(&self.closed[..])
            + size_of_val(&self.closed_parts[..])
            + size_of_val(&self.senses[..])
            + size_of_val(&self.part_of[..]);
        (floats * size_of::<f32>() + triangles + closed) as u64
    }
}

/// The triangles along the Morton curve through their centroids, as indices.
///
/// Equal keys keep the caller's order, so the result is the same on every machine.
fn along_the_curve(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Vec<u32>> {
    let corner = |v: u32| positions[v as usize];
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in triangles.iter().flatten().map(|v| corner(*v)) {
        for k in 0..3 {
            min[k] = min[k].min(p[k]);
            max[k] = max[k].max(p[k]);
        }
    }
    let extent = (0..3).map(|k| max[k] - min[k]).fold(f64::MIN_POSITIVE, f64::max);
    let cells = f64::from((1_u32 << 20) - 1) / extent;
    let key = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        (0..3).fold(0, |key, k| {
            let from_min = (a[k] - min[k]) / 3.0 + (b[k] - min[k]) / 3.0 + (c[k] - min[k]) / 3.0;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range")]
            let cell = (from_min * cells) as u64;
            key | spread(cell) << k
        })
    };
    let mut keyed = memory::collected(
        triangles.iter().enumerate().map(|(i, t)| (key(t), i as u32)),
        "triangles",
    )?;
    keyed.sort_unstable();
    memory::collected(keyed.into_iter().map(|(_, i)| i), "triangles")
}

/// Cuts one mesh into meshlets.
///
/// `triangles` are its triangles as indices into `positions`; they are sorted by meshlet.
/// `first_triangle` is the number of triangles of the meshes before it.
pub(super) fn cluster(
    positions: &[Vec3],
    triangles: &mut [[u32; 3]],
    first_triangle: u32,
    meshlets: &mut Vec<Meshlet>,
    blocks: &mut Blocks,
) -> Result<()> {
    let (order, closed) = order_and_parts(positions, triangles)?;
    let given = memory::collected(triangles.iter().copied(), "triangles")?;
    // By vertex: the meshlet that met it last, and its place in that one's block.
    let mut place = memory::list(positions.len(), "vertices")?;
    place.resize(positions.len(), (u32::MAX, 0_u8));
    let mut open = Open::default();
    let mut number = 0;
    for (sorted, index) in order.into_iter().enumerate() {
        let triangle = given[index as usize];
        let fresh = triangle.iter().filter(|v| place[**v as usize].0 != number).count();
        if open.corners.len() == MAX_TRIANGLES || open.vertices.len() + fresh > MAX_VERTICES {
            open.close(positions, &closed, first_triangle + sorted as u32, meshlets, blocks)?;
            number += 1;
        }
        open.given.push(index);
        open.corners.push(triangle.map(|v| {
            let seen = &mut place[v as usize];
            if seen.0 != number {
                *seen = (number, open.vertices.len() as u8);
                open.vertices.push(v);
            }
            seen.1
        }));
        triangles[sorted] = triangle;
    }
    open.close(positions, &closed, first_triangle + triangles.len() as u32, meshlets, blocks)
}

/// The triangles along the curve, and the closed parts; each on a thread of its own where it is
/// worth that.
fn order_and_parts(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<(Vec<u32>, ClosedParts)> {
    /// What the shorter one of both takes at least, in nanoseconds per triangle.
    const LEAST_NS: u64 = 10;
    let (mut order, mut closed) = (Ok(Vec::new()), Ok(ClosedParts::default()));
    let mut find_order = || order = along_the_curve(positions, triangles);
    let mut find_closed = || closed = ClosedParts::of(positions, triangles);
    let both: [&mut (dyn FnMut() + Send); 2] = [&mut find_order, &mut find_closed];
    on_threads(worth_it(LEAST_NS * triangles.len() as u64), both, |find| find());
    Ok((order?, closed?))
}

/// Triangles of a part.
const PART: usize = PART_GROUPS * LANES;

/// The meshlet that is being filled.
#[derive(Default)]
struct Open {
    vertices: Vec<u32>,
    corners: Vec<[u8; 3]>,
    /// Its triangles' numbers as they were given.
    given: Vec<u32>,
}

impl Open {
    /// Appends what its triangles have of closed parts to `blocks`; `None` if that is nothing.
    fn closed_of(&self, closed: &ClosedParts, blocks: &mut Blocks) -> Result<Option<u32>> {
        let is_closed = |triangle: &u32| closed.number_of(*triangle).is_some();
        if !self.given.iter().any(is_closed) {
            return Ok(None);
        }
        let first = blocks.closed_parts.len();
        let mut own = ClosedOf {
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
            parts: first as u32..first as u32,
            first_group: blocks.senses.len() as u32,
        };
        // Of the parts so far: their numbers in the mesh.
        let mut numbers: Vec<u32> = Vec::new();
        let groups = self.given.len().div_ceil(LANES);
        memory::reserve(&mut blocks.senses, groups, "triangles")?;
        memory::reserve(&mut blocks.part_of, groups, "triangles")?;
        for group in self.given.chunks(LANES) {
            let (mut senses, mut part_of) = ([0; LANES], [0; LANES]);
            for (lane, triangle) in group.iter().enumerate() {
                let Some(number) = closed.number_of(*triangle) else { continue };
                let part = closed.parts()[number as usize];
                // The last ones first, because neighbours are of the same part.
                let known = numbers.iter().rposition(|other| *other == number);
                if known.is_none() {
                    numbers.push(number);
                    memory::reserve(&mut blocks.closed_parts, 1, "parts")?;
                    blocks.closed_parts.push(part);
                    for k in 0..3 {
                        own.min[k] = own.min[k].min(part.min[k]);
                        own.max[k] = own.max[k].max(part.max[k]);
                    }
                }
                part_of[lane] = known.unwrap_or(numbers.len() - 1) as u8;
                senses[lane] = part.sense;
            }
            blocks.senses.push(senses);
            blocks.part_of.push(part_of);
        }
        own.parts.end = blocks.closed_parts.len() as u32;
        let index = blocks.closed.len() as u32;
        memory::reserve(&mut blocks.closed, 1, "meshlets")?;
        blocks.closed.push(own);
        Ok(Some(index))
    }

    /// The areas of its triangles as seen along each axis, added up.
    fn facing(&self, positions: &[Vec3]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for corners in &self.corners {
            let [a, b, c] =
                corners.map(|corner| positions[self.vertices[usize::from(corner)] as usize]);
            for (sum, double) in sum.iter_mut().zip(cross(sub(b, a), sub(c, a))) {
                *sum += 0.5 * double.abs();
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "an estimate")]
        sum.map(|area| area as f32)
    }

    /// Appends it to `meshlets` and `blocks`, and begins the next one.
    fn close(
        &mut self,
        positions: &[Vec3],
        closed: &ClosedParts,
        end: u32,
        meshlets: &mut Vec<Meshlet>,
        blocks: &mut Blocks,
    ) -> Result<()> {
        if self.corners.is_empty() {
            return Ok(());
        }
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let first_vertex = blocks.high[0].len() as u32;
        let padded = self.vertices.len().next_multiple_of(LANES);
        let halves: [Vec<(f32, f32)>; 3] = std::array::from_fn(|k| {
            (0..padded)
                .map(|i| {
                    // Padding repeats the first vertex.
                    let v = self.vertices.get(i).unwrap_or(&self.vertices[0]);
                    let x = positions[*v as usize][k];
                    min[k] = min[k].min(x);
                    max[k] = max[k].max(x);
                    split(x)
                })
                .collect()
        });
        let facing = self.facing(positions);
        let is_wide = halves.iter().flatten().any(|(_, low)| *low != 0.0);
        let first_low = is_wide.then_some(blocks.low[0].len() as u32);
        for (k, halves) in halves.iter().enumerate() {
            memory::reserve(&mut blocks.high[k], padded, "vertices")?;
            blocks.high[k].extend(halves.iter().map(|(high, _)| high));
            if is_wide {
                memory::reserve(&mut blocks.low[k], padded, "vertices")?;
                blocks.low[k].extend(halves.iter().map(|(_, low)| low));
            }
        }
        let first_group = blocks.corners.len() as u32;
        for group in self.corners.chunks(LANES) {
            // Padding is a triangle of no area.
            let corner = |k: usize, lane: usize| group.get(lane).map_or(0, |c| c[k]);
            blocks
                .corners
                .push(std::array::from_fn(|k| std::array::from_fn(|lane| corner(k, lane))));
        }
        let first_part = blocks.parts.len() as u32;
        memory::reserve(&mut blocks.parts, self.corners.len().div_ceil(PART), "meshlets")?;
        for part in self.corners.chunks(PART) {
            let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            let mut vertices = 0;
            for corner in part.as_flattened() {
                vertices |= 1 << (usize::from(*corner) / LANES);
                let p = positions[self.vertices[usize::from(*corner)] as usize];
                for k in 0..3 {
                    min[k] = min[k].min(p[k]);
                    max[k] = max[k].max(p[k]);
                }
            }
            blocks.parts.push(Part { min, max, vertices });
        }
        let closed = self.closed_of(closed, blocks)?;
        meshlets.push(Meshlet {
            min,
            max,
            triangles: end - self.corners.len() as u32..end,
            first_vertex,
            num_vertices: self.vertices.len() as u32,
            first_group,
            first_part,
            first_low,
            facing,
            closed,
        });
        self.vertices.clear();
        self.corners.clear();
        self.given.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of n x n squares, two triangles each, in an order that is not that of space.
    fn grid(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let at = |x, y| y * (n + 1) + x;
        let positions = (0..=n)
            .flat_map(|y| (0..=n).map(move |x| [f64::from(x) + 0.1, f64::from(y), 1e6]))
            .collect();
        let mut triangles: Vec<[u32; 3]> = (0..n)
            .flat_map(|y| (0..n).map(move |x| (x, y)))
            .flat_map(|(x, y)| {
                [
                    [at(x, y), at(x + 1, y), at(x, y + 1)],
                    [at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)],
                ]
            })
            .collect();
        let len = triangles.len();
        for i in 0..len {
            triangles.swap(i, (i * 7919) % len);
        }
        (positions, triangles)
    }

    #[test]
    fn areas_as_seen_along_the_axes() {
        let (positions, mut triangles) = grid(60);
        let (mut meshlets, mut blocks) = (Vec::new(), Blocks::default());
        cluster(&positions, &mut triangles, 0, &mut meshlets, &mut blocks).unwrap();
        for meshlet in &meshlets {
            let triangles = meshlet.triangles.len() as f32;
            assert_eq!(meshlet.facing[..2], [0.0, 0.0]);
            assert!((meshlet.facing[2] - 0.5 * triangles).abs() < 1e-3);
        }
    }

    #[test]
    fn every_triangle_is_in_one_meshlet_whose_block_and_box_hold_it() {
        let (positions, given) = grid(60);
        let mut triangles = given.clone();
        let (mut meshlets, mut blocks) = (Vec::new(), Blocks::default());
        cluster(&positions, &mut triangles, 10, &mut meshlets, &mut blocks).unwrap();
        let sorted = |mut t: Vec<[u32; 3]>| {
            t.sort_unstable();
            t
        };
        assert_eq!(sorted(triangles.clone()), sorted(given));
        let mut next = 10;
        for m in &meshlets {
            assert_eq!(m.triangles.start, next);
            next = m.triangles.end;
            assert!(m.triangles.len() <= MAX_TRIANGLES && m.num_vertices as usize <= MAX_VERTICES);
            for (i, t) in m.triangles.clone().enumerate() {
                let Part { min: low, max: high, vertices } =
                    &blocks.parts[m.first_part as usize + i / PART];
                let corners = blocks.corners[m.first_group as usize + i / LANES];
                for (k, v) in triangles[t as usize - 10].iter().enumerate() {
                    let local = u32::from(corners[k][i % LANES]);
                    assert!(local < m.num_vertices);
                    assert!(vertices >> (local as usize / LANES) & 1 == 1);
                    for (axis, p) in positions[*v as usize].into_iter().enumerate() {
                        assert!((m.min[axis]..=m.max[axis]).contains(&p));
                        assert!((low[axis]..=high[axis]).contains(&p));
                        assert!(m.min[axis] <= low[axis] && high[axis] <= m.max[axis]);
                        let high = blocks.high[axis][(m.first_vertex + local) as usize];
                        let low = blocks.low[axis][(m.first_low.unwrap() + local) as usize];
                        assert!((f64::from(high) + f64::from(low) - p).abs() < 1e-13);
                    }
                }
            }
        }
        assert_eq!(next, 10 + triangles.len() as u32);
        // The grid has 7,200 triangles, so most meshlets are nearly full.
        assert!(meshlets.len() < 100, "{}", meshlets.len());
    }
}
