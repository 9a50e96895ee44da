// The table of meshes: how many levels of detail each has, and their errors.
// Twin: `crates/hiz_core/src/output/mesh_table.rs`.

// Texels of a mesh: the number of its LODs, then their errors.
// Twin: `MESH_TEXELS` there.
const MESH_TEXELS: u32 = 3u;
// Errors in a texel, as a power of two.
const ERRORS_LOG2: u32 = 2u;

@group(1) @binding(3) var mesh_table: texture_2d<u32>;

fn lods_of(mesh: u32) -> u32 {
    return textureLoad(mesh_table, record_position(mesh, 0u, MESH_TEXELS), 0).x;
}

// The error of LOD l of a mesh at scale 1, in world units.
fn lod_error(mesh: u32, l: u32) -> f32 {
    let k = 1u + (l >> ERRORS_LOG2);
    let errors = textureLoad(mesh_table, record_position(mesh, k, MESH_TEXELS), 0);
    return bitcast<f32>(errors[l & ((1u << ERRORS_LOG2) - 1u)]);
}
