//! Bins by mesh and level of detail: lists, draw arguments and their number.
//! Expectations come from loops over what each instance was made to be.

mod common;

use std::sync::Arc;

use common::{Random, camera_along_z, ndc};
use hiz_core::headless::{Engine, NO_LOD};
use hiz_core::{
    ABSENT, Bounds, Camera, CullOptions, DepthConvention, DrawTemplate, Emit, Error, Floats,
    Hierarchy, HizContext, InstanceOptions, Instances, Lod, LodRule, MeshLods, MeshTable, Order,
    Outputs, Placement, Pyramid, PyramidOptions, Verdict, VertexDraw, Visible, WarmUp, WarmUpMore,
    testing::CANARY_WORDS, wgpu,
};

const CONVENTION: DepthConvention = DepthConvention::Reversed;

/// The instances choose their own LOD: the whole part of their scale, at most the last one.
const LOD_OF_SCALE: (&str, &str) = (
    "scale: f32, count: u32) -> u32 {\n    return 0u;",
    "scale: f32, count: u32) -> u32 {\n    return min(u32(scale), count - 1u);",
);

/// A device, a camera and the pyramid of a wall at depth 4.
struct World {
    engine: Engine,
    camera: Camera,
    pyramid: Arc<Pyramid>,
}

impl World {
    fn new(faults: &[(&str, &str)]) -> Self {
        let faults = [&[LOD_OF_SCALE], faults].concat();
        let engine = Engine::with_planted_faults(None, &faults).expect("a Vulkan driver");
        let adapter = engine.adapter().to_string();
        eprintln!("adapter: {adapter}");
        if let Ok(expected) = std::env::var("HIZVK_EXPECT_ADAPTER") {
            assert!(adapter.to_lowercase().contains(&expected.to_lowercase()), "{adapter}");
        }
        let camera = camera_along_z(64, 64, CONVENTION);
        let wall = engine.upload_depth(&[ndc(4.0, CONVENTION); 64 * 64], &camera).unwrap();
        let pyramid = engine.pyramid(&wall).unwrap();
        Self { engine, camera, pyramid }
    }

    fn table(&self, lods: &[usize], indexed: bool) -> MeshTable {
        let draw = |m: usize, l: usize| {
            let (count, first) = ((100 * m + l + 1) as u32, (7 * m + l) as u32);
            let error = (l * (m + 1)) as f64;
            if indexed {
                let base_vertex = -(m as i32) - 1;
                let draw = DrawTemplate {
                    index_count: count,
                    first_index: first,
                    base_vertex,
                    ..Default::default()
                };
                Lod::new(draw, error)
            } else {
                Lod::new(VertexDraw { vertex_count: count, first_vertex: first }, error)
            }
        };
        let all: Vec<Vec<Lod>> =
            lods.iter().enumerate().map(|(m, n)| (0..*n).map(|l| draw(m, l)).collect()).collect();
        let meshes: Vec<_> = all.iter().map(|lods| MeshLods::new(lods)).collect();
        self.engine.context().create_mesh_table(&meshes).unwrap()
    }

    fn words(&self, buffer: &wgpu::Buffer) -> Vec<u32> {
        let (device, queue) = (self.engine.device(), self.engine.queue());
        let staging = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("test.staging"),
            size: buffer.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let view = staging.get_mapped_range(..).unwrap();
        view.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect()
    }

    fn cull(&self, crowd: &Crowd, visible: &Visible, options: &CullOptions) -> Result<(), Error> {
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = self.engine.device().create_command_encoder(&descriptor);
        let (hiz, instances) = (self.engine.context(), &crowd.instances);
        hiz.record_cull(&mut encoder, instances, &self.camera, &self.pyramid, visible, options)?;
        self.engine.queue().submit([encoder.finish()]);
        Ok(())
    }
}

/// What an instance is made to be.
#[derive(Debug, Clone, Copy)]
struct Made {
    mesh: u32,
    lod: u32,
    /// Before the wall; behind it otherwise.
    shows: bool,
}

impl Made {
    fn is_kept(&self) -> bool {
        self.shows && self.mesh != ABSENT
    }
}

struct Crowd {
    made: Vec<Made>,
    instances: Arc<Instances>,
    piece: usize,
}

impl Crowd {
    /// Without `with_ids`, all must have mesh 0 and LOD 0.
    fn new(world: &World, made: Vec<Made>, piece: Option<u32>, with_ids: bool) -> Self {
        let centers: Vec<f32> =
            made.iter().flat_map(|m| [0.0, 0.0, if m.shows { 2.0 } else { 8.0 }]).collect();
        let radii = vec![0.125_f32; made.len()];
        let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
        let ids: Vec<u32> = made.iter().map(|m| m.mesh).collect();
        let scales: Vec<f32> = made.iter().map(|m| m.lod as f32 + 0.5).collect();
        let options = InstanceOptions {
            piece_capacity: piece,
            mesh_ids: with_ids.then_some(&ids),
            scales: with_ids.then_some(Floats::F32(&scales)),
            ..InstanceOptions::default()
        };
        let instances = world.engine.instances(&bounds, &options).unwrap();
        let piece = piece.map_or(made.len().max(1), |piece| piece as usize);
        Self { made, instances, piece }
    }

    fn random(n: usize, lods: &[usize], share: f64, absent: f64, random: &mut Random) -> Vec<Made> {
        let make = |_| {
            let mesh = (random.unit() * lods.len() as f64) as usize;
            let lod = (random.unit() * lods[mesh] as f64) as u32;
            let mesh = if random.unit() < absent { ABSENT } else { mesh as u32 };
            Made { mesh, lod, shows: random.unit() < share }
        };
        (0..n).map(make).collect()
    }

    /// The indices of each piece.
    fn pieces(&self) -> Vec<std::ops::Range<usize>> {
        let n = self.made.len();
        (0..n.max(1)).step_by(self.piece).map(|first| first..n.min(first + self.piece)).collect()
    }

    /// What a piece keeps of one bin, ascending.
    fn bin(&self, piece: &std::ops::Range<usize>, mesh: u32, lod: u32) -> Vec<u32> {
        let is_in = |i: &usize| {
            let made = self.made[*i];
            made.is_kept() && made.mesh == mesh && made.lod == lod
        };
        piece.clone().filter(is_in).map(|i| i as u32).collect()
    }
}

