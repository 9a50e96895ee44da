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
//! Lobes that are inside out are looked for along lines: how deep a line is inside of the part must
//! never fall below 0.
//! None of it depends on the order of the triangles.

use crate::error::Result;
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
        let mut part_at = filled(positions.len(), OPEN)?;
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
        let mut by_part = filled(sizes.iter().sum(), 0)?;
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
        let mut begin = 0;
        for end in ends {
            let own = &by_part[begin..end];
            begin = end;
            let corners = |i: u32| triangles[i as usize].map(|v| positions[v as usize]);
            let number = |i: u32| {
                let [a, b, c] = triangles[i as usize].map(|v| numbers[v as usize]);
                a.wrapping_add(b).wrapping_add(c)
            };
            let part =
                solid(own, corners).filter(|part| is_never_inside_out(own, corners, number, part));
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

    /// The part that a triangle belongs to; `None` if it is not closed.
    #[inline]
    pub(crate) fn part_of(&self, triangle: u32) -> Option<&ClosedPart> {
        self.parts.get(self.number_of(triangle)? as usize)
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

/// A number for a position that looks random (finalizers of Appleby's MurmurHash3).
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

/// A list of equal values.
fn filled<T: Clone>(len: usize, value: T) -> Result<Vec<T>> {
    let mut list = memory::list(len, "vertices")?;
    list.resize(len, value);
    Ok(list)
}

/// Sets of vertices that hang together, as trees (Galler and Fischer 1964).
struct Forest(Vec<u32>);

impl Forest {
    #[inline]
    fn root(&mut self, mut vertex: u32) -> u32 {
        loop {
            let parent = self.0[vertex as usize];
            if parent == vertex {
                return vertex;
            }
            // Paths are halved on the way.
            let above = self.0[parent as usize];
            self.0[vertex as usize] = above;
            vertex = above;
        }
    }

    #[inline]
    fn join(&mut self, a: u32, b: u32) {
        if self.0[a as usize] == self.0[b as usize] {
            return;
        }
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// The parts of a mesh, and by root whether its part is open.
///
/// Vertices at equal positions are joined where the border about one of them alone is not zero.
fn connected(numbers: &[u64], triangles: &[[u32; 3]]) -> Result<(Forest, Vec<bool>)> {
    let count = numbers.len();
    let mut forest = Forest(memory::collected(0..count as u32, "vertices")?);
    // The border about each vertex: what comes next, less what came before.
    let mut borders = filled(count, 0_u64)?;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| numbers[v as usize]);
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
    let mut is_open = filled(count, false)?;
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
    let mut table = filled(slots, EMPTY)?;
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

/// A part with its box and its sense; `None` where the sign of its volume is not sure.
fn solid(own: &[u32], corners: impl Fn(u32) -> [Vec3; 3]) -> Option<ClosedPart> {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in own.iter().flat_map(|i| corners(*i)) {
        for k in 0..3 {
            min[k] = min[k].min(p[k]);
            max[k] = max[k].max(p[k]);
        }
    }
    let middle: Vec3 = std::array::from_fn(|k| 0.5 * (min[k] + max[k]));
    let (mut volume, mut size) = (0.0, 0.0);
    for i in own {
        let [a, b, c] = corners(*i).map(|p| sub(p, middle));
        volume += dot(a, cross(b, c));
        // More than the sizes of the product's terms.
        size += [a, b, c].map(|p| p[0].abs() + p[1].abs() + p[2].abs()).iter().product::<f64>();
    }
    // A sum of n terms rounds by less than n epsilon times their sizes.
    let is_sure = volume.abs() > size * (own.len() as f64 + 64.0) * f64::EPSILON;
    (is_sure && size.is_finite()).then_some(ClosedPart {
        min,
        max,
        sense: if volume > 0.0 { 1 } else { -1 },
    })
}

/// Lines along each axis through triangles of a part.
const LINES: usize = 8;
/// Triangles that lines go through.
const SAMPLES: usize = 12;

/// Lines along one axis: where they are along the next one, and along the one after that.
#[derive(Default)]
struct Lines {
    count: usize,
    at: [[f64; LINES]; 2],
}

/// Whether no line that was tried runs through a lobe of the part that is inside out.
///
/// A lobe's triangles have it on their outside, so the lines go through some triangles of the part:
/// those with the least of random numbers.
fn is_never_inside_out(
    own: &[u32],
    corners: impl Fn(u32) -> [Vec3; 3],
    number: impl Fn(u32) -> u64,
    part: &ClosedPart,
) -> bool {
    let mut chosen = [(u64::MAX, 0); SAMPLES];
    for i in own {
        let key = (number(*i), *i);
        if key < chosen[SAMPLES - 1] {
            let place = chosen.partition_point(|other| *other < key);
            chosen[place..].rotate_right(1);
            chosen[place] = key;
        }
    }
    let mut lines: [Lines; 3] = Default::default();
    for (_, i) in &chosen[..SAMPLES.min(own.len())] {
        // Somewhere within, but on no diagonal.
        const WEIGHTS: [f64; 3] = [0.416_421_356, 0.317_837_245, 0.265_741_399];
        let [a, b, c] = corners(*i);
        let normal = cross(sub(b, a), sub(c, a)).map(f64::abs);
        let axis = (0..3).fold(0, |most, k| if normal[k] > normal[most] { k } else { most });
        let lines = &mut lines[axis];
        if lines.count < LINES {
            for (along, at) in [(axis + 1) % 3, (axis + 2) % 3].into_iter().zip(&mut lines.at) {
                at[lines.count] =
                    WEIGHTS[0] * a[along] + WEIGHTS[1] * b[along] + WEIGHTS[2] * c[along];
            }
            lines.count += 1;
        }
    }
    let mut crossings: [[Crossings; LINES]; 3] = Default::default();
    for i in own {
        let corners = corners(*i);
        for (axis, (lines, crossings)) in lines.iter().zip(&mut crossings).enumerate() {
            let ends = [1, 2].map(|next| {
                let [a, b, c] = corners.map(|p| p[(axis + next) % 3]);
                (a.min(b).min(c), a.max(b).max(c))
            });
            let is_near = |l: usize| {
                let within =
                    |k: usize| (ends[k].0 <= lines.at[k][l]) & (lines.at[k][l] <= ends[k].1);
                within(0) & within(1)
            };
            for l in (0..lines.count).filter(|l| is_near(*l)) {
                crossings[l].add(&corners, axis, [lines.at[0][l], lines.at[1][l]], part);
            }
        }
    }
    crossings.as_flattened_mut().iter_mut().all(Crossings::are_never_inside_out)
}

/// Where one line crosses a part.
#[derive(Default)]
struct Crossings {
    /// Where along the line, and whether it enters.
    list: Vec<(f64, bool)>,
    /// It meets an edge, so it tells nothing.
    is_void: bool,
}

impl Crossings {
    fn add(&mut self, corners: &[Vec3; 3], axis: usize, at: [f64; 2], part: &ClosedPart) {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let [a, b, c] = corners.map(|p| [p[u] - at[0], p[v] - at[1]]);
        // The same numbers for both triangles of an edge, up to their signs.
        let turn = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let turns = [turn(b, c), turn(c, a), turn(a, b)];
        let is_up = turns.iter().all(|turn| *turn >= 0.0);
        if !is_up && !turns.iter().all(|turn| *turn <= 0.0) {
            return;
        }
        if turns.contains(&0.0) {
            self.is_void = true;
            return;
        }
        let sum = turns[0] + turns[1] + turns[2];
        let place = (0..3).map(|k| turns[k] / sum * corners[k][axis]).sum::<f64>();
        let enters = is_up == (part.sense < 0);
        // Faces that touch are entered first.
        let tied = 1e-9 * (part.max[axis] - part.min[axis]);
        self.list.push((if enters { place - tied } else { place }, enters));
    }

    fn are_never_inside_out(&mut self) -> bool {
        self.list.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        let mut depth = 0;
        self.is_void
            || self.list.iter().all(|(_, enters)| {
                depth += if *enters { 1 } else { -1 };
                depth >= 0
            })
    }
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
            let of = |i: usize| closed.part_of(i as u32).map_or(0, |part| part.sense);
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
        assert_eq!(closed.part_of(12), Some(&expected[1]));
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
