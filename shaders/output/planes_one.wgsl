// A set of bit planes that holds one plane, for meshes of one level of detail (`emit_planes.wgsl`).

// A number for each plane of a set.
alias Numbers = u32;

// Numbers below 2^16 for each plane, in few words.
alias Packed = u32;

// Planes of a set.
// Twin: `PlaneSet` in `crates/hiz_core/src/output/bins.rs`.
const PLANES: u32 = 1u;

fn pack(numbers: Numbers) -> Packed {
    return numbers;
}

fn unpack(packed: Packed) -> Numbers {
    return packed;
}

fn in_any_plane(bits: Numbers) -> u32 {
    return bits;
}

fn sum(counts: Numbers) -> u32 {
    return counts;
}

// For each plane: the sum of the planes before it.
fn sum_before(counts: Numbers) -> Numbers {
    return 0u;
}

fn of_plane(numbers: Numbers, plane: u32) -> u32 {
    return numbers;
}

// The number for the first plane, and zeros.
fn of_first(number: u32) -> Numbers {
    return number;
}

// The plane that has this bit.
fn plane_with(bits: Numbers, bit: u32) -> u32 {
    return 0u;
}

// The rank of the next instance, which has this bit; `ranks` are those of the next of each plane.
fn take_rank(ranks: ptr<function, Numbers>, bits: Numbers, bit: u32) -> u32 {
    let rank = *ranks;
    *ranks += 1u;
    return rank;
}
