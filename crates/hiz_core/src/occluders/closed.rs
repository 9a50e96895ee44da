//! The closed parts of a mesh: which triangles bound a solid, and from which side.
//!
//! A **part** is a set of triangles that hang together by their vertices.
//! It is **closed** if its border is zero: each directed edge comes as often in the one direction
//! as in the other, where vertices at equal positions are one.
//! Each ray from outside meets a face of a closed part that it enters by before, or where, it meets
//! one that it leaves by, unless a lobe of the part is inside out.
//! So faces that leave need not be drawn.
//!
//! Borders are sums of random numbers, as in fingerprints of sets: around a vertex each triangle
//! adds the number of the next corner and takes away that of the one before.
//! The sum is 0 where all edges cancel, and elsewhere with a chance of about 2^-64.
//! A wrong answer could lose an occluder; it could not hide what can be seen.
//!
//! Which side is outside tells the sign of the volume.
//! A part whose triangles all face away from one point has no lobe that is inside out.
//! Elsewhere such lobes are looked for along lines: how deep a line is inside of the part must never
//! fall below 0.
//! None of it depends on the order of the triangles.

use crate::error::Result;
use crate::host::forest::Forest;
use crate::host::linear::{Vec3, cross, dot, sub};
use crate::host::memory;

/// The closed parts of one mesh.
#[derive(Debug, Default)]
pub(crate) struct ClosedParts {
    /// By triangle: its part, or [`OPEN`]; empty where no part is closed.
    part_of: Vec<u32>,
    parts: Vec<ClosedPart>,
}

/// A closed part of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ClosedPart {
    /// The box around it, in mesh coordinates.
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
    /// 1 if its triangles are counter-clockwise as seen from outside, and -1 if clockwise.
    pub(crate) sense: i8,
}

/// The triangle's part is not closed.
const OPEN: u32 = u32::MAX;

impl ClosedParts {
    /// The closed parts of a mesh, of which `triangles` are indices into `positions`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub(crate) fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let numbers = memory::collected(positions.iter().map(|p| mixed(*p)), "vertices")?;
        let (mut forest, is_open) = connected(&numbers, triangles)?;
        // By root: the number of its part.
        let mut part_at = memory::filled(positions.len(), OPEN, "vertices")?;
        let mut sizes = Vec::new();
        let mut part_of = memory::list(triangles.len(), "triangles")?;
        for triangle in triangles {
            let root = forest.root(triangle[0]) as usize;
            if is_open[root] {
                part_of.push(OPEN);
                continue;
            }
            if part_at[root] == OPEN {
                part_at[root] = sizes.len() as u32;
                memory::reserve(&mut sizes, 1, "parts")?;
                sizes.push(0);
            }
            sizes[part_at[root] as usize] += 1;
            part_of.push(part_at[root]);
        }
        if sizes.is_empty() {
            return Ok(Self::default());
        }
        drop(part_at);
        let mut by_part = memory::filled(sizes.iter().sum(), 0, "triangles")?;
        let ends = sizes.iter_mut().scan(0, |end, size| {
            *end += std::mem::replace(size, *end);
            Some(*end)
        });
        let ends = ends.collect::<Vec<usize>>();
        for (triangle, part) in (0..).zip(&part_of).filter(|(_, part)| **part != OPEN) {
            let next = &mut sizes[*part as usize];
            by_part[*next] = triangle;
            *next += 1;
        }
        let mut parts = memory::list(ends.len(), "parts")?;
        // By part as it was found: its number among those that stay.
        let mut stays = memory::list(ends.len(), "parts")?;
        let mut lines = Lines::default();
        let mut begin = 0;
        for end in ends {
            let own = &by_part[begin..end];
            begin = end;
            let corners = |i: u32| {
                let [a, b, c] = triangles[i as usize];
                [positions[a as usize], positions[b as usize], positions[c as usize]]
            };
            let number = |i: u32| {
                let [a, b, c] = triangles[i as usize];
                let sum = numbers[a as usize].wrapping_add(numbers[b as usize]);
                sum.wrapping_add(numbers[c as usize])
            };
            let part = solid(own, corners)
                .filter(|Solid { part, is_star }| {
                    *is_star
                        || (0..3).all(|axis| {
                            lines.find_nothing_inside_out(axis, own, corners, number, part)
                        })
                })
                .map(|solid| solid.part);
            stays.push(part.map_or(OPEN, |_| parts.len() as u32));
            parts.extend(part);
        }
        if parts.is_empty() {
            return Ok(Self::default());
        }
        for part in part_of.iter_mut().filter(|part| **part != OPEN) {
            *part = stays[*part as usize];
        }
        Ok(Self { part_of, parts })
    }

    /// The number of the part that a triangle belongs to; `None` if it is not closed.
    #[inline]
    pub(crate) fn number_of(&self, triangle: u32) -> Option<u32> {
        self.part_of.get(triangle as usize).copied().filter(|part| *part != OPEN)
    }

    /// All of them.
    pub(crate) fn parts(&self) -> &[ClosedPart] {
        &self.parts
    }
}

