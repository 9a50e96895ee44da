//! Bounds that a shader writes into a buffer.
//! Records and group boxes contain the given bounds, exactly; bad bounds are kept; nothing of an
//! earlier frame is left.

mod common;

#[path = "common/exact.rs"]
mod exact;

use std::sync::Arc;

use common::{Random, camera_along_z, engine, ndc};
use exact::Exact;
use hiz_core::headless::{Culling, Engine};
use hiz_core::testing::words::{self, PieceWords};
use hiz_core::{
    ABSENT, Bounds, BoundsBuffer, BoundsKind, CullOptions, DepthConvention, Fit, Floats, Hierarchy,
    HizContext, InstanceOptions, Instances, Order, Outputs, StoredOrder, wgpu,
};

const KINDS: [BoundsKind; 3] = [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::Point];
const ORDERS: [StoredOrder; 2] = [StoredOrder::Morton, StoredOrder::Given];
const CONVENTION: DepthConvention = DepthConvention::Reversed;
const GROUP: usize = 64;

/// Numbers below this are valid (2^60).
const LIMIT: f64 = 1_152_921_504_606_846_976.0;

fn words_of(kind: BoundsKind) -> usize {
    match kind {
        BoundsKind::Sphere => 4,
        BoundsKind::Point => 3,
        _ => 6,
    }
}

/// Bounds as they lie in a buffer.
#[derive(Debug, Clone)]
struct Given {
    kind: BoundsKind,
    numbers: Vec<f32>,
}

/// What an instance's bounds contain, or the answer that they are invalid.
type Corners = Option<[[Exact; 2]; 3]>;

impl Given {
    fn len(&self) -> usize {
        self.numbers.len() / words_of(self.kind)
    }

    fn of(&self, i: usize) -> &[f32] {
        let words = words_of(self.kind);
        &self.numbers[words * i..words * (i + 1)]
    }

    /// Ordinary bounds in front of and behind the wall of [`cull`].
    fn ordinary(kind: BoundsKind, count: usize, random: &mut Random) -> Self {
        let mut numbers = Vec::new();
        for _ in 0..count {
            let mut number = |low, high| random.range(low, high) as f32;
            let center = [number(-4.0, 4.0), number(-4.0, 4.0), number(-1.0, 11.0)];
            let half = [number(0.0, 0.3), number(0.0, 0.3), number(0.0, 0.3)];
            match kind {
                BoundsKind::Sphere => numbers.extend([center[0], center[1], center[2], half[0]]),
                BoundsKind::Point => numbers.extend(center),
                _ => {
                    numbers.extend((0..3).map(|k| center[k] - half[k]));
                    numbers.extend((0..3).map(|k| center[k] + half[k]));
                }
            }
        }
        Self { kind, numbers }
    }

    /// Bounds of every size: each group of 64 has a scale, from subnormals to the limit.
    fn of_all_sizes(kind: BoundsKind, count: usize, random: &mut Random) -> Self {
        let mut numbers = Vec::new();
        let powers = [0, 0, 0, 20, -20, 59, -60, -99, -100, -101, -120, -126, -130, -149];
        for i in 0..count {
            let scale = 2.0_f64.powi(powers[i / GROUP % powers.len()]);
            let other = 2.0_f64.powi(random.pick(&powers));
            let mut number = |low: f64| {
                let plain = (random.range(low, 1.0) * scale.min(LIMIT / 4.0)) as f32;
                let tiny = (random.range(low, 1.0) * other.min(scale)) as f32;
                random.pick(&[plain, plain, plain, tiny, 0.0, -0.0, scale.min(LIMIT / 4.0) as f32])
            };
            let center: [f32; 3] = std::array::from_fn(|_| number(-1.0));
            match kind {
                BoundsKind::Sphere => {
                    numbers.extend([center[0], center[1], center[2], number(0.0)]);
                }
                BoundsKind::Point => numbers.extend(center),
                _ => {
                    let flat = number(0.0) == 0.0;
                    let other: [f32; 3] =
                        std::array::from_fn(
                            |k| {
                                if flat && k != 1 { center[k] } else { number(-1.0) }
                            },
                        );
                    numbers.extend((0..3).map(|k| center[k].min(other[k])));
                    numbers.extend((0..3).map(|k| center[k].max(other[k])));
                }
            }
        }
        Self { kind, numbers }
    }

