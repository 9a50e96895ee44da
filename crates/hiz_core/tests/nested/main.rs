//! Tiers of boxes: what they contain, what culls with them keep, and how much they test.

#[path = "../common/mod.rs"]
mod common;
mod masks;

use std::sync::Arc;

use common::{Random, camera_along_z, engine, ndc};
use hiz_core::headless::{AmongSource, CullExtras, Culling, Engine};
use hiz_core::testing::words;
use hiz_core::{
    ABSENT, Bounds, Camera, CullOptions, DepthConvention, Depths, DrawTemplate, EarlySet, Emit,
    Floats, Hierarchy, InstanceOptions, Instances, Lod, LodRule, MeshLods, Order, Outputs,
    Placement, Pyramid, PyramidOptions, StoredOrder, Verdict, wgpu,
};
use wgpu::util::DeviceExt as _;

const CONVENTION: DepthConvention = DepthConvention::Reversed;
const GROUP: usize = 64;
/// The wall's distance, which fills the image.
const WALL: f32 = 4.0;

/// What becomes of an instance, by its place alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    Front,
    Behind,
    /// Outside of the view, and behind the wall's plane.
    Outside,
    /// Outside of the view, and before the wall's plane.
    Aside,
    Invalid,
    Absent,
}

use Fate::{Absent, Aside, Behind, Front, Invalid, Outside};

impl Fate {
    fn bounds(self, random: &mut Random) -> [f32; 4] {
        let aside = |random: &mut Random| random.range(-0.5, 0.5) as f32;
        let [x, y] = [aside(random), aside(random)];
        match self {
            Front => [x, y, random.range(2.0, 3.0) as f32, 0.05],
            Behind | Absent => [x, y, random.range(6.0, 8.0) as f32, 0.05],
            Outside => [100.0 + x, y, 6.0, 0.05],
            Aside => [100.0 + x, y, 2.5, 0.05],
            Invalid => [x, f32::NAN, 6.0, 0.05],
        }
    }

    /// The verdict, with both ends of the pyramid or one.
    fn verdict(self, both: bool) -> Verdict {
        match self {
            Front if both => Verdict::Unoccluded,
            Front => Verdict::Visible,
            Behind => Verdict::Occluded,
            Outside | Aside | Absent => Verdict::Outside,
            Invalid => Verdict::Invalid,
        }
    }
}

/// Fates by blocks: of each tier some boxes have one fate, and the others are mixed.
fn fates(count: usize, random: &mut Random) -> Vec<Fate> {
    let mut fates = vec![Behind; count];
    let mixed = |random: &mut Random| random.pick(&[Front, Behind, Behind, Outside, Aside, Absent]);
    for large in fates.chunks_mut(GROUP * GROUP) {
        let one = random.pick(&[None, None, Some(Front), Some(Behind), Some(Outside)]);
        for group in large.chunks_mut(GROUP) {
            let of_group = one.or(random.pick(&[
                None,
                Some(Front),
                Some(Behind),
                Some(Behind),
                Some(Outside),
                Some(Aside),
                Some(Absent),
            ]));
            // Some of it is not there, and the rest is of one fate.
            let gaps = random.below(3) == 0;
            for fate in group.iter_mut() {
                *fate = of_group.unwrap_or_else(|| mixed(random));
                if gaps && random.below(8) == 0 {
                    *fate = Absent;
                }
            }
            if random.below(16) == 0 {
                group[0] = Invalid;
            }
        }
    }
    fates
}

/// Spheres with these fates, and what is culled against.
struct World {
    engine: Arc<Engine>,
    camera: Camera,
    pyramid: Arc<Pyramid>,
    both: bool,
    fates: Vec<Fate>,
    instances: Arc<Instances>,
}

fn spheres(numbers: &[[f32; 4]]) -> (Vec<f32>, Vec<f32>) {
    (
        numbers.iter().flat_map(|n| [n[0], n[1], n[2]]).collect(),
        numbers.iter().map(|n| n[3]).collect(),
    )
}