/// A list of 0xFFFFFFFF into which bins are written, and the bins.
struct Expected {
    list: Vec<u32>,
    draws: Vec<u32>,
    count: u32,
    written: usize,
}

/// The words of a draw record of `World::table`.
fn record(indexed: bool, (mesh, lod): (u32, u32), count: usize, first_instance: usize) -> Vec<u32> {
    let (total, first) = (100 * mesh + lod + 1, 7 * mesh + lod);
    let (count, first_instance) = (count as u32, first_instance as u32);
    if indexed {
        vec![total, count, first, (-(mesh as i32) - 1).cast_unsigned(), first_instance]
    } else {
        vec![total, count, first, first_instance]
    }
}

/// What `crowd` should leave of one piece, with room for `room` more indices.
fn expected(
    crowd: &Crowd,
    piece: &std::ops::Range<usize>,
    lods: &[usize],
    (emit, indexed): (&Emit, bool),
    (capacity, room): (usize, usize),
) -> Expected {
    let most = lods.iter().copied().max().unwrap();
    let words = if indexed { 5 } else { 4 };
    let size = match emit {
        Emit::Binned { placement: Placement::Reserved, .. } => most * piece.len(),
        _ => piece.len().min(capacity),
    };
    let mut list = vec![u32::MAX; size + CANARY_WORDS as usize];
    if let Emit::Instances { .. } = emit {
        let largest = crowd.pieces().iter().map(std::iter::ExactSizeIterator::len).max().unwrap();
        let kept = piece.clone().filter(|i| crowd.made[*i].is_kept());
        let kept: Vec<_> = kept.take(room).collect();
        let mut draws = Vec::new();
        for (k, i) in kept.iter().enumerate() {
            list[k] = *i as u32;
            draws.extend(record(indexed, (crowd.made[*i].mesh, crowd.made[*i].lod), 1, k));
        }
        draws.resize(largest.min(capacity).max(1) * words, 0);
        return Expected { list, draws, count: kept.len() as u32, written: kept.len() };
    }
    // Where each bin lies, and what of it is written: LOD 0 of all meshes first.
    let mut written = 0;
    let mut bins = std::collections::BTreeMap::new();
    for lod in 0..most as u32 {
        let mut slot = 0;
        for mesh in 0..lods.len() as u32 {
            let all = crowd.bin(piece, mesh, lod);
            let part = &all[..all.len().min(room - written)];
            let is_of_mesh = |i: &usize| crowd.made[*i].mesh == mesh;
            let members = piece.clone().filter(is_of_mesh).count();
            let begin = match emit {
                Emit::Binned { placement: Placement::Reserved, .. } => {
                    lod as usize * piece.len() + slot
                }
                _ => written,
            };
            list[begin..begin + part.len()].copy_from_slice(part);
            bins.insert((mesh, lod), (begin, part.len()));
            written += part.len();
            slot += members;
        }
    }
    let mut draws = Vec::new();
    let mut count = 0;
    for mesh in 0..lods.len() as u32 {
        for lod in 0..most as u32 {
            let (begin, len) = bins[&(mesh, lod)];
            match emit {
                Emit::Binned { placement: Placement::Reserved, .. } => {
                    let exists = (lod as usize) < lods[mesh as usize];
                    let record = record(indexed, (mesh, lod), len, 0);
                    draws.extend(if exists { record } else { vec![0; words] });
                }
                _ if len > 0 => {
                    draws.extend(record(indexed, (mesh, lod), len, begin));
                    count += 1;
                }
                _ => {}
            }
        }
    }
    draws.resize(lods.len() * most * words, 0);
    Expected { list, draws, count, written }
}

/// Culls `crowd`, and compares everything that the cull leaves with `expected`.
fn check(
    world: &World,
    crowd: &Crowd,
    lods: &[usize],
    emit: &Emit,
    capacity: Option<u32>,
    indexed: bool,
) -> Result<(), String> {
    let outputs = Outputs {
        mask: true,
        indices: true,
        draws: true,
        capacity,
        emit: emit.clone(),
        ..Outputs::NONE
    };
    let visible = world.engine.context().create_visible(&crowd.instances, &outputs).unwrap();
    let draws = visible.draw_arguments().unwrap();
    // The second cull finds what the first one left.
    for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
        let garbage = vec![0xFF_u8; draws.size() as usize];
        world.engine.queue().write_buffer(draws, 0, &garbage);
        let options = CullOptions { hierarchy, ..CullOptions::default() };
        world.cull(crowd, &visible, &options).unwrap();
        let limit = capacity.map_or(crowd.made.len(), |c| c as usize);
        let mut room = limit;
        let (all_draws, counts) =
            (world.words(draws), visible.draw_count().map(|b| world.words(b)));
        for (p, piece) in crowd.pieces().iter().enumerate() {
            let want = expected(crowd, piece, lods, (emit, indexed), (limit, room));
            room -= want.written;
            let what = format!(
                "{n} instances, {m} meshes, piece {p}, capacity {capacity:?}, {hierarchy:?}",
                n = crowd.made.len(),
                m = lods.len(),
            );
            let list = world.words(visible.list(p).unwrap());
            if list != want.list {
                let at = list.iter().zip(&want.list).position(|(a, b)| a != b);
                return Err(format!("{what}: the lists differ at {at:?}"));
            }
            let at = visible.draw_offset(p) as usize / 4;
            let got = &all_draws[at..at + want.draws.len()];
            if got != want.draws {
                let at = got.iter().zip(&want.draws).position(|(a, b)| a != b);
                return Err(format!("{what}: the draws differ at word {at:?}"));
            }
            assert_eq!(
                visible.max_draws() as usize * if indexed { 5 } else { 4 },
                want.draws.len()
            );
            if let Some(counts) = &counts {
                let at = visible.draw_count_offset(p) as usize / 4;
                if counts[at] != want.count {
                    return Err(format!("{what}: {} draws, not {}", counts[at], want.count));
                }
            }
            let mask = world.words(visible.mask(p).unwrap());
            for (k, i) in piece.clone().enumerate() {
                if (mask[k / 32] >> (k % 32) & 1 == 1) != crowd.made[i].is_kept() {
                    return Err(format!("{what}: the mask of {i}"));
                }
            }
        }
    }
    Ok(())
}

fn emits(meshes: &MeshTable) -> [Emit; 3] {
    let binned = |placement| Emit::Binned { meshes: meshes.clone(), placement };
    [
        binned(Placement::Packed),
        binned(Placement::Reserved),
        Emit::Instances { meshes: meshes.clone() },
    ]
}

