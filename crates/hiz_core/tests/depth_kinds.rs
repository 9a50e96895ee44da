//! View depth becomes NDC depth that is never nearer than the exact one.
//! The exact NDC depths lie within a rounding of a float32, where float64's losses decide.

mod common;

use common::{CONVENTIONS, Random};
use hiz_core::{
    Camera, DepthConvention, DepthKind, Floats, ImageSize, Pose, Projection, ndc_from_kind,
};

/// A finite float64 or float32 as an integer times 2^-`scale`.
fn integer(v: f64, scale: i32) -> i128 {
    let bits = v.to_bits();
    let exponent = ((bits >> 52 & 0x7ff) as i32) - 1075;
    let mantissa = i128::from(bits & ((1 << 52) - 1) | 1 << 52);
    let shift = exponent + scale;
    if v == 0.0 {
        0
    } else if shift >= 0 {
        mantissa << shift
    } else {
        assert!(mantissa.trailing_zeros() as i32 >= -shift, "{v} is finer than 2^-{scale}");
        mantissa >> -shift
    }
}

#[test]
fn depth_is_never_nearer_than_the_exact_one() {
    let mut random = Random(8);
    for convention in CONVENTIONS {
        // Near 1 and far 9: NDC depth is (9 z - 9) / 8 z, reversed (9 - z) / 8 z, with exact rows.
        let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
        let fov_y = std::f64::consts::FRAC_PI_2;
        let projection = Projection::Perspective { fov_y, near: 1.0, far: Some(9.0), convention };
        let depths: Vec<f64> = (0..4000)
            .map(|i| {
                let ndc = f64::from(random.range(0.01, 0.99) as f32);
                let z = match convention {
                    DepthConvention::Standard => 9.0 / (9.0 - 8.0 * ndc),
                    DepthConvention::Reversed => 9.0 / (8.0 * ndc + 1.0),
                };
                [z.next_down(), z, z.next_up()][i % 3]
            })
            .collect();
        let camera = Camera::look_at(&pose, &projection, ImageSize::new(100, 40)).unwrap();
        let converted =
            ndc_from_kind(Floats::F64(&depths), DepthKind::Z, 1.0, &[], &camera).unwrap();
        let mut at_the_border = 0;
        for (z, ndc) in depths.iter().zip(&converted) {
            // Both sides are multiplied by 8 z.
            // Here a float32 below 1 is a multiple of 2^-48, and a depth is a multiple of 2^-52.
            let (d, depth) = (integer(f64::from(*ndc), 48), integer(*z, 52));
            let product = 8 * d * depth;
            let exact = |z: i128, nine: i128| match convention {
                DepthConvention::Standard => (9 * z - nine) << 48,
                DepthConvention::Reversed => (nine - z) << 48,
            };
            let exact = exact(depth, 9 << 52);
            match convention {
                DepthConvention::Standard => assert!(product >= exact, "{z}: {ndc} is nearer"),
                DepthConvention::Reversed => assert!(product <= exact, "{z}: {ndc} is nearer"),
            }
            // And not much farther: at most two steps of float32.
            let two = 8 * depth * integer(f64::from(ndc.next_up() - ndc), 48) * 2;
            assert!((product - exact).abs() <= two, "{z}: {ndc} is too far");
            at_the_border += usize::from((product - exact).abs() > two / 8);
        }
        assert!(at_the_border > 1000, "few depths are pushed past a float32: {at_the_border}");
    }
}
