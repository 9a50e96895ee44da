//! Cases worked by hand.
//! Every expectation follows from the few lines of arithmetic beside it.

use hiz_ref::{
    Coverage, Error, Options, OwnDepth, Verdict, View, Volume, classify, classify_with, hides,
    is_outside, own_depth, touched_pixels,
};
use std::f64::consts::FRAC_1_SQRT_2;

/// A camera at the origin that looks along +z.
/// 90 degrees, near plane 1, infinite far plane, standard Z.
/// With 4x4 pixels a point has `x_pixel = 2 + 2 x/z`, `y_pixel = 2 - 2 y/z`, depth `1 - 1/z`.
fn perspective(width: u32, height: u32) -> View {
    View {
        rows: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, -1.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
        origin: [0.0; 3],
        width,
        height,
        reversed: false,
    }
}

/// The same with reversed Z: depth is 1/z.
fn reversed(width: u32, height: u32) -> View {
    let mut view = perspective(width, height);
    view.rows[2] = [0.0, 0.0, 0.0, 1.0];
    view.reversed = true;
    view
}

/// World coordinates are NDC.
/// With 4x4 pixels `x_pixel = 2 + 2 x` and `y_pixel = 2 - 2 y`.
fn orthographic(width: u32, height: u32) -> View {
    let mut view = perspective(width, height);
    view.rows[2] = [0.0, 0.0, 1.0, 0.0];
    view.rows[3] = [0.0, 0.0, 0.0, 1.0];
    view
}

fn aabb(min: [f64; 3], max: [f64; 3]) -> Volume {
    Volume::Box { min, max }
}

fn sphere(center: [f64; 3], radius: f64) -> Volume {
    Volume::Sphere { center, radius }
}

/// An image of one depth with another at (column, row).
fn hole(view: &View, depth: f32, at: [u32; 2], other: f32) -> Vec<f32> {
    let mut image = vec![depth; (view.width * view.height) as usize];
    image[(at[1] * view.width + at[0]) as usize] = other;
    image
}

fn verdict(view: &View, volume: Volume, depth: &[f32]) -> Verdict {
    classify(view, &volume, depth).expect("valid input")
}

#[test]
fn a_pixel_is_closed() {
    // At z = 2, x = 1 is x_pixel = 3, the edge between columns 2 and 3.
    // y in 0.1..0.2 is y_pixel 1.8..1.9, which is row 1.
    // The depth is 0.5.
    let view = perspective(4, 4);
    let plate = |left| aabb([left, 0.1, 2.0], [1.5, 0.2, 2.0]);
    let image = hole(&view, 0.25, [2, 1], 1.0);
    assert_eq!(verdict(&view, plate(1.0), &image), Verdict::Visible);
    assert_eq!(verdict(&view, plate(1.0f64.next_up()), &image), Verdict::Hidden);
    let touched = |left| touched_pixels(&view, &plate(left), Coverage::Area).expect("valid");
    assert_eq!(touched(1.0), [[2, 1], [3, 1]]);
    assert_eq!(touched(1.0f64.next_up()), [[3, 1]]);

    // A point on a corner is in four pixels.
    let point = touched_pixels(&view, &sphere([1.0, -1.0, 2.0], 0.0), Coverage::Area);
    assert_eq!(point.expect("valid"), [[2, 2], [3, 2], [2, 3], [3, 3]]);
}

#[test]
fn equal_depth_is_visible_and_one_step_nearer_hides() {
    // The nearest z is 8: depth 1 - 1/8 = 0.875, reversed 0.125; both are float32 numbers.
    for volume in [
        sphere([0.0, 0.0, 10.0], 2.0),
        aabb([-1.0, -1.0, 8.0], [1.0, 1.0, 9.0]),
        Volume::OrientedBox {
            center: [0.0, 0.0, 10.0],
            half_sizes: [1.0, 2.0, 1.0],
            axes: [[1.0, 0.0, 0.0], [0.0, 0.0, 3.0], [0.0, 1.0, 0.0]],
        },
    ] {
        // The oriented box reaches from z = 10 - 2 to 10 + 2, because its axis 1 is along z.
        for (view, depth, nearer) in [
            (perspective(5, 3), 0.875f32, 0.875f32.next_down()),
            (reversed(5, 3), 0.125, 0.125f32.next_up()),
        ] {
            assert!(!hides(&view, &volume, depth).expect("valid"), "{volume:?}");
            assert!(hides(&view, &volume, nearer).expect("valid"), "{volume:?}");
            assert_eq!(verdict(&view, volume, &[depth; 15]), Verdict::Visible);
            assert_eq!(verdict(&view, volume, &[nearer; 15]), Verdict::Hidden);
            let options = Options::default();
            let outcome = classify_with(&view, &volume, &[nearer; 15], options).expect("valid");
            assert_eq!(outcome.outside, Some(false));
            let nearest = outcome.nearest_depth.expect("all of it is in front");
            assert!((nearest - f64::from(depth)).abs() < 1e-12, "{nearest}");
        }
    }
}