/// Levels of detail per mesh, instances, the share before the wall, the share absent, and how many
/// instances a piece has.
type Case<'a> = (&'a [usize], usize, f64, f64, Option<u32>);

/// The sizes at which the passes change: words, blocks, pieces, capacities.
#[test]
fn bins_hold_what_a_loop_finds() {
    let world = World::new(&[]);
    let mut random = Random(1);
    let cases: [Case<'_>; 12] = [
        (&[1], 1, 1.0, 0.0, None),
        (&[1], 1000, 0.3, 0.1, None),
        (&[4], 5000, 0.5, 0.1, None),
        (&[1; 40], 33, 1.0, 0.0, None),
        (&[2, 1, 8, 3], 3000, 0.5, 0.3, Some(1024)),
        (&[1, 4, 2], 3000, 0.5, 0.0, Some(384)),
        (&[3; 7], 2000, 0.4, 1.0, None),
        (&[3; 7], 2000, 0.0, 0.0, None),
        // A mesh per instance, and a word beside a block of 1024 words.
        (&[1; 2000], 2000, 0.6, 0.1, None),
        (&[2, 2], 32 * 1024 - 1, 0.3, 0.05, None),
        (&[2, 2], 32 * 1024, 1.0, 0.0, None),
        (&[2, 2], 32 * 1024 + 1, 0.3, 0.05, None),
    ];
    for (lods, n, share, absent, piece) in cases {
        let crowd =
            Crowd::new(&world, Crowd::random(n, lods, share, absent, &mut random), piece, true);
        let kept = crowd.made.iter().filter(|m| m.is_kept()).count() as u32;
        for indexed in [true, false] {
            let meshes = world.table(lods, indexed);
            for emit in emits(&meshes) {
                for capacity in [None, Some(0), Some(1), Some(kept / 2), Some(kept + 1)] {
                    check(&world, &crowd, lods, &emit, capacity, indexed).unwrap();
                }
            }
        }
    }
}

/// Meshes that no instance has lie before, between and behind those that are used.
#[test]
fn empty_meshes_have_no_draws() {
    let world = World::new(&[]);
    let lods = [2; 9];
    let made = |i: u32| Made { mesh: [2, 5][(i % 2) as usize], lod: i / 2 % 2, shows: true };
    let crowd = Crowd::new(&world, (0..101).map(made).collect(), None, true);
    let meshes = world.table(&lods, true);
    for emit in emits(&meshes) {
        check(&world, &crowd, &lods, &emit, None, true).unwrap();
    }
}

/// More meshes than the invocations of a workgroup of the draws have workgroups to add up.
#[test]
fn draws_of_many_meshes_stand_together() {
    let world = World::new(&[]);
    let lods = vec![1; 33_000];
    let mesh = |i: u32| [0, 511, 512, 600, 32_767, 32_768, 32_999][i as usize % 7];
    let made = |i| Made { mesh: mesh(i), lod: 0, shows: i % 3 > 0 };
    let crowd = Crowd::new(&world, (0..40).map(made).collect(), None, true);
    let emit = emits(&world.table(&lods, true))[0].clone();
    check(&world, &crowd, &lods, &emit, None, true).unwrap();
}

/// Without mesh ids and scales all have mesh 0, and their slots are their indices.
#[test]
fn instances_without_ids_have_mesh_0() {
    let world = World::new(&[]);
    let mut random = Random(2);
    // The scale is 1, so the LOD is 1 where there are two.
    for (lods, lod) in [(&[1][..], 0), (&[2, 1][..], 1)] {
        let make = |_| Made { mesh: 0, lod, shows: random.unit() < 0.4 };
        let crowd = Crowd::new(&world, (0..3000).map(make).collect(), Some(1024), false);
        let meshes = world.table(lods, true);
        for emit in emits(&meshes) {
            for capacity in [None, Some(700)] {
                check(&world, &crowd, lods, &emit, capacity, true).unwrap();
            }
        }
    }
}

/// Bins of one mesh in any order: the same sets, each within its reserved words.
#[test]
fn any_order_fills_the_bins_of_one_mesh() {
    let world = World::new(&[]);
    let mut random = Random(3);
    let lods = [4];
    for piece in [None, Some(1024)] {
        let made = Crowd::random(3000, &lods, 0.5, 0.1, &mut random);
        let crowd = Crowd::new(&world, made, piece, true);
        let meshes = world.table(&lods, true);
        let emit = Emit::Binned { meshes, placement: Placement::Reserved };
        for capacity in [None, Some(0), Some(1), Some(700), Some(3000)] {
            let outputs = Outputs {
                mask: true,
                indices: true,
                capacity,
                emit: emit.clone(),
                ..Outputs::NONE
            };
            let visible =
                world.engine.context().create_visible(&crowd.instances, &outputs).unwrap();
            let options = CullOptions { order: Order::Any, ..CullOptions::default() };
            for _ in 0..2 {
                world.cull(&crowd, &visible, &options).unwrap();
                let draws = world.words(visible.draw_arguments().unwrap());
                let mut total = 0;
                for (p, piece) in crowd.pieces().iter().enumerate() {
                    let list = world.words(visible.list(p).unwrap());
                    for lod in 0..4 {
                        let (offset, bytes) = visible.bin(p, 0, lod).unwrap();
                        let record = &draws[offset as usize / 4..][..5];
                        let count = record[1] as usize;
                        assert_eq!(record, first_record(lod, count));
                        let words = &list[bytes.start as usize / 4..bytes.end as usize / 4];
                        let mut got = words[..count].to_vec();
                        got.sort_unstable();
                        let want = crowd.bin(piece, 0, lod);
                        if capacity.is_none_or(|c| c >= 3000) {
                            assert_eq!(got, want, "piece {p}, LOD {lod}");
                        }
                        assert!(got.iter().all(|i| want.contains(i)), "piece {p}, LOD {lod}");
                        got.dedup();
                        assert_eq!(got.len(), count, "piece {p}, LOD {lod}: listed twice");
                        total += count;
                    }
                    assert!(list[4 * piece.len()..].iter().all(|word| *word == u32::MAX));
                }
                let kept = crowd.made.iter().filter(|m| m.is_kept()).count();
                assert_eq!(total, kept.min(capacity.unwrap_or(3000) as usize), "{capacity:?}");
            }
        }
    }
}

