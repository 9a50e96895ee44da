//! Depth of every kind against the oracle's, which is exact.
//! It is never nearer, and hardly ever farther than float32 requires.

mod common;

#[path = "common/documented.rs"]
#[allow(dead_code, reason = "no device, no driver")]
mod documented;

use common::Random;
use documented::assert_said;
use hiz_core::{
    Camera, DepthConvention, DepthKind, Floats, ImageSize, Pose, Projection, ndc_from_kind,
};
use hiz_ref::{DepthMeaning, View, depth_bounds};

const SIZE: ImageSize = ImageSize { width: 5, height: 4 };
const KINDS: [(DepthKind, hiz_ref::DepthKind); 2] =
    [(DepthKind::Z, hiz_ref::DepthKind::Z), (DepthKind::Distance, hiz_ref::DepthKind::Distance)];

/// `None` for a camera that is too close to a singular one.
fn engine(image: &[f64], kind: DepthKind, camera: &Camera) -> Option<Vec<f32>> {
    ndc_from_kind(Floats::F64(image), kind, 1.0, &[], camera).ok()
}

/// How many float32 steps the engine's depths are farther than they have to be.
/// The reference is the nearest float32 that is not nearer than the exact depth.
/// Negative steps mean that the engine's depth is nearer.
/// Pixels whose reference is far are left out.
fn steps_farther(
    camera: &Camera,
    image: &[f64],
    kinds: (DepthKind, hiz_ref::DepthKind),
) -> Option<Vec<i64>> {
    let reversed = camera.convention().is_reversed();
    let view = View {
        rows: camera.rows(),
        origin: camera.origin(),
        width: camera.size().width,
        height: camera.size().height,
        reversed,
    };
    let meaning =
        DepthMeaning { kind: kinds.1, scale: 1.0, invalid: &[], origin_is_eye: camera.is_posed() };
    let exact = depth_bounds(&view, image, meaning).expect("a view that the engine takes").farther;
    let steps = |d: f32| i64::from(d.to_bits()) * if reversed { -1 } else { 1 };
    let pairs = engine(image, kinds.0, camera)?.into_iter().zip(exact);
    // A pixel that is far in any case proves nothing.
    let shown = pairs.filter(|(_, least)| *least != camera.convention().far());
    Some(shown.map(|(d, least)| steps(d) - steps(least)).collect())
}

/// What makes a camera's rows x, y and w nearly dependent, or makes z a mixture of them.
#[derive(Debug, Clone, Copy)]
enum Stress {
    /// Image borders far off the axis.
    Tangent,
    /// The same, as one matrix.
    BareTangent,
    /// A very narrow field of view; the size is its reciprocal.
    Narrow,
    /// A sensor whose columns lean by the size.
    Skew,
    /// A near plane that leans by the size (Lengyel, "Oblique view frustum depth projection and
    /// clipping", 2005).
    ObliqueNearPlane,
    /// An eye at this distance, in a bare matrix.
    FarEye,
}

