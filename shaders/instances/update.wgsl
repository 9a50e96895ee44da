// The update: new records, of instances or of their groups, go to their places.

struct Update {
    // How many records.
    count: u32,
    // Texels of a record.
    texels: u32,
    // Which update of these instances this is, in the order of recording.
    number: u32,
    padding: u32,
}

// What the device knows of the order in which updates ran.
struct Sequence {
    // The number of the update that has to run next.
    next: u32,
    // Not 0 if an update was left out or overtaken.
    // The boxes that the host forms from then on may not contain their groups.
    broken: u32,
}

@group(0) @binding(0) var<uniform> update: Update;
@group(0) @binding(1) var<storage, read> places: array<u32>;
@group(0) @binding(2) var<storage, read> fresh: array<vec4<u32>>;
@group(0) @binding(3) var records: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(4) var<storage, read_write> sequence: Sequence;

// The bits of 2^62: a record of such numbers is invalid, whatever its kind.
const NO_VOLUME: vec4<u32> = vec4<u32>(0x5e800000u);

fn replace(id: u32, k: u32, texel: vec4<u32>) {
    textureStore(records, record_position(places[id], k, update.texels), texel);
}

@compute @workgroup_size(1)
fn begin() {
    if sequence.next != update.number { sequence.broken = 1u; }
    sequence.next = update.number + 1u;
}

@compute @workgroup_size(128)
fn replace_records(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= update.count {
        return;
    }
    for (var k = 0u; k < update.texels; k += 1u) {
        replace(id.x, k, fresh[id.x * update.texels + k]);
    }
}

@compute @workgroup_size(128)
fn replace_groups(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= update.count {
        return;
    }
    for (var k = 0u; k < update.texels; k += 1u) {
        var texel = fresh[id.x * update.texels + k];
        if sequence.broken != 0u { texel = NO_VOLUME; }
        replace(id.x, k, texel);
    }
}
