//! Stored order, groups and updates.
//! They give the same results as fresh instances in the caller's order, and boxes contain their
//! members.

mod common;

#[path = "common/exact.rs"]
mod exact;

use std::sync::Arc;

use common::{Random, camera_along_z, engine, ndc};
use exact::Exact;
use hiz_core::headless::Culling;
use hiz_core::testing::words::GroupWords;
use hiz_core::{
    Bounds, BoundsKind, CullOptions, DepthConvention, Floats, InstanceOptions, Instances, Order,
    Outputs, StoredOrder, testing::words,
};

const KINDS: [BoundsKind; 3] = [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox];
const ORDERS: [StoredOrder; 2] = [StoredOrder::Morton, StoredOrder::Given];
const CONVENTION: DepthConvention = DepthConvention::Reversed;

/// Bounds near the camera's wall, in arrays for every kind.
#[derive(Clone, Default)]
struct Crowd {
    centers: Vec<f64>,
    sizes: Vec<f64>,
    radii: Vec<f64>,
    min: Vec<f64>,
    max: Vec<f64>,
    rotations: Vec<f64>,
}

impl Crowd {
    fn new(n: usize, random: &mut Random) -> Self {
        let mut crowd = Self::default();
        for _ in 0..n {
            let center =
                [8.0 * random.unit() - 4.0, 8.0 * random.unit() - 4.0, 12.0 * random.unit() - 1.0];
            let sizes = [0.3 * random.unit(), 0.3 * random.unit(), 0.3 * random.unit()];
            crowd.push(center, sizes, std::array::from_fn(|_| 2.0 * random.unit() - 1.0));
        }
        crowd
    }

    fn push(&mut self, center: [f64; 3], sizes: [f64; 3], rotation: [f64; 9]) {
        self.centers.extend(center);
        self.sizes.extend(sizes);
        self.radii.push(sizes[0]);
        self.min.extend((0..3).map(|k| center[k] - sizes[k]));
        self.max.extend((0..3).map(|k| center[k] + sizes[k]));
        self.rotations.extend(rotation);
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
                half_sizes: Floats::F64(&self.sizes),
                rotations: Floats::F64(&self.rotations),
            },
            BoundsKind::Point | BoundsKind::WidePoint => {
                Bounds::Points { positions: Floats::F64(&self.centers) }
            }
        }
    }

    fn replace(&mut self, first: usize, other: &Self) {
        for (ours, theirs, width) in [
            (&mut self.centers, &other.centers, 3),
            (&mut self.sizes, &other.sizes, 3),
            (&mut self.radii, &other.radii, 1),
            (&mut self.min, &other.min, 3),
            (&mut self.max, &other.max, 3),
            (&mut self.rotations, &other.rotations, 9),
        ] {
            ours[width * first..width * first + theirs.len()].copy_from_slice(theirs);
        }
    }

    /// Makes bounds `i` invalid, whatever their kind.
    fn spoil(&mut self, i: usize) {
        self.centers[3 * i] = f64::NAN;
        self.max[3 * i + 1] = f64::NAN;
    }

    /// Whether bounds `i` are within the box, in exact arithmetic.
    fn is_within(&self, kind: BoundsKind, i: usize, corners: &[[f64; 3]; 2]) -> bool {
        (0..3).all(|k| {
            let at = |values: &[f64]| Exact::new(values[3 * i + k]);
            let (low, high) = match kind {
                BoundsKind::Sphere => {
                    let radius = Exact::new(self.radii[i]);
                    (at(&self.centers).minus(&radius), at(&self.centers).plus(&radius))
                }
                BoundsKind::Box => (at(&self.min), at(&self.max)),
                BoundsKind::Point | BoundsKind::WidePoint => (at(&self.centers), at(&self.centers)),
                BoundsKind::OrientedBox => {
                    let part = |axis: usize| {
                        let entry = self.rotations[9 * i + 3 * k + axis].abs();
                        Exact::new(entry).times(&Exact::new(self.sizes[3 * i + axis]))
                    };
                    let reach = part(0).plus(&part(1)).plus(&part(2));
                    (at(&self.centers).minus(&reach), at(&self.centers).plus(&reach))
                }
            };
            Exact::new(corners[0][k]).is_at_most(&low)
                && high.is_at_most(&Exact::new(corners[1][k]))
        })
    }
}

