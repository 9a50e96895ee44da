// The level of detail (LOD) of an instance: the coarsest one that a certificate allows.
//
// Every rule asks one thing of a LOD: is w, on all of the bounds, surely greater than its need?
// docs/accuracy.md derives the needs and counts their roundings, under "Levels of detail".
//
// What is used here and defined elsewhere:
//
// - `certificate.wgsl`: `Value`, `value_of`, `errors_of`
// - `view.wgsl`: `view`
// - `../instances/bounds_*.wgsl`: `Volume`, `exceeds_support`, `radius_of`
// - `../pyramid/texels.wgsl`: `view_uniform`, `LEAST_NORMAL`
// - `lod_error(mesh, lod)`: how far the surface of a LOD is from the full mesh at scale 1, in world
//   units.
//   Errors and scales are below 2^60.

// Which rule chooses.
// Twins: `LodRule::code` in `crates/hiz_core/src/cull/lod.rs`.
override LOD_RULE: u32;
const LOD_FINEST: u32 = 0u;
const LOD_BY_ERROR: u32 = 1u;
const LOD_BY_DISTANCE: u32 = 2u;
const LOD_BY_SIZE: u32 = 3u;

// LODs in a vector of `View.lod_needs`.
const NEEDS: u32 = 4u;

// The needs' factor: 1 and 4 EPS more.
// The products of a need lose less than 3 EPS of it, so it is never less than the exact one.
const NEED_FACTOR: f32 = 1.0 + 4.0 * EPS;

// No two points of valid bounds are farther apart than this, so no greater deviation counts as
// more.
// Without it, a need could overflow.
const LARGEST_DEVIATION: f32 = 0x1p60;

// True implies: w > need on all of the volume.
fn surely_farther(w: Value, need: f32) -> bool {
    return exceeds_support((w.center - need) - w.error, w.half);
}

// What w has to exceed for a LOD above 0.
//
// Error and scale are at least the least normal number, because a device may flush smaller ones.
fn lod_need(radius: f32, mesh: u32, scale: f32, lod: u32) -> f32 {
    if LOD_RULE == LOD_BY_ERROR {
        let deviation = max(lod_error(mesh, lod), LEAST_NORMAL) * max(scale, LEAST_NORMAL);
        return min(deviation, LARGEST_DEVIATION) * view.lod_needs[0].x * NEED_FACTOR;
    }
    // From the uniform itself.
    // A private copy that is indexed by a variable would leave the registers.
    let need = view_uniform.lod_needs[lod / NEEDS][lod % NEEDS];
    if LOD_RULE == LOD_BY_SIZE {
        return radius * need * NEED_FACTOR;
    }
    return need;
}

// The coarsest of `count` LODs of a mesh such that it and all finer ones are surely allowed.
// LOD 0 needs nothing: it is the answer wherever no other is proved.
// So it is for bounds that cross the plane of the eye, and for invalid ones.
fn lod_of(volume: Volume, mesh: u32, scale: f32, count: u32) -> u32 {
    if LOD_RULE == LOD_FINEST {
        return 0u;
    }
    let w = value_of(view.w, errors_of(volume).w, volume);
    var radius = 0.0;
    if LOD_RULE == LOD_BY_SIZE {
        radius = radius_of(volume);
    }
    let end = select(1u, min(count, view.lod_end), volume.size < view.coordinate_limit);
    var lod = 1u;
    while lod < end && surely_farther(w, lod_need(radius, mesh, scale, lod)) {
        lod += 1u;
    }
    return lod - 1u;
}
