//! A verdict is the same with groups and without, and whenever it is read.
//! It is explained by the texels that were read for it.

mod common;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::{CONVENTIONS, Random, camera_along_z, engine, ndc};
use hiz_core::headless::{Culling, Engine, Explanation};
use hiz_core::{
    AtlasUse, Bounds, BoundsKind, Camera, Coverage, CullOptions, DepthConvention, Fit, Floats,
    Footprint, Hierarchy, InstanceOptions, Instances, Outputs, Pyramid, PyramidOptions, Verdict,
    wgpu,
};

const KINDS: [BoundsKind; 3] = [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox];
const OUTSIDE: Verdict = Verdict::Outside;
const OCCLUDED: Verdict = Verdict::Occluded;
const VISIBLE: Verdict = Verdict::Visible;
const SIDE: u32 = 64;

/// Bounds behind the wall at depth 4, many of them outside the view, which is |x| and |y| up to z.
/// There are arrays of every kind; each contains the sphere about its centre.
struct Crowd {
    centers: Vec<f64>,
    radii: Vec<f64>,
    halves: Vec<f64>,
    min: Vec<f64>,
    max: Vec<f64>,
    rotations: Vec<f64>,
}

impl Crowd {
    fn new(n: usize, seed: u64) -> Self {
        let mut random = Random(seed);
        let place = |random: &mut Random| {
            [random.range(-14.0, 14.0), random.range(-14.0, 14.0), random.range(6.0, 12.0)]
        };
        let centers: Vec<f64> = (0..n).flat_map(|_| place(&mut random)).collect();
        let radii: Vec<f64> = (0..n).map(|_| random.range(0.0, 0.2)).collect();
        let halves: Vec<f64> = radii.iter().flat_map(|r| [*r; 3]).collect();
        let corner = |sign: f64| centers.iter().zip(&halves).map(|(c, h)| c + sign * h).collect();
        let (min, max) = (corner(-1.0), corner(1.0));
        let rotations =
            (0..n).flat_map(|_| [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]).collect();
        Self { centers, radii, halves, min, max, rotations }
    }

    fn bounds(&self, kind: BoundsKind) -> Bounds<'_> {
        match kind {
            BoundsKind::Sphere => Bounds::Spheres {
                centers: Floats::F64(&self.centers),
                radii: Floats::F64(&self.radii),
            },
            BoundsKind::Box => {
                Bounds::Boxes { min: Floats::F64(&self.min), max: Floats::F64(&self.max) }
            }
            BoundsKind::OrientedBox => Bounds::OrientedBoxes {
                centers: Floats::F64(&self.centers),
                half_sizes: Floats::F64(&self.halves),
                rotations: Floats::F64(&self.rotations),
            },
            BoundsKind::Point | BoundsKind::WidePoint => {
                Bounds::Points { positions: Floats::F64(&self.centers) }
            }
        }
    }

    /// The distances of two shapes from the sides of the view, x = +-z and y = +-z.
    /// Negative inside.
    /// The shapes are the sphere within bounds `i` and the box around them.
    /// Worked out by hand, as a distance times the square root of 2.
    fn beside(&self, i: usize) -> [f64; 2] {
        let [x, y, z] = [0, 1, 2].map(|k| self.centers[3 * i + k]);
        let (side, r) = (x.abs().max(y.abs()) - z, self.radii[i]);
        [side - 2.0_f64.sqrt() * r, side - 2.0 * r]
    }
}

fn upload(engine: &Engine, crowd: &Crowd, kind: BoundsKind) -> Arc<Instances> {
    // Two pieces and a part of a third.
    let options = InstanceOptions { piece_capacity: Some(1024), ..InstanceOptions::default() };
    engine.instances(&crowd.bounds(kind), &options).unwrap()
}

/// A wall at depth 4, with a hole if asked for.
fn wall(engine: &Engine, camera: &Camera, hole: bool, atlas: AtlasUse) -> Arc<Pyramid> {
    let convention = camera.convention();
    let is_hole = |i: u32| hole && (20..30).contains(&(i % SIDE)) && (40..43).contains(&(i / SIDE));
    let depth: Vec<_> =
        (0..SIDE * SIDE).map(|i| ndc(if is_hole(i) { 1e6 } else { 4.0 }, convention)).collect();
    let options = PyramidOptions { atlas, ..PyramidOptions::default() };
    engine.pyramid_with(&engine.upload_depth(&depth, camera).unwrap(), &options).unwrap()
}