/// The record of the first mesh.
fn first_record(lod: u32, count: usize) -> Vec<u32> {
    record(true, (0, lod), count, 0)
}

/// What can be read of an engine's cull: draws, their number, bins and LODs.
#[test]
fn an_engines_cull_tells_its_bins() {
    let world = World::new(&[]);
    let mut random = Random(5);
    let lods = [2, 1, 3];
    let made = Crowd::random(2500, &lods, 0.5, 0.2, &mut random);
    let crowd = Crowd::new(&world, made, Some(1024), true);
    let kept = crowd.made.iter().filter(|m| m.is_kept()).count() as u64;
    let absent = crowd.made.iter().filter(|m| m.mesh == ABSENT).count() as u64;
    let indices: Vec<u32> = (0..2500).filter(|i: &u32| crowd.made[*i as usize].is_kept()).collect();
    for emit in emits(&world.table(&lods, true)) {
        let outputs = Outputs { emit: emit.clone(), ..Outputs::ALL };
        let options = CullOptions::default();
        let World { engine, camera, pyramid, .. } = &world;
        let culling = engine.cull(&crowd.instances, camera, pyramid, &options, &outputs).unwrap();
        let by_index = culling.lods().unwrap();
        for (made, lod) in crowd.made.iter().zip(&by_index) {
            assert_eq!(*lod, if made.is_kept() { made.lod as u8 } else { NO_LOD });
        }
        let draws = culling.draws().unwrap();
        assert_eq!(draws.len(), 3 * culling.visible().max_draws() as usize);
        assert_eq!(draws.iter().map(|d| u64::from(d.instance_count)).sum::<u64>(), kept);
        let counts = culling.draw_counts().unwrap();
        let used = draws.iter().filter(|d| d.instance_count > 0).count() as u32;
        assert_eq!(counts.iter().sum::<u32>(), used);
        assert_eq!(culling.demand_and_written().unwrap(), (Some(kept), kept));
        // Mask, list and verdicts are those of any cull.
        assert_eq!(culling.indices().unwrap(), indices);
        assert_eq!(culling.mask().unwrap().iter().filter(|kept| **kept).count() as u64, kept);
        let counts = culling.counts().unwrap();
        assert_eq!((counts.absent, counts.tested, counts.visible), (absent, 2500 - absent, kept));
        assert_eq!((counts.outside, counts.occluded), (0, 2500 - absent - kept));
        let Emit::Binned { .. } = emit else {
            assert!(culling.bin(0, 0).unwrap_err().to_string().contains("Emit::Instances"));
            continue;
        };
        for (mesh, lods) in (0..).zip(lods) {
            for lod in 0..lods as u32 {
                let of_pieces = crowd.pieces();
                let all = of_pieces.iter().flat_map(|p| crowd.bin(p, mesh, lod));
                assert_eq!(culling.bin(mesh, lod).unwrap(), all.collect::<Vec<_>>());
            }
            assert!(culling.bin(mesh, lods as u32).unwrap_err().to_string().starts_with("lod: "));
        }
        assert!(culling.bin(3, 0).unwrap_err().to_string().starts_with("mesh: expected"));
        // Without a mask, too, more is known than what was written.
        let outputs = Outputs { indices: true, capacity: Some(9), emit, ..Outputs::NONE };
        let culling = engine.cull(&crowd.instances, camera, pyramid, &options, &outputs).unwrap();
        assert_eq!(culling.demand_and_written().unwrap(), (Some(kept), 9));
    }
}

/// An absent instance is in no group's box, whatever its bounds are, and an update leaves it so.
#[test]
fn absent_instances_are_not_there() {
    let world = World::new(&[]);
    let World { engine, camera, pyramid, .. } = &world;
    // One group before the wall if it were not absent, and 63 instances behind it.
    let n = 64;
    let centers = |absent: f32| -> Vec<f32> {
        (0..n).flat_map(|i| [0.0, 0.0, if i == 7 { absent } else { 8.0 }]).collect()
    };
    let ids: Vec<u32> = (0..n).map(|i| if i == 7 { ABSENT } else { 0 }).collect();
    let radii = vec![0.125; n];
    for depth in [2.0, f32::NAN] {
        let centers = centers(depth);
        let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
        let options =
            InstanceOptions { strict: true, mesh_ids: Some(&ids), ..InstanceOptions::default() };
        let instances = engine.instances(&bounds, &options).unwrap();
        assert_eq!((instances.num_absent(), instances.invalid().unwrap().len()), (1, 0));
        let options = CullOptions { hierarchy: Hierarchy::Always, ..CullOptions::default() };
        for _ in 0..2 {
            let culling =
                engine.cull(&instances, camera, pyramid, &options, &Outputs::ALL).unwrap();
            let counts = culling.counts().unwrap();
            assert_eq!((counts.tested_groups, counts.tested_instances), (1, 0), "a whole group");
            assert_eq!((counts.occluded, counts.outside, counts.absent), (63, 0, 1));
            assert_eq!(culling.verdicts().unwrap()[7], Verdict::Outside);
            assert!(culling.explain(7).unwrap().reason.contains("absent"));
            assert!(culling.indices().unwrap().is_empty());
            engine.update(&instances, 0, &bounds, true).unwrap();
        }
    }
    // All absent: the group is hidden, too.
    let ids = [ABSENT; 64];
    let centers = centers(2.0);
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let options = InstanceOptions { mesh_ids: Some(&ids), ..InstanceOptions::default() };
    let instances = engine.instances(&bounds, &options).unwrap();
    for hierarchy in [Hierarchy::Always, Hierarchy::Never] {
        let options = CullOptions { hierarchy, ..CullOptions::default() };
        let culling = engine.cull(&instances, camera, pyramid, &options, &Outputs::ALL).unwrap();
        let counts = culling.counts().unwrap();
        assert_eq!((counts.tested, counts.outside, counts.absent, counts.demand), (0, 0, 64, 0));
    }
}