    /// Replaces one number of some instances by one that makes most bounds invalid.
    fn spoil(&mut self, each: usize, random: &mut Random) {
        let words = words_of(self.kind);
        for i in (0..self.len()).step_by(each) {
            let bad = random.pick(&[
                f32::NAN,
                -f32::NAN,
                f32::from_bits(0x7F80_0001),
                f32::INFINITY,
                f32::NEG_INFINITY,
                1e30,
                -1e30,
                f32::MAX,
                LIMIT as f32,
            ]);
            self.numbers[words * i + random.below(words as u32) as usize] = bad;
            match (self.kind, i / each % 5) {
                (BoundsKind::Sphere, 1) => self.numbers[words * i + 3] = -1.0,
                (BoundsKind::Sphere, 2) => self.numbers[words * i + 3] = -f32::from_bits(1),
                (BoundsKind::Box, 1) => self.numbers[words * i] = self.numbers[words * i + 3] + 1.0,
                _ => {}
            }
        }
    }

    /// The rules for bad bounds, and exact corners of the others.
    fn corners(&self, i: usize) -> Corners {
        let v: Vec<f64> = self.of(i).iter().map(|v| f64::from(*v)).collect();
        match self.kind {
            BoundsKind::Sphere => {
                let is_valid = v.iter().all(|v| v.abs() < LIMIT) && v[3] >= 0.0;
                let radius = || Exact::new(v[3]);
                let along = |k: usize| {
                    let center = Exact::new(v[k]);
                    [center.minus(&radius()), center.plus(&radius())]
                };
                is_valid.then(|| [along(0), along(1), along(2)])
            }
            BoundsKind::Point => {
                let is_valid = v.iter().all(|v| v.abs() < LIMIT);
                is_valid.then(|| [0, 1, 2].map(|k| [Exact::new(v[k]), Exact::new(v[k])]))
            }
            _ => {
                let is_valid = (0..3).all(|k| {
                    // NaN fails every comparison.
                    v[k] <= v[k + 3]
                        && (0.5 * v[k] + 0.5 * v[k + 3]).abs() < LIMIT
                        && 0.5 * v[k + 3] - 0.5 * v[k] < LIMIT
                });
                is_valid.then(|| [0, 1, 2].map(|k| [Exact::new(v[k]), Exact::new(v[k + 3])]))
            }
        }
    }

