//! Triangle meshes, borrowed from the caller, and which of their faces occlude.

use crate::host::linear::{cross, dot};
use crate::input::bounds::Floats;
use crate::input::camera::Camera;

/// Which triangles do not occlude.
///
/// The corners of a front face run counter-clockwise as seen from outside.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum FaceCull {
    /// All triangles occlude, on both sides.
    #[default]
    None,
    /// Back faces do not occlude.
    Back,
    /// Front faces do not occlude.
    Front,
}

/// A triangle mesh, borrowed from the caller.
#[derive(Debug, Clone, Copy)]
pub struct MeshData<'a> {
    /// V positions in mesh coordinates, 3 scalars each: x, y, z.
    /// In world coordinates they must be finite and below 1e30.
    pub vertices: Floats<'a>,
    /// T triangles, 3 indices below V each.
    pub triangles: &'a [u32],
    /// K affine matrices `world_from_mesh`, 16 row-major scalars each, last row (0, 0, 0, 1).
    ///
    /// `None`: one copy of the mesh, whose vertices are in world coordinates.
    pub transforms: Option<Floats<'a>>,
}

impl FaceCull {
    /// The faces that do not occlude, as they appear in the image of `camera`.
    ///
    /// A camera that mirrors the world, such as a left-handed one, reverses all windings.
    pub(crate) fn as_seen_by(self, camera: &Camera) -> Self {
        let rows = camera.rows();
        let lin = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
        let (x, y) = (lin(0), lin(1));
        // Towards the scene: w grows in front of a perspective camera.
        // Orthographic depth grows there, or falls in reversed Z.
        let forward = if lin(3) != [0.0; 3] {
            lin(3)
        } else if camera.convention().is_reversed() {
            lin(2).map(|v| -v)
        } else {
            lin(2)
        };
        let mirrored = dot(cross(x, y), forward) > 0.0;
        if mirrored { self.reversed() } else { self }
    }

    /// The other faces.
    pub(crate) fn reversed(self) -> Self {
        match self {
            Self::None => Self::None,
            Self::Back => Self::Front,
            Self::Front => Self::Back,
        }
    }
}