/// The caller's records are listed in place of indices.
#[test]
fn records_are_copied_in_place_of_indices() {
    let world = World::new(&[]);
    let mut random = Random(6);
    for (n, piece, stride) in [(3000, Some(384), 4), (700, None, 256), (3000, Some(1024), 36)] {
        let made = Crowd::random(n, &[1], 0.4, 0.1, &mut random);
        let crowd = Crowd::new(&world, made, piece, true);
        let words = stride as usize / 4;
        let data: Vec<u32> =
            (0..n * words).map(|i| (i as u32).wrapping_mul(2_654_435_761)).collect();
        let records = world.engine.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("test.records"),
            size: 4 * data.len() as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let bytes: Vec<u8> = data.iter().flat_map(|word| word.to_le_bytes()).collect();
        world.engine.queue().write_buffer(&records, 0, &bytes);
        let emit = Emit::Copy { records, stride };
        for capacity in [None, Some(0), Some(100), Some(n as u32)] {
            let outputs = Outputs { indices: true, capacity, emit: emit.clone(), ..Outputs::NONE };
            let visible =
                world.engine.context().create_visible(&crowd.instances, &outputs).unwrap();
            world.cull(&crowd, &visible, &CullOptions::default()).unwrap();
            let draws = world.words(visible.draw_arguments().unwrap());
            let mut room = capacity.map_or(n, |c| c as usize);
            for (p, piece) in crowd.pieces().iter().enumerate() {
                let kept = piece.clone().filter(|i| crowd.made[*i].is_kept());
                let kept: Vec<usize> = kept.take(room).collect();
                room -= kept.len();
                assert_eq!(draws[5 * p + 1] as usize, kept.len());
                let list = world.words(visible.list(p).unwrap());
                let want = kept.iter().flat_map(|i| &data[i * words..(i + 1) * words]);
                let (got, behind) = list.split_at(kept.len() * words);
                assert!(got.iter().eq(want), "{n} {stride} {capacity:?} {p}");
                assert!(behind.iter().all(|word| *word == u32::MAX), "past the end");
                assert!(behind.len() >= CANARY_WORDS as usize);
            }
            let options = CullOptions { order: Order::Any, ..CullOptions::default() };
            let text = world.cull(&crowd, &visible, &options).unwrap_err().to_string();
            assert!(text.starts_with("order: expected Order::Stable for Emit::Copy"), "{text}");
        }
    }
}

/// What cannot be used is refused by name.
#[test]
fn bad_tables_ids_and_records_are_refused() {
    let world = World::new(&[]);
    let hiz = world.engine.context();
    let draw = DrawTemplate { index_count: 3, ..DrawTemplate::default() };
    let lod = |error: f64| Lod::new(draw, error);
    let refused = |lods: &[&[Lod]]| {
        let meshes: Vec<_> = lods.iter().map(|lods| MeshLods::new(lods)).collect();
        hiz.create_mesh_table(&meshes).unwrap_err()
    };
    assert_eq!(refused(&[]).to_string(), "meshes: expected at least one mesh, got none");
    assert!(refused(&[&[]]).to_string().contains("mesh 0 has none"));
    assert_eq!(
        refused(&[&[lod(0.0)], &[lod(0.0); 9]]),
        Error::Limit { name: "levels of detail of mesh 1".into(), requested: 9, allowed: 8 }
    );
    for error in [-1.0, f64::NAN, f64::INFINITY] {
        let text = refused(&[&[lod(error)]]).to_string();
        assert!(text.starts_with("error: expected errors from 0 on"), "{text}");
    }
    let vertices = Lod::new(VertexDraw { vertex_count: 3, first_vertex: 0 }, 0.0);
    assert!(refused(&[&[lod(0.0)], &[vertices]]).to_string().starts_with("draw: expected"));
    let moved = Lod::new(DrawTemplate { first_instance: 1, ..draw }, 0.0);
    assert!(refused(&[&[moved]]).to_string().starts_with("first_instance: expected 0"));

    let centers = [0.0_f32; 6];
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&[1.0; 2]) };
    let upload = |ids: Option<&[u32]>, scales: Option<&[f64]>| {
        let scales = scales.map(Floats::F64);
        let options = InstanceOptions { mesh_ids: ids, scales, ..InstanceOptions::default() };
        world.engine.instances(&bounds, &options)
    };
    let text = upload(Some(&[0]), None).unwrap_err().to_string();
    assert_eq!(text, "mesh_ids: expected one per instance, which are 2, got 1");
    let text = upload(None, Some(&[1.0, -1.0])).unwrap_err().to_string();
    assert!(text.starts_with("scales: expected numbers from 0 on") && text.ends_with("index 1"));
    assert!(matches!(upload(Some(&[0, 1 << 20]), None), Err(Error::Limit { .. })));
    let instances = upload(Some(&[0, 5]), None).unwrap();
    let meshes = world.table(&[1; 5], true);
    let visible = |instances: &Instances, emit: Emit| {
        hiz.create_visible(instances, &Outputs { draws: true, emit, ..Outputs::NONE })
    };
    let binned = |placement| Emit::Binned { meshes: meshes.clone(), placement };
    let text = visible(&instances, binned(Placement::Packed)).unwrap_err().to_string();
    assert_eq!(text, "mesh_ids: expected ids below 5, the number of meshes, got 5");

    // Bins belong to the ids of their instances, and in any order to one mesh.
    let [first, second] = [0, 1].map(|id| upload(Some(&[id, 1]), None).unwrap());
    let packed = visible(&first, binned(Placement::Packed)).unwrap();
    let crowd = |instances: &Arc<Instances>| Crowd {
        made: Vec::new(),
        instances: Arc::clone(instances),
        piece: 2,
    };
    let error = world.cull(&crowd(&second), &packed, &CullOptions::default()).unwrap_err();
    assert!(error.to_string().starts_with("visible: expected buffers that were created for these"));
    let any = CullOptions { order: Order::Any, ..CullOptions::default() };
    for placement in [Placement::Packed, Placement::Reserved] {
        let visible = visible(&first, binned(placement)).unwrap();
        let text = world.cull(&crowd(&first), &visible, &any).unwrap_err().to_string();
        assert!(text.starts_with("order: expected Order::Stable, got Order::Any"), "{text}");
    }

    let buffer = |size, usage| {
        let (label, mapped_at_creation) = (None, false);
        let descriptor = wgpu::BufferDescriptor { label, size, usage, mapped_at_creation };
        world.engine.device().create_buffer(&descriptor)
    };
    let storage = wgpu::BufferUsages::STORAGE;
    let copy = |records: wgpu::Buffer, stride| {
        visible(&first, Emit::Copy { records, stride }).unwrap_err().to_string()
    };
    for stride in [0, 2, 6, 260] {
        assert!(copy(buffer(4096, storage), stride).starts_with("stride: expected 4 to 256"));
    }
    assert!(copy(buffer(12, storage), 8).starts_with("records: expected 16 bytes, which are 8"));
    let text = copy(buffer(64, wgpu::BufferUsages::VERTEX), 8);
    assert!(text.starts_with("records: expected the usage STORAGE"), "{text}");
}