/// The pyramid of an image, of its farthest depths or of both ends.
fn levels(engine: &Engine, image: &[f32], camera: &Camera, both: bool) -> Arc<Pyramid> {
    let depths = if both { Depths::Both } else { Depths::Farthest };
    let options = PyramidOptions { depths, ..PyramidOptions::default() };
    engine.pyramid_with(&engine.upload_depth(image, camera).unwrap(), &options).unwrap()
}

impl World {
    fn new(
        engine: Arc<Engine>,
        fates: Vec<Fate>,
        piece: Option<u32>,
        (order, both): (StoredOrder, bool),
    ) -> Self {
        let mut random = Random(7);
        let numbers: Vec<_> = fates.iter().map(|fate| fate.bounds(&mut random)).collect();
        let (centers, radii) = spheres(&numbers);
        let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
        let ids: Vec<u32> =
            fates.iter().map(|fate| if *fate == Absent { ABSENT } else { 0 }).collect();
        let options = InstanceOptions {
            order,
            mesh_ids: fates.contains(&Absent).then_some(&ids[..]),
            piece_capacity: piece,
            ..InstanceOptions::default()
        };
        let instances = engine.instances(&bounds, &options).unwrap();
        let camera = camera_along_z(64, 64, CONVENTION);
        let pyramid = levels(&engine, &[ndc(WALL, CONVENTION); 64 * 64], &camera, both);
        Self { engine, camera, pyramid, both, fates, instances }
    }

    fn options(tiers: u32) -> CullOptions {
        CullOptions { hierarchy: Hierarchy::Tiers(tiers), ..CullOptions::default() }
    }

    fn cull(&self, options: &CullOptions) -> Culling {
        let outputs = Outputs::default();
        self.engine.cull(&self.instances, &self.camera, &self.pyramid, options, &outputs).unwrap()
    }

    fn update(&mut self, first: usize, fates: &[Fate]) {
        let mut random = Random(first as u64);
        let numbers: Vec<_> = fates.iter().map(|fate| fate.bounds(&mut random)).collect();
        let (centers, radii) = spheres(&numbers);
        let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
        self.engine.update(&self.instances, first as u32, &bounds, false).unwrap();
        self.fates[first..first + fates.len()].copy_from_slice(fates);
    }

    /// How many answers of a cull differ from the fates.
    fn wrong(&self, culling: &Culling) -> usize {
        let verdicts = culling.verdicts().unwrap();
        let of_verdicts =
            self.fates.iter().zip(&verdicts).filter(|(f, v)| f.verdict(self.both) != **v);
        let mask = culling.mask().unwrap();
        let kept = |fate: &Fate| fate.verdict(self.both).is_kept();
        let of_mask = self.fates.iter().zip(&mask).filter(|(f, kept_here)| kept(f) != **kept_here);
        let mut listed = culling.indices().unwrap();
        listed.sort_unstable();
        let expected = (0..).zip(&self.fates).filter(|(_, f)| kept(f)).map(|(i, _)| i);
        of_verdicts.count() + of_mask.count() + usize::from(!listed.into_iter().eq(expected))
    }
}

/// What a cull with so many tiers tests, worked out from the fates of a piece stored as given.
#[derive(Debug, Default, PartialEq, Eq)]
struct Spent {
    boxes: [u64; 3],
    instances: u64,
    accepted: u64,
}

impl Spent {
    fn counted(culling: &Culling) -> Self {
        let counts = culling.counts().unwrap();
        assert_eq!(counts.tested_groups, counts.tested_boxes[0]);
        Self {
            boxes: counts.tested_boxes,
            instances: counts.tested_instances,
            accepted: counts.accepted_instances,
        }
    }

    fn of(fates: &[Fate], (tiers, both): (usize, bool), piece: usize) -> Self {
        let mut spent = Self::default();
        for fates in fates.chunks(piece) {
            // A tier begins where one of its boxes is full.
            let groups = fates.len().div_ceil(GROUP);
            let there = 1 + usize::from(groups >= 64) + usize::from(groups > 64 * 63);
            match tiers.min(there) {
                0 => spent.instances += fates.len() as u64,
                tiers => spent.down(fates, tiers - 1, both),
            }
        }
        spent
    }

