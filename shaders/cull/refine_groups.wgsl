// Finds the groups that are hidden by depth and lie within the view with all that they hold.
// None of their members is outside, so `refine.wgsl` need not test them.
// This is for area coverage.
// In sample coverage a volume between the pixel centres is outside, wherever it is in the view.

// Twin: `WORKGROUP` in `crates/hiz_core/src/cull/refine.rs`.
const WORKGROUP: u32 = 64u;

// The texel of a box's record in which the fourth word says that a member is absent.
const LAST_TEXEL: u32 = 2u;

// A flag beside the verdict of such a group; REFINED of `refine.wgsl` is another.
const WITHIN: u32 = 16u;

// The tier of the groups' boxes.
@group(1) @binding(0) var<uniform> groups: Tier;
@group(2) @binding(1) var<storage, read_write> group_verdicts: array<u32>;

// True implies: all of the box lies within the planes that `classify` asks about.
// Then no certificate can say that a part of the box is outside.
fn is_within(i: u32) -> bool {
    let volume = load_volume(i);
    if !(volume.size < view.coordinate_limit) {
        return false;
    }
    let errors = errors_of(volume);
    let x = value_of(view.x, errors.x, volume);
    let y = value_of(view.y, errors.y, volume);
    let z = value_of(view.z, errors.z, volume);
    let w = value_of(view.w, errors.w, volume);
    let border = view.half_size + view.reach;
    let a = view.z_slope;
    return surely_below(x, border.x, w) && surely_above(x, -border.x, w)
        && surely_below(y, border.y, w) && surely_above(y, -border.y, w)
        && surely_above(z, bar(-a), w) && surely_below(z, bar(1.0 - a), w);
}

@compute @workgroup_size(WORKGROUP)
fn refine_groups(@builtin(global_invocation_id) id: vec3<u32>) {
    begin();
    let group = id.x;
    if group >= groups.count || group_verdicts[group] != OCCLUDED {
        return;
    }
    // The verdict of an absent member is not that of its group.
    if record_texel(group, LAST_TEXEL).w != 0u {
        return;
    }
    if is_within(group) {
        group_verdicts[group] = OCCLUDED | WITHIN;
    }
}