/// Without the feature, what sets `first_instance` is refused, and reserved bins work.
#[test]
fn packed_bins_need_first_instances() {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let request = wgpu::RequestAdapterOptions::default();
    let adapter = pollster::block_on(instance.request_adapter(&request)).expect("a driver");
    let descriptor = wgpu::DeviceDescriptor::default();
    let (device, queue) =
        pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
    let hiz = HizContext::new(&device).unwrap();
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let bounds = Bounds::Spheres { centers: Floats::F32(&[0.0; 3]), radii: Floats::F32(&[1.0]) };
    let instances =
        hiz.record_instances(&mut encoder, &bounds, &InstanceOptions::default()).unwrap();
    queue.submit([encoder.finish()]);
    let draw = DrawTemplate { index_count: 3, ..DrawTemplate::default() };
    let meshes = hiz.create_mesh_table(&[MeshLods::new(&[Lod::new(draw, 0.0)])]).unwrap();
    let visible =
        |emit| hiz.create_visible(&instances, &Outputs { draws: true, emit, ..Outputs::NONE });
    let packed = Emit::Binned { meshes: meshes.clone(), placement: Placement::Packed };
    let text = visible(packed).unwrap_err().to_string();
    assert!(text.starts_with("placement: expected a device with the feature INDIRECT_FIRST"));
    assert!(text.ends_with("or use Placement::Reserved"), "{text}");
    let text = visible(Emit::Instances { meshes: meshes.clone() }).unwrap_err().to_string();
    assert!(text.starts_with("emit: expected a device with the feature INDIRECT_FIRST_INSTANCE"));
    let reserved = Emit::Binned { meshes, placement: Placement::Reserved };
    assert!(visible(reserved).is_ok());
}

/// Each fault must show: in a list, in the draws or in their number.
#[test]
fn planted_faults_are_seen() {
    for (what, by, name, way) in [
        ("ranks(s, starts[share.x])", "ranks(s, starts[share.x] + 1u)", "starts off by one", 0),
        (
            "starts[mesh + 1u]), written)",
            "starts[mesh + 1u] + 1u), written)",
            "the end of a bin",
            0,
        ),
        (
            "let through_block = blocks[block_at(s, w)];",
            "let through_block = Numbers();",
            "a rank",
            0,
        ),
        (
            "unpack(before[at]) + blocks[block_at(s, workgroup.x * WORKGROUP)]",
            "unpack(before[at])",
            "a scatter without its block",
            0,
        ),
        ("packed >> vec2<u32>(COUNT_BITS)", "packed", "the counts of two planes", 0),
        ("earlier = Numbers(kept) +", "earlier =", "what earlier sets keep", 0),
        ("+ sum_before(all)", "", "what earlier planes keep", 0),
        ("if rank < written {", "if true {", "a list past its capacity", 0),
        ("min(kept, room())", "min(kept, emit.capacity)", "the capacity that is left", 0),
        ("index = index_of[index];", "", "slots as indices", 0),
        ("bin.lod / PLANES * piece.words + at.word", "at.word", "the set", 0),
        ("word_of_set * PLANES + bin.lod % PLANES", "word_of_set * PLANES", "the plane", 0),
        ("*ranks += select(Numbers(0u), Numbers(1u), has);", "", "the ranks of a plane", 0),
        ("*ranks += 1u;", "", "the ranks of the one plane", 0),
        ("at += filled_through(min(id.x - 1u, last));", "", "the draws of earlier shares", 0),
        ("select(0u, filled, w < workgroup.x)", "0u", "the draws of earlier workgroups", 0),
        ("write_draw(bin, Template(), 0u, 0u);", "", "the tail of the draws", 0),
        (
            "draw_counts[emit.piece] = all.y;",
            "draw_counts[emit.piece] = emit.records;",
            "the number of draws",
            0,
        ),
        (
            "lod * emit.count + starts[mesh] - begin",
            "lod * emit.count + starts[mesh]",
            "the shift of a bin",
            1,
        ),
        ("s * PLANES + plane_with(bits, bit)", "plane_with(bits, bit)", "a level of a set", 1),
        ("lod = s * PLANES + plane_with(bits_of_set, lowest);", "", "a draw of another level", 2),
    ] {
        let world = World::new(&[(what, by)]);
        // Two pieces, of which the first has more than one block of words; one plane; and draws of
        // several workgroups.
        let crowds = [(vec![6, 3, 1], 40_000), (vec![1; 3], 3000), (vec![1; 600], 1000)];
        let seen = crowds.into_iter().any(|(lods, n)| {
            let made = Crowd::random(n, &lods, 0.9, 0.1, &mut Random(4));
            let crowd = Crowd::new(&world, made, Some(36_864), true);
            let emit = emits(&world.table(&lods, true))[way].clone();
            let kept = crowd.made.iter().filter(|m| m.is_kept()).count() as u32;
            [None, Some(kept - 10), Some(kept / 2)]
                .into_iter()
                .any(|capacity| check(&world, &crowd, &lods, &emit, capacity, true).is_err())
        });
        assert!(seen, "{name}: nothing shows it");
    }
}

/// A device without planted faults but these, and an image in which nothing hides anything.
fn open_world(faults: &[(&str, &str)]) -> World {
    let world = World::new(faults);
    let far = world.engine.upload_depth(&[ndc(f32::INFINITY, CONVENTION); 64 * 64], &world.camera);
    let pyramid = world.engine.pyramid(&far.unwrap()).unwrap();
    World { pyramid, ..world }
}