/// A number for a position that looks random (finalizers of Appleby's `MurmurHash3`).
fn mixed(p: Vec3) -> u64 {
    let mut number = 0x9E37_79B9_7F4A_7C15_u64;
    for x in p {
        // -0 and 0 are one place.
        number ^= (x + 0.0).to_bits();
        number = (number ^ (number >> 33)).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
        number = (number ^ (number >> 33)).wrapping_mul(0xC4CE_B9FE_1A85_EC53);
    }
    number ^ (number >> 33)
}

/// The parts of a mesh, and by root whether its part is open.
///
/// Vertices at equal positions are joined where the border about one of them alone is not zero.
fn connected(numbers: &[u64], triangles: &[[u32; 3]]) -> Result<(Forest, Vec<bool>)> {
    let count = numbers.len();
    let mut forest = Forest::new(count as u32, "vertices")?;
    // The border about each vertex: what comes next, less what came before.
    let mut borders = memory::filled(count, 0_u64, "vertices")?;
    for triangle in triangles {
        let [a, b, c] = *triangle;
        let [a, b, c] = [numbers[a as usize], numbers[b as usize], numbers[c as usize]];
        for (v, edges) in
            triangle.iter().zip([b.wrapping_sub(c), c.wrapping_sub(a), a.wrapping_sub(b)])
        {
            let border = &mut borders[*v as usize];
            *border = border.wrapping_add(edges);
        }
        forest.join(triangle[0], triangle[1]);
        forest.join(triangle[1], triangle[2]);
    }
    weld(numbers, &mut borders, &mut forest)?;
    let mut is_open = memory::filled(count, false, "vertices")?;
    for (vertex, border) in (0..).zip(borders) {
        if border != 0 {
            is_open[forest.root(vertex) as usize] = true;
        }
    }
    Ok((forest, is_open))
}

/// Joins vertices at equal positions with borders other than 0, and adds those up at one of them.
fn weld(numbers: &[u64], borders: &mut [u64], forest: &mut Forest) -> Result<()> {
    const EMPTY: u32 = u32::MAX;
    let count = borders.iter().filter(|border| **border != 0).count();
    let slots = (2 * count).next_power_of_two();
    let mut table = memory::filled(slots, EMPTY, "vertices")?;
    for vertex in 0..borders.len() {
        if borders[vertex] == 0 {
            continue;
        }
        #[expect(clippy::cast_possible_truncation, reason = "some bits of the number")]
        let mut slot = numbers[vertex] as usize & (slots - 1);
        loop {
            let other = table[slot] as usize;
            if table[slot] == EMPTY {
                table[slot] = vertex as u32;
                break;
            }
            if numbers[other] == numbers[vertex] {
                borders[other] = borders[other].wrapping_add(std::mem::take(&mut borders[vertex]));
                forest.join(other as u32, vertex as u32);
                break;
            }
            slot = (slot + 1) & (slots - 1);
        }
    }
    Ok(())
}