#[test]
fn a_sphere_tangent_to_a_pixel_edge() {
    // Eight columns: x_pixel = 4 + 4 x/z, so x_pixel = 7 is the plane 4 x - 3 z = 0.
    // Its distance from (0, 0, 10) is 30/5 = 6.
    // The foot is (4.8, 0, 6.4), well beyond the near plane.
    // So radius 6 touches column 7, and the float64 below 6 does not.
    let view = perspective(8, 8);
    let image: Vec<f32> = (0..64).map(|i| if i % 8 == 7 { 1.0 } else { 0.0 }).collect();
    let ball = |radius: f64| sphere([0.0, 0.0, 10.0], radius);
    assert_eq!(verdict(&view, ball(6.0), &image), Verdict::Visible);
    assert_eq!(verdict(&view, ball(6.0f64.next_down()), &image), Verdict::Hidden);
    let options = Options::default();
    let outcome = classify_with(&view, &ball(6.0), &image, options).expect("valid");
    // y = 0 is the edge between rows 3 and 4.
    assert!(matches!(outcome.witness, Some([7, 3 | 4])), "{outcome:?}");
}

#[test]
fn a_disk_misses_the_corners_of_its_square() {
    // Orthographic, 8x8: one pixel is a quarter wide.
    // Radius 0.75 about the middle reaches column 7 (x from 0.75) only where y = 0.
    // The corner of pixel (6, 1) nearest to the middle is (0.5, 0.5), 0.707 away, so it is touched.
    // With radius 0.7 it is not.
    let view = orthographic(8, 8);
    let ball = |radius| sphere([0.0, 0.0, 0.5], radius);
    let touched = |volume| touched_pixels(&view, &volume, Coverage::Area).expect("valid");
    let big = touched(ball(0.75));
    assert!(big.contains(&[6, 1]) && big.contains(&[7, 3]) && big.contains(&[7, 4]));
    assert!(!big.contains(&[7, 2]) && !big.contains(&[7, 7]));
    // 6x6 squares, and two more at each end of both axes.
    assert_eq!(big.len(), 36 + 8);
    let small = touched(ball(0.7));
    // The 6x6 squares without their four corners.
    assert_eq!(small.len(), 32);
    // At sqrt(0.5) itself the float64 below is short of the corner, and the one above reaches it.
    let corner = |radius| touched(ball(radius)).contains(&[6, 1]);
    let (below, above) = if FRAC_1_SQRT_2 * FRAC_1_SQRT_2 > 0.5 {
        (FRAC_1_SQRT_2.next_down(), FRAC_1_SQRT_2)
    } else {
        (FRAC_1_SQRT_2, FRAC_1_SQRT_2.next_up())
    };
    assert!(!corner(below) && corner(above));
}

#[test]
fn row_0_is_on_top() {
    let view = perspective(4, 4);
    let up_left = sphere([-7.0, 7.0, 10.0], 0.01);
    let touched = touched_pixels(&view, &up_left, Coverage::Area).expect("valid");
    assert_eq!(touched, [[0, 0]]);
}

#[test]
fn the_near_plane_and_what_lies_behind() {
    let view = perspective(4, 4);
    let nearest = [0.0f32; 16];
    // Around the camera, and across the near plane inside the frustum.
    // Both are visible, whatever the image holds.
    assert_eq!(verdict(&view, sphere([0.0; 3], 3.0), &nearest), Verdict::Visible);
    let across = aabb([-0.1, -0.1, 0.5], [0.1, 0.1, 5.0]);
    assert_eq!(verdict(&view, across, &nearest), Verdict::Visible);
    // Across the near plane, but beside the image (|x| > z everywhere): outside.
    let beside = aabb([6.0, -1.0, -5.0], [7.0, 1.0, 5.0]);
    assert!(is_outside(&view, &beside).expect("valid"));
    assert_eq!(verdict(&view, beside, &[1.0; 16]), Verdict::Hidden);
    // Behind the camera and up to the near plane; touching that plane counts.
    let behind = |to| aabb([-0.5, -0.5, -9.0], [0.5, 0.5, to]);
    assert!(is_outside(&view, &behind(1.0f64.next_down())).expect("valid"));
    assert!(!is_outside(&view, &behind(1.0)).expect("valid"));
    assert_eq!(verdict(&view, behind(1.0), &[0.5; 16]), Verdict::Visible);
    // Nothing is drawn between the camera and the near plane.
    assert!(is_outside(&view, &sphere([0.0, 0.0, 0.5], 0.25)).expect("valid"));
    // The orthographic far plane is z = 1 and belongs to the frustum.
    let view = orthographic(4, 4);
    assert!(!is_outside(&view, &sphere([0.0, 0.0, 2.0], 1.0)).expect("valid"));
    assert!(is_outside(&view, &sphere([0.0, 0.0, 2.0], 1.0f64.next_down())).expect("valid"));
}

