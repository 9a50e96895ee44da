//! The copies of meshes as boxes, for methods that choose whole objects.

use crate::host::linear::Vec3;
use crate::occluders::placement::box_corner;
use crate::occluders::surface::OccluderSurface;

/// The box of one copy of a mesh in the world, turned with the copy.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CopyBox {
    /// Bit k of a corner's number chooses the end along the mesh's axis k.
    pub(crate) corners: [Vec3; 8],
    pub(crate) triangles: u64,
}

impl OccluderSurface {
    /// The boxes of all copies in their order; `None` for a mesh without triangles.
    pub(crate) fn copy_boxes(&self) -> Vec<Option<CopyBox>> {
        let of = |placement: &super::placement::Placement| {
            let mesh = &self.shapes().meshes[placement.mesh as usize];
            let corner = |i| placement.world(box_corner(mesh.min, mesh.max, i));
            (!mesh.triangles.is_empty()).then(|| CopyBox {
                corners: std::array::from_fn(corner),
                triangles: mesh.triangles.len() as u64,
            })
        };
        self.placements().iter().map(of).collect()
    }
}