/// What is known of a part before lines are tried.
struct Solid {
    part: ClosedPart,
    /// Whether all of its triangles face away from one point.
    ///
    /// Then it is a sum of tetrahedra from there that all have its sense, so no lobe of it is
    /// inside out.
    is_star: bool,
}

/// A part with its box and its sense; `None` where the sign of its volume is not sure.
fn solid(own: &[u32], corners: impl Fn(u32) -> [Vec3; 3]) -> Option<Solid> {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for i in own {
        let [a, b, c] = corners(*i);
        for k in 0..3 {
            min[k] = least(min[k], least(least(a[k], b[k]), c[k]));
            max[k] = greatest(max[k], greatest(greatest(a[k], b[k]), c[k]));
        }
    }
    let middle = [0, 1, 2].map(|k: usize| 0.5 * (min[k] + max[k]));
    let (mut volume, mut size) = (0.0, 0.0);
    let (mut smallest, mut largest) = (0.0, 0.0);
    for i in own {
        let [a, b, c] = corners(*i);
        let (along, across) = (sub(b, a), sub(c, a));
        let term = dot(sub(a, middle), cross(along, across));
        volume += term;
        let length = |p: Vec3| p[0].abs() + p[1].abs() + p[2].abs();
        size += length(along) * length(across);
        (smallest, largest) = (least(smallest, term), greatest(largest, term));
    }
    // A term rounds by a few epsilon times the product of these lengths, and their sum by one for
    // each of them.
    size *= (0..3).map(|k| max[k] - min[k]).sum::<f64>();
    let is_sure = volume.abs() > size * (own.len() as f64 + 64.0) * f64::EPSILON;
    (is_sure && size.is_finite()).then_some(Solid {
        part: ClosedPart { min, max, sense: if volume > 0.0 { 1 } else { -1 } },
        is_star: smallest == 0.0 || largest == 0.0,
    })
}

/// `a` where it is less, else `b`: one instruction, unlike `f64::min`.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greatest(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// How many lines are tried along each axis.
const LINES: usize = 4;

/// Lines along an axis that run through a part.
#[derive(Default)]
struct Lines {
    /// Where they cross it: which line, where along it, and whether it enters.
    crossings: Vec<(usize, f64, bool)>,
}