#[test]
fn the_corner_of_the_frustum_where_no_plane_alone_decides() {
    // Orthographic: a ball beyond the corner (1, 1).
    // It is nearer than its radius to both side planes but not to their edge: 3-4-5.
    let view = orthographic(4, 4);
    let ball = |radius| sphere([1.0 + 3.0, 1.0 + 4.0, 0.5], radius);
    assert!(!is_outside(&view, &ball(5.0)).expect("valid"));
    assert!(is_outside(&view, &ball(5.0f64.next_down())).expect("valid"));
    // The same at the corner (1, 1, 1) of the far plane: 2-3-6-7.
    let ball = |radius| sphere([1.0 + 2.0, 1.0 + 3.0, 1.0 + 6.0], radius);
    assert!(!is_outside(&view, &ball(7.0)).expect("valid"));
    assert!(is_outside(&view, &ball(7.0f64.next_down())).expect("valid"));
    // A square on its tip beyond the corner: |x - 3| + |y - 3| <= 4 reaches exactly (1, 1).
    let diamond = |half| Volume::OrientedBox {
        center: [3.0, 3.0, 0.5],
        half_sizes: [half, half, 0.25],
        axes: [[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 1.0]],
    };
    assert!(!is_outside(&view, &diamond(2.0)).expect("valid"));
    assert!(is_outside(&view, &diamond(2.0f64.next_down())).expect("valid"));
}

#[test]
fn one_open_pixel_is_found() {
    let view = perspective(64, 64);
    let big = aabb([-20.0, -20.0, 10.0], [20.0, 20.0, 30.0]);
    for at in [[0, 0], [63, 63], [17, 42]] {
        let image = hole(&view, 0.5, at, 1.0);
        let outcome = classify_with(&view, &big, &image, Options::default()).expect("valid");
        assert_eq!(outcome.verdict, Verdict::Visible);
        assert_eq!(outcome.witness, Some(at));
    }
    assert_eq!(verdict(&view, big, &[0.5; 64 * 64]), Verdict::Hidden);
}

#[test]
fn special_depths() {
    let (view, back) = (perspective(1, 1), reversed(1, 1));
    let far_away = aabb([-1.0, -1.0, 1e30], [1.0, 1.0, 1e30]);
    for far in [f32::NAN, f32::INFINITY, -0.5, -1e-40, 1.5, 1.0] {
        assert_eq!(verdict(&view, far_away, &[far]), Verdict::Visible, "{far}");
    }
    for far in [f32::NAN, f32::NEG_INFINITY, -0.5, 1.5, 0.0, -0.0, 1e-40] {
        assert_eq!(verdict(&back, far_away, &[far]), Verdict::Visible, "{far}");
    }
    // Beyond the far plane a depth of 1 is nearer than everything.
    // It means "nothing there" and hides nothing all the same.
    let beyond = sphere([0.0, 0.0, 5.0], 1.0);
    assert!(!hides(&orthographic(1, 1), &beyond, 1.0).expect("valid"));
    assert!(hides(&orthographic(1, 1), &beyond, 1.0f32.next_down()).expect("valid"));
    for near in [0.0, -0.0, 1e-40, 0.5] {
        assert_eq!(verdict(&view, far_away, &[near]), Verdict::Hidden, "{near}");
    }
    for near in [1e-20, 1.0] {
        assert_eq!(verdict(&back, far_away, &[near]), Verdict::Hidden, "{near}");
    }
}

