//! Draw arguments.

/// The arguments of `draw_indexed_indirect`, as the device reads them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct DrawIndexedIndirect {
    /// Indices of the mesh.
    pub index_count: u32,
    /// Instances to draw: what the cull wrote.
    pub instance_count: u32,
    /// First index in the index buffer.
    pub first_index: u32,
    /// Added to each index.
    pub base_vertex: i32,
    /// First instance; other than 0 needs the feature `INDIRECT_FIRST_INSTANCE`.
    pub first_instance: u32,
}

const _: () = assert!(size_of::<DrawIndexedIndirect>() == 20);

/// What the draw arguments say beside the instance count.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct DrawTemplate {
    /// See [`DrawIndexedIndirect::index_count`].
    pub index_count: u32,
    /// See [`DrawIndexedIndirect::first_index`].
    pub first_index: u32,
    /// See [`DrawIndexedIndirect::base_vertex`].
    pub base_vertex: i32,
    /// See [`DrawIndexedIndirect::first_instance`].
    pub first_instance: u32,
}