impl Lines {
    /// Whether no line along `axis` that was tried runs through a lobe of the part that is inside
    /// out.
    ///
    /// A lobe's triangles have it on their outside.
    /// So the lines go through some triangles of the part: those with the least of random numbers.
    fn find_nothing_inside_out(
        &mut self,
        axis: usize,
        own: &[u32],
        corners: impl Fn(u32) -> [Vec3; 3],
        number: impl Fn(u32) -> u64,
        part: &ClosedPart,
    ) -> bool {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let corners_of = |i: u32| {
            let [a, b, c] = corners(i);
            [[a[u], a[v]], [b[u], b[v]], [c[u], c[v]]]
        };
        let at = places(own, corners_of, number);
        let ClosedPart { min, max, sense } = part;
        let tied = 1e-9 * (max[axis] - min[axis]);
        self.crossings.clear();
        // A line that meets an edge tells nothing.
        let mut is_void = [false; LINES];
        for i in own {
            let [a, b, c] = corners_of(*i);
            let ends =
                |k: usize| (least(least(a[k], b[k]), c[k]), greatest(greatest(a[k], b[k]), c[k]));
            let ((left, right), (low, high)) = (ends(0), ends(1));
            let mut is_near = [false; LINES];
            for l in 0..LINES {
                is_near[l] = (left <= at[0][l])
                    & (at[0][l] <= right)
                    & (low <= at[1][l])
                    & (at[1][l] <= high);
            }
            if is_near == [false; LINES] {
                continue;
            }
            for l in (0..LINES).filter(|l| is_near[*l]) {
                let from = |p: [f64; 2]| [p[0] - at[0][l], p[1] - at[1][l]];
                let (a, b, c) = (from(a), from(b), from(c));
                // The same numbers for both triangles of an edge, up to their signs.
                let [p, q, r] = [turn(b, c), turn(c, a), turn(a, b)];
                let is_up = (p >= 0.0) & (q >= 0.0) & (r >= 0.0);
                if !is_up && !((p <= 0.0) & (q <= 0.0) & (r <= 0.0)) {
                    continue;
                }
                is_void[l] |= (p == 0.0) | (q == 0.0) | (r == 0.0);
                let [a, b, c] = corners(*i);
                let (a, b, c) = (a[axis], b[axis], c[axis]);
                let place = (p * a + q * b + r * c) / (p + q + r);
                let enters = is_up == (*sense < 0);
                // Faces that touch are entered first.
                self.crossings.push((l, if enters { place - tied } else { place }, enters));
            }
        }
        self.crossings
            .sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(b.2.cmp(&a.2)));
        let (mut depth, mut last) = (0, 0);
        self.crossings.iter().all(|(line, _, enters)| {
            if *line != last {
                (depth, last) = (0, *line);
            }
            depth += if *enters { 1 } else { -1 };
            depth >= 0 || is_void[*line]
        })
    }
}

