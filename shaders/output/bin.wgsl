// The bin of an instance: its mesh and its level of detail.
//
// Within a piece the instances have a second order, by mesh and then by index.
// The rank of an instance in it is its *slot*.

// The instances have mesh ids or scales of their own.
// Otherwise all have mesh 0 and scale 1, and their slots are their indices.
override SORTED: bool;

// Per place: .x the mesh, .y the slot, .z the bits of the scale.
// Twin: `crates/hiz_core/src/instances/slots.rs`.
@group(1) @binding(2) var slots: texture_2d<u32>;

struct Bin {
    mesh: u32,
    lod: u32,
    slot: u32,
}

// The bin of the instance at a place, whose index is `index`.
fn bin_of(place: u32, index: u32) -> Bin {
    var mesh = 0u;
    var slot = index;
    var scale = 1.0;
    if SORTED {
        let texel = textureLoad(slots, record_position(place, 0u, 1u), 0);
        mesh = texel.x;
        slot = texel.y;
        scale = bitcast<f32>(texel.z);
    }
    return Bin(mesh, lod_of(load_volume(place), mesh, scale, lods_of(mesh)), slot);
}