    fn down(&mut self, fates: &[Fate], tier: usize, both: bool) {
        for part in fates.chunks(GROUP.pow(tier as u32 + 1)) {
            self.boxes[tier] += 1;
            let all = |of: &[Fate]| part.iter().all(|fate| *fate == Absent || of.contains(fate));
            // Behind the wall or beside the view, or before the wall and within the view.
            if all(&[Behind, Outside]) || all(&[Outside, Aside]) {
                continue;
            }
            if both && all(&[Front]) {
                self.accepted += part.len() as u64;
                continue;
            }
            match tier {
                0 => self.instances += part.len() as u64,
                _ => self.down(part, tier - 1, both),
            }
        }
    }
}

fn check_sizes(engine: &Arc<Engine>, sizes: &[usize], piece: Option<u32>) -> usize {
    let mut wrong = 0;
    for (count, both) in sizes.iter().flat_map(|count| [(*count, false), (*count, true)]) {
        let fates = fates(count, &mut Random(count as u64));
        let stored = (StoredOrder::Given, both);
        let world = World::new(Arc::clone(engine), fates, piece, stored);
        for tiers in 0..=3 {
            for order in [Order::Stable, Order::Any] {
                let culling = world.cull(&CullOptions { order, ..World::options(tiers) });
                let got = Spent::counted(&culling);
                let piece = piece.map_or(usize::MAX, |piece| piece as usize);
                let expected = Spent::of(&world.fates, (tiers as usize, both), piece);
                let here = world.wrong(&culling) + usize::from(got != expected);
                if here > 0 {
                    eprintln!("{count} {both} {tiers} {order:?}: {here} {got:?} {expected:?}");
                }
                wrong += here;
            }
        }
    }
    wrong
}

/// One instance is before the wall, at the beginning or end of a box.
fn check_single(engine: &Arc<Engine>) -> usize {
    let wrong = |place: usize| {
        let mut fates = vec![Behind; 8300];
        fates[place] = Front;
        let stored = (StoredOrder::Given, false);
        let world = World::new(Arc::clone(engine), fates, None, stored);
        world.wrong(&world.cull(&World::options(2)))
    };
    [0, 63, 64, 4031, 4032, 4095, 4096, 8299].into_iter().map(wrong).sum()
}

/// The last group is short and shows as a whole; the first instances do not.
/// Its members are odd, so that flips of a wrong bit by those that it lacks do not cancel.
fn check_last(engine: &Arc<Engine>) -> usize {
    let wrong = |hidden: usize| {
        let mut fates = vec![Front; 4099];
        fates[..hidden].fill(Behind);
        let world = World::new(Arc::clone(engine), fates, None, (StoredOrder::Given, true));
        world.wrong(&world.cull(&World::options(2)))
    };
    wrong(64) + wrong(4096)
}

/// Groups of which a half is beside the view, and all is before the wall.
fn check_aside(engine: &Arc<Engine>) -> usize {
    let fates = [Front, Aside].repeat(2100);
    let world = World::new(Arc::clone(engine), fates, None, (StoredOrder::Given, true));
    world.wrong(&world.cull(&World::options(2)))
}

const SIZES: [usize; 10] = [1, 63, 64, 65, 4032, 4033, 4095, 4096, 4097, 8300];

#[test]
fn every_number_of_tiers_gives_the_same_answers() {
    assert_eq!(check_sizes(&engine(), &SIZES, None), 0);
    assert_eq!(check_sizes(&engine(), &[20_000], Some(8192)), 0);
    assert_eq!(check_single(&engine()) + check_last(&engine()) + check_aside(&engine()), 0);
}

#[test]
fn three_tiers_of_a_quarter_of_a_million() {
    for (count, both) in
        [(258_048, true), (258_049, false), (262_143, true), (262_144, false), (262_145, true)]
    {
        let fates = fates(count, &mut Random(count as u64));
        let world = World::new(engine(), fates, None, (StoredOrder::Given, both));
        for tiers in [0, 3] {
            let culling = world.cull(&World::options(tiers));
            let expected = Spent::of(&world.fates, (tiers as usize, both), usize::MAX);
            assert_eq!(Spent::counted(&culling), expected, "{count}");
            assert_eq!(world.wrong(&culling), 0, "{count}, {tiers} tiers");
        }
    }
}