#[test]
fn samples_count_alone_where_asked() {
    // Pixel (2, 1) of 4x4 has its centre at (2.5, 1.5), the NDC point (0.25, 0.25).
    let view = orthographic(4, 4);
    let options = Options { coverage: Coverage::Sample, ..Options::default() };
    let sample = |volume: Volume| {
        let outcome = classify_with(&view, &volume, &[1.0; 16], options).expect("valid");
        (outcome.verdict, outcome.witness)
    };
    let plate = |right| aabb([0.01, 0.01, 0.5], [right, 0.4, 0.5]);
    assert_eq!(sample(plate(0.25)), (Verdict::Visible, Some([2, 1])));
    assert_eq!(sample(plate(0.25f64.next_down())), (Verdict::Hidden, None));
    assert_eq!(verdict(&view, plate(0.2), &[1.0; 16]), Verdict::Visible, "the square is touched");
    let ball = |radius| sphere([-0.05, 0.65, 0.5], radius);
    // The sample nearest to (-0.05, 0.65) is (-0.25, 0.75), the centre of pixel (1, 0).
    // It is sqrt(0.05) = 0.2236 away.
    assert_eq!(sample(ball(0.22)), (Verdict::Hidden, None));
    assert_eq!(sample(ball(0.23)), (Verdict::Visible, Some([1, 0])));
    let touched = touched_pixels(&view, &plate(0.25), Coverage::Sample).expect("valid");
    assert_eq!(touched, [[2, 1]]);
}

#[test]
fn far_from_the_origin() {
    // The first case again, 1e9 units away.
    // The view is relative to its origin, so nothing changes.
    let origin = [1e9, -1e9, 1e9];
    let view = View { origin, ..perspective(4, 4) };
    let moved = |p: [f64; 3]| [p[0] + origin[0], p[1] + origin[1], p[2] + origin[2]];
    let plate = |left| aabb(moved([left, 0.125, 2.0]), moved([1.5, 0.25, 2.0]));
    let image = hole(&view, 0.25, [2, 1], 1.0);
    assert_eq!(verdict(&view, plate(1.0), &image), Verdict::Visible);
    let step = 2.0f64.powi(-23); // the ulp of 1e9
    assert_eq!(verdict(&view, plate(1.0 + step), &image), Verdict::Hidden);
}

#[test]
fn huge_and_tiny_numbers_are_decided_exactly() {
    let view = perspective(4, 4);
    let everything = aabb([-1e300; 3], [1e300; 3]);
    assert_eq!(verdict(&view, everything, &[0.0; 16]), Verdict::Visible);
    let wall = aabb([-1e300, -1e300, 4.0], [1e300, 1e300, 1e300]);
    assert_eq!(verdict(&view, wall, &[0.75; 16]), Verdict::Visible);
    let nearer = [0.75f32.next_down(); 16];
    assert_eq!(verdict(&view, wall, &nearer), Verdict::Hidden);
    // A matrix scaled by 2^-600: the same view, though its products underflow.
    let mut scaled = view.clone();
    scaled.rows = view.rows.map(|row| row.map(|x| x * 2.0f64.powi(-600)));
    assert_eq!(verdict(&scaled, wall, &nearer), Verdict::Hidden);
    assert_eq!(verdict(&scaled, wall, &[0.75; 16]), Verdict::Visible);
}

#[test]
fn a_matrix_that_float64_cannot_follow() {
    // x = 5 K p.x - 4 K p.y - K p.z + 0.6 is 0.6 for p = (t, t, t).
    // Each product is rounded by up to 32, so in plain float64 the point may be anywhere.
    // `x_pixel` = 2 + 1.2 is column 3; `y_pixel` = 2 - 0.2 is row 1.
    // The same holds mirrored, and with x and y exchanged.
    const K: f64 = 1e17;
    for (sign, exchanged, pixel) in
        [(1.0, false, [3, 1]), (-1.0, false, [0, 1]), (1.0, true, [2, 0]), (-1.0, true, [2, 3])]
    {
        let mut view = orthographic(4, 4);
        view.rows[0] = [5.0 * K, -4.0 * K, -K, 0.6].map(|x| sign * x);
        view.rows[1] = [0.0, 0.0, 0.0, 0.1];
        view.rows[2] = [0.0, 0.0, 0.0, 0.5];
        if exchanged {
            view.rows.swap(0, 1);
        }
        for tenths in 11..40u8 {
            let t = f64::from(tenths) / 10.0;
            let touched = touched_pixels(&view, &sphere([t; 3], 0.0), Coverage::Area);
            assert_eq!(touched.expect("valid"), [pixel], "{t}");
        }
    }
}