fn instances(crowd: &Crowd, kind: BoundsKind, order: StoredOrder) -> Arc<Instances> {
    let options =
        InstanceOptions { order, piece_capacity: Some(384), ..InstanceOptions::default() };
    engine().instances(&crowd.bounds(kind), &options).unwrap()
}

/// Culls against a wall that hides the left part of what is behind it.
fn cull(instances: &Arc<Instances>, order: Order) -> Culling {
    let camera = camera_along_z(64, 64, CONVENTION);
    let depth: Vec<_> =
        (0..64 * 64).map(|i| if i % 64 < 40 { ndc(4.0, CONVENTION) } else { 0.0 }).collect();
    let pyramid = engine().pyramid(&engine().upload_depth(&depth, &camera).unwrap()).unwrap();
    let options = CullOptions { order, ..CullOptions::default() };
    engine().cull(instances, &camera, &pyramid, &options, &Outputs::default()).unwrap()
}

/// The first thing that is wrong with the groups:
///
/// - a member is missing or occurs twice;
/// - a box does not contain its members;
/// - a box is larger than `slack` times the box that it has to be;
/// - a record is not the box's.
fn wrong_groups(
    groups: &[GroupWords],
    crowd: &Crowd,
    kind: BoundsKind,
    invalid: &[usize],
) -> Option<String> {
    let mut members: Vec<_> = groups.iter().flat_map(|g| g.members.clone()).collect();
    members.sort_unstable();
    if !members.iter().copied().eq(0..crowd.radii.len() as u32) {
        return Some("each instance is in one group".to_owned());
    }
    for group in groups {
        let is_valid = !group.members.iter().any(|i| invalid.contains(&(*i as usize)));
        let Some(corners) = group.corners else {
            let nan = Floats::F64(&[f64::NAN; 3]);
            let is_nan =
                group.record == words::instances(&Bounds::Boxes { min: nan, max: nan }).unwrap();
            if is_valid || !is_nan {
                return Some(format!("{group:?} is invalid"));
            }
            continue;
        };
        if !is_valid {
            return Some(format!("{group:?} has a member that is invalid"));
        }
        if let Some(i) =
            group.members.iter().find(|i| !crowd.is_within(kind, **i as usize, &corners))
        {
            return Some(format!("instance {i} is not within {group:?}"));
        }
        let (min, max) = (Floats::F64(&corners[0]), Floats::F64(&corners[1]));
        if words::instances(&Bounds::Boxes { min, max }).unwrap() != group.record {
            return Some(format!("the device has another box: {group:?}"));
        }
    }
    None
}

fn assert_same_as_fresh(instances: &Arc<Instances>, crowd: &Crowd, kind: BoundsKind, what: &str) {
    let invalid: Vec<_> =
        (0..crowd.radii.len()).filter(|i| crowd.centers[3 * i].is_nan()).collect();
    let found: Vec<_> = instances.invalid().unwrap().iter().map(|i| *i as usize).collect();
    assert_eq!(found, invalid, "{what}");
    let groups = words::groups(&engine(), instances).unwrap();
    assert_eq!(wrong_groups(&groups, crowd, kind, &invalid), None, "{what}");
    // One piece, in the caller's order.
    let options = InstanceOptions { order: StoredOrder::Given, ..InstanceOptions::default() };
    let fresh = cull(&engine().instances(&crowd.bounds(kind), &options).unwrap(), Order::Stable);
    let (verdicts, counts) = (fresh.verdicts().unwrap(), fresh.counts().unwrap());
    if crowd.radii.len() > 500 {
        assert!(
            counts.outside > 0 && counts.occluded > 0 && counts.visible > 0,
            "{what}: a scene that tells something"
        );
    }
    for order in [Order::Stable, Order::Any] {
        let culling = cull(instances, order);
        assert_eq!(culling.verdicts().unwrap(), verdicts, "{what}");
        let mut indices = culling.indices().unwrap();
        if order == Order::Any {
            indices.sort_unstable();
        }
        assert_eq!(indices, fresh.indices().unwrap(), "{what}");
        assert_eq!(culling.counts().unwrap(), counts, "{what}");
    }
    let culling = cull(instances, Order::Stable);
    for i in (0..crowd.radii.len()).step_by(97) {
        assert_eq!(
            culling.explain(i as u64).unwrap(),
            fresh.explain(i as u64).unwrap(),
            "{what}: instance {i}"
        );
    }
}

