// A tier of boxes over the instances of a piece.
// A box of the lowest tier is that of a group: it holds GROUP instances.
// A box of an upper tier holds GROUP boxes of the tier below it.

// Twin: `TierUniform` in `crates/hiz_core/src/instances/tiers.rs`.
struct Tier {
    // Boxes of this tier.
    count: u32,
    // What they hold in all: boxes of the tier below, or instances.
    below: u32,
    padding: vec2<u32>,
}
