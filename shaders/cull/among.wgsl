// Which instances a cull asks for, where it is restricted to some of them.
// The others count as outside, and are not tested.

// True: only the instances of `among` are asked for; false: all of them.
override AMONG: bool;

// A bit per place, in stored order; `among_order.wgsl` writes it.
@group(1) @binding(4) var among: texture_2d<u32>;

// Words of the bits of a group.
// Twin: `GROUP` in `crates/hiz_core/src/instances/groups.rs`.
const AMONG_OF_GROUP: u32 = 2u;

fn among_word(word: u32) -> u32 {
    return textureLoad(among, among_position(word), 0).x;
}

fn is_among(place: u32) -> bool {
    if AMONG {
        return ((among_word(place / AMONG_BITS) >> (place % AMONG_BITS)) & 1u) != 0u;
    }
    return true;
}

// Whether any member of a group is asked for.
fn any_among(group: u32) -> bool {
    if AMONG {
        let word = group * AMONG_OF_GROUP;
        return (among_word(word) | among_word(word + 1u)) != 0u;
    }
    return true;
}