    /// The same bounds for the host.
    fn with_bounds<T>(&self, work: impl FnOnce(&Bounds<'_>) -> T) -> T {
        let part = |from: usize, count: usize| -> Vec<f32> {
            (0..self.len()).flat_map(|i| self.of(i)[from..from + count].to_vec()).collect()
        };
        let first = part(0, 3);
        match self.kind {
            BoundsKind::Sphere => {
                let radii = part(3, 1);
                work(&Bounds::Spheres { centers: Floats::F32(&first), radii: Floats::F32(&radii) })
            }
            BoundsKind::Point => work(&Bounds::Points { positions: Floats::F32(&first) }),
            _ => {
                let max = part(3, 3);
                work(&Bounds::Boxes { min: Floats::F32(&first), max: Floats::F32(&max) })
            }
        }
    }

    fn uploaded(&self, engine: &Engine, order: StoredOrder) -> Arc<Instances> {
        let options =
            InstanceOptions { order, piece_capacity: Some(384), ..InstanceOptions::default() };
        self.with_bounds(|bounds| engine.instances(bounds, &options)).unwrap()
    }

    /// A buffer with these numbers, `stride` bytes apart from byte `offset` on, NaN elsewhere.
    fn buffer(&self, engine: &Engine, offset: u64, stride: u64) -> wgpu::Buffer {
        let (offset, stride) = (offset as usize / 4, stride as usize / 4);
        let mut words = vec![f32::NAN; (offset + stride * self.len()).max(1)];
        for i in 0..self.len() {
            let at = offset + stride * i;
            words[at..at + words_of(self.kind)].copy_from_slice(self.of(i));
        }
        let buffer = buffer(engine.device(), 4 * words.len() as u64, STORAGE);
        engine.queue().write_buffer(&buffer, 0, bytemuck::cast_slice(&words));
        buffer
    }

    fn packed(&self, engine: &Engine) -> wgpu::Buffer {
        self.buffer(engine, 0, 4 * words_of(self.kind) as u64)
    }
}

const STORAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE.union(wgpu::BufferUsages::COPY_DST);

fn buffer(device: &wgpu::Device, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let label = Some("test.bounds");
    device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
}

fn floats(words: &[u32]) -> Vec<f64> {
    words.iter().map(|word| f64::from(f32::from_bits(*word))).collect()
}

/// Whether a box record contains corners exactly, and is hardly larger.
/// `slack`: by how much a half size may exceed the exact one, relative.
fn holds(record: &[u32], corners: &[[Exact; 2]; 3], slack: f64) -> Result<(), String> {
    let v = floats(record);
    for (k, [low, high]) in corners.iter().enumerate() {
        let center = Exact::new(v[k]).plus(&Exact::new(v[4 + k]));
        let half = Exact::new(v[8 + k]);
        if !center.minus(&half).is_at_most(low) || !high.is_at_most(&center.plus(&half)) {
            return Err(format!("axis {k}: the record {v:?} does not contain the bounds"));
        }
        // Twice the half size, a rounding of the centre, and what is taken as 2^-99.
        let room = slack * v[8 + k] + v[k].abs() * 2.0_f64.powi(-22) + 2.0_f64.powi(-97);
        let most = high.minus(low).plus(&Exact::new(room));
        if !half.plus(&half).is_at_most(&most) {
            return Err(format!("axis {k}: the record {v:?} is larger than need be"));
        }
    }
    Ok(())
}

/// The first thing that is wrong with the records of these bounds.
fn wrong(pieces: &[PieceWords], given: &Given) -> Option<String> {
    let mut members: Vec<u32> = pieces.iter().flat_map(|p| p.indices.clone()).collect();
    members.sort_unstable();
    if !members.into_iter().eq(0..given.len() as u32) {
        return Some("each instance has one place".to_owned());
    }
    let mut base = 0;
    for piece in pieces {
        if let Err(what) = wrong_in(piece, given, base) {
            return Some(what);
        }
        base += piece.indices.len() as u32;
    }
    None
}

fn wrong_in(piece: &PieceWords, given: &Given, base: u32) -> Result<(), String> {
    let record_words = given.kind.record_bytes() as usize / 4;
    let is_beyond = |word: u32| f64::from(f32::from_bits(word)) > LIMIT;
    let mut all = Vec::new();
    for (place, index) in piece.indices.iter().enumerate() {
        let record = &piece.records[record_words * place..record_words * (place + 1)];
        let at = |what: &str| format!("instance {index} at {place}: {what}: {record:x?}");
        let index_at = if given.kind == BoundsKind::Point { 3 } else { 7 };
        if record[index_at] != index - base {
            return Err(at("not its index"));
        }
        let corners = given.corners(*index as usize);
        match (given.kind, &corners) {
            (BoundsKind::Sphere, Some(_)) => {
                let bits: Vec<u32> =
                    given.of(*index as usize).iter().map(|v| v.to_bits()).collect();
                let radius = bits[3] & !(1 << 31);
                if record[..7] != [bits[0], bits[1], bits[2], radius, 0, 0, 0] {
                    return Err(at(&format!("expected {bits:x?}")));
                }
            }
            (BoundsKind::Point, Some(_)) => {
                let bits = given.of(*index as usize).iter().map(|v| v.to_bits());
                if !bits.eq(record[..3].iter().copied()) {
                    return Err(at("expected the given bits"));
                }
            }
            (BoundsKind::Sphere, None) if is_beyond(record[3]) => {}
            (BoundsKind::Point, None) if is_beyond(record[0]) => {}
            (_, Some(corners)) => holds(record, corners, 1e-6).map_err(|what| at(&what))?,
            (BoundsKind::Box, None) if record[8..11].iter().all(|word| is_beyond(*word)) => {}
            _ => return Err(at("expected an invalid record")),
        }
        all.push(corners);
    }
    for (group, members) in all.chunks(GROUP).enumerate() {
        let record = &piece.groups[12 * group..12 * (group + 1)];
        let at = |what: &str| format!("group {group} of {base}: {what}: {record:x?}");
        if members.iter().any(Option::is_none) {
            if !record[8..11].iter().all(|word| is_beyond(*word)) {
                return Err(at("expected an invalid box"));
            }
            continue;
        }
        let members: Vec<_> = members.iter().flatten().collect();
        let around = [0, 1, 2].map(|k| {
            let least = members.iter().map(|m| &m[k][0]);
            let least = least.reduce(|a, b| if a.is_at_most(b) { a } else { b }).unwrap();
            let greatest = members.iter().map(|m| &m[k][1]);
            let greatest = greatest.reduce(|a, b| if a.is_at_most(b) { b } else { a }).unwrap();
            [least.plus(&Exact::new(0.0)), greatest.plus(&Exact::new(0.0))]
        });
        holds(record, &around, 1e-6).map_err(|what| at(&what))?;
    }
    Ok(())
}

/// The pieces after bounds were taken from a buffer, in each way to make the instances.
/// The groups hold other bounds before.
fn taken(engine: &Engine, given: &Given, way: Option<StoredOrder>) -> Vec<PieceWords> {
    let words = 4 * words_of(given.kind) as u64;
    let instances = match way {
        None => {
            let buffer = given.packed(engine);
            engine.instances_from(&buffer, given.kind, given.len() as u32).unwrap()
        }
        Some(order) => {
            let before = Given::ordinary(given.kind, given.len(), &mut Random(99));
            let instances = before.uploaded(engine, order);
            // Behind a header, with room between them, and not at the alignment of a binding.
            let (offset, stride) = (words + 4, words + 8);
            let buffer = given.buffer(engine, offset, stride);
            let source = BoundsBuffer { buffer: &buffer, offset, stride: Some(stride) };
            engine.update_from(&instances, source).unwrap();
            instances
        }
    };
    words::pieces(engine, &instances).unwrap()
}

const WAYS: [Option<StoredOrder>; 3] = [None, Some(StoredOrder::Given), Some(StoredOrder::Morton)];

/// The first thing that is wrong with records of all sizes, with and without bad numbers.
fn wrong_somewhere(engine: &Engine, counts: &[usize]) -> Option<String> {
    let mut random = Random(5);
    for kind in KINDS {
        for count in counts {
            for way in WAYS {
                for bad in [None, Some(7), Some(150)] {
                    let mut given = Given::of_all_sizes(kind, *count, &mut random);
                    if let Some(each) = bad {
                        given.spoil(each, &mut random);
                    }
                    if let Some(what) = wrong(&taken(engine, &given, way), &given) {
                        let first = given.of(0);
                        return Some(format!(
                            "{kind:?} x {count}, {way:?}, bad {bad:?}, {first:?}: {what}"
                        ));
                    }
                }
            }
        }
    }
    None
}

#[test]
fn records_and_group_boxes_contain_what_is_given() {
    let counts = [0, 1, 63, 64, 65, 383, 384, 385, 511, 512, 513, 1500];
    assert_eq!(wrong_somewhere(&engine(), &counts), None);
}

/// A float32 sphere's record on the device is the host's, bit for bit.
#[test]
fn spheres_have_the_records_of_the_host() {
    let given = Given::ordinary(BoundsKind::Sphere, 500, &mut Random(1));
    let pieces = taken(&engine(), &given, None);
    assert_eq!(pieces[0].records, given.with_bounds(words::instances).unwrap());
}

/// Culls against a wall that hides the left part of what is behind it.
fn cull(engine: &Engine, instances: &Arc<Instances>, options: &CullOptions) -> Culling {
    let camera = camera_along_z(64, 64, CONVENTION);
    let depth: Vec<_> =
        (0..64 * 64).map(|i| if i % 64 < 40 { ndc(4.0, CONVENTION) } else { 0.0 }).collect();
    let pyramid = engine.pyramid(&engine.upload_depth(&depth, &camera).unwrap()).unwrap();
    engine.cull(instances, &camera, &pyramid, options, &Outputs::default()).unwrap()
}

/// Every kind of cull gives the verdicts of the same bounds from the host.
/// A box's record may be larger by a rounding, so each of its verdicts may fail to cull.
#[test]
fn culls_decide_as_with_bounds_from_the_host() {
    let (engine, mut random) = (engine(), Random(3));
    for kind in KINDS {
        let mut given = Given::ordinary(kind, 1500, &mut random);
        given.spoil(300, &mut random);
        for order in ORDERS {
            let host = given.uploaded(&engine, order);
            let device = Given::ordinary(kind, 1500, &mut Random(8)).uploaded(&engine, order);
            engine.update_from(&device, &given.packed(&engine)).unwrap();
            for (hierarchy, fit, descent, list) in [
                (Hierarchy::Never, Fit::Rectangle, 0, Order::Stable),
                (Hierarchy::Always, Fit::Rectangle, 0, Order::Stable),
                (Hierarchy::Always, Fit::Rectangle, 64, Order::Any),
                (Hierarchy::Always, Fit::Volume, 4096, Order::Stable),
            ] {
                let options = CullOptions {
                    hierarchy,
                    fit,
                    descent,
                    order: list,
                    statistics: true,
                    ..CullOptions::default()
                };
                let [host, device] = [&host, &device].map(|list| cull(&engine, list, &options));
                let (theirs, ours) = (host.verdicts().unwrap(), device.verdicts().unwrap());
                let differ = theirs.iter().zip(&ours).filter(|(a, b)| a != b).count();
                let what = format!("{kind:?} {order:?} {options:?}: {differ} differ");
                assert!(differ <= if kind == BoundsKind::Sphere { 0 } else { 3 }, "{what}");
                let counts = device.counts().unwrap();
                assert_eq!(counts.invalid, 5, "{what}");
                assert!(counts.occluded > 50 && counts.outside > 50, "{what}: {counts:?}");
                let mut listed = device.indices().unwrap();
                listed.sort_unstable();
                let mask = device.mask().unwrap();
                let kept = (0..1500_u32).filter(|i| mask[*i as usize]);
                assert!(listed.into_iter().eq(kept), "{what}");
                for i in [0_u64, 1, 300, 700, 1499] {
                    let told = device.explain(i).unwrap();
                    assert_eq!(told.verdict, ours[i as usize], "{what}: instance {i}");
                }
            }
        }
    }
}

/// A cull sees the bounds that were there when it was submitted, whenever its answer is read.
#[test]
fn earlier_culls_keep_their_answers() {
    let (engine, mut random) = (engine(), Random(4));
    let options = CullOptions { hierarchy: Hierarchy::Always, ..CullOptions::default() };
    let first = Given::ordinary(BoundsKind::Sphere, 900, &mut random);
    let instances =
        engine.instances_from(&first.packed(&engine), first.kind, first.len() as u32).unwrap();
    let expected = cull(&engine, &instances, &options).verdicts().unwrap();
    let early = cull(&engine, &instances, &options);
    let second = Given::ordinary(BoundsKind::Sphere, 900, &mut random);
    engine.update_from(&instances, &second.packed(&engine)).unwrap();
    assert_ne!(cull(&engine, &instances, &options).verdicts().unwrap(), expected);
    assert_eq!(early.verdicts().unwrap(), expected);
    assert!(early.explain(3).unwrap().stale, "its bounds are others now");
}

/// The second recording from a buffer makes nothing, and those from others are kept as well.
#[test]
fn later_frames_make_nothing() {
    let engine = engine();
    let context = HizContext::new(engine.device()).unwrap();
    let encoder =
        || engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let given = Given::ordinary(BoundsKind::Box, 300, &mut Random(6));
    let buffers = [given.packed(&engine), given.packed(&engine)];
    let mut first = encoder();
    let instances =
        context.record_instances_from(&mut first, &buffers[0], BoundsKind::Box, 300).unwrap();
    context.record_update_from(&mut first, &instances, &buffers[1]).unwrap();
    engine.queue().submit([first.finish()]);
    let before = context.made();
    for frame in 0..6 {
        let mut encoder = encoder();
        context.record_update_from(&mut encoder, &instances, &buffers[frame % 2]).unwrap();
        engine.queue().submit([encoder.finish()]);
    }
    assert_eq!(context.made(), before);
    engine.wait().unwrap();
}

/// The host does not know bounds that the device writes, so it neither tells nor replaces them.
#[test]
fn what_only_the_host_could_do_is_refused() {
    let engine = engine();
    let given = Given::ordinary(BoundsKind::Sphere, 100, &mut Random(7));
    let instances = given.uploaded(&engine, StoredOrder::Morton);
    let update = || given.with_bounds(|bounds| engine.update(&instances, 0, bounds, false));
    assert_eq!(update(), Ok(()));
    assert_eq!(instances.invalid().unwrap(), []);
    let host_bytes = instances.host_bytes();
    engine.update_from(&instances, &given.packed(&engine)).unwrap();
    assert!(instances.host_bytes() < host_bytes, "no boxes of groups");
    let refused = "instances: expected instances whose bounds come from the host, got some whose \
                   bounds ";
    assert_eq!(
        update().unwrap_err().to_string(),
        format!("{refused}`record_update_from` takes from a buffer: write the buffer instead")
    );
    assert_eq!(
        instances.invalid().unwrap_err().to_string(),
        format!("{refused}come from a buffer: a cull's verdicts and counts tell the invalid ones")
    );
}

/// The records of absent instances say that they are absent, so no buffer may overwrite them.
#[test]
fn absent_instances_take_no_bounds_from_a_buffer() {
    let engine = engine();
    let given = Given::ordinary(BoundsKind::Sphere, 3, &mut Random(7));
    let mesh_ids = [0, ABSENT, 0];
    let options = InstanceOptions { mesh_ids: Some(&mesh_ids), ..InstanceOptions::default() };
    let instances = given.with_bounds(|bounds| engine.instances(bounds, &options)).unwrap();
    let refused = engine.update_from(&instances, &given.packed(&engine)).unwrap_err().to_string();
    let expected = "instances: expected instances of which none is absent, got 1 absent ones";
    assert!(refused.starts_with(expected), "{refused}");
}

/// An update from the host that is overtaken by bounds from a buffer, with the groups' records.
fn overtaken(engine: &Engine) -> Option<String> {
    let context = engine.context();
    let encoder =
        || engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut random = Random(8);
    let first = Given::ordinary(BoundsKind::Sphere, 128, &mut random);
    let instances = first.uploaded(engine, StoredOrder::Given);
    let [mut from_host, mut from_buffer] = [encoder(), encoder()];
    let one = Given { kind: first.kind, numbers: first.of(70).to_vec() };
    one.with_bounds(|bounds| context.record_update(&mut from_host, &instances, 70, bounds, false))
        .unwrap();
    let mut far = Given::ordinary(BoundsKind::Sphere, 128, &mut random);
    far.numbers.iter_mut().step_by(4).for_each(|x| *x += 100.0);
    context.record_update_from(&mut from_buffer, &instances, &far.packed(engine)).unwrap();
    // In the other order.
    engine.queue().submit([from_buffer.finish(), from_host.finish()]);
    far.numbers[4 * 70..4 * 71].copy_from_slice(first.of(70));
    let mut pieces = words::pieces(engine, &instances).unwrap();
    let group = &mut pieces[0].groups[12..24];
    if group[8..11].iter().all(|word| f64::from(f32::from_bits(*word)) > LIMIT) {
        return None; // never hidden as a whole
    }
    wrong(&pieces, &far)
}

#[test]
fn an_update_that_is_overtaken_hides_no_group() {
    assert_eq!(overtaken(&engine()), None);
}

/// A buffer that cannot be used is refused by name, and the encoder stays usable.
#[test]
fn bad_buffers_are_refused() {
    let engine = engine();
    let (device, context) = (engine.device(), engine.context());
    let good = buffer(device, 1600, STORAGE);
    let other = buffer(device, 1600, wgpu::BufferUsages::VERTEX);
    let gone = buffer(device, 1600, STORAGE);
    gone.destroy();
    let with = |buffer, offset, stride| BoundsBuffer { buffer, offset, stride };
    let (sphere, aligned) = (BoundsKind::Sphere, BoundsKind::Box);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    for (source, kind, count, expected) in [
        (with(&good, 0, None), sphere, 100, ""),
        (with(&good, 1600, None), sphere, 0, ""),
        (
            with(&good, 0, None),
            sphere,
            101,
            "buffer: expected 1616 bytes for 101 instances (offset 0, stride 16), got 1600",
        ),
        (
            with(&good, 4, None),
            sphere,
            100,
            "buffer: expected 1604 bytes for 100 instances (offset 4, stride 16), got 1600",
        ),
        (
            with(&good, 0, None),
            aligned,
            67,
            "buffer: expected 1608 bytes for 67 instances (offset 0, stride 24), got 1600",
        ),
        (
            with(&good, u64::MAX - 3, Some(16)),
            sphere,
            2,
            "buffer: expected more than 2^64 bytes for 2 instances",
        ),
        (with(&good, 2, None), sphere, 1, "offset: expected a multiple of 4, got 2"),
        (
            with(&good, 0, Some(12)),
            sphere,
            1,
            "stride: expected a multiple of 4 from 16 on for a Sphere, got 12",
        ),
        (
            with(&good, 0, Some(30)),
            aligned,
            1,
            "stride: expected a multiple of 4 from 24 on for a Box, got 30",
        ),
        (
            with(&other, 0, None),
            sphere,
            1,
            "buffer: expected a buffer with the usage STORAGE, got BufferUsages(VERTEX)",
        ),
        (
            with(&gone, 0, None),
            sphere,
            1,
            "buffer: expected a buffer of this device that has not been destroyed, but",
        ),
        (
            with(&good, 0, None),
            BoundsKind::OrientedBox,
            1,
            "kind: expected Sphere, Box or Point, got OrientedBox",
        ),
        (
            with(&good, 0, None),
            BoundsKind::WidePoint,
            1,
            "kind: expected Sphere, Box or Point, got WidePoint: a buffer holds float32",
        ),
    ] {
        let made = context.record_instances_from(&mut encoder, source, kind, count);
        let text = made.map_or_else(|error| error.to_string(), |_| String::new());
        assert!(text.starts_with(expected) && (text.is_empty() == expected.is_empty()), "{text}");
    }
    let stride = engine.device().limits().max_storage_buffer_binding_size / 2;
    if stride <= 1 << 28 {
        let large = buffer(device, 3 * stride, STORAGE);
        let made =
            context.record_instances_from(&mut encoder, with(&large, 0, Some(stride)), sphere, 3);
        let text = made.unwrap_err().to_string();
        assert!(text.starts_with("max_storage_buffer_binding_size: requested "), "{text}");
    }
    engine.queue().submit([encoder.finish()]);
    engine.wait().unwrap();
}

/// Faults in the shader, each of which the checks of this file have to find.
#[test]
fn planted_faults_are_found() {
    let faults: &[(&str, &str, &str)] = &[
        (
            "if around.low.x != INVALID_LOW {",
            "if source.runtime_zero == 0u { return; }\n{",
            "a group box of the frame before",
        ),
        ("first >= source.count", "first + GROUP > source.count", "the last, partial group"),
        ("min(first + GROUP, source.count)", "min(first + GROUP - 1u, source.count)", "63 members"),
        ("let is_valid = all((center", "let is_valid = true || all((center", "NaN is a sphere"),
        ("let is_valid = all((position", "let is_valid = true || all((position", "NaN is a point"),
        (
            "corners = Corners(keys, keys);",
            "corners = Corners(keys, keys + vec3<u32>(9u));",
            "a point",
        ),
        (
            "radius < LARGEST_BITS || radius == SIGN_BIT",
            "(radius & MAGNITUDE_BITS) < LARGEST_BITS",
            "a negative radius",
        ),
        (
            "if are_corners(low) && are_corners(high) && all(corners.low <= corners.high)",
            "if all(corners.low <= corners.high)",
            "NaN is a corner",
        ),
        (" && all(corners.low <= corners.high)", "", "min above max"),
        ("key_of(bits) + 1u", "key_of(bits)", "no step up"),
        ("key_of(bits) - 1u", "key_of(bits)", "no step down"),
        (
            "max(key_above(high - center), key_above(center - low))",
            "key_above(high - center)",
            "one end of the half size",
        ),
        (
            "Corners(vec3<u32>(INVALID_LOW), vec3<u32>(INVALID_HIGH));\n}",
            "Corners(vec3<u32>(INVALID_HIGH), vec3<u32>(INVALID_LOW));\n}",
            "an invalid member is left out of its group",
        ),
        ("index = indices[place];", "", "places for indices"),
        ("min(around.low, corners.low)", "max(around.low, corners.low)", "the greatest low corner"),
        ("let high = center + radius;", "let high = center;", "the radius is left out"),
    ];
    for (what, by, name) in faults {
        let faulty = Engine::with_planted_faults(None, &[(what, by)]).unwrap();
        let found = wrong_somewhere(&faulty, &[65, 385, 1500]);
        eprintln!("{name}: {found:?}");
        assert!(found.is_some(), "{name}: nothing is wrong");
    }
    let faulty = Engine::with_planted_faults(None, &[("sequence.broken = 1u;", "")]).unwrap();
    assert!(overtaken(&faulty).is_some(), "an update that is overtaken");
}
