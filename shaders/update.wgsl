// The update: new records (of instances, or of their groups) go to their places.

struct Update {
    // How many records.
    count: u32,
    // Vectors of 16 bytes in a record.
    vectors: u32,
    // Which update of these instances this is, in the order of recording.
    number: u32,
    padding: u32,
}

// What the device knows of the order in which updates ran.
struct Sequence {
    // The number of the next one.
    next: u32,
    // Not 0: one was left out, or overtaken. The boxes that the host forms from then on may not contain their groups.
    broken: u32,
}

@group(0) @binding(0) var<uniform> update: Update;
@group(0) @binding(1) var<storage, read> places: array<u32>;
@group(0) @binding(2) var<storage, read> fresh: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> records: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> sequence: Sequence;

// A record of NaNs is no volume, whatever its kind.
const NO_VOLUME: vec4<u32> = vec4<u32>(0xFFFFFFFFu);

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
    for (var v = 0u; v < update.vectors; v += 1u) {
        records[places[id.x] * update.vectors + v] = fresh[id.x * update.vectors + v];
    }
}

@compute @workgroup_size(128)
fn replace_groups(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= update.count {
        return;
    }
    for (var v = 0u; v < update.vectors; v += 1u) {
        var vector = fresh[id.x * update.vectors + v];
        if sequence.broken != 0u { vector = NO_VOLUME; }
        records[places[id.x] * update.vectors + v] = vector;
    }
}
