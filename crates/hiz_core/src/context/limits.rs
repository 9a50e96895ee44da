//! What a device has to offer.

use crate::instances::piece::CULL_WORKGROUP;
use crate::pyramid::PyramidUniform;

/// The limits that the shaders and their bindings need, each with what the device has.
///
/// `tests/validation/limits.rs` runs everything on a device with exactly these limits.
/// It also tries devices where one limit is lower by one.
pub(super) fn needed(have: &wgpu::Limits) -> Vec<(&'static str, u64, u64)> {
    macro_rules! limits {
        ($($name:ident >= $need:expr,)*) => {
            vec![$((stringify!($name), $need, u64::from(have.$name))),*]
        };
    }
    limits! {
        // A row of oriented box records, which take 4 texels each (`instances/records.rs`).
        // It is also a row of the list of surviving groups.
        max_texture_dimension_2d >= 4096,
        // The cull of members: view, records, outputs, survivors.
        max_bind_groups >= 4,
        max_bind_groups_plus_vertex_buffers >= 4,
        // The view of a cull (`cull/pipelines.rs`, `DepthStore::layout`).
        max_bindings_per_bind_group >= 7,
        // A depth image; slots and mesh table of a cull that emits bins; which instances are asked
        // for.
        max_sampled_textures_per_shader_stage >= 4,
        max_samplers_per_shader_stage >= 1,
        // The cull of members: three chunks, mask, list, draws, statistics, survivors.
        max_storage_buffers_per_shader_stage >= 8,
        // An atlas or an image of depth bits; records; the survivors of two tiers of boxes.
        max_storage_textures_per_shader_stage >= 4,
        // Pyramid, view, piece, capacity.
        max_uniform_buffers_per_shader_stage >= 4,
        max_uniform_buffer_binding_size >= size_of::<PyramidUniform>() as u64,
        // The verdicts of a row of records, and the row itself in its staging buffer.
        max_storage_buffer_binding_size >= 8192,
        max_buffer_size >= 65_536,
        // Occluders: vertices and copies (`occluders/device_meshes.rs`).
        max_vertex_buffers >= 2,
        max_vertex_attributes >= 8,
        max_vertex_buffer_array_stride >= 88,
        // No shader needs it, but wgpu 30 counts down from it.
        max_inter_stage_shader_variables >= 1,
        // Prefix sums of 256 words (`output/compact.wgsl`); 64 vectors of four words
        // (`cull/count.wgsl`).
        max_compute_workgroup_storage_size >= 1024,
        max_compute_invocations_per_workgroup >= 256,
        max_compute_workgroup_size_x >= 256,
        max_compute_workgroup_size_y >= 1,
        max_compute_workgroup_size_z >= 1,
        // The least that WebGPU guarantees.
        // A column of blocks of the largest image and every piece fit into it.
        max_compute_workgroups_per_dimension >= 65_535,
    }
}

const _: () = assert!(CULL_WORKGROUP <= 256);
