//! What is drawn, as data: bodies that are culled, walls that hide them, cameras.
//! No GPU here.

use hiz_core::{Bounds, Camera, Floats, Vec3};

/// A convex body in world coordinates.
/// Its bounds are exactly what is drawn, but for balls, which are drawn inside of theirs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// Axis-aligned.
    Box {
        min: Vec3,
        max: Vec3,
    },
    /// Turned by a matrix in C order.
    Turned {
        center: Vec3,
        half: Vec3,
        rotation: [f64; 9],
    },
    Ball {
        center: Vec3,
        radius: f64,
    },
}

/// What is culled, drawn or both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Body {
    pub(crate) shape: Shape,
    pub(crate) colour: [f32; 3],
}

/// Triangles of any kind, a colour for each vertex; flat faces have vertices of their own.
#[derive(Debug, Default, Clone)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vec3>,
    pub(crate) colours: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub(crate) fn append(&mut self, other: &Self) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(&other.vertices);
        self.colours.extend(&other.colours);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| first + v)));
    }

    /// The bodies one after another, each with as many vertices.
    pub(crate) fn of_bodies<'a>(bodies: impl IntoIterator<Item = &'a Body>) -> Self {
        let mut all = Self::default();
        for body in bodies {
            all.append(&body.mesh());
        }
        all
    }

    /// A triangle whose light comes from its normal.
    pub(crate) fn push_triangle(&mut self, corners: [Vec3; 3], colour: [f32; 3]) {
        let first = self.vertices.len() as u32;
        let lit = colour.map(|c| c * light(normal(corners)));
        self.vertices.extend(corners);
        self.colours.extend([lit; 3]);
        self.triangles.push([first, first + 1, first + 2]);
    }
}

/// The unit normal of a triangle; up where it has none.
pub(crate) fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { n.map(|x| x / length) } else { [0.0, 1.0, 0.0] }
}

/// Faces along x, y and z: 0.7, 1 and 0.85, both sides alike.
fn light(normal: Vec3) -> f32 {
    [0.7, 1.0, 0.85].iter().zip(normal).map(|(l, n)| l * n * n).sum::<f64>() as f32
}

/// Which of its two sides vertex `v` of a box takes on each axis: four vertices a face.
fn corner(v: usize) -> [usize; 3] {
    let axis = v / 8;
    let mut sides = [0; 3];
    sides[axis] = v / 4 % 2;
    sides[(axis + 1) % 3] = v % 2;
    sides[(axis + 2) % 3] = v / 2 % 2;
    sides
}

/// An octahedron whose edges are cut in half and pushed out to the sphere: 18 unit vectors, 32
/// triangles.
fn octasphere() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    const TIPS: [Vec3; 6] = [
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    let mut points = TIPS.to_vec();
    let mut triangles = Vec::new();
    let middle = |points: &mut Vec<Vec3>, a: usize, b: usize| {
        let m = [0, 1, 2].map(|k| (TIPS[a][k] + TIPS[b][k]) / 2.0_f64.sqrt());
        points.iter().position(|p| *p == m).unwrap_or_else(|| {
            points.push(m);
            points.len() - 1
        })
    };
    for octant in 0..8 {
        let tips @ [x, y, z] = [octant & 1, 2 + (octant >> 1 & 1), 4 + (octant >> 2 & 1)];
        let [xy, yz, zx] = [(x, y), (y, z), (z, x)].map(|(a, b)| middle(&mut points, a, b));
        for t in [[tips[0], xy, zx], [tips[1], yz, xy], [tips[2], zx, yz], [xy, yz, zx]] {
            triangles.push(t.map(|v| v as u32));
        }
    }
    (points, triangles)
}

