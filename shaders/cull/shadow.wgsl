// Bounds swept along a light: the volume that a caster can shadow.
//
// A caster K shadows a point q if q = p + m L for a point p of K and m >= 0.
// Receivers lie in a box, so m is at most s, the longest way from K to a face where light leaves.
// The swept volume is hull(K, K + s L): K moved by s L / 2, with a fourth half axis s L / 2.
// It grows by a ball of radius g = f + s tan(a), for the filter's radius f and the light's angular
// radius a.
// docs/accuracy.md derives this, under "Shadow casters".
//
// What is used here and defined elsewhere:
//
// - `certificate.wgsl`: `Value`, `value_of`, `errors_of`, `surely_above`, `surely_below`
// - `view.wgsl`: `view`, of which the fields for casters are documented there
// - `../instances/bounds_*.wgsl`: `Volume`, `reach_of`
// - `../pyramid/texels.wgsl`, `unoccluded.wgsl`: `occluding_depth`, `revealing_depth`

// Longer than any way to a face, for the axes along which light leaves no face.
const NO_FACE: f32 = 0x1p100;

// A row on the swept volume.
struct Swept {
    // On the unswept volume, moved to the sweep's middle, with the growth in its error.
    middle: Value,
    // The change along the fourth half axis.
    along: f32,
}

// How far the light carries the shadow of a volume: at least the longest way to a receiver.
// Below 0, no receiver lies in the volume's shadow.
fn sweep_of(volume: Volume) -> f32 {
    // Every rounding below makes less of a difference than this to a way along an axis.
    let rounding = ERROR_ULPS * EPS * (volume.size + view.exit_size) + ERROR_FLOOR;
    let reach = reach_of(volume) + vec3<f32>(view.filter_radius + rounding);
    let ways = (view.exits - volume.center) * view.exit_rates + reach * abs(view.exit_rates);
    let bounds = select(vec3<f32>(NO_FACE), ways, view.exit_rates != vec3<f32>(0.0));
    return min(min(bounds.x, bounds.y), bounds.z);
}

// A row on the volume swept by s; the error is that of the row on all of it.
fn swept_value(row: vec4<f32>, error: f32, along: f32, s: f32, volume: Volume) -> Swept {
    let value = value_of(row, error, volume);
    let half = s * along;
    return Swept(Value(value.center + half, error, value.half), half);
}

// A row of the swept volume for the plane r - t w = 0.
// The fourth half axis reaches by |r - t w| along it, like every other half axis of a box.
fn against(r: Swept, t: f32, w: Swept) -> Value {
    return Value(r.middle.center, r.middle.error + abs(r.along - t * w.along), r.middle.half);
}

// True implies: r - t w > 0 on all of the swept volume.
fn swept_above(r: Swept, t: f32, w: Swept) -> bool {
    return surely_above(against(r, t, w), t, w.middle);
}

// True implies: r - t w < 0 on all of the swept volume.
fn swept_below(r: Swept, t: f32, w: Swept) -> bool {
    return surely_below(against(r, t, w), t, w.middle);
}

// True implies: r - t w > 0 on all of the swept volume, or -r - t w > 0 is.
fn swept_beyond(r: Swept, t: f32, w: Swept) -> bool {
    return swept_above(r, t, w) | swept_below(r, -t, w);
}

// Whether a block of pixels holds no receiver at all.
fn has_no_receiver(farthest_bits: u32, nearest_bits: u32) -> bool {
    return (farthest_bits == near_bits()) && (nearest_bits == far_bits());
}

// True implies: no receiver of a block of pixels lies in the swept volume.
// All of the volume is farther than the block's farthest receiver, or nearer than its nearest.
fn surely_clear_of(farthest_bits: u32, nearest_bits: u32, z: Swept, w: Swept) -> bool {
    if has_no_receiver(farthest_bits, nearest_bits) {
        return true;
    }
    let d = occluding_depth(farthest_bits);
    let behind = bar(d - view.z_slope);
    let before = bar(revealing_depth(nearest_bits) - view.z_slope);
    if REVERSED {
        return (d >= LEAST_NORMAL && swept_below(z, behind, w)) || swept_above(z, before, w);
    }
    return (d < 1.0 && swept_above(z, behind, w)) || swept_below(z, before, w);
}