fn cull(
    engine: &Engine,
    (instances, camera, pyramid): (&Arc<Instances>, &Camera, &Arc<Pyramid>),
    options: &CullOptions,
) -> Culling {
    engine.cull(instances, camera, pyramid, options, &Outputs::default()).unwrap()
}

fn counted(verdicts: &[Verdict], culling: &Culling) -> bool {
    let counts = culling.counts().unwrap();
    let told = [counts.outside, counts.occluded, counts.visible, counts.invalid];
    let of = |verdict: Verdict| verdicts.iter().filter(|v| **v == verdict).count() as u64;
    told == [OUTSIDE, OCCLUDED, VISIBLE, Verdict::Invalid].map(of)
        && counts.demand == counts.visible
        && counts.tested == verdicts.len() as u64
}

/// Verdicts and counts do not depend on the hierarchy.
/// What is outside is checked by hand.
#[test]
fn verdicts_are_the_same_with_groups_and_without() {
    let crowd = Crowd::new(2500, 5);
    let mut refined = 0;
    for kind in KINDS {
        let instances = upload(&engine(), &crowd, kind);
        for convention in CONVENTIONS {
            let camera = camera_along_z(SIDE, SIDE, convention);
            for (atlas, coverage) in
                [(AtlasUse::Never, Coverage::Area), (AtlasUse::Always, Coverage::Sample)]
            {
                let pyramid = wall(&engine(), &camera, true, atlas);
                let with = |hierarchy| {
                    let options = CullOptions { coverage, hierarchy, ..CullOptions::default() };
                    cull(&engine(), (&instances, &camera, &pyramid), &options)
                };
                let (flat, grouped) = (with(Hierarchy::Never), with(Hierarchy::Always));
                // One cull reads the counts first, the other the verdicts.
                let counts = grouped.counts().unwrap();
                assert!(
                    counts.tested_instances < counts.tested / 2,
                    "most groups are hidden: {counts:?}"
                );
                let (flat_verdicts, verdicts) =
                    (flat.verdicts().unwrap(), grouped.verdicts().unwrap());
                let what = format!("{kind:?} {convention:?} {coverage:?}");
                assert!(counted(&verdicts, &grouped) && counted(&flat_verdicts, &flat), "{what}");
                let mask = grouped.mask().unwrap();
                let kept = mask.iter().filter(|kept| **kept).count() as u64;
                assert_eq!(
                    (grouped.demand_and_written().unwrap(), kept > 0),
                    ((Some(kept), kept), true),
                    "{what}"
                );
                for (i, (flat, verdict)) in flat_verdicts.iter().zip(&verdicts).enumerate() {
                    assert!(
                        flat == verdict || (*flat, *verdict) == (VISIBLE, OCCLUDED),
                        "{what} {i}: {flat:?} {verdict:?}"
                    );
                    assert_eq!(*verdict >= VISIBLE, mask[i], "{what} {i}");
                    let [of_sphere, of_box] = crowd.beside(i);
                    if of_box > 0.01 {
                        assert_eq!(*verdict, OUTSIDE, "{what} {i}: beside the view by {of_box}");
                    } else if of_sphere < -0.01 && coverage == Coverage::Area {
                        assert_ne!(*verdict, OUTSIDE, "{what} {i}: in the view by {of_sphere}");
                    }
                }
                let told: Vec<_> =
                    (0..2500).step_by(101).map(|i| grouped.explain(i).unwrap()).collect();
                for (told, i) in told.iter().zip((0..2500).step_by(101)) {
                    assert_eq!(told.verdict, verdicts[i], "{what} {i}: {told:?}");
                    let is_of_occluded =
                        told.group.as_ref().is_some_and(|group| group.verdict == OCCLUDED);
                    refined += usize::from(is_of_occluded && told.verdict == OUTSIDE);
                }
            }
        }
    }
    assert!(refined > 20, "members outside of groups that are hidden by depth: {refined}");
}