impl Body {
    /// The triangles that are drawn.
    pub(crate) fn mesh(&self) -> Mesh {
        let place = |sides: [usize; 3]| match self.shape {
            Shape::Box { min, max } => [0, 1, 2].map(|k| [min, max][sides[k]][k]),
            Shape::Turned { center, half, rotation: r } => {
                let p = [0, 1, 2].map(|k| if sides[k] == 0 { -half[k] } else { half[k] });
                [0, 1, 2].map(|k| {
                    center[k] + r[3 * k] * p[0] + r[3 * k + 1] * p[1] + r[3 * k + 2] * p[2]
                })
            }
            Shape::Ball { .. } => unreachable!("balls have no sides"),
        };
        if let Shape::Ball { center, radius } = self.shape {
            let (points, triangles) = octasphere();
            // A millionth inside, so that no rounding puts a vertex outside.
            let vertices = points
                .iter()
                .map(|u| [0, 1, 2].map(|k| center[k] + 0.999_999 * radius * u[k]))
                .collect();
            let colours = points.iter().map(|u| self.colour.map(|c| c * light(*u))).collect();
            return Mesh { vertices, colours, triangles };
        }
        let vertices: Vec<Vec3> = (0..24).map(|v| place(corner(v))).collect();
        let colours = (0..24)
            .map(|v| {
                let face = v / 4 * 4;
                self.colour.map(|c| {
                    c * light(normal([vertices[face], vertices[face + 1], vertices[face + 2]]))
                })
            })
            .collect();
        let triangles =
            (0..6).flat_map(|f| [[0, 1, 2], [2, 1, 3]].map(|t| t.map(|v| 4 * f + v))).collect();
        Mesh { vertices, colours, triangles }
    }

    /// Moved by `shift`.
    pub(crate) fn moved(self, shift: Vec3) -> Self {
        let at = |p: Vec3| [0, 1, 2].map(|k| p[k] + shift[k]);
        let shape = match self.shape {
            Shape::Box { min, max } => Shape::Box { min: at(min), max: at(max) },
            Shape::Turned { center, half, rotation } => {
                Shape::Turned { center: at(center), half, rotation }
            }
            Shape::Ball { center, radius } => Shape::Ball { center: at(center), radius },
        };
        Self { shape, ..self }
    }
}

/// An axis-aligned box.
pub(crate) fn block(min: Vec3, max: Vec3, colour: [f32; 3]) -> Body {
    Body { shape: Shape::Box { min, max }, colour }
}

/// The crowd may be culled, the walls are always drawn.
#[derive(Debug)]
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    /// All of one shape.
    pub(crate) crowd: Vec<Body>,
    pub(crate) walls: Mesh,
    /// Where it stands, and how far from there the crowd spreads.
    pub(crate) origin: Vec3,
    pub(crate) reach: Vec3,
}

impl Scene {
    /// The scene about `origin`, of bodies about 0.
    pub(crate) fn at(
        origin: Vec3,
        name: &'static str,
        crowd: &[Body],
        mut walls: Mesh,
        reach: Vec3,
    ) -> Self {
        for vertex in &mut walls.vertices {
            *vertex = [0, 1, 2].map(|k| vertex[k] + origin[k]);
        }
        let crowd = crowd.iter().map(|body| body.moved(origin)).collect();
        Self { name, crowd, walls, origin, reach }
    }

    /// Hands over the crowd's bounds.
    pub(crate) fn with_bounds<T>(&self, take: impl FnOnce(&Bounds<'_>) -> T) -> T {
        let mut arrays: [Vec<f64>; 3] = Default::default();
        for body in &self.crowd {
            match &body.shape {
                Shape::Box { min, max } => {
                    arrays.iter_mut().zip([min, max]).for_each(|(a, p)| a.extend(p));
                }
                Shape::Turned { center, half, rotation } => {
                    let parts: [&[f64]; 3] = [center, half, rotation];
                    arrays.iter_mut().zip(parts).for_each(|(a, p)| a.extend(p));
                }
                Shape::Ball { center, radius } => {
                    arrays[0].extend(center);
                    arrays[1].push(*radius);
                }
            }
        }
        let [a, b, c] = [&arrays[0], &arrays[1], &arrays[2]].map(|a| Floats::F64(a));
        take(&match self.crowd[0].shape {
            Shape::Box { .. } => Bounds::Boxes { min: a, max: b },
            Shape::Turned { .. } => {
                Bounds::OrientedBoxes { centers: a, half_sizes: b, rotations: c }
            }
            Shape::Ball { .. } => Bounds::Spheres { centers: a, radii: b },
        })
    }
}

/// A camera, and who hides whom.
#[derive(Debug)]
pub(crate) struct Shot {
    pub(crate) name: &'static str,
    pub(crate) camera: Camera,
    /// Whether the crowd is drawn into the depth prepass, too, so that it hides itself: nobody may
    /// be hidden by his own depth.
    pub(crate) crowd_occludes: bool,
}

/// `SplitMix64` (Steele, Lea, Flood, OOPSLA 2014): the same scenes everywhere.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `low..high`.
    pub(crate) fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in `0..n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    pub(crate) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    /// A colour that is neither black nor white.
    pub(crate) fn colour(&mut self) -> [f32; 3] {
        [0; 3].map(|_| self.range(0.15, 1.0) as f32)
    }
}
