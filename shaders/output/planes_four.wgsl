// A set of bit planes that holds four planes (`emit_planes.wgsl`).
// Each function does what its namesake in `planes_one.wgsl` does.

alias Numbers = vec4<u32>;
alias Packed = vec2<u32>;

// Twin: `PlaneSet` in `crates/hiz_core/src/output/bins.rs`.
const PLANES: u32 = 4u;

// Bits of a packed count.
const COUNT_BITS: u32 = 16u;
const COUNT_MASK: u32 = (1u << COUNT_BITS) - 1u;

fn pack(numbers: Numbers) -> Packed {
    return numbers.xy | (numbers.zw << vec2<u32>(COUNT_BITS));
}

fn unpack(packed: Packed) -> Numbers {
    return Numbers(packed & vec2<u32>(COUNT_MASK), packed >> vec2<u32>(COUNT_BITS));
}

fn in_any_plane(bits: Numbers) -> u32 {
    return bits.x | bits.y | bits.z | bits.w;
}

fn sum(counts: Numbers) -> u32 {
    return counts.x + counts.y + counts.z + counts.w;
}

fn sum_before(counts: Numbers) -> Numbers {
    let two = counts.x + counts.y;
    return Numbers(0u, counts.x, two, two + counts.z);
}

fn of_plane(numbers: Numbers, plane: u32) -> u32 {
    return numbers[plane];
}

fn of_first(number: u32) -> Numbers {
    return Numbers(number, 0u, 0u, 0u);
}

fn plane_with(bits: Numbers, bit: u32) -> u32 {
    let has = (bits & Numbers(bit)) != Numbers(0u);
    return select(select(select(0u, 1u, has.y), 2u, has.z), 3u, has.w);
}

fn take_rank(ranks: ptr<function, Numbers>, bits: Numbers, bit: u32) -> u32 {
    let has = (bits & Numbers(bit)) != Numbers(0u);
    let next = *ranks;
    *ranks += select(Numbers(0u), Numbers(1u), has);
    return select(select(select(next.x, next.y, has.y), next.z, has.z), next.w, has.w);
}