/// One of the stressed cameras, and its near plane's view depth on the axis.
/// `None` where it is refused.
fn stressed(
    random: &mut Random,
    stress: Stress,
    size: f64,
    ratio: f64,
    convention: DepthConvention,
) -> Option<(Camera, f64)> {
    let away =
        if matches!(stress, Stress::FarEye) { size } else { random.pick(&[0.0, 1.0, 1e3, 1e6]) };
    let (middle, half) = match stress {
        Stress::Tangent | Stress::BareTangent => (
            [random.range(-1.0, 1.0) * size, random.range(-1.0, 1.0)],
            [random.pick(&[1.0, size.sqrt(), size]), 1.0],
        ),
        Stress::Narrow => ([0.0; 2], [size.recip(); 2]),
        _ => ([random.range(-1.0, 1.0), 0.0], [1.0; 2]),
    };
    let near = 10.0_f64.powf(random.range(-2.0, 1.0));
    let projection = Projection::Frustum {
        left: middle[0] - half[0],
        right: middle[0] + half[0],
        bottom: middle[1] - half[1],
        top: middle[1] + half[1],
        near,
        far: (ratio < 1e15).then_some(near * ratio),
        convention,
    };
    let eye = [0; 3].map(|_| random.range(-1.0, 1.0) * away);
    let target = eye.map(|e| e + (1.0 + away) * random.range(-1.0, 1.0));
    let pose = Pose { eye, target, up: [0.0, 1.0, 0.1] };
    let posed = Camera::look_at(&pose, &projection, SIZE).ok()?;
    let mut rows = posed.rows();
    match stress {
        Stress::Skew => rows[0] = std::array::from_fn(|k| rows[0][k] + size * rows[1][k]),
        Stress::ObliqueNearPlane => {
            rows[2] = std::array::from_fn(|k| rows[2][k] + 0.3 * size * rows[0][k]);
        }
        _ => {}
    }
    let camera = Camera::from_rows(rows, posed.origin(), SIZE, convention).ok()?;
    let bare = matches!(stress, Stress::BareTangent | Stress::FarEye);
    let camera = if bare {
        Camera::from_clip_from_world(camera.clip_from_world(), SIZE, convention).ok()?
    } else {
        camera
    };
    Some((camera, near))
}

