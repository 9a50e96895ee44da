//! Bins by mesh and level of detail: lists, draw arguments and their number.
//! Expectations come from loops over what each instance was made to be.

mod common;

use std::sync::Arc;

use common::{Random, camera_along_z, ndc};
use hiz_core::headless::Engine;
use hiz_core::{
    ABSENT, Bounds, Camera, CullOptions, DepthConvention, DrawTemplate, Emit, Error, Floats,
    Hierarchy, InstanceOptions, Instances, Lod, MeshLods, MeshTable, Order, Outputs, Placement,
    Pyramid, VertexDraw, Visible, testing::CANARY_WORDS, wgpu,
};

const CONVENTION: DepthConvention = DepthConvention::Reversed;

/// The instances choose their own LOD: the whole part of their scale, at most the last one.
const LOD_OF_SCALE: (&str, &str) =
    ("-> u32 {\n    return 0u;\n}", "-> u32 {\n    return min(u32(scale), count - 1u);\n}");

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
            if indexed {
                let base_vertex = -(m as i32) - 1;
                let draw = DrawTemplate {
                    index_count: count,
                    first_index: first,
                    base_vertex,
                    ..Default::default()
                };
                Lod::new(draw, l as f64)
            } else {
                Lod::new(VertexDraw { vertex_count: count, first_vertex: first }, l as f64)
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

/// The sizes at which the passes change: words, blocks, pieces, capacities.
#[test]
fn bins_hold_what_a_loop_finds() {
    let world = World::new(&[]);
    let mut random = Random(1);
    // Levels of detail per mesh, instances, share kept, share absent, pieces.
    let cases: [(&[usize], usize, f64, f64, Option<u32>); 12] = [
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
                        assert_eq!(record, super_record(lod, count));
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

fn super_record(lod: u32, count: usize) -> Vec<u32> {
    record(true, (0, lod), count, 0)
}

/// Each fault must show: in a list, in the draws or in their number.
#[test]
fn planted_faults_are_seen() {
    let faults: [(&str, &str, usize); 11] = [
        ("starts off by one", "rank(lod, starts[mesh])", 0),
        ("the end of a bin", "starts[mesh + 1u]), written)", 0),
        ("a rank without its block", "return blocks[w >> BLOCK_LOG2_WORDS] + before[w]", 0),
        ("a scatter without its block", "var rank = blocks[w >> BLOCK_LOG2_WORDS] + before[w];", 0),
        ("a list past its capacity", "while bits != 0u && rank < written {", 0),
        ("the capacity that is left", "min(through, room())", 0),
        ("slots as indices", "index = index_of[index];", 0),
        ("the plane", "bin.lod * piece.words + at.word", 0),
        ("the tail of the draws", "write_draw(empty, Template(), 0u, 0u);", 0),
        ("the number of draws", "draw_counts[emit.piece] = count;", 0),
        ("the shift of a bin", "lod * emit.count + starts[mesh] - begin", 1),
    ];
    let by = [
        "rank(lod, starts[mesh] + 1u)",
        "starts[mesh + 1u] + 1u), written)",
        "return before[w]",
        "var rank = before[w];",
        "while bits != 0u {",
        "min(through, emit.capacity)",
        "",
        "at.word",
        "",
        "draw_counts[emit.piece] = emit.records;",
        "lod * emit.count + starts[mesh]",
    ];
    for ((name, what, way), by) in faults.into_iter().zip(by) {
        let world = World::new(&[(what, by)]);
        let mut random = Random(4);
        let lods = [2, 3, 1];
        // Two pieces, of which the first has more than one block of words.
        let made = Crowd::random(40_000, &lods, 0.9, 0.1, &mut random);
        let crowd = Crowd::new(&world, made, Some(36_864), true);
        let emit = emits(&world.table(&lods, true))[way].clone();
        let kept = crowd.made.iter().filter(|m| m.is_kept()).count() as u32;
        let seen = [None, Some(kept - 10), Some(kept / 2)]
            .into_iter()
            .any(|capacity| check(&world, &crowd, &lods, &emit, capacity, true).is_err());
        assert!(seen, "{name}: nothing shows it");
    }
}