#[test]
fn strange_matrices() {
    // With negated rows 0 <= z <= w asks for points behind the camera.
    // Their z/w would have to be that of points in front of it, and there are none.
    let mut negated = perspective(4, 4);
    negated.rows = negated.rows.map(|row| row.map(|x| -x));
    for volume in
        [sphere([0.0, 0.0, 10.0], 5.0), sphere([0.0, 0.0, -10.0], 5.0), aabb([-1e6; 3], [1e6; 3])]
    {
        assert!(is_outside(&negated, &volume).expect("valid"), "{volume:?}");
    }
    // A singular matrix has a point with clip = (0, 0, 0, 0).
    // It counts as touched everywhere, which is the safe side.
    let mut singular = perspective(4, 4);
    singular.rows[2] = [0.0; 4];
    let eye = sphere([0.0; 3], 0.0);
    assert_eq!(verdict(&singular, eye, &[0.0; 16]), Verdict::Visible);
    // If all are zero, every point is such a point.
    singular.rows = [[0.0; 4]; 4];
    assert_eq!(verdict(&singular, sphere([3.0; 3], 1.0), &[0.5; 16]), Verdict::Visible);
}

#[test]
fn invalid_volumes_and_bad_input_have_names() {
    let view = perspective(4, 4);
    let bad = sphere([0.0; 3], -1.0);
    assert_eq!(verdict(&view, bad, &[0.0; 16]), Verdict::Invalid);
    assert!(!is_outside(&view, &bad).expect("valid view"));
    assert!(!hides(&view, &bad, 0.0).expect("valid view"));
    let none = touched_pixels(&view, &bad, Coverage::Area);
    assert_eq!(none, Ok(Vec::new()));

    let good = sphere([0.0; 3], 1.0);
    let text = |result: Result<Verdict, Error>| result.expect_err("bad input").to_string();
    assert_eq!(text(classify(&view, &good, &[0.0; 15])), "depth: expected 16 values (4x4), got 15");
    assert_eq!(
        text(classify(&perspective(0, 4), &good, &[])),
        "view size: expected sides of 1 to 32768 pixels, got 0x4"
    );
    let mut broken = view.clone();
    broken.rows[1][3] = f64::NAN;
    assert_eq!(
        text(classify(&broken, &good, &[0.0; 16])),
        "view: expected finite rows and a finite origin, got NaN or infinity"
    );
}

#[test]
fn a_pixel_shows_its_own_part_of_a_slope() {
    // World is NDC: columns 0..4 are x in -1..1.
    // A plate recedes to the right.
    // Its depth is 0.5 in its middle (x = 0), 0.25 at x = -0.9, and 0.75 at x = 0.9.
    // In column 0 (x below -0.5) its depth is from 0.25 to 0.361, in column 3 from 0.639 to 0.75.
    let view = orthographic(4, 1);
    let slope = Volume::OrientedBox {
        center: [0.0, 0.0, 0.5],
        half_sizes: [1.0, 0.5, 0.0],
        axes: [[0.9, 0.0, 0.0], [0.0, 1.0, 0.0], [0.25, 0.0, 1.0]],
    };
    let ask = |depth: [f32; 4], own_depth| {
        classify_with(&view, &slope, &depth, Options { own_depth, ..Options::default() })
            .expect("valid input")
    };
    let following = [0.24, 0.36, 0.49, 0.63];
    assert_eq!(ask(following, OwnDepth::PerPixel).verdict, Verdict::Hidden);
    assert_eq!(ask(following, OwnDepth::Nearest).verdict, Verdict::Visible);
    // The part in column 2 begins with the depth of x = 0.
    let begins =
        |column| own_depth(&view, &slope, Coverage::Area, [column, 0]).expect("valid input");
    assert_eq!(begins(2), Some(0.5));
    assert!((f64::from(begins(3).expect("touched")) - (0.5 + 0.5 / 0.9 * 0.25)).abs() < 1e-7);
    // At x = 0.5 the depth is 0.6389.
    let outcome = ask([0.24, 0.36, 0.49, 0.64], OwnDepth::PerPixel);
    assert_eq!((outcome.verdict, outcome.witness), (Verdict::Visible, Some([3, 0])));
    // Equal depth is visible: at x = 0 the third column begins with 0.5.
    assert_eq!(ask([0.24, 0.36, 0.5, 0.63], OwnDepth::PerPixel).verdict, Verdict::Visible);
    assert_eq!(ask([0.24, 0.36, 0.49, 1.0], OwnDepth::PerPixel).verdict, Verdict::Visible);
}