/// An update in between does not change the results of an earlier cull.
/// That holds for every kind of update, and whatever was read before.
#[test]
fn verdicts_are_those_of_the_bounds_that_were_culled() {
    let (before, after) = (Crowd::new(2500, 7), Crowd::new(2500, 8));
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Reversed);
    let pyramid = wall(&engine(), &camera, false, AtlasUse::Never);
    let options = CullOptions { hierarchy: Hierarchy::Always, ..CullOptions::default() };
    for kind in KINDS {
        let fresh = |crowd| {
            cull(&engine(), (&upload(&engine(), crowd, kind), &camera, &pyramid), &options)
                .verdicts()
                .unwrap()
        };
        let (expected, later) = (fresh(&before), fresh(&after));
        assert_ne!(expected, later);
        let update = |instances: &Arc<Instances>, raw: bool| {
            let bounds = after.bounds(kind);
            if !raw {
                return engine().update(instances, 0, &bounds, true).unwrap();
            }
            let encoder = || {
                engine().device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
            };
            let (mut kept, mut dropped) = (encoder(), encoder());
            // The first update is submitted after a second one was recorded and dropped.
            // With the second, the refinement of a cull never runs.
            engine().context().record_update(&mut kept, instances, 0, &bounds, true).unwrap();
            drop(engine().context().record_update(&mut dropped, instances, 0, &bounds, true));
            engine().queue().submit([kept.finish()]);
        };
        for raw in [false, true] {
            let instances = upload(&engine(), &before, kind);
            let culls: Vec<_> = (0..3)
                .map(|_| cull(&engine(), (&instances, &camera, &pyramid), &options))
                .collect();
            assert_eq!(culls[0].verdicts().unwrap(), expected, "{kind:?}: read before");
            update(&instances, raw);
            let new = cull(&engine(), (&instances, &camera, &pyramid), &options);
            assert!(counted(&expected, &culls[1]), "{kind:?} {raw}: {:?}", culls[1].counts());
            for culling in &culls {
                assert_eq!(culling.verdicts().unwrap(), expected, "{kind:?} raw {raw}");
            }
            assert_eq!(
                new.verdicts().unwrap().iter().zip(&later).filter(|(a, b)| a != b).count(),
                0,
                "{kind:?} {raw}"
            );
            let told = culls[0].explain(3).unwrap();
            assert!(told.stale && told.reason.starts_with("updated since the cull"), "{told:?}");
            assert!(!new.explain(3).unwrap().stale);
        }
    }
}

/// Stale are only the updated instances, and groups that have an updated member.
#[test]
fn explanations_of_updated_instances_are_stale() {
    let crowd = Crowd::new(640, 9);
    let kind = BoundsKind::Sphere;
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Standard);
    let pyramid = wall(&engine(), &camera, false, AtlasUse::Never);
    let instances = upload(&engine(), &crowd, kind);
    let options = CullOptions { hierarchy: Hierarchy::Always, ..CullOptions::default() };
    let culling = cull(&engine(), (&instances, &camera, &pyramid), &options);
    let told: Vec<_> = (0..640).map(|i| culling.explain(i).unwrap()).collect();
    assert!(
        told.iter().all(|told| !told.stale && told.group.as_ref().is_none_or(|group| !group.stale))
    );
    let moved =
        Bounds::Spheres { centers: Floats::F64(&[0.0, 0.0, 2.0]), radii: Floats::F64(&[0.5]) };
    engine().update(&instances, 77, &moved, true).unwrap();
    let again: Vec<_> = (0..640).map(|i| culling.explain(i).unwrap()).collect();
    let stale: Vec<_> = (0..640).filter(|i| again[*i].stale).collect();
    assert_eq!((stale, again[77].verdict), (vec![77], VISIBLE));
    let groups =
        again.iter().filter(|told| told.group.as_ref().is_some_and(|group| group.stale)).count();
    assert!(groups < 64 && (groups == 63 || told[77].group.is_none()), "{groups}");
    assert!((0..640).all(|i| i == 77 || again[i].verdict == told[i].verdict));
}