fn faulty(faults: &[(&str, &str)]) -> Arc<Engine> {
    Arc::new(Engine::with_planted_faults(None, faults).expect("a Vulkan driver"))
}

#[test]
fn faults_of_tiers_are_seen() {
    for (what, by) in [
        // A box that misses a child, or the last ones.
        ("min(first + GROUP, source.below)", "min(first + GROUP - 1u, source.below)"),
        ("i < min(first + GROUP, source.below)", "i < min(first + 32u, source.below)"),
        // An invalid box below that is not seen.
        ("if hi.x != ABSENT_CENTER_BITS {", "if is_small(hi) && is_small(half) {"),
        // Children of the wrong parent, or of too few parents.
        ("(parent & ~ACCEPTED) * GROUP + lane % GROUP", "slot * GROUP + lane % GROUP"),
        ("workgroup.x * PARENTS + lane / GROUP", "workgroup.x * PARENTS"),
        // Groups of a hidden box without a verdict.
        ("group < end_group(box)", "group < first_group(box) + 1u"),
        (
            "return min((box + 1u) << (GROUP_LOG2 * TIER)",
            "return min((box + 2u) << (GROUP_LOG2 * TIER)",
        ),
        // Accepted without being inside the view, or with invalid members.
        ("is_inside = !hidden && surely_inside(x, y, z, w);", "is_inside = !hidden;"),
        (
            "return NEAREST && !SAMPLE_COVERAGE && outcome.verdict == UNOCCLUDED;",
            "return NEAREST && outcome.verdict >= INVALID;",
        ),
        // Members that are absent or beyond the piece.
        ("return ABSENT && record_texel", "return false && record_texel"),
        (
            "for (var k = 0u; k < RUN && first + k * SHARE < piece.count; k += 1u) {\n        let \
             place = first + k * SHARE;\n        let is_kept",
            "for (var k = 0u; k < RUN; k += 1u) {\n        let place = first + k * \
             SHARE;\n        let is_kept",
        ),
        // Accepted groups whose verdicts are left alone.
        ("let verdict = select(OUTSIDE, UNOCCLUDED, is_kept);", "let verdict = VISIBLE;"),
    ] {
        let engine = faulty(&[(what, by)]);
        let sizes = [20_000];
        // Counts may also come out negative, which panics.
        let wrong = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let ends = check_single(&engine) + check_last(&engine) + check_aside(&engine);
            ends + check_sizes(&engine, &sizes, None)
        }));
        let wrong = wrong.unwrap_or(1);
        eprintln!("{what} -> {by}: {wrong}");
        assert!(wrong > 0, "{what} -> {by}");
    }
}

/// Each box of an upper tier contains the spheres below it, as far as the last bit.
fn uncovered(world: &World, numbers: &[[f32; 4]]) -> usize {
    let mut uncovered = 0;
    let float = |bits: u32| f64::from(f32::from_bits(bits));
    for piece in words::pieces(&world.engine, &world.instances).unwrap() {
        for (tier, records) in piece.tiers.iter().enumerate() {
            let size = GROUP.pow(tier as u32 + 2);
            for (record, members) in records.chunks_exact(12).zip(piece.indices.chunks(size)) {
                for number in members.iter().map(|i| numbers[*i as usize]) {
                    let is_within = |k: usize| {
                        let (center, half) = (float(record[k]), float(record[8 + k]));
                        let [at, radius] = [number[k], number[3]].map(f64::from);
                        center - half <= at - radius && at + radius <= center + half
                    };
                    uncovered += usize::from(!(0..3).all(is_within));
                }
            }
        }
    }
    uncovered
}

fn buffer(engine: &Engine, numbers: &[f32]) -> wgpu::Buffer {
    engine.device().create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("test.bounds"),
        contents: bytemuck::cast_slice(numbers),
        usage: wgpu::BufferUsages::STORAGE,
    })
}

