// The update: new records, of instances or of the boxes around their groups, go to their places.
//
// If a recorded update is dropped or reordered, the host's group boxes may no longer contain their
// members.
// So updates are numbered, and on a mismatch every group box that is written later becomes invalid.

// Twin: `UpdateUniform` in `crates/hiz_core/src/instances/update.rs`.
struct Update {
    // How many records.
    count: u32,
    // Texels of a record.
    texels: u32,
    // The number of this update, counted in the order of recording.
    number: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> update: Update;
@group(0) @binding(1) var<storage, read> places: array<u32>;
@group(0) @binding(2) var<storage, read> fresh: array<vec4<u32>>;
@group(0) @binding(3) var records: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(4) var<storage, read_write> sequence: Sequence;

// Twin: `WORKGROUP` in `crates/hiz_core/src/instances/update.rs`.
const WORKGROUP: u32 = 128u;

fn replace(id: u32, k: u32, texel: vec4<u32>) {
    textureStore(records, record_position(places[id], k, update.texels), texel);
}

@compute @workgroup_size(1)
fn begin() {
    if sequence.next != update.number { sequence.broken = 1u; }
    sequence.next = update.number + 1u;
}

@compute @workgroup_size(WORKGROUP)
fn replace_records(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= update.count {
        return;
    }
    for (var k = 0u; k < update.texels; k += 1u) {
        replace(id.x, k, fresh[id.x * update.texels + k]);
    }
}

@compute @workgroup_size(WORKGROUP)
fn replace_groups(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= update.count {
        return;
    }
    for (var k = 0u; k < update.texels; k += 1u) {
        var texel = fresh[id.x * update.texels + k];
        if sequence.broken != 0u { texel = vec4<u32>(BEYOND_LIMITS_BITS); }
        replace(id.x, k, texel);
    }
}