/// Counts down when a thread ends, also after a panic.
struct Done<'a>(&'a AtomicUsize);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Culls, reads and updates on threads: each result belongs to one state of the instances.
#[test]
fn verdicts_on_threads() {
    let states = [Crowd::new(700, 21), Crowd::new(700, 22)];
    let kind = BoundsKind::Box;
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Reversed);
    let pyramid = wall(&engine(), &camera, false, AtlasUse::Never);
    let options = CullOptions { hierarchy: Hierarchy::Always, ..CullOptions::default() };
    let flat = CullOptions { hierarchy: Hierarchy::Never, ..CullOptions::default() };
    let expected = states.each_ref().map(|crowd| {
        cull(&engine(), (&upload(&engine(), crowd, kind), &camera, &pyramid), &flat)
            .verdicts()
            .unwrap()
    });
    let instances = upload(&engine(), &states[0], kind);
    let running = AtomicUsize::new(2);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let _done = Done(&running);
                for k in 0..40 {
                    let culling = cull(&engine(), (&instances, &camera, &pyramid), &options);
                    let later = cull(&engine(), (&instances, &camera, &pyramid), &options);
                    for culling in [&later, &culling] {
                        let is_counted = counted(&culling.verdicts().unwrap(), culling);
                        let verdicts = culling.verdicts().unwrap();
                        assert!(
                            is_counted && expected.contains(&verdicts),
                            "cull {k} mixes two states"
                        );
                    }
                }
            });
        }
        scope.spawn(|| {
            for k in (1..).take_while(|_| running.load(Ordering::Relaxed) > 0) {
                engine().update(&instances, 0, &states[k % 2].bounds(kind), true).unwrap();
                // Otherwise a slow driver's queue fills with updates.
                // Each cull would wait for all of them.
                engine().wait().unwrap();
            }
        });
    });
}

/// A cull of one instance, and how many texels it read by its own count.
fn texels_counted(
    engine: &Engine,
    camera: &Camera,
    pyramid: &Arc<Pyramid>,
    bounds: &Bounds<'_>,
    options: &CullOptions,
) -> (Culling, u64) {
    let instances = engine.instances(bounds, &InstanceOptions::default()).unwrap();
    let options = CullOptions { statistics: true, ..options.clone() };
    let culling = cull(engine, (&instances, camera, pyramid), &options);
    let counts = culling.counts().unwrap();
    (culling, counts.texels_read)
}

/// Every texel that a test reads is listed with the depth that its level has there.
/// `farthest` agrees with the verdict.
#[test]
fn explain_tells_what_was_read() {
    let mut random = Random(31);
    let mut ends = std::collections::BTreeMap::<String, usize>::new();
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        // A wall with dents of all depths.
        let depth: Vec<_> = (0..SIDE * SIDE)
            .map(|_| {
                ndc(
                    if random.below(40) == 0 { 4.0 + 60.0 * random.unit() as f32 } else { 4.0 },
                    convention,
                )
            })
            .collect();
        let pyramid = engine().pyramid(&engine().upload_depth(&depth, &camera).unwrap()).unwrap();
        let levels: Vec<_> = (0..7).map(|k| engine().read_level(&pyramid, k).unwrap()).collect();
        for (footprint, descent, fit) in [
            (Footprint::One, 0, Fit::Rectangle),
            (Footprint::One, 4096, Fit::Rectangle),
            (Footprint::One, 4096, Fit::Volume),
            (Footprint::Two, 0, Fit::Rectangle),
            (Footprint::Four, 0, Fit::Rectangle),
            (Footprint::Eight, 0, Fit::Rectangle),
            (Footprint::Two, 5, Fit::Rectangle),
            (Footprint::Two, 4096, Fit::Rectangle),
            (Footprint::Two, 9, Fit::Volume),
            (Footprint::Two, 4096, Fit::Volume),
            (Footprint::Four, 0, Fit::Volume),
        ] {
            let options = CullOptions { footprint, descent, fit, ..CullOptions::default() };
            for _ in 0..25 {
                let z = random.range(5.0, 40.0);
                let center = [random.range(-0.9, 0.9) * z, random.range(-0.9, 0.9) * z, z];
                let radius = [0.02 * z + random.range(0.0, 0.3) * z];
                let bounds =
                    Bounds::Spheres { centers: Floats::F64(&center), radii: Floats::F64(&radius) };
                let (culling, texels_read) =
                    texels_counted(&engine(), &camera, &pyramid, &bounds, &options);
                let told = culling.explain(0).unwrap();
                let what = format!(
                    "{convention:?} {footprint:?} {descent} {fit:?} {center:?} {radius:?} {told:#?}"
                );
                assert_eq!(told.verdict, culling.verdicts().unwrap()[0], "{what}");
                assert_eq!(u64::from(told.texels_read), texels_read, "{what}");
                assert_told(&told, &levels, &what);
                if fit == Fit::Rectangle {
                    assert_farthest(&told, convention, &what);
                }
                let is_descent = told.texels_read as usize > footprint_of(&told).len();
                if told.verdict == VISIBLE && is_descent && descent > 0 {
                    // If a texel decided, no budget helps; if the budget ended, a larger one does.
                    let deeper = CullOptions { descent: 65_536, ..options.clone() };
                    let (deeper, more) =
                        texels_counted(&engine(), &camera, &pyramid, &bounds, &deeper);
                    let same = deeper.verdicts().unwrap()[0] == VISIBLE && more == texels_read;
                    assert!(
                        if told.reason.contains("budget") { more > texels_read } else { same },
                        "{what} {more}"
                    );
                }
                *ends.entry(format!("{:?} {}", told.verdict, told.reason)).or_default() += 1;
            }
        }
    }
    eprintln!("{ends:#?}");
    let seen = |what: &str| ends.keys().any(|end| end.contains(what));
    for what in ["farthest depth of the texels", "all texels", "every pixel", "a pixel", "budget"] {
        assert!(seen(what), "{what} in {ends:?}");
    }
}

