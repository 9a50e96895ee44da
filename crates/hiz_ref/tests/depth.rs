//! What the numbers of a depth image mean, worked out by hand.

use hiz_ref::{
    DepthBounds, DepthKind, DepthMeaning, Error, Options, Verdict, View, Volume, classify_between,
    depth_bounds,
};

const PLAIN: DepthMeaning<'_> =
    DepthMeaning { kind: DepthKind::Z, scale: 1.0, invalid: &[], origin_is_eye: true };

fn view(rows: [[f64; 4]; 4], reversed: bool) -> View {
    View { rows, origin: [0.0; 3], width: 1, height: 1, reversed }
}

/// A camera 90 degrees wide that looks along +z from the origin; near 1, no far plane.
/// Depth is 1 - 1/z, or 1/z reversed.
fn perspective(reversed: bool) -> View {
    let z = if reversed { [0.0, 0.0, 0.0, 1.0] } else { [0.0, 0.0, 1.0, -1.0] };
    view([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, [0.0, 0.0, 1.0, 0.0]], reversed)
}

/// An orthographic camera that looks along +z, from view depth `near` to `near` + 8.
fn parallel(near: f64, reversed: bool) -> View {
    let z = if reversed {
        [0.0, 0.0, -0.125, 1.0 + near / 8.0]
    } else {
        [0.0, 0.0, 0.125, -near / 8.0]
    };
    view([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, [0.0, 0.0, 0.0, 1.0]], reversed)
}

/// The nearer and the farther depth of one pixel.
fn bounds(view: &View, number: f64, meaning: DepthMeaning) -> [f32; 2] {
    let DepthBounds { nearer, farther } = depth_bounds(view, &[number], meaning).unwrap();
    [nearer[0], farther[0]]
}

fn z(view: &View, number: f64) -> [f32; 2] {
    bounds(view, number, PLAIN)
}

/// Asserts that `truth` is between neighbours, of which the nearer is first.
fn around(found: [f32; 2], truth: f64, reversed: bool) {
    let [low, high] = if reversed { [found[1], found[0]] } else { found };
    assert!(f64::from(low) < truth && truth < f64::from(high), "{found:?} for {truth}");
    assert_eq!(low.next_up(), high, "{truth}");
}

#[test]
fn what_float32_holds_is_met_exactly() {
    for (number, depth) in
        [(8.0, 0.875), (2.0, 0.5), (1.0, 0.0), (1.0 + f64::EPSILON * 8192.0, 0.0)]
    {
        if number == 1.0 || number >= 2.0 {
            assert_eq!(z(&perspective(false), number), [depth; 2]);
            assert_eq!(z(&perspective(true), number), [1.0 - depth; 2]);
        }
    }
    around(z(&perspective(false), 3.0), 2.0 / 3.0, false);
    around(z(&perspective(true), 3.0), 1.0 / 3.0, true);
    // In units of 1/2, and for rows of any scale: w grows by 3 along the view.
    assert_eq!(bounds(&perspective(false), 16.0, DepthMeaning { scale: 0.5, ..PLAIN }), [0.875; 2]);
    let mut tripled = perspective(false);
    tripled.rows = tripled.rows.map(|row| row.map(|v| 3.0 * v));
    assert_eq!(z(&tripled, 8.0), [0.875; 2]);
    // 8000 thousandths are only nearly 8: as float64 0.001 is not exact, and a little above.
    let [nearer, farther] =
        bounds(&perspective(false), 8000.0, DepthMeaning { scale: 0.001, ..PLAIN });
    assert_eq!([nearer, farther], [0.875, 0.875_f32.next_up()]);
}

#[test]
fn distances_by_pythagoras() {
    let distance = DepthMeaning { kind: DepthKind::Distance, ..PLAIN };
    // The ray through the middle leans by 3/4, so it is 5/4 times as long as its view depth.
    for reversed in [false, true] {
        let mut leaning = perspective(reversed);
        leaning.rows[0] = [1.0, 0.0, -0.75, 0.0];
        assert_eq!(bounds(&leaning, 10.0, distance), [if reversed { 0.125 } else { 0.875 }; 2]);
        assert_eq!(z(&leaning, 8.0), [if reversed { 0.125 } else { 0.875 }; 2]);
        // The same distance from an eye elsewhere.
        let mut moved = leaning.clone();
        moved.origin = [100.0, -7.0, 3.0];
        assert_eq!(bounds(&moved, 10.0, distance), bounds(&leaning, 10.0, distance));
        // The same eye, written into a bare matrix, at (0, 0, 2^40).
        let eye = 2.0_f64.powi(40);
        let mut bare = leaning.clone();
        for row in &mut bare.rows {
            row[3] -= row[2] * eye;
        }
        assert_eq!(bounds(&bare, 10.0, distance), bounds(&leaning, 10.0, distance));
        // An image border at a tangent of 2^36.
        // The ray is longer than its view depth by that factor and a hair.
        let mut far_off = perspective(reversed);
        let tangent = 2.0_f64.powi(36);
        far_off.rows[0] = [1.0, 0.0, -tangent, 0.0];
        let depth = if reversed { 0.125 } else { 0.875 };
        let [nearer, farther] = bounds(&far_off, 8.0 * tangent, distance);
        // w is less than 8 by 2^-73 of it, so the depth is nearer by less than a spacing.
        let before = if reversed { f32::next_up(depth) } else { f32::next_down(depth) };
        assert_eq!([nearer, farther], [before, depth]);
    }
}

