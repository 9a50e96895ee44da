// The LOD of each instance of a piece, written down, for tests of `../cull/lod.wgsl`.

// LODs of a mesh at most.
// Twin: `MAX_LODS` in `crates/hiz_core/src/cull/lod.rs`.
const MAX_LODS: u32 = 8u;
// Invocations of a workgroup.
// Twin: `LANES` in `crates/hiz_core/src/testing/lod.rs`.
const LANES: u32 = 64u;

// Twin: `LodCase` in `crates/hiz_core/src/testing/lod.rs`.
struct LodCase {
    mesh: u32,
    count: u32,
    scale: f32,
    padding: u32,
}

@group(1) @binding(0) var<uniform> piece: Piece;
// `MAX_LODS` errors per mesh.
@group(2) @binding(0) var<storage, read> mesh_errors: array<f32>;
@group(2) @binding(1) var<storage, read> cases: array<LodCase>;
@group(2) @binding(2) var<storage, read_write> chosen: array<u32>;

fn lod_error(mesh: u32, lod: u32) -> f32 {
    return mesh_errors[mesh * MAX_LODS + lod];
}

@compute @workgroup_size(LANES)
fn choose_lods(@builtin(global_invocation_id) id: vec3<u32>) {
    begin();
    if id.x < piece.count {
        let one = cases[id.x];
        chosen[id.x] = lod_of(load_volume(id.x), one.mesh, one.scale, one.count);
    }
}