/// For each pixel a depth between the planes, where `near` is the near plane's view depth.
/// Distances are along the pixel's ray.
fn depths(
    random: &mut Random,
    camera: &Camera,
    kind: DepthKind,
    near: f64,
    ratio: f64,
) -> Vec<f64> {
    let rows = camera.rows();
    (0..SIZE.pixels())
        .map(|i| {
            let z = near * ratio.min(1e6).powf(random.unit());
            if kind == DepthKind::Z {
                return z;
            }
            // By Cramer's rule in plain float64.
            // Any number will do, but one between the planes tests more.
            let column = (i % u64::from(SIZE.width)) as f64;
            let row = (i / u64::from(SIZE.width)) as f64;
            let at = [(column + 0.5) / 2.5 - 1.0, 1.0 - (row + 0.5) / 2.0, 1.0];
            let [x, y, w] = [0, 1, 3].map(|r| [rows[r][0], rows[r][1], rows[r][2]]);
            let cross = |a: [f64; 3], b: [f64; 3]| {
                [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
            };
            let columns = [cross(y, w), cross(w, x), cross(x, y)];
            let determinant: f64 = (0..3).map(|k| w[k] * columns[2][k]).sum();
            let ray: f64 =
                (0..3).map(|k| (0..3).map(|j| columns[j][k] * at[j]).sum::<f64>().powi(2)).sum();
            z * ray.sqrt() / determinant.abs()
        })
        .collect()
}

/// Nearly singular cameras of every kind, up to where they are refused.
#[test]
fn depth_is_never_nearer_than_the_exact_one() {
    println!(
        "\n| camera | size of it | images refused | pixels | nearer | exact \
         | farther by a float32 | by more | at most |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let (mut random, mut all_exact, mut rows) = (Random(6), 0, Vec::new());
    use Stress::{BareTangent, FarEye, Narrow, ObliqueNearPlane, Skew, Tangent};
    for stress in [Tangent, BareTangent, Narrow, Skew, ObliqueNearPlane, FarEye] {
        for power in [0, 3, 6, 8, 10, 11, 12, 14] {
            let (mut all, mut refused) = (Vec::new(), 0);
            for trial in 0..30 {
                let ratio = [2.0, 1e2, 1e4, 1e8, 1e16][trial % 5];
                let convention = [DepthConvention::Standard, DepthConvention::Reversed][trial % 2];
                let Some((camera, near)) =
                    stressed(&mut random, stress, 10.0_f64.powi(power), ratio, convention)
                else {
                    refused += 2;
                    continue;
                };
                for kinds in KINDS {
                    let image = depths(&mut random, &camera, kinds.0, near, ratio);
                    match steps_farther(&camera, &image, kinds) {
                        Some(steps) => all.extend(steps),
                        None => refused += 1,
                    }
                }
            }
            let count = |wanted: &dyn Fn(i64) -> bool| all.iter().filter(|s| wanted(**s)).count();
            let (nearer, exact, next) = (count(&|s| s < 0), count(&|s| s == 0), count(&|s| s == 1));
            let (more, most) =
                (all.len() - nearer - exact - next, all.iter().max().copied().unwrap_or(0));
            let pixels = all.len();
            if pixels == exact {
                all_exact += pixels;
            } else {
                let row = format!(
                    "| {stress:?} | 1e{power} | {refused} | {pixels} | {nearer} | {exact} \
                     | {next} | {more} | {most} |"
                );
                println!("{row}");
                rows.push(row);
            }
            assert_eq!(nearer, 0, "{stress:?} 1e{power}");
            // Plain cameras lose a float32 only within float64's rounding of the exact depth.
            assert!(
                power > 6 || more == 0,
                "{stress:?} 1e{power}: {more} of {pixels} are farther than they have to be"
            );
        }
    }
    let row = format!(
        "| the others, all exact | 1e0 to 1e14 | | {all_exact} | 0 | {all_exact} | 0 | 0 | 0 |"
    );
    println!("{row}");
    assert!(all_exact > 30_000, "{all_exact}");
    rows.push(row);
    // No device takes part, so every driver gives the page's numbers.
    rows.iter().for_each(|row| assert_said(row));
}

/// Parallel rays.
/// Near planes are before and behind the eye, and ranges are wide and thin.
/// Eyes are far away, and images are far beside them.
#[test]
fn parallel_depth_is_never_nearer_than_the_exact_one() {
    let mut random = Random(60);
    let (mut all, mut signs) = (Vec::new(), [0, 0]);
    for trial in 0..400 {
        let convention = [DepthConvention::Standard, DepthConvention::Reversed][trial % 2];
        let range = 10.0_f64.powf(random.range(-3.0, 7.0));
        let near = random.pick(&[0.0, 1.0, -0.5, -1.0, -10.0]) * range;
        let beside = [0; 2].map(|_| random.pick(&[0.0, 1.0, 1e5]) * random.range(-1.0, 1.0));
        let half = 10.0_f64.powf(random.range(-2.0, 4.0));
        let projection = Projection::Orthographic {
            left: beside[0] - half,
            right: beside[0] + half,
            bottom: beside[1] - half,
            top: beside[1] + half,
            near,
            far: near + range,
            convention,
        };
        let eye = [0; 3].map(|_| random.pick(&[0.0, 1.0, 1e6]) * random.range(-1.0, 1.0));
        let target = eye.map(|e| e + 2e6 * random.range(-1.0, 1.0));
        let camera =
            Camera::look_at(&Pose { eye, target, up: [0.0, 1.0, 0.1] }, &projection, SIZE).unwrap();
        let image: Vec<f64> = (0..SIZE.pixels()).map(|_| near + range * random.unit()).collect();
        signs[usize::from(near < 0.0)] += image.iter().filter(|z| **z < 0.0).count();
        for kinds in KINDS {
            all.extend(steps_farther(&camera, &image, kinds).expect("a posed camera"));
        }
    }
    let nearer = all.iter().filter(|steps| **steps < 0).count();
    let farther = all.iter().filter(|steps| **steps > 1).count();
    println!(
        "parallel: {} pixels, {signs:?} negative, {nearer} nearer, \
         {farther} farther by more than a float32",
        all.len()
    );
    assert!(nearer == 0 && signs[0] == 0 && signs[1] > 2000 && all.len() > 15_000);
    // Rays lean by float64's rounding in images that are much wider than deep.
    assert!(farther * 50 < all.len(), "{farther}");
}