/// Twice the area of a triangle whose third corner is the origin.
fn turn(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Where lines run: through some of the triangles.
fn places(
    own: &[u32],
    corners: impl Fn(u32) -> [[f64; 2]; 3],
    number: impl Fn(u32) -> u64,
) -> [[f64; LINES]; 2] {
    let mut chosen = [(u64::MAX, 0); LINES];
    let mut count = 0;
    for i in own {
        let key = (number(*i), *i);
        if key >= chosen[LINES - 1] {
            continue;
        }
        let [a, b, c] = corners(*i);
        let from_a = |p: [f64; 2]| [p[0] - a[0], p[1] - a[1]];
        if turn(from_a(b), from_a(c)) == 0.0 {
            continue;
        }
        let mut place = LINES - 1;
        while place > 0 && key < chosen[place - 1] {
            chosen[place] = chosen[place - 1];
            place -= 1;
        }
        chosen[place] = key;
        count = LINES.min(count + 1);
    }
    // NaN is near nothing.
    let mut at = [[f64::NAN; LINES]; 2];
    for (l, (_, i)) in chosen[..count].iter().enumerate() {
        // Somewhere within, but on no diagonal.
        const WEIGHTS: [f64; 3] = [0.416_421_356, 0.317_837_245, 0.265_741_399];
        let [a, b, c] = corners(*i);
        for (k, at) in at.iter_mut().enumerate() {
            at[l] = WEIGHTS[0] * a[k] + WEIGHTS[1] * b[k] + WEIGHTS[2] * c[k];
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Default)]
    struct Mesh {
        positions: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
    }

    impl Mesh {
        fn add(&mut self, other: &Self) -> &mut Self {
            let first = self.positions.len() as u32;
            self.positions.extend(&other.positions);
            self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
            self
        }

        /// Each triangle with vertices of its own.
        fn apart(&self) -> Self {
            let positions =
                self.triangles.as_flattened().iter().map(|v| self.positions[*v as usize]);
            let count = self.triangles.len() as u32;
            let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            Self { positions: positions.collect(), triangles }
        }

        fn turned(&self) -> Self {
            let mut turned = self.clone();
            turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            turned
        }

        /// By triangle: its sense, 0 if its part is open.
        fn senses(&self) -> Vec<i8> {
            let closed = ClosedParts::of(&self.positions, &self.triangles).unwrap();
            let sense = |number: u32| closed.parts()[number as usize].sense;
            let of = |i: usize| closed.number_of(i as u32).map_or(0, sense);
            (0..self.triangles.len()).map(of).collect()
        }

        #[track_caller]
        fn expect(&self, sense: i8) {
            assert_eq!(self.senses(), vec![sense; self.triangles.len()]);
        }
    }

    /// A prism over a polygon of the plane, from z = 0 to z = 1.
    ///
    /// Its caps are fans, so that the polygon may be any.
    fn prism(polygon: &[[f64; 2]]) -> Mesh {
        let n = polygon.len() as u32;
        let at = |z: f64| polygon.iter().map(move |p| [p[0], p[1], z]);
        let mut mesh = Mesh { positions: at(0.0).chain(at(1.0)).collect(), triangles: vec![] };
        for i in 0..n {
            let j = (i + 1) % n;
            mesh.triangles.extend([[i, j, n + i], [j, n + j, n + i]]);
            if i > 0 && j > 0 {
                mesh.triangles.extend([[0, j, i], [n, n + i, n + j]]);
            }
        }
        mesh
    }

    fn cube(at: Vec3) -> Mesh {
        let mut cube = prism(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        for p in &mut cube.positions {
            *p = std::array::from_fn(|k| p[k] + at[k]);
        }
        cube
    }

    /// n x n squares that are bent into a torus.
    fn torus(n: u32) -> Mesh {
        let angle = |k: u32| f64::from(k) / f64::from(n) * std::f64::consts::TAU;
        let positions = (0..n * n).map(|i| {
            let ((s, c), (t, d)) = (angle(i / n).sin_cos(), angle(i % n).sin_cos());
            [(3.0 + d) * c, (3.0 + d) * s, t]
        });
        let triangles = (0..n * n).flat_map(|i| {
            let (row, column) = (i / n, i % n);
            let at = |row: u32, column: u32| row % n * n + column % n;
            let [a, b] = [at(row, column), at(row + 1, column)];
            let [c, d] = [at(row, column + 1), at(row + 1, column + 1)];
            [[a, b, c], [c, b, d]]
        });
        Mesh { positions: positions.collect(), triangles: triangles.collect() }
    }

    #[test]
    fn solids_are_closed_and_know_their_sense() {
        for mesh in [cube([0.0; 3]), cube([1e6, -0.0, 0.1]), torus(40)] {
            for mesh in [mesh.clone(), mesh.apart()] {
                mesh.expect(1);
                mesh.turned().expect(-1);
            }
        }
        // A concave one.
        prism(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0]]).expect(1);
    }

    #[test]
    fn the_box_is_that_of_the_part() {
        let mut mesh = cube([0.0; 3]);
        mesh.add(&cube([5.0, 6.0, 7.0]).turned());
        let closed = ClosedParts::of(&mesh.positions, &mesh.triangles).unwrap();
        let expected = [
            ClosedPart { min: [0.0; 3], max: [1.0; 3], sense: 1 },
            ClosedPart { min: [5.0, 6.0, 7.0], max: [6.0, 7.0, 8.0], sense: -1 },
        ];
        assert_eq!(closed.parts(), expected);
        assert_eq!(closed.number_of(0), Some(0));
        assert_eq!(closed.number_of(12), Some(1));
    }

    #[test]
    fn whatever_has_a_border_is_open() {
        for left_out in 0..12 {
            let mut mesh = cube([0.0; 3]);
            mesh.triangles.remove(left_out);
            mesh.expect(0);
            mesh.apart().expect(0);
            // One triangle is the wrong way round.
            let mut mesh = cube([0.0; 3]);
            mesh.triangles[left_out].swap(0, 1);
            mesh.expect(0);
            // One triangle comes twice.
            let mut mesh = cube([0.0; 3]);
            mesh.triangles.push(mesh.triangles[left_out]);
            mesh.expect(0);
        }
        Mesh::default().expect(0);
    }

    #[test]
    fn parts_are_told_apart_by_positions() {
        let mut open = cube([3.0, 0.0, 0.0]);
        open.triangles.pop();
        let mut mesh = cube([0.0; 3]);
        mesh.add(&open).add(&cube([0.5; 3]).turned());
        let expected = [vec![1; 12], vec![0; 11], vec![-1; 12]].concat();
        assert_eq!(mesh.senses(), expected);
        assert_eq!(mesh.apart().senses(), expected);
        // It touches the open one, and is closed by itself.
        let mut mesh = cube([2.0, 0.0, 0.0]);
        mesh.add(&open);
        assert_eq!(mesh.senses(), [vec![1; 12], vec![0; 11]].concat());
    }

    #[test]
    fn what_has_no_volume_is_open() {
        let mut sheet = Mesh {
            positions: vec![[0.1, 0.2, 0.3], [1.0, 0.7, 0.9], [0.3, 0.9, 0.1]],
            triangles: vec![[0, 1, 2]],
        };
        let back = sheet.turned();
        sheet.add(&back).expect(0);
    }

    #[test]
    fn what_is_inside_out_somewhere_is_open() {
        // Two lobes of unequal size, which turn in opposite directions.
        let bow = prism(&[[0.0, 0.0], [3.0, 3.0], [3.0, 0.0], [0.0, 1.0]]);
        bow.expect(0);
        bow.turned().expect(0);
        // Two cubes that share a vertex; one is inside out, and smaller.
        let mut pair = cube([0.0; 3]);
        let mut small = cube([0.0; 3]).turned();
        small.positions.iter_mut().for_each(|p| *p = p.map(|x| 1.0 + 0.9 * x));
        pair.add(&small);
        assert_eq!(pair.senses(), [vec![1; 12], vec![-1; 12]].concat());
        let shared = pair.positions.iter().position(|p| *p == [1.0; 3]).unwrap() as u32;
        for v in pair.triangles.as_flattened_mut() {
            if pair.positions[*v as usize] == [1.0; 3] {
                *v = shared;
            }
        }
        pair.expect(0);
    }

    #[test]
    fn lobes_may_lie_within_one_another() {
        // A pentagram winds twice around its middle, and never backwards.
        let corner = |k: u32| {
            let angle = f64::from(k * 2 % 5) / 5.0 * std::f64::consts::TAU + 0.1;
            [angle.cos(), angle.sin()]
        };
        let star: Vec<_> = (0..5).map(corner).collect();
        prism(&star).expect(1);
        // Two cubes that overlap and share a vertex: a part of the mesh, and no worse for it.
        let mut pair = cube([0.0; 3]);
        let mut other = cube([0.5; 3]);
        other.triangles.as_flattened_mut().iter_mut().for_each(|v| *v += 8);
        other.triangles.iter_mut().for_each(|t| *t = t.map(|v| if v == 8 { 0 } else { v }));
        pair.positions.extend(&other.positions);
        pair.triangles.extend(&other.triangles);
        // The shared vertex pulls one corner of the second cube to that of the first.
        pair.expect(1);
    }

    #[test]
    fn the_order_of_the_triangles_does_not_matter() {
        let mut mesh = torus(30);
        let mut open = torus(8);
        open.triangles.pop();
        mesh.add(&open).add(&cube([0.5; 3]).turned());
        let expected = mesh.senses();
        let mut order: Vec<usize> = (0..mesh.triangles.len()).collect();
        let len = order.len();
        for i in 0..len {
            order.swap(i, (i * 7919) % len);
        }
        mesh.triangles = order.iter().map(|i| mesh.triangles[*i]).collect();
        let shuffled: Vec<i8> = order.iter().map(|i| expected[*i]).collect();
        assert_eq!(mesh.senses(), shuffled);
    }
}
