//! How a cull emits the kept instances: one list, bins by mesh and level of detail, or a draw each.

use crate::output::mesh_table::MeshTable;

/// Where the bins lie in the list.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Placement {
    /// One behind the other, so that all bins together take a word per instance.
    ///
    /// A draw finds its bin by `first_instance`, which needs the feature
    /// `INDIRECT_FIRST_INSTANCE`.
    /// The records of empty bins are left out: those of the others come first, in the order of
    /// mesh and LOD, and zeros follow.
    #[default]
    Packed,
    /// Each bin has room for all instances of its mesh, so the list has a word per instance and
    /// LOD.
    ///
    /// `first_instance` is 0, which every device can draw.
    /// The record of each bin has a fixed place, and so has its part of the list
    /// ([`Visible::bin`](crate::Visible::bin)).
    Reserved,
}

/// How a cull lists what it keeps, if [`Outputs`](crate::Outputs) ask for indices or draws.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub enum Emit {
    /// One list with one draw, whose constant part is [`Outputs::draw`](crate::Outputs::draw).
    #[default]
    List,
    /// A list and a draw for each bin: the kept instances of one mesh and one level of detail.
    ///
    /// Indices ascend within each bin.
    /// Where the list is shorter than what is kept, LOD 0 of all meshes goes first, then LOD 1, and
    /// so on: the coarsest are left out.
    Binned {
        /// The meshes that the instances' `mesh_ids` speak of.
        meshes: MeshTable,
        /// Where the bins lie in the list.
        placement: Placement,
    },
    /// A draw of its own for each kept instance, ascending by index.
    /// Its `first_instance` is its place in the list, which needs the feature
    /// `INDIRECT_FIRST_INSTANCE`.
    Instances {
        /// The meshes that the instances' `mesh_ids` speak of.
        meshes: MeshTable,
    },
    /// As [`Emit::List`], with the caller's own records of the kept instances in place of their
    /// indices.
    /// So a pipeline reads them as a vertex buffer with step mode `Instance`, without a change to
    /// its shaders.
    Copy {
        /// A record per instance, by index, in a buffer with the usage `STORAGE`.
        /// A cull copies what the records hold when it runs.
        records: wgpu::Buffer,
        /// Bytes of a record: 4 to 256, a multiple of 4.
        stride: u32,
    },
}

impl Emit {
    /// Whether there is one list with one draw per piece.
    pub(crate) fn is_one_list(&self) -> bool {
        matches!(self, Self::List | Self::Copy { .. })
    }
}
