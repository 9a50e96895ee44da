//! The campaign against the exact oracle on wide images, and on stored levels in several chunks.
//! Wide images have columns past 512, up to the sizes of screens; there are two and three chunks.
//! Also cheap counterparts of faults that otherwise show only with twenty million instances.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;

use campaign::{Campaign, Class};
use common::{Random, camera_along_z, engine, ndc};
use hiz_core::headless::Engine;
use hiz_core::{
    Bounds, CullOptions, DepthConvention, Floats, Footprint, Hierarchy, InstanceOptions, Order,
    Outputs, StoredOrder,
};

const WIDE: &[(u32, u32)] = &[(1920, 1080), (1031, 7), (3, 2053), (641, 1025), (4099, 2)];
const MODES: &[(Footprint, u32)] = &[(Footprint::Two, 0), (Footprint::Two, 4096)];
const IN_IMAGES: &[Class] = &[
    Class::PixelBorders,
    Class::Holes,
    Class::Grazing,
    Class::Random,
    Class::Huge,
    Class::InfiniteReversed,
];

/// SwiftShader's compiler runs out of memory on a reduction over several chunks.
fn has_chunks() -> bool {
    !engine().adapter().to_string().contains("SwiftShader")
}

#[test]
fn wide_images_give_no_false_cull() {
    let campaign = Campaign {
        seed: 71,
        rounds: 2,
        volumes: 12,
        classes: IN_IMAGES,
        modes: MODES,
        sizes: WIDE,
        ..Campaign::default()
    };
    let total = campaign.run(&engine()).total();
    eprintln!("wide: {total:?}");
    assert!(total.false_culls == 0 && total.culled > total.cases / 10, "{total:?}");
}

/// Culls that read chunks past the first.
fn split(engine: &Engine, chunks: u64, rounds: usize) -> campaign::Tally {
    let campaign = Campaign {
        seed: 72,
        rounds,
        classes: IN_IMAGES,
        modes: &MODES[..1],
        chunks,
        ..Campaign::default()
    };
    campaign.run(engine).total()
}

#[test]
fn culls_of_split_pyramids_give_no_false_cull() {
    if !has_chunks() {
        return;
    }
    let whole = split(&engine(), 1, 3);
    for chunks in [2, 3] {
        let total = split(&engine(), chunks, 3);
        eprintln!("{chunks} chunks: {total:?}");
        // The rounds are the same: whatever chunk holds a level, its texels are the same.
        assert!(
            total == whole && total.false_culls == 0 && total.culled > total.cases / 10,
            "{total:?} {whole:?}"
        );
    }
    for (what, by, chunks) in [
        ("case 1u: { return chunk_1[i]; }", "case 1u: { return chunk_0[i]; }", 2),
        ("default: { return chunk_2[i]; }", "default: { return chunk_1[i]; }", 3),
        ("let i = index - (chunk << pyramid.chunk_shift);", "let i = index;", 2),
    ] {
        let faulty = Engine::with_planted_faults(None, &[(what, by)])
            .expect("the device tests need a Vulkan driver");
        let total = split(&faulty, chunks, 3);
        eprintln!("{what} -> {by}: {total:?}");
        assert!(total.false_culls > 0, "{what} -> {by}: stayed green");
    }
}

/// Culls a crowd that exceeds several sizes:
///
/// - more groups than a row of the survivors' list has (4096 of 64);
/// - more words than the scan's invocations have (256 of 32);
/// - more places than a row of records has;
/// - pieces that begin past 2^16.
///
/// Checks that exactly the instances known to be visible are kept.
fn crowd(engine: &Engine, piece: Option<u32>, hierarchy: Hierarchy, order: Order) -> bool {
    crowd_of(300_000, engine, piece, hierarchy, order)
}