/// All texels of the level that the rectangle meets, row by row.
fn footprint_of(told: &Explanation) -> Vec<[u32; 2]> {
    let (Some(level), Some(rectangle)) = (told.level, told.rectangle) else { return Vec::new() };
    let [x0, y0, x1, y1] = rectangle.map(|p| p as u32 >> level);
    (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| [x, y])).collect()
}

fn assert_told(told: &Explanation, levels: &[Vec<f32>], what: &str) {
    let listed = told.texels.len();
    assert_eq!(
        [listed, told.texel_levels.len(), told.texel_depths.len()],
        [told.texels_read as usize; 3],
        "{what}"
    );
    for ((level, [x, y]), depth) in
        told.texel_levels.iter().zip(&told.texels).zip(&told.texel_depths)
    {
        let width = SIDE >> level;
        assert_eq!(levels[*level as usize][(y * width + x) as usize], *depth, "{what}");
    }
    let Some(level) = told.level else { return };
    // The footprint is listed first.
    let footprint = footprint_of(told);
    assert_eq!(told.texels[..footprint.len()], footprint, "{what}");
    assert!(told.texel_levels[..footprint.len()].iter().all(|l| *l == level), "{what}");
    if told.texels_read as usize == footprint.len() {
        let depths = told.texel_depths.iter().copied();
        let decided = told.decisive.map(|i| told.texel_depths[i]);
        assert!(
            decided.is_none()
                || decided == depths.clone().reduce(f32::min)
                || decided == depths.reduce(f32::max)
        );
    }
}

/// A depth that hides is nearer than the bounds' nearest one; a depth that does not hide is not.
fn assert_farthest(told: &Explanation, convention: DepthConvention, what: &str) {
    let (Some(farthest), Some(nearest)) = (told.farthest.map(f64::from), told.nearest) else {
        return;
    };
    let before = if convention.is_reversed() { farthest - nearest } else { nearest - farthest };
    match told.verdict {
        OCCLUDED => assert!(before > 0.0, "{what}"),
        _ => assert!(before < 1e-5, "{what}"),
    }
    assert_eq!(told.decisive.map(|i| told.texel_depths[i]), told.farthest, "{what}");
    let (farthest_z, nearest_z) = (told.farthest_z.unwrap(), told.nearest_z.unwrap());
    // By hand: NDC depth is 1 - 1/z, or 1/z.
    let z = |ndc: f64| if convention.is_reversed() { 1.0 / ndc } else { 1.0 / (1.0 - ndc) };
    assert!((farthest_z / z(farthest) - 1.0).abs() < 1e-9, "{what}");
    assert!((nearest_z / z(nearest) - 1.0).abs() < 1e-4, "{what}");
}