#[test]
fn upper_boxes_contain_what_they_hold() {
    let mut random = Random(3);
    for (scale, count) in [(1.0, 4500), (1e-30, 4200), (1e6, 4100), (1e15, 4097)] {
        let numbers: Vec<[f32; 4]> = (0..count)
            .map(|_| {
                let mut number = |low: f64| (scale * random.range(low, 1.0)) as f32;
                [number(-1.0) + number(0.0), number(-1.0), number(-1.0), 0.1 * number(0.0)]
            })
            .collect();
        let (centers, radii) = spheres(&numbers);
        let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
        for order in [StoredOrder::Morton, StoredOrder::Given] {
            let options = InstanceOptions { order, ..InstanceOptions::default() };
            let mut world = World::new(engine(), vec![Front], None, (order, false));
            world.instances = world.engine.instances(&bounds, &options).unwrap();
            assert_eq!(uncovered(&world, &numbers), 0, "{scale} {order:?}");
            // The same of a buffer.
            let other = [3.0, 3.0, 3.0, 1.0].repeat(count);
            let engine = &world.engine;
            engine.update_from(&world.instances, &buffer(engine, &other)).unwrap();
            assert!(uncovered(&world, &numbers) > 0);
            let flat: Vec<f32> = numbers.iter().flatten().copied().collect();
            engine.update_from(&world.instances, &buffer(engine, &flat)).unwrap();
            assert_eq!(uncovered(&world, &numbers), 0, "{scale} {order:?} from a buffer");
        }
    }
}

/// Members move out of hidden boxes and back: culls with tiers follow.
fn check_updates(engine: Arc<Engine>) -> usize {
    let mut random = Random(5);
    let mut world = World::new(engine, vec![Behind; 8300], None, (StoredOrder::Morton, true));
    let mut wrong = 0;
    for step in 0..12 {
        let (first, count) = match step % 3 {
            0 => (random.below(8300) as usize, 1),
            1 => (random.below(8000) as usize, 300),
            _ => (0, 8300),
        };
        let fate = random.pick(&[Front, Behind, Outside, Invalid]);
        world.update(first, &vec![fate; count]);
        for tiers in [0, 2] {
            wrong += world.wrong(&world.cull(&World::options(tiers)));
        }
        if step % 3 == 2 {
            world.update(0, &vec![Behind; 8300]);
            let culling = world.cull(&World::options(2));
            wrong += world.wrong(&culling);
            // As tight as new ones.
            assert_eq!(culling.counts().unwrap().tested_boxes, [0, 3, 0]);
        }
    }
    wrong
}

#[test]
fn updates_reach_every_tier() {
    assert_eq!(check_updates(engine()), 0);
}

#[test]
fn boxes_of_the_frame_before_are_seen() {
    for (what, by) in [
        ("if SOME { here = chosen[id.x]; }", "if SOME { return; }"),
        ("if SOME { here = chosen[id.x]; }", ""),
    ] {
        let wrong = std::panic::catch_unwind(|| check_updates(faulty(&[(what, by)])));
        assert!(wrong.is_err() || wrong.is_ok_and(|wrong| wrong > 0), "{by}");
    }
}

/// A cull of some instances alone asks for the same ones, whatever the tiers.
#[test]
fn among_some() {
    let fates = fates(9000, &mut Random(2));
    let world = World::new(engine(), fates, None, (StoredOrder::Morton, true));
    let mut random = Random(9);
    for share in [2, 50, 3000] {
        let asked: Vec<bool> = (0..9000).map(|_| random.below(share) == 0).collect();
        let among = world.engine.among(&world.instances, &AmongSource::Mask(&asked)).unwrap();
        for tiers in 0..=2 {
            let extras = CullExtras { among: Some(&among), ..CullExtras::default() };
            let (options, outputs) = (World::options(tiers), Outputs::default());
            let World { engine, instances, camera, pyramid, .. } = &world;
            let culling =
                engine.cull_given(instances, camera, pyramid, &options, &outputs, &extras).unwrap();
            for (i, got) in culling.verdicts().unwrap().into_iter().enumerate() {
                let expected =
                    if asked[i] { world.fates[i].verdict(world.both) } else { Verdict::Outside };
                assert_eq!(got, expected, "{share} {tiers} {i}");
            }
        }
    }
}