fn crowd_of(
    count: usize,
    engine: &Engine,
    piece: Option<u32>,
    hierarchy: Hierarchy,
    order: Order,
) -> bool {
    let mut random = Random(6);
    // One in sixteen is in front of the wall, so that nearly every group survives.
    let kept: Vec<bool> = (0..count).map(|_| random.below(16) == 0).collect();
    let centers: Vec<f32> =
        kept.iter().flat_map(|kept| [0.0, 0.0, if *kept { 2.0 } else { 8.0 }]).collect();
    let radii = vec![0.125; count];
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let options = InstanceOptions {
        order: StoredOrder::Given,
        piece_capacity: piece,
        ..InstanceOptions::default()
    };
    let instances = engine.instances(&bounds, &options).unwrap();
    let convention = DepthConvention::Reversed;
    let camera = camera_along_z(16, 16, convention);
    let pyramid = engine
        .pyramid(&engine.upload_depth(&[ndc(4.0, convention); 256], &camera).unwrap())
        .unwrap();
    let options = CullOptions { hierarchy, order, ..CullOptions::default() };
    let culling =
        engine.cull(&instances, &camera, &pyramid, &options, &Outputs::default()).unwrap();
    let expected: Vec<u32> = (0..count as u32).filter(|i| kept[*i as usize]).collect();
    let mut indices = culling.indices().unwrap();
    indices.sort_unstable();
    let counts = culling.counts().unwrap();
    let survive = kept.chunks(64).filter(|group| group.contains(&true)).count();
    assert!(survive > 4200, "{survive}");
    culling.mask().unwrap() == kept
        && indices == expected
        && counts.visible == expected.len() as u64
        && counts.occluded == (count - expected.len()) as u64
}

#[test]
fn three_hundred_thousand_instances() {
    for (piece, hierarchy, order) in [
        (None, Hierarchy::Never, Order::Stable),
        (None, Hierarchy::Always, Order::Stable),
        (None, Hierarchy::Always, Order::Any),
        (Some(1 << 17), Hierarchy::Auto, Order::Stable),
    ] {
        assert!(crowd(&engine(), piece, hierarchy, order), "{piece:?} {hierarchy:?} {order:?}");
    }
}

/// Records of 64 MiB, which are staged in several parts (`MANY` in `instances/records.rs`).
#[test]
fn two_million_instances() {
    for hierarchy in [Hierarchy::Never, Hierarchy::Auto] {
        let kept = crowd_of(2_100_003, &engine(), None, hierarchy, Order::Stable);
        assert!(kept, "{hierarchy:?}");
    }
}

/// Faults that only many instances show.
#[test]
fn faults_of_many_instances_are_seen() {
    for (what, by) in [
        // Rows of records; rows of the survivors' list; shares of the scan; places in the mask.
        // Then groups of a workgroup.
        ("i >> RECORDS_PER_ROW_LOG2)", "(i >> RECORDS_PER_ROW_LOG2) % 256u)"),
        ("slot >> SURVIVORS_PER_ROW_LOG2)", "0u)"),
        ("(piece.words + LANES - 1u) / LANES", "piece.words / LANES"),
        ("before[w] = count;", "before[w] = sums[lane] - sum;"),
        ("workgroup.x * RUN + lane / SHARE", "workgroup.x % 512u * RUN + lane / SHARE"),
        (
            "atomicAdd(&survivors.workgroups, 1u);",
            "atomicMax(&survivors.workgroups, min(slot / RUN + 1u, 512u));",
        ),
        ("let vector = id.x * VECTORS + v;", "let vector = (id.x & 0x3fffu) * VECTORS + v;"),
    ] {
        let faulty = Engine::with_planted_faults(None, &[(what, by)])
            .expect("the device tests need a Vulkan driver");
        assert!(
            !crowd(&faulty, None, Hierarchy::Always, Order::Stable)
                || !crowd(&faulty, None, Hierarchy::Never, Order::Stable),
            "{what} -> {by}: stayed green"
        );
    }
}