/// The LODs of balls along the axis, by distance and by error, from their definitions.
/// With `camera_along_z`, w is view depth, so its least value on a ball is z - r.
/// The rows X' and Y' are 32 x and 32 y: the norm of the error's matrix is greatest in the corners,
/// `|[32 0 -32; 0 32 -32]| = sqrt(3072)`.
fn lods_by_rule(world: &World) -> Result<(), String> {
    const N: usize = 4000;
    let mut random = Random(7);
    let (pixels, stretch) = (4.0, 3072.0_f64.sqrt());
    let lods = [8, 3, 1, 5];
    let meshes = world.table(&lods, true);
    let mut instances = Vec::new();
    for _ in 0..N {
        let radius = 0.5 * random.unit();
        // A scale that leads to all LODs: their errors are 0, 1, 2 and so on.
        let scale = 0.05 + random.unit();
        let mesh = (random.unit() * lods.len() as f64) as usize;
        instances.push((1.0 + radius + 60.0 * random.unit(), radius, scale, mesh as u32));
    }
    let centers: Vec<f64> = instances.iter().flat_map(|i| [0.0, 0.0, i.0]).collect();
    let radii: Vec<f64> = instances.iter().map(|i| i.1).collect();
    let scales: Vec<f64> = instances.iter().map(|i| i.2).collect();
    let ids: Vec<u32> = instances.iter().map(|i| i.3).collect();
    let bounds = Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
    let options = InstanceOptions {
        mesh_ids: Some(&ids),
        scales: Some(Floats::F64(&scales)),
        ..InstanceOptions::default()
    };
    let uploaded = world.engine.instances(&bounds, &options).unwrap();
    let thresholds = vec![5.0, 10.0, 20.0, 30.0];
    let by_distance = LodRule::Distance { thresholds: thresholds.clone() };
    let mut used = std::collections::BTreeSet::new();
    for (rule, hierarchy) in [
        (by_distance.clone(), Hierarchy::Never),
        (by_distance, Hierarchy::Always),
        (LodRule::Error { pixels }, Hierarchy::Always),
    ] {
        for emit in emits(&meshes) {
            let options = CullOptions { lod: rule.clone(), hierarchy, ..CullOptions::default() };
            let outputs = Outputs { indices: true, emit, ..Outputs::NONE };
            let World { engine, camera, pyramid, .. } = world;
            let culling = engine.cull(&uploaded, camera, pyramid, &options, &outputs).unwrap();
            for (i, got) in culling.lods().unwrap().into_iter().enumerate() {
                let (z, radius, scale, mesh) = instances[i];
                // The rounding of the certificate may only choose a finer one, near a threshold.
                let lod_at = |w: f64| {
                    let is_allowed = |l: &usize| match &rule {
                        LodRule::Error { .. } => {
                            let error = (l * (mesh as usize + 1)) as f64;
                            w > error * scale * stretch / pixels
                        }
                        _ => thresholds.get(l - 1).is_some_and(|threshold| w > *threshold),
                    };
                    (1..lods[mesh as usize]).take_while(is_allowed).count() as u8
                };
                let w = z - radius;
                let (least, most) = (lod_at(w * (1.0 - 1e-4)), lod_at(w));
                if !(least..=most).contains(&got) {
                    return Err(format!("{rule:?}: {i} has LOD {got}, not {least}..={most}"));
                }
                used.insert(got);
            }
        }
    }
    assert_eq!(used, (0..8).collect(), "all levels occur");
    Ok(())
}

#[test]
fn lods_follow_the_rule() {
    lods_by_rule(&open_world(&[])).unwrap();
}

#[test]
fn faults_in_the_choice_of_lods_are_seen() {
    for (name, fault) in [
        ("the scale dropped", ("scale = bitcast<f32>(texel.z);", "")),
        (
            "the group's first member",
            ("lod_of(load_volume(place)", "lod_of(load_volume(place & ~63u)"),
        ),
        ("the errors of mesh 0", ("mesh, scale, lods_of(mesh)", "0u, scale, lods_of(mesh)")),
        ("the number of LODs", ("scale, lods_of(mesh)", "scale, 8u")),
        ("the second four errors", ("let k = 1u + (l >> ERRORS_LOG2);", "let k = 1u;")),
    ] {
        let seen = std::panic::catch_unwind(|| lods_by_rule(&open_world(&[fault])));
        assert!(!matches!(seen, Ok(Ok(()))), "{name}: nothing shows it");
    }
}

/// Draws one pixel per instance: column `index`, and the number of its draw as the colour.
const DRAW_SHADER: &str = "
struct Out { @builtin(position) at: vec4<f32>, @location(0) @interpolate(flat) bin: u32 }
@vertex fn vertex(@builtin(vertex_index) vertex: u32, @location(0) instance: u32) -> Out {
    let corner = vec2<f32>(f32(vertex % 3u & 1u), f32(vertex % 3u >> 1u)) * 4.0 - 1.0;
    // A triangle that holds the centre of its pixel, cut by the row above and below.
    let x = (f32(instance) + 0.5 + 0.1 * corner.x) / WIDTH * 2.0 - 1.0;
    return Out(vec4<f32>(x, corner.y, 0.5, 1.0), vertex / 3u);
}
@fragment fn fragment(in: Out) -> @location(0) u32 { return in.bin + 1u; }
";

/// How the renderer of a test draws.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    All,
    Counted,
    PerBin,
}

/// What a renderer draws of the bins: the number of the bin at each instance's column, plus one.
fn drawn(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    (visible, meshes): (&Visible, &MeshTable),
    (width, way): (u32, Way),
) -> Vec<u32> {
    let size = wgpu::Extent3d { width, height: 1, depth_or_array_layers: 1 };
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("test.target"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R32Uint,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    let text = DRAW_SHADER.replace("WIDTH", &format!("{width}.0"));
    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let attributes = wgpu::vertex_attr_array![0 => Uint32];
    let list = wgpu::VertexBufferLayout {
        array_stride: 4,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &attributes,
    };
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(list)],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::TextureFormat::R32Uint.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    // Three corners per bin.
    let bins = meshes.len() * meshes.most_lods();
    let corners: Vec<u8> = (0..3 * bins).flat_map(u32::to_le_bytes).collect();
    let indices = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("test.indices"),
        size: corners.len() as u64,
        usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&indices, 0, &corners);
    let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("test.staging"),
        size: row.into(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
    let draws = visible.draw_arguments().unwrap();
    for piece in 0..visible.num_pieces() {
        let list = visible.list(piece).unwrap();
        pass.set_vertex_buffer(0, list.slice(..));
        let offset = visible.draw_offset(piece);
        match way {
            Way::All => pass.multi_draw_indexed_indirect(draws, offset, visible.max_draws()),
            Way::Counted => {
                let (count, at) = (visible.draw_count().unwrap(), visible.draw_count_offset(piece));
                let most = visible.max_draws();
                pass.multi_draw_indexed_indirect_count(draws, offset, count, at, most);
            }
            Way::PerBin => {
                for mesh in 0..meshes.len() {
                    for lod in 0..meshes.lods(mesh) {
                        let (draw, part) = visible.bin(piece, mesh, lod).unwrap();
                        if !part.is_empty() {
                            pass.set_vertex_buffer(0, list.slice(part));
                            pass.draw_indexed_indirect(draws, draw);
                        }
                    }
                }
            }
        }
    }
    drop(pass);
    let copied = wgpu::TexelCopyBufferInfo {
        buffer: &staging,
        layout: wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: None,
        },
    };
    encoder.copy_texture_to_buffer(target.as_image_copy(), copied, size);
    queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let view = staging.get_mapped_range(..).unwrap();
    let words = view.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap()));
    words.take(width as usize).collect()
}