/// Four pixels with centres at (+-1/2, +-1/2), row 0 on top.
#[test]
fn pixels_are_where_they_are() {
    let mut view = View { width: 2, height: 2, ..perspective(false) };
    // Depth that also grows to the right and downwards: z = z - 1 + (x - y) / 4 in clip space.
    view.rows[2] = [0.25, -0.25, 1.0, -1.0];
    let found = depth_bounds(&view, &[2.0; 4], PLAIN).unwrap();
    assert_eq!(found.nearer, [0.25, 0.5, 0.5, 0.75]);
    assert_eq!(found.farther, found.nearer);
}

#[test]
fn parallel_rays_and_planes_behind_the_eye() {
    for (number, depth) in
        [(-4.0, 0.0), (-2.0, 0.25), (0.0, 0.5), (-0.0, 0.5), (3.0, 0.875), (4.0, 1.0)]
    {
        for kind in [DepthKind::Z, DepthKind::Distance] {
            let meaning = DepthMeaning { kind, ..PLAIN };
            assert_eq!(bounds(&parallel(-4.0, false), number, meaning), [depth; 2], "{number}");
            assert_eq!(
                bounds(&parallel(-4.0, true), number, meaning),
                [1.0 - depth; 2],
                "{number}"
            );
        }
    }
    for number in [-5.0, 4.5, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(
            (z(&parallel(-4.0, false), number), z(&parallel(-4.0, true), number)),
            ([1.0; 2], [0.0; 2])
        );
    }
    // With a near plane at the eye, or before it, zero and negative numbers are no data.
    for near in [0.0, 1.0] {
        for number in [0.0, -0.0, -2.0] {
            assert_eq!(z(&parallel(near, false), number), [1.0; 2]);
            assert_eq!(z(&parallel(near, true), number), [0.0; 2]);
        }
    }
    // A near plane that only rounding has put behind the eye counts as one at the eye.
    let mut rounded = parallel(0.0, false);
    rounded.rows[2][3] = 1e-13;
    assert_eq!(z(&rounded, 0.0), [1.0; 2]);
    let bare = DepthMeaning { origin_is_eye: false, ..PLAIN };
    let error = depth_bounds(&parallel(0.0, false), &[1.0], bare).unwrap_err();
    assert!(error.to_string().contains("where view depth starts"), "{error}");
}

#[test]
fn no_data_is_far() {
    for reversed in [false, true] {
        let far = [if reversed { 0.0 } else { 1.0 }; 2];
        for number in [0.0, -0.0, -3.0, 0.5, f64::NAN, f64::INFINITY] {
            assert_eq!(z(&perspective(reversed), number), far, "{number}");
        }
        let invalid = DepthMeaning { invalid: &[8.0, -1.0], scale: 2.0, ..PLAIN };
        assert_eq!(bounds(&perspective(reversed), 8.0, invalid), far);
        assert_ne!(
            bounds(&perspective(reversed), 4.0, invalid),
            far,
            "invalid values are not scaled"
        );
    }
}

#[test]
fn ndc_depth_is_itself() {
    let ndc = DepthMeaning { kind: DepthKind::Ndc, ..PLAIN };
    let reversed = DepthMeaning { kind: DepthKind::ReversedNdc, ..PLAIN };
    for depth in [0.0_f32, 0.25, 1.0, 0.1, f32::MIN_POSITIVE] {
        assert_eq!(bounds(&perspective(false), f64::from(depth), ndc), [depth; 2]);
        assert_eq!(bounds(&perspective(true), f64::from(depth), reversed), [depth; 2]);
    }
    around(bounds(&perspective(false), 0.1, ndc), 0.1, false);
    around(bounds(&perspective(true), 0.1, reversed), 0.1, true);
    assert_eq!(bounds(&perspective(false), 1e-40, ndc), [0.0, f32::MIN_POSITIVE]);
    assert_eq!(bounds(&perspective(true), 1e-40, reversed), [f32::MIN_POSITIVE, 0.0]);
    for number in [-1e-300, 1.0 + f64::EPSILON, f64::NAN, f64::INFINITY] {
        assert_eq!(bounds(&perspective(false), number, ndc), [1.0; 2]);
        assert_eq!(bounds(&perspective(true), number, reversed), [0.0; 2]);
    }
    assert_eq!(bounds(&perspective(false), 0.5, DepthMeaning { invalid: &[0.5], ..ndc }), [1.0; 2]);
    for meaning in
        [reversed, DepthMeaning { scale: 2.0, ..ndc }, DepthMeaning { scale: 0.0, ..PLAIN }]
    {
        assert!(matches!(
            depth_bounds(&perspective(false), &[0.5], meaning),
            Err(Error::DepthMeaning(_))
        ));
    }
}

/// A ball whose front is at the wall's depth, a hair in front of it, and a hair behind it.
#[test]
fn between_two_images_nothing_is_said() {
    let view = perspective(false);
    let verdict = |wall: f64, front: f64| {
        let depth = depth_bounds(&view, &[wall], PLAIN).unwrap();
        let ball = Volume::Sphere { center: [0.0, 0.0, front + 1.0], radius: 1.0 };
        classify_between(&view, &ball, &depth, Options::default()).unwrap()
    };
    // Depth 7/8 is a float32, so equal depth can be decided, and it is visible.
    assert_eq!(verdict(8.0, 8.0), Verdict::Visible);
    assert_eq!(verdict(8.0, 8.000_001), Verdict::Hidden);
    // 2/3 is not a float32; its neighbours are 3e-7 apart in view depth.
    assert_eq!(verdict(3.0, 3.0), Verdict::Undecided);
    assert_eq!(verdict(3.0, 3.000_001), Verdict::Hidden);
    assert_eq!(verdict(3.0, 2.999_999), Verdict::Visible);
}