#[test]
fn sorted_instances_get_the_verdicts_of_unsorted_ones() {
    let mut random = Random(11);
    for kind in KINDS {
        for n in [0, 1, 63, 64, 65, 384, 385, 1500] {
            let mut crowd = Crowd::new(n, &mut random);
            if n > 100 {
                crowd.spoil(70);
            }
            for order in ORDERS {
                assert_same_as_fresh(
                    &instances(&crowd, kind, order),
                    &crowd,
                    kind,
                    &format!("{kind:?} {order:?} {n}"),
                );
            }
        }
    }
}

#[test]
fn updated_instances_get_the_verdicts_of_fresh_ones() {
    let mut random = Random(12);
    for kind in KINDS {
        for order in ORDERS {
            let mut crowd = Crowd::new(1000, &mut random);
            crowd.spoil(3);
            crowd.spoil(500);
            let list = instances(&crowd, kind, order);
            // Updates across borders of pieces (384) and groups.
            // They are of one instance, one twice, all, and none.
            // Some invalid bounds are repaired and some are made.
            for (first, n, spoilt) in [
                (0, 1, None),
                (999, 1, None),
                (380, 10, None),
                (500, 1, None),
                (3, 700, Some(5)),
                (5, 1, Some(0)),
                (5, 1, None),
                (64, 64, Some(63)),
                (0, 1000, None),
                (100, 300, Some(200)),
                (1000, 0, None),
                (0, 1000, Some(999)),
            ] {
                let mut moved = Crowd::new(n, &mut random);
                if let Some(i) = spoilt {
                    moved.spoil(i);
                }
                engine().update(&list, first as u32, &moved.bounds(kind), false).unwrap();
                crowd.replace(first, &moved);
                assert_same_as_fresh(
                    &list,
                    &crowd,
                    kind,
                    &format!("{kind:?} {order:?}: {n} from {first}"),
                );
            }
        }
    }
}

/// Far from the origin, where sums round, and at sizes whose products vanish.
#[test]
fn boxes_of_groups_contain_their_members_exactly() {
    let mut random = Random(13);
    let mut crowd = Crowd::default();
    for i in 0..2000 {
        // Together with the small rotations some products vanish in float64.
        let scale = 10.0_f64.powi(i / 64 - 24);
        let mut number = || (random.unit() - 0.5) * scale;
        let center = std::array::from_fn(|_| number() + 1e6 * f64::from(i % 3));
        let sizes = std::array::from_fn(|_| number().abs());
        let smallness = if i % 5 == 0 { 1e-310 } else { 1.0 };
        crowd.push(center, sizes, std::array::from_fn(|_| (random.unit() - 0.5) * smallness));
    }
    for kind in KINDS {
        for order in ORDERS {
            let list = instances(&crowd, kind, order);
            let groups = words::groups(&engine(), &list).unwrap();
            assert_eq!(wrong_groups(&groups, &crowd, kind, &[]), None, "{kind:?} {order:?}");
            // The check can fail.
            // It notices a box that is a few ulps smaller, and a sphere without its radius.
            for k in 0..3 {
                let mut small = groups.clone();
                let [min, max] = small[7].corners.as_mut().unwrap();
                max[k] -= 1e-14 * (min[k].abs() + max[k].abs());
                assert!(
                    wrong_groups(&small, &crowd, kind, &[]).unwrap().contains("is not within"),
                    "{kind:?}"
                );
            }
        }
    }
    let points = Crowd { radii: vec![0.0; 2000], ..crowd.clone() };
    let groups =
        words::groups(&engine(), &instances(&points, BoundsKind::Sphere, StoredOrder::Given))
            .unwrap();
    assert!(
        wrong_groups(&groups, &crowd, BoundsKind::Sphere, &[]).is_some(),
        "boxes of centres alone are found out"
    );
}