/// A renderer draws each kept instance with the draw of its bin: from all records with their zeros,
/// from as many as the device counts, and bin by bin.
/// The devices have no feature, that for first instances, and that for counts.
#[test]
fn renderers_draw_what_is_kept() {
    const N: usize = 2000;
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let request = wgpu::RequestAdapterOptions::default();
    let adapter = pollster::block_on(instance.request_adapter(&request)).expect("a driver");
    let first = wgpu::Features::INDIRECT_FIRST_INSTANCE;
    let counted = first | wgpu::Features::MULTI_DRAW_INDIRECT_COUNT;
    let mut random = Random(8);
    let lods = [1, 3, 1, 2, 1];
    let made = Crowd::random(N, &lods, 0.6, 0.1, &mut random);
    // By distance: LOD l is chosen beyond 10 l.
    let depth = |m: &Made| if m.shows { 10.0 * (m.lod as f32) + 5.0 } else { -5.0 };
    let centers: Vec<f32> = made.iter().flat_map(|m| [0.0, 0.0, depth(m)]).collect();
    let radii = vec![0.125_f32; N];
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let ids: Vec<u32> = made.iter().map(|m| m.mesh).collect();
    let bin = |m: &Made| if m.is_kept() { 3 * m.mesh + m.lod + 1 } else { 0 };
    let want: Vec<u32> = made.iter().map(bin).collect();
    for (features, ways) in [
        (wgpu::Features::empty(), &[Way::PerBin][..]),
        (first, &[Way::PerBin, Way::All]),
        (counted, &[Way::Counted]),
    ] {
        if !adapter.features().contains(features) {
            eprintln!("left out: the adapter lacks {features:?}");
            continue;
        }
        let limits = HizContext::required_limits();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: features,
            required_limits: limits,
            ..Default::default()
        }))
        .expect("a device");
        let hiz = HizContext::new(&device).unwrap();
        let draw = |m: usize, l: usize| {
            let first_index = 3 * (3 * m + l) as u32;
            Lod::new(DrawTemplate { index_count: 3, first_index, ..Default::default() }, 0.0)
        };
        let all: Vec<Vec<Lod>> =
            (0..lods.len()).map(|m| (0..lods[m]).map(|l| draw(m, l)).collect()).collect();
        let meshes: Vec<_> = all.iter().map(|lods| MeshLods::new(lods)).collect();
        let meshes = hiz.create_mesh_table(&meshes).unwrap();
        let camera = camera_along_z(16, 16, CONVENTION);
        let far = device.create_texture(&common::depth_descriptor(
            (16, 16),
            wgpu::TextureFormat::R32Float,
            wgpu::TextureUsages::TEXTURE_BINDING,
        ));
        let view = far.create_view(&wgpu::TextureViewDescriptor::default());
        let pyramid = hiz.create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
        let lod = LodRule::Distance { thresholds: vec![10.0, 20.0] };
        let options = CullOptions { lod, ..CullOptions::default() };
        for way in ways {
            let mut encoder =
                device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let upload = InstanceOptions {
                mesh_ids: Some(&ids),
                piece_capacity: Some(1024),
                ..InstanceOptions::default()
            };
            let instances = hiz.record_instances(&mut encoder, &bounds, &upload).unwrap();
            let placement =
                if *way == Way::PerBin { Placement::Reserved } else { Placement::Packed };
            let emit = Emit::Binned { meshes: meshes.clone(), placement };
            let outputs = Outputs { indices: true, emit, ..Outputs::NONE };
            let visible = hiz.create_visible(&instances, &outputs).unwrap();
            hiz.record_reduce(&mut encoder, &view, &camera, &pyramid).unwrap();
            hiz.record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)
                .unwrap();
            queue.submit([encoder.finish()]);
            let got = drawn((&device, &queue), (&visible, &meshes), (N as u32, *way));
            let at = got.iter().zip(&want).position(|(a, b)| a != b);
            assert_eq!(at, None, "{features:?} {way:?}");
        }
    }
}

/// Frames make no objects once the first culls have run, and a warm-up leaves nothing to draw.
#[test]
fn frames_of_bins_make_nothing() {
    let world = World::new(&[]);
    let mut random = Random(9);
    let lods = [2, 4];
    let crowd = Crowd::new(&world, Crowd::random(500, &lods, 0.5, 0.1, &mut random), None, true);
    for emit in emits(&world.table(&lods, true)) {
        let outputs = Outputs { indices: true, draws: true, emit, ..Outputs::NONE };
        let hiz = world.engine.context();
        let visible = hiz.create_visible(&crowd.instances, &outputs).unwrap();
        let options = CullOptions::default();
        let mut before = hiz.made();
        for frame in 0..8 {
            if frame == 3 {
                world.engine.wait().unwrap();
                before = hiz.made();
            }
            world.cull(&crowd, &visible, &options).unwrap();
            world.engine.wait().unwrap();
        }
        assert_eq!(hiz.made(), before);
        let depth = world.engine.upload_depth(&[0.0; 64 * 64], &world.camera).unwrap();
        let view = depth.texture().create_view(&wgpu::TextureViewDescriptor::default());
        let frame = WarmUp {
            occluders: None,
            depth: &view,
            camera: &world.camera,
            pyramid: &world.pyramid,
            instances: &crowd.instances,
            visible: &visible,
            options: &options,
            updates: false,
            more: WarmUpMore::default(),
        };
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = world.engine.device().create_command_encoder(&descriptor);
        hiz.record_warm_up(&mut encoder, &frame).unwrap();
        world.engine.queue().submit([encoder.finish()]);
        let draws = world.words(visible.draw_arguments().unwrap());
        assert!(draws.iter().all(|word| *word == 0), "nothing is drawn");
    }
}
