//! Where a mesh stands, and how a camera sees it from there.

use crate::error::{Error, Result};
use crate::host::linear::{Vec3, cross, dot, inverse3, mul3, sub};
use crate::input::bounds::Floats;
use crate::input::mesh::MeshData;
use crate::occluders::shapes::{COORDINATE_LIMIT, Shapes};

/// One copy of one mesh.
#[derive(Debug, Clone)]
pub(crate) struct Placement {
    /// The mesh, by its number.
    pub(crate) mesh: u32,
    /// `world_from_mesh`, affine and row-major; `None`: mesh coordinates are world coordinates.
    pub(crate) matrix: Option<[f64; 16]>,
    /// Whether the matrix turns the mesh inside out, so that its triangles have to be reversed.
    pub(crate) mirrored: bool,
    /// How often it has moved since the upload.
    pub(crate) moves: u32,
    /// The inverse of the matrix' linear part, if it has one.
    inverse: Option<[Vec3; 3]>,
}

impl Placement {
    /// The copies of all `meshes`, of which `shapes` was made.
    ///
    /// # Errors
    /// Those of [`Placement::of_mesh`].
    pub(super) fn of_meshes(shapes: &Shapes, meshes: &[MeshData<'_>]) -> Result<Vec<Self>> {
        let mut placements = Vec::new();
        for (number, mesh) in (0..).zip(meshes) {
            placements.extend(Self::of_mesh(shapes, number, mesh.transforms)?);
        }
        Ok(placements)
    }

    /// The copies of mesh `number` at `transforms`; one copy in world coordinates for `None`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for matrices that are not affine or not finite, and for places beyond
    /// [`COORDINATE_LIMIT`].
    pub(super) fn of_mesh(
        shapes: &Shapes,
        number: u32,
        transforms: Option<Floats<'_>>,
    ) -> Result<Vec<Self>> {
        let Some(transforms) = transforms else {
            return Ok(vec![Self {
                mesh: number,
                matrix: None,
                mirrored: false,
                moves: 0,
                inverse: None,
            }]);
        };
        let scalars = transforms.len();
        if !scalars.is_multiple_of(16) {
            return Err(Error::invalid(
                "transforms",
                format!("expected 16 numbers a matrix, got {scalars} numbers"),
            ));
        }
        (0..scalars / 16).map(|k| Self::at(shapes, number, transforms.array(k), k)).collect()
    }

    fn at(shapes: &Shapes, number: u32, m: [f64; 16], k: usize) -> Result<Self> {
        if m[12..] != [0.0, 0.0, 0.0, 1.0] || !m.iter().all(|v| v.is_finite()) {
            return Err(Error::invalid(
                "transforms",
                format!(
                    "expected finite affine matrices with last row (0, 0, 0, 1), got {:?} in \
                     matrix {k}",
                    &m[12..]
                ),
            ));
        }
        let linear: [Vec3; 3] = std::array::from_fn(|i| [m[4 * i], m[4 * i + 1], m[4 * i + 2]]);
        let column = |c: usize| linear.map(|row| row[c]);
        let placed = Self {
            mesh: number,
            matrix: Some(m),
            mirrored: dot(cross(column(0), column(1)), column(2)) < 0.0,
            moves: 0,
            inverse: inverse3(&linear),
        };
        let mesh = &shapes.meshes[number as usize];
        let far = (0..8)
            .map(|corner| placed.world(box_corner(mesh.min, mesh.max, corner)))
            .find(|p| !mesh.triangles.is_empty() && !p.iter().all(|x| x.abs() < COORDINATE_LIMIT));
        match far {
            None => Ok(placed),
            Some(p) => Err(Error::invalid(
                "transforms",
                format!(
                    "expected finite positions below 1e30, got {p:?} for a corner of the mesh's \
                     box in matrix {k}"
                ),
            )),
        }
    }

    /// Whether the matrix flattens the mesh, or nearly so.
    pub(super) fn is_flat(&self) -> bool {
        self.matrix.is_some() && self.inverse.is_none()
    }

    /// The world position of a vertex: in float64, rounded once per operation.
    #[inline]
    pub(crate) fn world(&self, p: Vec3) -> Vec3 {
        match &self.matrix {
            None => p,
            Some(m) => std::array::from_fn(|i| {
                dot([m[4 * i], m[4 * i + 1], m[4 * i + 2]], p) + m[4 * i + 3]
            }),
        }
    }

    /// The mesh's point whose world position is nearly `point`; `None` for a flattening matrix.
    pub(super) fn mesh_point(&self, point: Vec3) -> Option<Vec3> {
        let Some(m) = &self.matrix else { return Some(point) };
        let from_world = mul3(self.inverse.as_ref()?, sub(point, [m[3], m[7], m[11]]));
        from_world.iter().all(|v| v.abs() < COORDINATE_LIMIT).then_some(from_world)
    }
}

/// Corner 0..8 of a box: bit k chooses the end along axis k.
pub(super) fn box_corner(min: Vec3, max: Vec3, corner: usize) -> Vec3 {
    std::array::from_fn(|k| if corner >> k & 1 == 0 { min[k] } else { max[k] })
}