/// The tests above would notice if groups were not refitted.
#[test]
fn boxes_from_before_an_update_are_found_out() {
    let mut random = Random(14);
    let mut crowd = Crowd::new(1000, &mut random);
    let list = instances(&crowd, BoundsKind::Box, StoredOrder::Morton);
    let before = words::groups(&engine(), &list).unwrap();
    let moved = Crowd::new(5, &mut random);
    engine().update(&list, 400, &moved.bounds(BoundsKind::Box), false).unwrap();
    crowd.replace(400, &moved);
    assert!(wrong_groups(&before, &crowd, BoundsKind::Box, &[]).unwrap().contains("is not within"));
}

/// A group does not grow along a member's path.
/// Once all members have moved, it is as tight as a new one.
#[test]
fn boxes_forget_where_members_were() {
    let place = |x: f64| {
        let mut crowd = Crowd::default();
        crowd.push([x, 0.0, 0.0], [0.0; 3], [0.0; 9]);
        crowd
    };
    let mut crowd = Crowd::default();
    (0..64).for_each(|i| crowd.replace_or_push(i, &place(i as f64)));
    let list = instances(&crowd, BoundsKind::Box, StoredOrder::Morton);
    let corners = || words::groups(&engine(), &list).unwrap()[0].corners.unwrap().map(|c| c[0]);
    assert_eq!(corners(), [0.0, 63.0]);
    let kind = BoundsKind::Box;
    for x in [1000.0, -5000.0, 64.0] {
        engine().update(&list, 9, &place(x).bounds(kind), false).unwrap();
        assert_eq!(corners(), [x.min(0.0), x.max(63.0)], "its box is about where it is now");
    }
    for i in 0..64 {
        engine().update(&list, i, &place(10.0).bounds(kind), false).unwrap();
    }
    assert_eq!(corners(), [10.0, 10.0], "as tight as new");
    engine().update(&list, 0, &crowd.bounds(kind), false).unwrap();
    assert_eq!(corners(), [0.0, 63.0], "moved as a whole");
    engine().update(&list, 63, &place(5.0).bounds(kind), false).unwrap();
    assert_eq!(
        corners(),
        [0.0, 63.0],
        "where the others are is known as of the last move of the whole"
    );
}

impl Crowd {
    fn replace_or_push(&mut self, i: usize, one: &Self) {
        assert_eq!(i, self.radii.len());
        self.centers.extend(&one.centers);
        self.sizes.extend(&one.sizes);
        self.radii.extend(&one.radii);
        self.min.extend(&one.min);
        self.max.extend(&one.max);
        self.rotations.extend(&one.rotations);
    }
}

/// Otherwise the host's next boxes would be built for bounds that the device does not have.
#[test]
fn after_an_update_that_never_ran_touched_groups_are_never_culled_as_a_whole() {
    let is_no_volume =
        |group: &GroupWords| group.record.iter().all(|word| *word == 2.0_f32.powi(62).to_bits());
    let mut random = Random(15);
    let kind = BoundsKind::Sphere;
    for overtaken in [false, true] {
        let mut crowd = Crowd::new(1000, &mut random);
        let list = instances(&crowd, kind, StoredOrder::Given);
        let record = |first: u32, moved: &Crowd| {
            let mut encoder = engine()
                .device()
                .create_command_encoder(&hiz_core::wgpu::CommandEncoderDescriptor::default());
            engine()
                .context()
                .record_update(&mut encoder, &list, first, &moved.bounds(kind), false)
                .unwrap();
            encoder.finish()
        };
        let (one, other) = (Crowd::new(10, &mut random), Crowd::new(10, &mut random));
        let (first, second) = (record(0, &one), record(5, &other));
        engine().queue().submit([second]);
        crowd.replace(5, &other);
        if overtaken {
            engine().queue().submit([first]);
            crowd.replace(0, &one);
        }
        let third = Crowd::new(1, &mut random);
        engine().update(&list, 70, &third.bounds(kind), false).unwrap();
        crowd.replace(70, &third);
        let groups = words::groups(&engine(), &list).unwrap();
        assert!(is_no_volume(&groups[0]) && is_no_volume(&groups[1]), "touched");
        assert!(!groups[2..].iter().any(is_no_volume), "not touched");
        let fresh = instances(&crowd, kind, StoredOrder::Given);
        let verdicts = |list| cull(list, Order::Stable).verdicts().unwrap();
        assert_eq!(
            verdicts(&list),
            verdicts(&fresh),
            "records are those that ran, in the order in which they ran"
        );
    }
}

