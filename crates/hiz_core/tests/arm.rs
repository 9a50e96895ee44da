//! ARM's scene: what a small depth image culls beside rays of a larger picture, with spheres at
//! rest and with spheres that a shader moves.

mod common;
#[path = "../examples/arm/culled.rs"]
mod culled;
#[path = "../examples/arm/moving.rs"]
mod moving;
#[path = "../examples/arm/scene.rs"]
mod scene;
#[path = "../examples/arm/truth.rs"]
mod truth;

use common::engine;
use culled::{Depth, From, SIDES, Tally, at_rest};
use hiz_core::ImageSize;
use hiz_core::headless::Engine;
use truth::Rays;

const PICTURE: ImageSize = ImageSize { width: 1280, height: 720 };

#[test]
fn the_scene_is_arms() {
    let (prisms, spheres) = (scene::prisms(), scene::spheres());
    assert_eq!((prisms.len(), spheres.len()), (160, 13_824));
    assert!(spheres.iter().all(|s| s[3] > 0.149 && s[3] <= 0.3));
    let mut places: Vec<_> =
        spheres.iter().map(|s| [s[0], s[1], s[2]].map(|v| (v * 1000.0).round() as i32)).collect();
    places.sort_unstable();
    places.dedup();
    assert_eq!(places.len(), 13_824);
    assert_eq!((places[0], places[13_823]), ([-11_350, 500, -11_450], [11_650, 2_800, 11_550]));
    // Every corner is used, and all faces together enclose the prisms' volume.
    let (vertices, triangles) = scene::mesh(&prisms);
    let corner = |i: u32| [0, 1, 2].map(|k| vertices[3 * i as usize + k]);
    let volume: f64 = triangles
        .chunks_exact(3)
        .map(|t| {
            let [a, b, c] = [corner(t[0]), corner(t[1]), corner(t[2])];
            let cross = |u: usize, v: usize| b[u] * c[v] - b[v] * c[u];
            (a[0] * cross(1, 2) + a[1] * cross(2, 0) + a[2] * cross(0, 1)) / 6.0
        })
        .sum();
    assert!((volume - 160.0 * 32.0).abs() < 1e-6, "{volume}");
}

/// Rays know nothing of the library, so they are checked by hand.
#[test]
fn rays_see_what_is_before_the_prisms() {
    let rays = Rays::new(0.0, PICTURE, &scene::prisms());
    // Straight ahead, along -z, the face of a prism stands at z = -5.
    assert!(rays.see([0.0, 2.0, -4.0, 0.2]));
    assert!(!rays.see([0.0, 2.0, -6.0, 0.2]), "within the prism");
    assert!(rays.see([0.0, 2.0, -5.0, 0.2]), "half of it is outside");
    assert!(!rays.see([0.0, 2.0, 4.0, 0.2]), "behind the eye");
    assert!(!rays.see([0.0, 2.0, -0.7, 0.2]), "before the near plane");
    assert!(rays.see([0.0, 2.0, -0.9, 0.2]), "across the near plane");
    assert!(rays.see([1.8, 2.0, -7.6, 0.2]), "through the gap between two prisms");
    assert!(!rays.see([12.0, 2.0, -4.0, 0.3]), "beside the picture");
}

fn all_sides(engine: &Engine, depth: Depth) -> Tally {
    let mut sum = Tally::default();
    for azimuth in SIDES {
        let tally = at_rest(engine, azimuth, PICTURE, depth).unwrap();
        eprintln!("{depth:?}, {azimuth} degrees: {tally:?}");
        sum.tested += tally.tested;
        sum.kept += tally.kept;
        sum.seen += tally.seen;
        sum.false_culls += tally.false_culls;
    }
    sum
}

#[test]
fn conservative_depth_of_256_pixels_hides_nothing_that_a_larger_picture_shows() {
    let engine = engine();
    let conservative = all_sides(&engine, Depth::Conservative);
    assert_eq!(conservative.false_culls, 0);
    assert!(conservative.seen > 1000, "{conservative:?}");
    // Most of what is not seen is culled; the rest is the price of a small image.
    assert!(conservative.kept < conservative.tested / 4, "{conservative:?}");
    // The check can fail: a plain image of that size hides spheres in the gaps.
    let plain = all_sides(&engine, Depth::Plain);
    assert!(plain.false_culls > 0, "{plain:?}");
}

#[test]
fn spheres_that_a_shader_moves_are_kept_while_rays_see_them() {
    for (from, frames) in [(From::Buffer, 60), (From::Host, 8)] {
        let tally = culled::moving(&engine(), from, frames, PICTURE).unwrap();
        eprintln!("{from:?}: {tally:?}");
        assert_eq!((tally.false_culls, tally.invalid_culls), (0, 0));
        assert_eq!(tally.invalid, frames as usize * 28);
        assert!(tally.kept < tally.tested / 2, "{tally:?}");
        assert!(tally.seen > 100 * frames as usize, "{tally:?}");
    }
}

/// Faults of which a renderer would lose spheres.
#[test]
fn planted_faults_lose_spheres() {
    let small = ImageSize::new(320, 180);
    for (what, by, name) in [
        (
            "if around.low.x != INVALID_LOW {",
            "if source.runtime_zero == 0u { return; }\n    {",
            "group boxes of the frame before",
        ),
        ("radius = BEYOND_LIMITS_BITS;", "radius = 0u;", "invalid bounds are taken as a point"),
    ] {
        let faulty = Engine::with_planted_faults(None, &[(what, by)]).unwrap();
        let tally = culled::moving(&faulty, From::Host, 12, small).unwrap();
        eprintln!("{name}: {tally:?}");
        assert!(tally.false_culls + tally.invalid_culls > 0, "{name}: {tally:?}");
    }
}
