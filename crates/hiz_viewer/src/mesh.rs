//! Triangle meshes with a colour and a normal per vertex, and how far two of them differ.

use hiz_core::Vec3;

/// A vertex as the device reads it; twin: `shaders/scene.wgsl`, `Vertex`.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Vertex {
    /// In the mesh's own coordinates.
    pub(crate) position: [f32; 3],
    /// A unit vector in 127ths, and the LOD that the vertex belongs to.
    pub(crate) normal: [i8; 4],
    /// Red, green, blue, and 255.
    pub(crate) colour: [u8; 4],
}

/// Triangles of one LOD.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) indices: Vec<u32>,
}

pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a + t b`.
pub(crate) fn along(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    [0, 1, 2].map(|k| a[k] + t * b[k])
}

/// A vector of length 1, or up for a vector of length 0.
pub(crate) fn unit(v: Vec3) -> Vec3 {
    let length = dot(v, v).sqrt();
    if length > 0.0 { v.map(|x| x / length) } else { [0.0, 1.0, 0.0] }
}

fn wide(p: [f32; 3]) -> Vec3 {
    p.map(f64::from)
}

impl Mesh {
    pub(crate) fn num_triangles(&self) -> usize {
        self.indices.len() / 3
    }

    /// Appends a vertex and returns its index.
    pub(crate) fn push(&mut self, position: Vec3, normal: Vec3, colour: [f32; 3]) -> u32 {
        let [x, y, z] = unit(normal).map(|v| (127.0 * v).round() as i8);
        let [r, g, b] = colour.map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8);
        let position = position.map(|v| v as f32);
        self.vertices.push(Vertex { position, normal: [x, y, z, 0], colour: [r, g, b, 255] });
        self.vertices.len() as u32 - 1
    }

    /// Appends an axis-aligned box.
    pub(crate) fn push_box(&mut self, min: Vec3, max: Vec3, colour: [f32; 3]) {
        for axis in 0..3 {
            for side in 0..2 {
                let corner = |u: usize, v: usize| {
                    let mut sides = [0; 3];
                    sides[axis] = side;
                    sides[(axis + 1) % 3] = u;
                    sides[(axis + 2) % 3] = v;
                    [0, 1, 2].map(|k| [min, max][sides[k]][k])
                };
                let mut normal = [0.0; 3];
                normal[axis] = [-1.0, 1.0][side];
                let first = self.vertices.len() as u32;
                for (u, v) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                    self.push(corner(u, v), normal, colour);
                }
                self.indices.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
            }
        }
    }

    /// Appends a cone without a floor around the y axis, with smooth sides.
    pub(crate) fn push_cone(
        &mut self,
        sides: u32,
        [bottom, top]: [f64; 2],
        radius: f64,
        colour: [f32; 3],
    ) {
        let first = self.vertices.len() as u32;
        let slope = radius / (top - bottom);
        let tip = self.push([0.0, top, 0.0], [0.0, 1.0, 0.0], colour);
        for k in 0..sides {
            let (sin, cos) = (f64::from(k) / f64::from(sides) * std::f64::consts::TAU).sin_cos();
            self.push([radius * cos, bottom, radius * sin], [cos, slope, sin], colour);
        }
        for k in 0..sides {
            self.indices.extend([tip, first + 1 + (k + 1) % sides, first + 1 + k]);
        }
    }

    /// A sphere of radius 1 with `points` on each circle, inside of the round sphere.
    ///
    /// There are `points` meridians and half as many bands between the poles.
    pub(crate) fn sphere(points: u32, colour: [f32; 3]) -> Self {
        let mut mesh = Self::default();
        let bands = points / 2;
        let at = |band: u32, turn: u32| -> Vec3 {
            let (s, c) = (f64::from(band) / f64::from(bands) * std::f64::consts::PI).sin_cos();
            let (x, z) = (f64::from(turn) / f64::from(points) * std::f64::consts::TAU).sin_cos();
            // A hair inside, so that rounding to float32 never leaves the sphere.
            [s * x, c, s * z].map(|v| v * (1.0 - 1e-6))
        };
        for band in 0..=bands {
            for turn in 0..points {
                mesh.push(at(band, turn), at(band, turn), colour);
            }
        }
        for band in 0..bands {
            for turn in 0..points {
                let next = (turn + 1) % points;
                let [a, b] = [turn, next].map(|t| band * points + t);
                let [c, d] = [turn, next].map(|t| (band + 1) * points + t);
                if band > 0 {
                    mesh.indices.extend([a, c, b]);
                }
                if band + 1 < bands {
                    mesh.indices.extend([b, c, d]);
                }
            }
        }
        mesh
    }

    /// Marks all vertices as those of a LOD.
    pub(crate) fn of_lod(mut self, lod: usize) -> Self {
        for vertex in &mut self.vertices {
            vertex.normal[3] = lod as i8;
        }
        self
    }

    /// The radius of the largest ball around the origin that no triangle's plane cuts.
    pub(crate) fn inner_radius(&self) -> f64 {
        let from_origin = |[a, b, c]: [Vec3; 3]| {
            let normal = unit(cross(sub(b, a), sub(c, a)));
            dot(a, normal).abs()
        };
        self.triangles().map(from_origin).fold(f64::MAX, f64::min)
    }

    fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        self.indices
            .chunks_exact(3)
            .map(|t| [0, 1, 2].map(|k| wide(self.vertices[t[k] as usize].position)))
    }

    /// How far any point of this surface is from `other`, at most.
    ///
    /// The distance of points changes by no more than the points move.
    /// So points at most `step` apart, and `step` added to their greatest distance, are a bound.
    fn one_sided(&self, other: &Self, step: f64) -> f64 {
        let theirs: Vec<_> = other.triangles().collect();
        let mut worst = 0.0_f64;
        for [a, b, c] in self.triangles() {
            let longest = [sub(b, a), sub(c, b), sub(a, c)].map(|e| dot(e, e).sqrt());
            let cuts = (longest.into_iter().fold(0.0, f64::max) / step).ceil().max(1.0) as u32;
            for i in 0..=cuts {
                for j in 0..=cuts - i {
                    let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(cuts));
                    let p = along(along(a, sub(b, a), u), sub(c, a), v);
                    let nearest = theirs.iter().map(|t| distance(p, *t)).fold(f64::MAX, f64::min);
                    worst = worst.max(nearest);
                }
            }
        }
        worst + step
    }

    /// A bound on how far two surfaces are apart (Hausdorff), within about 2 % of `size`.
    pub(crate) fn deviation(&self, other: &Self, size: f64) -> f64 {
        let step = 0.02 * size;
        self.one_sided(other, step).max(other.one_sided(self, step))
    }
}

/// The distance of a point from a triangle (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
fn distance(p: Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
    let (ab, ac) = (sub(b, a), sub(c, a));
    let nearest_on = |a: Vec3, b: Vec3| {
        let edge = sub(b, a);
        let t = dot(sub(p, a), edge) / dot(edge, edge).max(f64::MIN_POSITIVE);
        along(a, edge, t.clamp(0.0, 1.0))
    };
    let normal = cross(ab, ac);
    let area = dot(normal, normal);
    let inside = area > 0.0
        && [(a, b), (b, c), (c, a)]
            .into_iter()
            .all(|(from, to)| dot(cross(sub(to, from), sub(p, from)), normal) >= 0.0);
    if inside {
        return dot(sub(p, a), normal).abs() / area.sqrt();
    }
    [(a, b), (b, c), (c, a)]
        .into_iter()
        .map(|(from, to)| {
            let away = sub(p, nearest_on(from, to));
            dot(away, away).sqrt()
        })
        .fold(f64::MAX, f64::min)
}