#[test]
fn a_cull_that_was_submitted_before_sees_the_old_bounds() {
    let mut random = Random(16);
    let kind = BoundsKind::OrientedBox;
    let (old, new) = (Crowd::new(1000, &mut random), Crowd::new(1000, &mut random));
    let list = instances(&old, kind, StoredOrder::Morton);
    let before = cull(&list, Order::Stable);
    engine().update(&list, 0, &new.bounds(kind), false).unwrap();
    let after = cull(&list, Order::Stable);
    let fresh = |crowd| {
        cull(&instances(crowd, kind, StoredOrder::Given), Order::Stable).verdicts().unwrap()
    };
    assert_ne!(fresh(&old), fresh(&new));
    assert_eq!(before.verdicts().unwrap(), fresh(&old));
    assert_eq!(after.verdicts().unwrap(), fresh(&new));
}

#[test]
fn updates_that_do_not_fit_are_refused_and_change_nothing() {
    let mut random = Random(17);
    let mut crowd = Crowd::new(100, &mut random);
    let list = instances(&crowd, BoundsKind::Sphere, StoredOrder::Morton);
    let mut bad = Crowd::new(10, &mut random);
    bad.spoil(4);
    bad.spoil(7);
    let refused = |first, bounds: Bounds<'_>| {
        engine().update(&list, first, &bounds, true).unwrap_err().to_string()
    };
    assert_eq!(
        refused(0, bad.bounds(BoundsKind::Box)),
        "bounds: expected the instances' kind, Sphere, got Box"
    );
    assert_eq!(
        refused(101, bad.bounds(BoundsKind::Sphere)),
        "first: expected a number in 0..=100, got 101"
    );
    assert_eq!(
        refused(95, bad.bounds(BoundsKind::Sphere)),
        "bounds: expected at most 5 from instance 95 on, got 10"
    );
    assert_eq!(
        refused(3, bad.bounds(BoundsKind::Sphere)),
        "bounds: expected finite numbers below 2^60, lengths >= 0 and min <= max, \
         got 2 bad of 10, the first at index 4"
    );
    assert_same_as_fresh(&list, &crowd, BoundsKind::Sphere, "after refusals");
    // A refusal takes no update number.
    let moved = Crowd::new(10, &mut random);
    engine().update(&list, 3, &moved.bounds(BoundsKind::Sphere), true).unwrap();
    crowd.replace(3, &moved);
    assert_same_as_fresh(&list, &crowd, BoundsKind::Sphere, "after an update");
}

/// Uploads of more than a megabyte go through buffers that earlier uploads have filled.
/// The last row of the second one is short, and what lies behind it is zero all the same.
#[test]
fn kept_staging_buffers_leave_nothing_of_earlier_uploads() {
    const ROW: usize = 1024;
    let upload = |count: usize, order| {
        let corners = [vec![1.5_f32; 3 * count], vec![2.5_f32; 3 * count]];
        let [min, max] = corners.each_ref().map(|corners| Floats::F32(corners));
        let options = InstanceOptions { order, ..InstanceOptions::default() };
        let made = engine().instances(&Bounds::Boxes { min, max }, &options).unwrap();
        engine().wait().unwrap();
        words::pieces(&engine(), &made).unwrap().swap_remove(0)
    };
    for order in ORDERS {
        let whole = upload(30 * ROW, order);
        assert_eq!((whole.padding.len(), whole.records.len()), (0, 30 * ROW * 12));
        for count in [29 * ROW + 1, 30 * ROW - 1] {
            let short = upload(count, order);
            assert!(short.records[..] == whole.records[..12 * count], "{order:?} {count}");
            assert_eq!(short.padding.len(), 12 * (30 * ROW - count));
            assert!(short.padding.iter().all(|word| *word == 0), "{order:?} {count}");
        }
    }
}