/// The words of a buffer, after everything that was submitted.
fn read(engine: &Engine, buffer: &wgpu::Buffer) -> Vec<u32> {
    let (told, answer) = std::sync::mpsc::channel();
    let (device, queue) = (engine.device(), engine.queue());
    wgpu::util::DownloadBuffer::read_buffer(device, queue, &buffer.slice(..), move |bytes| {
        told.send(bytemuck::pod_collect_to_vec(&bytes.expect("mapped"))).expect("waited for");
    });
    engine.wait().unwrap();
    answer.recv().unwrap()
}

/// Frames of two passes, in which the wall comes and goes: with tiers they draw what flat ones draw.
#[test]
fn two_passes_draw_the_same() {
    let fates = fates(8300, &mut Random(4));
    let world = World::new(engine(), fates, None, (StoredOrder::Morton, true));
    let World { engine, camera, pyramid, instances, .. } = &world;
    let open = levels(engine, &[0.0; 64 * 64], camera, true);
    let words = instances.len().div_ceil(32) as usize;
    let outputs = Outputs { mask: true, ..Outputs::NONE };
    let run = |tiers: u32| {
        let context = engine.context();
        let temporal = context.create_temporal(instances, &outputs).unwrap();
        let options = World::options(tiers);
        let noise = vec![0xFF_u8; temporal.history(0).size() as usize - 16];
        engine.queue().write_buffer(temporal.history(0), 16, &noise);
        let frame = |k: usize| {
            let mut encoder = engine.device().create_command_encoder(&Default::default());
            let set = EarlySet::LastVisible;
            context
                .record_early(&mut encoder, instances, camera, &temporal, set, &options)
                .unwrap();
            let pyramid = if [2, 5].contains(&k) { &open } else { pyramid };
            context
                .record_late(&mut encoder, instances, camera, pyramid, &temporal, &options)
                .unwrap();
            engine.queue().submit([encoder.finish()]);
            [temporal.early(), temporal.late()]
                .map(|pass| read(engine, pass.mask(0).unwrap())[..words].to_vec())
        };
        (0..8).map(frame).collect::<Vec<_>>()
    };
    let flat = run(0);
    let ones = |words: &[u32]| words.iter().map(|word| word.count_ones()).sum::<u32>();
    let drawn: Vec<_> = flat.iter().map(|passes| passes.each_ref().map(|w| ones(w))).collect();
    eprintln!("early and late: {drawn:?}");
    assert!(drawn[3][0] > 2 * drawn[1][0] && drawn[2][1] > 1000, "{drawn:?}");
    for tiers in 1..=2 {
        assert!(run(tiers) == flat, "{tiers} tiers");
    }
}

/// Bins by mesh and level of detail hold the same, whatever the tiers.
#[test]
fn bins_hold_the_same() {
    let fates = fates(9000, &mut Random(6));
    let world = World::new(engine(), fates, None, (StoredOrder::Morton, true));
    let draw = DrawTemplate { index_count: 3, ..DrawTemplate::default() };
    let lods: Vec<Lod> = (0..4).map(|l| Lod::new(draw, f64::from(l))).collect();
    let meshes =
        world.engine.context().create_mesh_table(&[MeshLods::new(&lods)]).expect("a table");
    let lod = LodRule::Distance { thresholds: vec![2.2, 2.5, 2.8] };
    for placement in [Placement::Packed, Placement::Reserved] {
        let emit = Emit::Binned { meshes: meshes.clone(), placement };
        let outputs = Outputs { mask: true, indices: true, emit, ..Outputs::NONE };
        let run = |tiers: u32| {
            let options = CullOptions { lod: lod.clone(), ..World::options(tiers) };
            let World { engine, instances, camera, pyramid, .. } = &world;
            let culling = engine.cull(instances, camera, pyramid, &options, &outputs).unwrap();
            (culling.mask().unwrap(), culling.lods().unwrap(), culling.draws().unwrap())
        };
        let flat = run(0);
        assert!((1..4).all(|lod| flat.1.contains(&lod)), "all levels of detail occur");
        for tiers in 1..=2 {
            assert!(run(tiers) == flat, "{tiers} tiers, {placement:?}");
        }
    }
}