/// A descent reads more texels than are listed.
/// The rest is counted, and `farthest` agrees with the verdict.
#[test]
fn what_is_not_listed_is_counted() {
    let convention = DepthConvention::Reversed;
    let camera = camera_along_z(512, 512, convention);
    // One pixel in four is a dent that is too shallow for a box behind the wall to show.
    // The last pixel is deep enough.
    let mut depth: Vec<_> = (0..512 * 512)
        .map(|i| ndc(if i % 2 == 0 && i / 512 % 2 == 0 { 6.0 } else { 4.0 }, convention))
        .collect();
    let bounds =
        Bounds::Boxes { min: Floats::F64(&[-7.0, -7.0, 8.0]), max: Floats::F64(&[7.0, 7.0, 9.0]) };
    let options = CullOptions { descent: 65_536, ..CullOptions::default() };
    for (far, verdict) in [(None, OCCLUDED), (Some(511 - 40), VISIBLE)] {
        // At depth 8 the box spans pixels 32 to 479, and the far pixel is in one of its last rows.
        // The dents hide a box at depth 8.
        if let Some(row) = far {
            depth[row * 512 + 470] = ndc(50.0, convention);
        }
        let pyramid = engine().pyramid(&engine().upload_depth(&depth, &camera).unwrap()).unwrap();
        let deeper = CullOptions { fit: Fit::Rectangle, ..options.clone() };
        let (culling, texels_read) = texels_counted(&engine(), &camera, &pyramid, &bounds, &deeper);
        let told = culling.explain(0).unwrap();
        assert_eq!((told.verdict, u64::from(told.texels_read)), (verdict, texels_read));
        assert!(
            told.texels.len() <= 4096 && told.texels.len() == told.texels_read.min(4096) as usize
        );
        let farthest = if verdict == OCCLUDED { 6.0 } else { 50.0 };
        assert_eq!(told.farthest, Some(ndc(farthest, convention)), "{}", told.reason);
    }
}

/// The texels that groups read are counted.
/// For a group that is hidden as a whole, nothing else is read.
#[test]
fn the_reads_of_groups_are_counted() {
    let centers: Vec<f64> = (0..64).flat_map(|i| [0.01 * f64::from(i), 0.0, 8.0]).collect();
    let bounds = Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&[0.1; 64]) };
    let instances = engine().instances(&bounds, &InstanceOptions::default()).unwrap();
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        let pyramid = wall(&engine(), &camera, false, AtlasUse::Never);
        let options = CullOptions {
            hierarchy: Hierarchy::Always,
            statistics: true,
            ..CullOptions::default()
        };
        let culling = cull(&engine(), (&instances, &camera, &pyramid), &options);
        let counts = culling.counts().unwrap();
        assert_eq!((counts.occluded, counts.tested_groups, counts.tested_instances), (64, 1, 0));
        // From x = -0.1 to 0.73 at depth 7.9: pixels 31 to 34, and rows 31 and 32.
        // Three texels of level 1 are too many, so level 2 is read: columns 7 and 8, rows 7 and 8.
        assert_eq!(
            (counts.texels_read, counts.levels[2], counts.levels.iter().sum::<u64>()),
            (4, 1, 1)
        );
        let told = culling.explain(5).unwrap();
        assert_eq!((told.verdict, told.group.as_ref().unwrap().texels_read), (OCCLUDED, 4));
        assert!(
            told.reason.starts_with("its group of 64 is hidden as a whole (behind"),
            "{}",
            told.reason
        );
        let without = CullOptions { statistics: false, ..options };
        let counts = cull(&engine(), (&instances, &camera, &pyramid), &without).counts().unwrap();
        assert_eq!((counts.occluded, counts.texels_read), (64, 0));
    }
}

/// Compile time is not part of a cull's time.
/// The second cull of a kind compiles nothing.
#[test]
fn compiling_is_told_apart() {
    let engine = &Engine::new(None).unwrap();
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Reversed);
    let crowd = Crowd::new(640, 3);
    let instances = upload(engine, &crowd, BoundsKind::Box);
    let pyramid = wall(engine, &camera, true, AtlasUse::Never);
    for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
        let options = CullOptions { hierarchy, ..CullOptions::default() };
        let [first, second] =
            [0, 1].map(|_| cull(engine, (&instances, &camera, &pyramid), &options));
        // The work that the driver compiled with culled nothing, so the results are the same.
        assert_eq!(first.verdicts().unwrap(), second.verdicts().unwrap());
        assert_eq!(first.indices().unwrap(), second.indices().unwrap());
        let (first, second) = (first.timings(), second.timings());
        eprintln!("{hierarchy:?}: first {first:?}, second {second:?}");
        assert!(
            first.compile_ms > 0.0 && first.record_ms > 0.0 && first.wall_ms > 0.0,
            "{first:?}"
        );
        assert!(second.compile_ms == 0.0, "{second:?}");
        // The time ends when the device is seen to be done.
        // It does not matter who asks, and when the result is read.
        let third = cull(engine, (&instances, &camera, &pyramid), &options);
        engine.wait().unwrap();
        let seen = third.timings().wall_ms;
        third.mask().unwrap();
        assert!(seen > 0.0 && third.timings().wall_ms == seen, "{seen} {:?}", third.timings());
    }
}
