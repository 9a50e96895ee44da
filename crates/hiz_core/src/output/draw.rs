//! Draw arguments: the record that an indirect draw consumes, and its constant part.

/// The arguments of `draw_indexed_indirect`, 20 bytes, as the device reads them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct DrawIndexedIndirect {
    /// How many indices the mesh has.
    pub index_count: u32,
    /// How many instances to draw; the cull writes it.
    pub instance_count: u32,
    /// The first index in the index buffer.
    pub first_index: u32,
    /// The number that is added to each index.
    pub base_vertex: i32,
    /// The first instance.
    /// A number other than 0 needs the feature `INDIRECT_FIRST_INSTANCE`.
    pub first_instance: u32,
}

const _: () = assert!(size_of::<DrawIndexedIndirect>() == 20);

/// The constant part of the draw arguments: everything except the instance count.
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

/// The arguments of `draw_indirect`, 16 bytes, as the device reads them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct DrawIndirect {
    /// How many vertices the mesh has.
    pub vertex_count: u32,
    /// How many instances to draw; the cull writes it.
    pub instance_count: u32,
    /// The first vertex.
    pub first_vertex: u32,
    /// The first instance.
    /// A number other than 0 needs the feature `INDIRECT_FIRST_INSTANCE`.
    pub first_instance: u32,
}

const _: () = assert!(size_of::<DrawIndirect>() == 16);

/// The constant part of a [`DrawIndirect`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct VertexDraw {
    /// See [`DrawIndirect::vertex_count`].
    pub vertex_count: u32,
    /// See [`DrawIndirect::first_vertex`].
    pub first_vertex: u32,
}