/// The explanation of a member of a hidden box names the box that decided.
#[test]
fn explanations_name_the_box() {
    let world = World::new(engine(), vec![Behind; 4200], None, (StoredOrder::Given, true));
    let culling = world.cull(&World::options(2));
    let told = culling.explain(4199).unwrap();
    assert_eq!(told.verdict, Verdict::Occluded);
    assert!(told.reason.contains("its group of 64 is hidden as a whole"), "{}", told.reason);
    assert_eq!(told.group.unwrap().verdict, Verdict::Occluded);

    let world = World::new(engine(), vec![Front; 4200], None, (StoredOrder::Given, true));
    let told = world.cull(&World::options(2)).explain(4199).unwrap();
    assert_eq!(told.verdict, Verdict::Unoccluded);
    assert!(told.reason.contains("its group of 64 shows as a whole"), "{}", told.reason);
}

/// A crowd before a rough image: the oracle agrees with what is culled and with what is accepted.
#[test]
fn the_oracle_agrees() {
    let (engine, mut random, count) = (engine(), Random(11), 6000);
    let image: Vec<f32> = (0..64 * 64)
        .map(|i| ndc([4.0, 4.0, 6.0, 2.5][(i % 64 / 16 + i / 1024) % 4], CONVENTION))
        .collect();
    let numbers: Vec<[f32; 4]> = (0..count)
        .map(|i| {
            // Clusters of a group each.
            let mut cluster = Random(i / 64);
            let z = cluster.range(1.2, 9.0);
            let [x, y] = [0, 1].map(|_| cluster.range(-1.1, 1.1) * z);
            let mut near = |v: f64| (v + random.range(-0.1, 0.1)) as f32;
            [near(x), near(y), near(z), random.range(0.0, 0.05) as f32]
        })
        .collect();
    let (centers, radii) = spheres(&numbers);
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let given = InstanceOptions { order: StoredOrder::Given, ..InstanceOptions::default() };
    let instances = engine.instances(&bounds, &given).unwrap();
    let camera = camera_along_z(64, 64, CONVENTION);
    let pyramid = levels(&engine, &image, &camera, true);
    let row = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k)));
    let view = hiz_ref::View {
        rows: [row(0), row(1), row(3), row(2)],
        origin: [0.0; 3],
        width: 64,
        height: 64,
        reversed: true,
    };
    let cull = |options: &CullOptions| {
        engine.cull(&instances, &camera, &pyramid, options, &Outputs::default()).unwrap()
    };
    let flat = cull(&World::options(0)).mask().unwrap();
    for tiers in 1..=2 {
        let culling = cull(&World::options(tiers));
        let (counts, mask) = (culling.counts().unwrap(), culling.mask().unwrap());
        assert!(counts.accepted_instances > 200 && counts.occluded > 200, "{counts:?}");
        let verdicts = culling.verdicts().unwrap();
        for (i, number) in numbers.iter().enumerate() {
            let [x, y, z, radius] = number.map(f64::from);
            let volume = hiz_ref::Volume::Sphere { center: [x, y, z], radius };
            assert!(!mask[i] || flat[i], "{tiers} tiers keep {i}, which its own test culls");
            let is_right = match verdicts[i] {
                Verdict::Unoccluded => {
                    let coverage = hiz_ref::Coverage::Area;
                    hiz_ref::is_unoccluded(&view, &volume, &image, coverage).unwrap()
                }
                Verdict::Outside | Verdict::Occluded => {
                    hiz_ref::classify(&view, &volume, &image).unwrap() == hiz_ref::Verdict::Hidden
                }
                _ => true,
            };
            assert!(is_right, "{tiers} tiers: {i} is {:?}", verdicts[i]);
            assert_eq!(mask[i], verdicts[i].is_kept());
        }
    }
}
