// The masks of several views in one buffer, and what any of them keeps.
// A dispatch adds one view: an invocation a word of its mask.

// Twin: `WORKGROUP` in `crates/hiz_core/src/output/views.rs`.
const WORKGROUP: u32 = 64u;

// Twin: `JoinUniform` in `crates/hiz_core/src/output/views.rs`.
struct Join {
    // The number of the view.
    view: u32,
    // Words from the mask of one view to that of the next.
    stride: u32,
    // The first word of this piece in a mask, and how many it has.
    begin: u32,
    words: u32,
}

@group(0) @binding(0) var<uniform> join: Join;
@group(0) @binding(1) var<storage, read> mask: array<u32>;
@group(0) @binding(2) var<storage, read_write> masks: array<u32>;
@group(0) @binding(3) var<storage, read_write> any_mask: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn join_views(@builtin(global_invocation_id) id: vec3<u32>) {
    let word = id.x;
    if word >= join.words {
        return;
    }
    let bits = mask[word];
    masks[join.view * join.stride + join.begin + word] = bits;
    // The first view replaces what an earlier recording has left.
    var joined = bits;
    if join.view > 0u {
        joined |= any_mask[word];
    }
    any_mask[word] = joined;
}
