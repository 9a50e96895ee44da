//! Groups that are accepted by a walk over rows of texels (`descend_in_front` in
//! `shaders/cull/unoccluded.wgsl`).
//! Expectations come from the pixels, by loops of these tests.

use super::*;

const SIDE: usize = 128;
/// The distance of what is far, and of the single pixels before everything.
const FAR: f32 = 20.0;
const NEAR: f32 = 1.0;

/// Clusters of a group each, of points that lie anywhere in the view.
fn clusters(groups: u64) -> Vec<[f32; 4]> {
    let mut numbers = Vec::new();
    for group in 0..groups {
        let mut random = Random(group);
        let z = random.range(2.0, 8.0);
        let [x, y] = [0, 1].map(|_| random.range(-0.9, 0.9) * z);
        let half = random.range(0.05, 0.12) * z;
        for _ in 0..GROUP {
            let mut near = |v: f64| (v + random.range(-half, half)) as f32;
            numbers.push([near(x), near(y), near(z), 0.0]);
        }
    }
    numbers
}

/// Where the view's image shows a point: the column and the row.
fn pixel(number: &[f32; 4]) -> Option<[usize; 2]> {
    let [x, y, z, _] = number.map(f64::from);
    let half = SIDE as f64 / 2.0;
    let at = [half + half * x / z, half - half * y / z];
    at.iter().all(|v| (0.0..SIDE as f64).contains(v)).then(|| at.map(|v| v as usize))
}

/// How many instances are accepted, and how many of these lie behind their pixel.
fn check(engine: &Arc<Engine>) -> [usize; 2] {
    let (mut accepted, mut wrong) = (0, 0);
    let numbers = clusters(700);
    let (centers, radii) = spheres(&numbers);
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let given = InstanceOptions { order: StoredOrder::Given, ..InstanceOptions::default() };
    let instances = engine.instances(&bounds, &given).unwrap();
    let camera = camera_along_z(SIDE as u32, SIDE as u32, CONVENTION);
    for (seed, share) in [(1, 60), (2, 300), (3, 1500)] {
        let mut random = Random(seed);
        let depths: Vec<f32> =
            (0..SIDE * SIDE).map(|_| if random.below(share) == 0 { NEAR } else { FAR }).collect();
        let image: Vec<f32> = depths.iter().map(|z| ndc(*z, CONVENTION)).collect();
        let pyramid = levels(engine, &image, &camera, true);
        for descent in [0, 64] {
            let options = CullOptions { descent, ..World::options(1) };
            let outputs = Outputs { verdicts: true, ..Outputs::NONE };
            let culling = engine.cull(&instances, &camera, &pyramid, &options, &outputs).unwrap();
            accepted += culling.counts().unwrap().accepted_instances as usize;
            for (number, verdict) in numbers.iter().zip(culling.verdicts().unwrap()) {
                let Some([column, row]) = pixel(number) else { continue };
                let is_behind = number[2] > depths[row * SIDE + column];
                wrong += usize::from(is_behind && verdict == Verdict::Unoccluded);
            }
        }
    }
    [accepted, wrong]
}

#[test]
fn rows_before_all_their_pixels_are_accepted() {
    let [accepted, wrong] = check(&engine());
    eprintln!("{accepted} accepted, {wrong} wrong");
    assert!(accepted > 30_000, "{accepted}");
    assert_eq!(wrong, 0);
}

#[test]
fn faults_of_rows_are_seen() {
    for (what, by) in [
        // The last column or row is left out.
        ("if at.x > last.x >> level {\n", "if at.x >= last.x >> level {\n"),
        ("return at.y <= last.y >> level;", "return at.y < (last.y >> level);"),
        // The first ones are left out.
        ("vec2<u32>(first.x >> level, at.y + 1u)", "vec2<u32>((first.x >> level) + 1u, at.y + 1u)"),
        (
            "at = max(at << vec2<u32>(down), least);",
            "at = max((at << vec2<u32>(down)) + vec2<u32>(0u, 1u), least);",
        ),
        // Of the row below, the texels left of the one that failed are left out.
        (
            "    if at.x > last.x >> level {\n        at = vec2<u32>(first.x >> level, at.y + 1u);",
            "    if at.x > last.x >> level {\n        at = vec2<u32>((*place).x, at.y + 1u);",
        ),
        // A texel that fails counts as passed.
        ("at = max(at << vec2<u32>(down), least);", "at = (at << vec2<u32>(down)) + 1u;"),
    ] {
        let [accepted, wrong] = check(&faulty(&[(what, by)]));
        eprintln!("{what} -> {by}: {wrong} of {accepted}");
        assert!(wrong > 0, "{what} -> {by}");
    }
}
