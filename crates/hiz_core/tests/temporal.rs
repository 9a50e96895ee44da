//! Two passes of a frame: early and late together show what all instances show, bit for bit.
//!
//! A town of boxes is drawn by a small renderer, frame by frame, from the lists alone.
//! Some boxes move, some come and go, and the camera walks and jumps.

mod common;
#[path = "common/drawn_boxes.rs"]
mod drawn_boxes;

use common::{Random, engine};
use drawn_boxes::{Body, BoxRenderer, Difference, NUM_INDICES, Target};
use hiz_core::{
    ABSENT, Bounds, Camera, Coverage, CullOptions, DepthConvention, DrawTemplate, EarlySet, Emit,
    Error, Floats, Hierarchy, HizContext, ImageSize, InstanceOptions, Instances, Lod, LodRule,
    MeshLods, Order, Outputs, Placement, Pose, Projection, Pyramid, PyramidOptions, StoredOrder,
    Temporal, Vec3, wgpu,
};

const SIZE: ImageSize = ImageSize { width: 192, height: 108 };

/// Houses a side of the town, and metres from one to the next.
const SIDE: usize = 12;
const STEP: f64 = 14.0;
const HOUSES: usize = SIDE * SIDE;
const SMALL: usize = 1500;
const BODIES: usize = HOUSES + SMALL;

/// Frames of each way.
fn frames() -> u32 {
    std::env::var("HIZVK_SOAK_FRAMES").ok().map_or(64, |text| text.parse().expect("a number"))
}

fn camera(eye: Vec3, target: Vec3) -> Camera {
    let pose = Pose { eye, target, up: [0.0, 1.0, 0.0] };
    let convention = DepthConvention::Reversed;
    let projection = Projection::Perspective { fov_y: 1.05, near: 0.1, far: None, convention };
    Camera::look_at(&pose, &projection, SIZE).unwrap()
}

/// The depth's error of a renderer in float32; `examples/renderer` measures it.
fn options(hierarchy: Hierarchy) -> CullOptions {
    CullOptions {
        depth_slack: 1e-2,
        transform_slack: 8.0,
        descent: 1024,
        hierarchy,
        ..CullOptions::default()
    }
}

/// Boxes that move, come and go.
struct Town {
    random: Random,
    bodies: Vec<Body>,
    velocity: Vec<[f32; 3]>,
    is_absent: Vec<bool>,
}

/// Where an absent box stands: below everything.
const NOWHERE: Body = ([0.0, -1000.0, 0.0], [0.01; 3]);

impl Town {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let mut bodies = Vec::new();
        for house in 0..HOUSES {
            let [x, z] = [house % SIDE, house / SIDE].map(|k| k as f64 * STEP);
            let half = [
                random.range(2.5, 5.0) as f32,
                random.range(3.0, 12.0) as f32,
                random.range(2.5, 5.0) as f32,
            ];
            let at = |v: f64, random: &mut Random| (v + random.range(-1.0, 1.0)) as f32;
            bodies.push(([at(x, &mut random), half[1], at(z, &mut random)], half));
        }
        let side = SIDE as f64 * STEP;
        for _ in 0..SMALL {
            let half = [0, 1, 2].map(|_| random.range(0.15, 0.6) as f32);
            let up = half[1] + random.range(0.0, 2.0) as f32;
            let center = [random.range(0.0, side) as f32, up, random.range(0.0, side) as f32];
            bodies.push((center, half));
        }
        let velocity = (0..BODIES)
            .map(|i| {
                let speed = if i >= HOUSES && random.below(5) == 0 { 1.0 } else { 0.0 };
                let mut along = || (speed * random.range(-0.6, 0.6)) as f32;
                [along(), 0.0, along()]
            })
            .collect();
        Self { random, bodies, velocity, is_absent: vec![false; BODIES] }
    }

    /// Goes on by one frame.
    fn step(&mut self, frame: u32) {
        for (body, velocity) in self.bodies.iter_mut().zip(&self.velocity) {
            (0..3).for_each(|k| body.0[k] += velocity[k]);
        }
        if frame % 3 == 1 {
            for _ in 0..60 {
                let i = HOUSES + self.random.below(SMALL as u32) as usize;
                self.is_absent[i] = !self.is_absent[i];
            }
        }
        // A house that opens the view on what is behind it, for one frame.
        if frame % 7 == 2 {
            let i = self.random.below(HOUSES as u32) as usize;
            self.is_absent[i] = !self.is_absent[i];
        }
    }

    fn standing(&self) -> Vec<Body> {
        let bodies = self.bodies.iter().zip(&self.is_absent);
        bodies.map(|(body, is_absent)| if *is_absent { NOWHERE } else { *body }).collect()
    }
}

/// A walk along a street, with a jump every 16 frames.
fn walk(frame: u32) -> Camera {
    let (jump, step) = (f64::from(frame / 16), f64::from(frame % 16));
    let (x, z) = (7.0 + 0.7 * step, 7.0 + STEP * (1.0 + 3.0 * jump) % (SIDE as f64 * STEP));
    let (eye, turn) = ([x, 1.7 + 12.0 * (jump % 2.0), z], 0.05 * step + jump);
    let down = -0.02 - 0.3 * (jump % 2.0);
    camera(eye, [eye[0] + turn.cos(), eye[1] + down, eye[2] + turn.sin()])
}

/// The boxes' corners, for bounds in float32, rounded outwards.
fn corners(bodies: &[Body]) -> (Vec<f64>, Vec<f64>) {
    let side = |sign: f64| {
        let corner = |(center, half): &Body| {
            [0, 1, 2].map(|k| f64::from(center[k]) + sign * f64::from(half[k]))
        };
        bodies.iter().flat_map(corner).collect()
    };
    (side(-1.0), side(1.0))
}

/// What is drawn early.
#[derive(Clone, Copy, PartialEq)]
enum Early {
    Last,
    /// By size after each jump.
    SizeAtJumps,
    /// A random mask of the caller.
    Mask,
    /// The history holds random bits.
    RandomHistory,
    /// Every third early pass is dropped together with the drawing of its list.
    Dropped,
    /// Every third frame has no early pass.
    Missing,
}

/// How a series of frames is drawn.
#[derive(Clone, Copy)]
struct Way {
    early: Early,
    capacity: Option<u32>,
    hierarchy: Hierarchy,
    piece_capacity: Option<u32>,
    /// The instances are uploaded anew every eighth frame.
    uploads: bool,
    /// The late pass tests against the depth of the frame before: a fault.
    is_behind: bool,
    emit: Lists,
}

/// How lists are emitted.
#[derive(Clone, Copy, PartialEq)]
enum Lists {
    One,
    Packed,
    /// With two LODs each.
    PackedLods,
    Reserved,
    Each,
    Copied,
}

const PLAIN: Way = Way {
    early: Early::Last,
    capacity: None,
    hierarchy: Hierarchy::Always,
    piece_capacity: None,
    uploads: false,
    is_behind: false,
    emit: Lists::One,
};

/// What a series of frames showed.
#[derive(Debug, Default)]
struct Seen {
    differing: Difference,
    /// Instances drawn, and the fewest that the final depth allows, per frame.
    drawn: Vec<u32>,
    best: Vec<u32>,
    /// The instances that early passes have drawn.
    early: Vec<u32>,
}

struct Stage {
    context: HizContext,
    renderer: BoxRenderer,
    target: Target,
    reference: Target,
    before: Target,
    pyramid: Pyramid,
    reference_pyramid: Pyramid,
}

impl Stage {
    fn new(faults: &[(&str, &str)]) -> Self {
        let engine = engine();
        let context = HizContext::with_planted_faults(engine.device(), faults).unwrap();
        let renderer = BoxRenderer::new(engine, BODIES as u32);
        let [target, reference, before] = [(); 3].map(|()| renderer.target(SIZE));
        let pyramid = || context.create_pyramid(SIZE, &PyramidOptions::default()).unwrap();
        let (pyramid, reference_pyramid) = (pyramid(), pyramid());
        Self { context, renderer, target, reference, before, pyramid, reference_pyramid }
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.renderer.engine.device().create_command_encoder(&Default::default())
    }

    fn submit(&self, encoder: wgpu::CommandEncoder) {
        self.renderer.engine.queue().submit([encoder.finish()]);
    }

    fn instances(&self, bodies: &[Body], way: &Way) -> Instances {
        let (min, max) = corners(bodies);
        let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
        // Three meshes that look alike.
        let mesh_ids: Vec<u32> = (0..bodies.len() as u32).map(|i| i % 3).collect();
        let has_meshes = ![Lists::One, Lists::Copied].contains(&way.emit);
        let options = InstanceOptions {
            piece_capacity: way.piece_capacity,
            mesh_ids: has_meshes.then_some(&mesh_ids),
            ..InstanceOptions::default()
        };
        let mut encoder = self.encoder();
        let instances = self.context.record_instances(&mut encoder, &bounds, &options).unwrap();
        self.submit(encoder);
        instances
    }

    fn emit(&self, way: &Way) -> Emit {
        let draw = DrawTemplate { index_count: NUM_INDICES, ..DrawTemplate::default() };
        let mut lods = vec![Lod::new(draw, 0.0)];
        if way.emit == Lists::PackedLods {
            lods.push(Lod::new(draw, 0.05));
        }
        let mesh = || MeshLods::new(&lods);
        let meshes = || self.context.create_mesh_table(&[mesh(), mesh(), mesh()]).unwrap();
        match way.emit {
            Lists::One => Emit::List,
            Lists::Packed | Lists::PackedLods => {
                Emit::Binned { meshes: meshes(), placement: Placement::Packed }
            }
            Lists::Reserved => Emit::Binned { meshes: meshes(), placement: Placement::Reserved },
            Lists::Each => Emit::Instances { meshes: meshes() },
            // The records are the numbers themselves.
            Lists::Copied => Emit::Copy { records: self.renderer.numbers().clone(), stride: 4 },
        }
    }

    fn temporal(&self, instances: &Instances, way: &Way) -> Temporal {
        let outputs = Outputs { capacity: way.capacity, emit: self.emit(way), ..listed() };
        self.context.create_temporal(instances, &outputs).unwrap()
    }

    /// Draws frames in one way, and compares each with the picture of everything.
    fn run(&self, way: &Way, frames: u32) -> Seen {
        let Self { context, renderer, target, reference, pyramid, .. } = self;
        let (mut town, mut random, mut seen) = (Town::new(5), Random(7), Seen::default());
        let mut instances = self.instances(&town.standing(), way);
        let temporal = self.temporal(&instances, way);
        let lod = match way.emit {
            Lists::PackedLods => LodRule::Error { pixels: 1.0 },
            _ => LodRule::Finest,
        };
        let options = CullOptions { lod, ..options(way.hierarchy) };
        let mask = renderer.engine.device().create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 4 * BODIES.div_ceil(32) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let best = context.create_visible(&instances, &listed()).unwrap();
        for frame in 0..frames {
            town.step(frame);
            let (bodies, camera) = (town.standing(), walk(frame));
            renderer.place(&bodies, &camera);
            let mut random_words = |share: u32, bits: u32| {
                let mut word = || {
                    (0..bits)
                        .fold(0, |word, bit| word | u32::from(random.below(100) < share) << bit)
                };
                (0..BODIES).map(|_| word()).collect::<Vec<u32>>()
            };
            if way.uploads && frame % 8 == 3 {
                instances = self.instances(&bodies, way);
            } else {
                let mut encoder = self.encoder();
                let (min, max) = corners(&bodies);
                let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
                context.record_update(&mut encoder, &instances, 0, &bounds, false).unwrap();
                self.submit(encoder);
            }
            let queue = renderer.engine.queue();
            let mut set = EarlySet::LastVisible;
            match way.early {
                Early::SizeAtJumps if frame % 16 == 0 => set = EarlySet::Largest { pixels: 8 },
                Early::Mask => {
                    let words = random_words(10, 32);
                    queue.write_buffer(
                        &mask,
                        0,
                        bytemuck::cast_slice(&words[..BODIES.div_ceil(32)]),
                    );
                    set = EarlySet::Given(&mask);
                }
                Early::RandomHistory => {
                    for piece in 0..instances.num_pieces() {
                        let history = temporal.history(piece);
                        // Also bits that no place has.
                        let words = random_words(20, 12);
                        let room = (history.size() / 4 - 4) as usize;
                        let words = &words[..room.min(words.len())];
                        queue.write_buffer(history, 16, bytemuck::cast_slice(words));
                    }
                }
                _ => {}
            }
            let mut encoder = self.encoder();
            let has_early =
                !(frame % 3 == 2 && [Early::Dropped, Early::Missing].contains(&way.early));
            if has_early || way.early == Early::Dropped {
                context
                    .record_early(&mut encoder, &instances, &camera, &temporal, set, &options)
                    .unwrap();
            }
            if has_early {
                renderer.draw(&mut encoder, target, Some(temporal.early()), true);
            } else {
                encoder = self.encoder();
                renderer.clear(&mut encoder, target);
            }
            let depth = if way.is_behind && frame > 0 { &self.before } else { target };
            context.record_reduce(&mut encoder, &depth.depth_view, &camera, pyramid).unwrap();
            context
                .record_late(&mut encoder, &instances, &camera, pyramid, &temporal, &options)
                .unwrap();
            if way.is_behind {
                renderer.draw(&mut encoder, &self.before, None, true);
            }
            renderer.draw(&mut encoder, target, Some(temporal.late()), false);
            renderer.draw(&mut encoder, reference, None, true);
            let of_all = &self.reference_pyramid;
            context.record_reduce(&mut encoder, &reference.depth_view, &camera, of_all).unwrap();
            context
                .record_cull(&mut encoder, &instances, &camera, of_all, &best, &options)
                .unwrap();
            self.submit(encoder);
            let difference = renderer.read(target).difference(&renderer.read(reference));
            seen.differing.depth += difference.depth;
            seen.differing.ties += difference.ties;
            let early = if has_early { renderer.listed(temporal.early()) } else { 0 };
            seen.early.push(early);
            seen.drawn.push(early + renderer.listed(temporal.late()));
            seen.best.push(renderer.listed(&best));
        }
        seen
    }
}

/// Lists, for boxes.
fn listed() -> Outputs {
    Outputs {
        indices: true,
        draws: true,
        draw: DrawTemplate { index_count: NUM_INDICES, ..DrawTemplate::default() },
        ..Outputs::NONE
    }
}

fn ways() -> Vec<(&'static str, Way)> {
    vec![
        ("groups", PLAIN),
        ("flat", Way { hierarchy: Hierarchy::Never, ..PLAIN }),
        ("a list of 1", Way { capacity: Some(1), ..PLAIN }),
        ("a list of 13", Way { capacity: Some(13), hierarchy: Hierarchy::Never, ..PLAIN }),
        ("a list of 200", Way { capacity: Some(200), ..PLAIN }),
        ("by size at jumps", Way { early: Early::SizeAtJumps, ..PLAIN }),
        ("a mask", Way { early: Early::Mask, ..PLAIN }),
        (
            "a mask, flat, a list of 40",
            Way { early: Early::Mask, hierarchy: Hierarchy::Never, capacity: Some(40), ..PLAIN },
        ),
        ("a random history", Way { early: Early::RandomHistory, ..PLAIN }),
        (
            "a random history, a list of 90",
            Way { early: Early::RandomHistory, capacity: Some(90), ..PLAIN },
        ),
        ("early passes dropped", Way { early: Early::Dropped, ..PLAIN }),
        ("early passes missing", Way { early: Early::Missing, ..PLAIN }),
        ("pieces, a list of 70", Way { piece_capacity: Some(512), capacity: Some(70), ..PLAIN }),
        ("pieces and a mask", Way { piece_capacity: Some(384), early: Early::Mask, ..PLAIN }),
        ("uploads", Way { uploads: true, ..PLAIN }),
        (
            "packed bins of LODs, a list of 20",
            Way { emit: Lists::PackedLods, capacity: Some(20), ..PLAIN },
        ),
        ("packed bins", Way { emit: Lists::Packed, ..PLAIN }),
        (
            "packed bins, a list of 20, pieces",
            Way { emit: Lists::Packed, capacity: Some(20), piece_capacity: Some(640), ..PLAIN },
        ),
        (
            "reserved bins and a mask, a list of 30",
            Way {
                emit: Lists::Reserved,
                early: Early::Mask,
                capacity: Some(30),
                hierarchy: Hierarchy::Never,
                ..PLAIN
            },
        ),
        ("a draw each, of 25", Way { emit: Lists::Each, capacity: Some(25), ..PLAIN }),
        ("copied records, a list of 35", Way { emit: Lists::Copied, capacity: Some(35), ..PLAIN }),
    ]
}

#[test]
fn early_and_late_show_what_all_show() {
    let stage = Stage::new(&[]);
    let (mut pixels, mut ties) = (0, 0);
    for (name, way) in ways() {
        // Thousands of draws take their time.
        let frames = if way.emit == Lists::Each { 16 } else { frames() };
        let seen = stage.run(&way, frames);
        let mean = |counts: &[u32]| f64::from(counts.iter().sum::<u32>()) / counts.len() as f64;
        eprintln!(
            "{name}: {} frames, early {:.0}, drawn {:.0}, best {:.0}, {:?}",
            seen.drawn.len(),
            mean(&seen.early),
            mean(&seen.drawn),
            mean(&seen.best),
            seen.differing
        );
        assert_eq!(seen.differing.depth, 0, "{name}");
        let is_drawn = seen.early.iter().filter(|count| **count > 0).count();
        assert!(2 * is_drawn > seen.early.len(), "{name}: nothing was drawn early");
        pixels += seen.drawn.len() * (SIZE.width * SIZE.height) as usize;
        ties += seen.differing.ties;
    }
    // Two boxes that share the nearest depth: the one that is drawn first wins.
    eprintln!("{ties} ties in {pixels} pixels");
    assert!(ties * 10_000 < pixels, "{ties} ties");
}

/// The mean over the frames after the second, of a walk without jumps.
#[test]
fn a_steady_walk_draws_little_more_than_the_best() {
    let seen = Stage::new(&[]).run(&PLAIN, 16);
    let sum = |counts: &[u32]| f64::from(counts[2..].iter().sum::<u32>());
    let ratio = sum(&seen.drawn) / sum(&seen.best);
    eprintln!("drawn {:?}, best {:?}: {ratio:.3}", seen.drawn, seen.best);
    assert!(ratio < 1.4, "{ratio}");
    // The first frame has no history, and begins by size.
    assert!(seen.early[0] > 0 && seen.drawn[0] < 4 * seen.best[0]);
    assert!(seen.best.iter().all(|best| *best > 20 && *best < BODIES as u32 / 4));
}

/// A fault of the passes, and the way in which it shows.
type Fault = (&'static str, &'static [(&'static str, &'static str)], Way);

const FAULTS: &[Fault] = &[
    (
        "the early set of an older frame",
        &[(
            "let is_of_frame = frame.early != 0u && atomicLoad(&history[0]) == frame.early;",
            "let is_of_frame = true;",
        )],
        Way { early: Early::Missing, ..PLAIN },
    ),
    (
        "an early pass that was dropped",
        &[("atomicLoad(&history[0]) == frame.early", "frame.early != 0u")],
        Way { early: Early::Dropped, ..PLAIN },
    ),
    (
        "drawn before the capacity is known",
        &[("mask[word] = left;", "mask[word] |= left;")],
        Way { capacity: Some(13), ..PLAIN },
    ),
    (
        "the early set by place instead of by index",
        &[("if !is_drawn(caller_index(place)) {", "if !is_drawn(place) {")],
        PLAIN,
    ),
    (
        "neighbours skipped by word",
        &[(
            "(atomicLoad(&mask[early_begin() + at.word]) & at.bit) != 0u",
            "atomicLoad(&mask[early_begin() + at.word]) != 0u",
        )],
        PLAIN,
    ),
    ("the pyramid of the frame before", &[], Way { is_behind: true, ..PLAIN }),
    (
        "bins that are drawn before the capacity is known",
        &[("if rank >= written {", "if rank >= written && written == 0u {")],
        Way { emit: Lists::Packed, capacity: Some(13), ..PLAIN },
    ),
    (
        "bins that are cut by slot",
        &[("if SORTED && !BY_INDEX {", "if false {")],
        Way { emit: Lists::Packed, capacity: Some(13), ..PLAIN },
    ),
];

#[test]
fn planted_faults_are_seen() {
    for (name, faults, way) in FAULTS {
        let seen = Stage::new(faults).run(way, 32);
        eprintln!("{name}: {:?}", seen.differing);
        assert!(seen.differing.depth > 0, "{name}");
    }
}

/// A door hides a room with more than a group of boxes, and opens for one frame.
/// The room's groups are hidden as a whole before, so no early pass looks into them.
#[test]
fn what_a_door_hides_shows_when_it_opens() {
    let stage = Stage::new(&[]);
    let Stage { context, renderer, target, reference, pyramid, .. } = &stage;
    let mut random = Random(1);
    let mut bodies: Vec<Body> = (0..BODIES)
        .map(|_| {
            let at = [random.range(-6.0, 6.0), random.range(-3.0, 3.0), random.range(20.0, 40.0)];
            (at.map(|v| v as f32), [0.2; 3])
        })
        .collect();
    bodies[0] = ([0.0, 0.0, 10.0], [20.0, 20.0, 0.1]);
    let way = Way { hierarchy: Hierarchy::Always, ..PLAIN };
    let instances = stage.instances(&bodies, &way);
    let temporal = stage.temporal(&instances, &way);
    let (camera, options) = (camera([0.0; 3], [0.0, 0.0, 1.0]), options(Hierarchy::Always));
    for frame in 0..8 {
        let is_open = frame == 3 || frame == 7;
        bodies[0].0[0] = if is_open { 100.0 } else { 0.0 };
        renderer.place(&bodies, &camera);
        let mut encoder = stage.encoder();
        let (min, max) = corners(&bodies[..1]);
        let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
        context.record_update(&mut encoder, &instances, 0, &bounds, false).unwrap();
        let set = EarlySet::LastVisible;
        context.record_early(&mut encoder, &instances, &camera, &temporal, set, &options).unwrap();
        renderer.draw(&mut encoder, target, Some(temporal.early()), true);
        context.record_reduce(&mut encoder, &target.depth_view, &camera, pyramid).unwrap();
        context
            .record_late(&mut encoder, &instances, &camera, pyramid, &temporal, &options)
            .unwrap();
        renderer.draw(&mut encoder, target, Some(temporal.late()), false);
        renderer.draw(&mut encoder, reference, None, true);
        stage.submit(encoder);
        let difference = renderer.read(target).difference(&renderer.read(reference));
        assert_eq!(difference.depth, 0, "frame {frame}");
        let counts = [temporal.early(), temporal.late()].map(|visible| renderer.listed(visible));
        eprintln!("frame {frame}, open {is_open}: early and late {counts:?}");
        match frame {
            // The door alone.
            0..=2 | 6 => assert_eq!(counts, [1, 0]),
            3 | 7 => assert!(counts[0] == 0 && counts[1] > 300, "{counts:?}"),
            // The room is drawn early once more, and the door late: so it hides the room only in
            // the late pass of the next frame.
            4 => assert!(counts[0] > 300 && counts[1] == 1, "{counts:?}"),
            _ => assert!(counts[0] > 300 && counts[1] == 0, "{counts:?}"),
        }
    }
}

/// After a late pass each bit of the history says whether a plain cull keeps a place, whatever it
/// held before: also in groups that were rejected.
fn check_history(faults: &[(&str, &str)]) -> usize {
    let stage = Stage::new(faults);
    let Stage { context, renderer, target, pyramid, .. } = &stage;
    let mut wrong = 0;
    for hierarchy in [Hierarchy::Always, Hierarchy::Never] {
        let mut bodies = Town::new(3).standing();
        // Neighbours become neighbours in storage, so that groups are outside or hidden as a whole.
        bodies.sort_by_key(|(center, _)| {
            [center[0], center[2]].map(|v| (f64::from(v) / STEP) as i32)
        });
        let (camera, options) = (walk(4), options(hierarchy));
        renderer.place(&bodies, &camera);
        let (min, max) = corners(&bodies);
        let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
        let mut encoder = stage.encoder();
        // As they come, so that a place is an index.
        let given = InstanceOptions { order: StoredOrder::Given, ..InstanceOptions::default() };
        let instances = context.record_instances(&mut encoder, &bounds, &given).unwrap();
        let temporal = stage.temporal(&instances, &PLAIN);
        let outputs = Outputs { mask: true, ..Outputs::NONE };
        let alone = context.create_visible(&instances, &outputs).unwrap();
        let noise = vec![0xFF_u8; temporal.history(0).size() as usize - 16];
        renderer.engine.queue().write_buffer(temporal.history(0), 16, &noise);
        renderer.draw(&mut encoder, target, None, true);
        context.record_reduce(&mut encoder, &target.depth_view, &camera, pyramid).unwrap();
        context
            .record_late(&mut encoder, &instances, &camera, pyramid, &temporal, &options)
            .unwrap();
        context.record_cull(&mut encoder, &instances, &camera, pyramid, &alone, &options).unwrap();
        stage.submit(encoder);
        let history = renderer.words(temporal.history(0));
        let mask = renderer.words(alone.mask(0).unwrap());
        let kept = (0..BODIES).filter(|i| mask[i / 32] >> (i % 32) & 1 == 1).count();
        assert!(kept > 50 && kept < BODIES / 2, "{kept}");
        for place in 0..BODIES {
            let (group, share, bit) = (place / 64, place % 8, place % 64 / 8);
            let of_history = history[4 + 2 * group + share / 4] >> (share % 4 * 8 + bit) & 1;
            wrong += usize::from(of_history != mask[place / 32] >> (place % 32) & 1);
        }
    }
    wrong
}

#[test]
fn a_late_pass_writes_the_history_of_every_place() {
    assert_eq!(check_history(&[]), 0);
}

/// These faults cost time and no pixel, because any early set is right: the history shows them.
#[test]
fn faults_of_the_history_are_seen() {
    let faults = [
        ("found << history_shift(share)", "found"),
        ("if found != 0u {", "if found > 1u {"),
        (
            "group * WORDS_OF_GROUP + share / SHARES_OF_WORD",
            "group * WORDS_OF_GROUP + share % WORDS_OF_GROUP",
        ),
    ];
    for fault in faults {
        let wrong = check_history(&[fault]);
        eprintln!("{fault:?}: {wrong}");
        assert!(wrong > 0, "{fault:?}");
    }
}

/// Frames of two passes make no object after the first ones.
#[test]
fn frames_make_nothing_anew() {
    let stage = Stage::new(&[]);
    let Stage { context, renderer, target, pyramid, .. } = &stage;
    for hierarchy in [Hierarchy::Always, Hierarchy::Never] {
        let way = Way { hierarchy, capacity: Some(50), ..PLAIN };
        let bodies = Town::new(9).standing();
        let instances = stage.instances(&bodies, &way);
        let (temporal, options) = (stage.temporal(&instances, &way), options(hierarchy));
        let mut before = context.made();
        for frame in 0..30 {
            if frame == 6 {
                renderer.engine.wait().unwrap();
                before = context.made();
            }
            let (camera, mut encoder) = (walk(frame), stage.encoder());
            let set = EarlySet::LastVisible;
            context
                .record_early(&mut encoder, &instances, &camera, &temporal, set, &options)
                .unwrap();
            context.record_reduce(&mut encoder, &target.depth_view, &camera, pyramid).unwrap();
            context
                .record_late(&mut encoder, &instances, &camera, pyramid, &temporal, &options)
                .unwrap();
            stage.submit(encoder);
            if frame % 2 == 1 {
                renderer.engine.wait().unwrap();
            }
        }
        let after = context.made();
        let buffers = after.buffers - before.buffers;
        assert!(buffers <= 8, "{hierarchy:?}: {buffers} buffers");
        let rest = hiz_core::testing::Made { buffers: before.buffers, ..after };
        assert_eq!(rest, before, "{hierarchy:?}");
    }
}

/// What two passes cannot promise is refused by name, and says the way out.
#[test]
fn what_is_refused_is_named() {
    let stage = Stage::new(&[]);
    let Stage { context, target, pyramid, .. } = &stage;
    let bodies = Town::new(9).standing();
    let instances = stage.instances(&bodies, &PLAIN);
    let temporal = stage.temporal(&instances, &PLAIN);
    let (here, there) = (walk(0), walk(1));
    let mut encoder = stage.encoder();
    context.record_reduce(&mut encoder, &target.depth_view, &here, pyramid).unwrap();
    let plain = CullOptions::default();
    let early = |instances: &Instances, set: EarlySet<'_>| {
        context.record_early(&mut stage.encoder(), instances, &here, &temporal, set, &plain)
    };
    let late = |instances: &Instances, camera: &Camera, options: &CullOptions| {
        context.record_late(&mut stage.encoder(), instances, camera, pyramid, &temporal, options)
    };
    let said = |result: hiz_core::Result<()>| match result {
        Err(Error::Invalid { parameter, message } | Error::Mismatch { parameter, message }) => {
            (parameter, message)
        }
        other => panic!("expected a refusal, got {other:?}"),
    };

    let (parameter, message) =
        said(late(&instances, &here, &CullOptions { order: Order::Any, ..plain.clone() }));
    assert!(parameter == "order" && message.contains("Stable"), "{message}");

    let sample = CullOptions { coverage: Coverage::Sample, ..plain.clone() };
    let (parameter, message) = said(late(&instances, &here, &sample));
    assert!(parameter == "guard_px" && message.contains("9/256"), "{message}");
    let guarded = CullOptions { guard_px: Some(9.0 / 256.0), ..sample };
    late(&instances, &here, &guarded).unwrap();

    // The same camera, the same instances, at the same moment.
    early(&instances, EarlySet::LastVisible).unwrap();
    let (parameter, message) = said(late(&instances, &there, &plain));
    assert!(parameter == "camera" && message.contains("record_early"), "{message}");
    let others = stage.instances(&bodies, &PLAIN);
    let (parameter, message) = said(late(&others, &here, &plain));
    assert!(parameter == "instances" && message.contains("record_early"), "{message}");
    let (min, max) = corners(&bodies[..1]);
    let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
    context.record_update(&mut encoder, &instances, 0, &bounds, false).unwrap();
    let (parameter, message) = said(late(&instances, &here, &plain));
    assert!(parameter == "instances" && message.contains("update before"), "{message}");
    // Bounds from a buffer are an update, too.
    early(&instances, EarlySet::LastVisible).unwrap();
    let source = renderer_mask(&stage, 24 * BODIES as u64, wgpu::BufferUsages::STORAGE);
    context.record_update_from(&mut encoder, &instances, &source).unwrap();
    let (parameter, message) = said(late(&instances, &here, &plain));
    assert!(parameter == "instances" && message.contains("update before"), "{message}");
    // A refused late pass leaves the early one as it was, and a new early one helps.
    early(&instances, EarlySet::LastVisible).unwrap();
    late(&instances, &here, &plain).unwrap();

    let few = stage.instances(&bodies[..100], &PLAIN);
    let (parameter, _) = said(early(&few, EarlySet::LastVisible));
    assert_eq!(parameter, "temporal");
    let short = renderer_mask(&stage, 8, wgpu::BufferUsages::STORAGE);
    let (parameter, message) = said(early(&instances, EarlySet::Given(&short)));
    assert!(parameter == "set" && message.contains("got 8 bytes"), "{message}");
    let other = renderer_mask(&stage, 4096, wgpu::BufferUsages::VERTEX);
    let (parameter, message) = said(early(&instances, EarlySet::Given(&other)));
    assert!(parameter == "set" && message.contains("STORAGE"), "{message}");

    let (parameter, message) = said(context.create_temporal(&instances, &Outputs::NONE).map(drop));
    assert!(parameter == "outputs" && message.contains("mask, indices or draws"), "{message}");
    let (parameter, message) = said(context.record_cull(
        &mut stage.encoder(),
        &instances,
        &here,
        pyramid,
        temporal.early(),
        &plain,
    ));
    assert!(parameter == "visible" && message.contains("create_visible"), "{message}");
    drop(encoder);
}

fn renderer_mask(stage: &Stage, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    stage.renderer.engine.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// An absent instance is in no pass, whatever asks for it.
#[test]
fn absent_instances_are_never_listed() {
    let stage = Stage::new(&[]);
    let Stage { context, renderer, target, pyramid, .. } = &stage;
    let (bodies, camera, plain) = (Town::new(9).standing(), walk(2), options(Hierarchy::Always));
    let is_absent = |i: usize| i.is_multiple_of(5) || (640..900).contains(&i);
    let ids: Vec<u32> = (0..BODIES).map(|i| if is_absent(i) { ABSENT } else { 0 }).collect();
    let (min, max) = corners(&bodies);
    let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
    let mut encoder = stage.encoder();
    let given = InstanceOptions { mesh_ids: Some(&ids), ..InstanceOptions::default() };
    let instances = context.record_instances(&mut encoder, &bounds, &given).unwrap();
    let outputs = Outputs { mask: true, ..Outputs::NONE };
    let temporal = context.create_temporal(&instances, &outputs).unwrap();
    let all = renderer_mask(&stage, 4 * BODIES.div_ceil(32) as u64, wgpu::BufferUsages::STORAGE);
    let queue = renderer.engine.queue();
    queue.write_buffer(&all, 0, &vec![0xFF; all.size() as usize]);
    let noise = vec![0xFF_u8; temporal.history(0).size() as usize - 16];
    renderer.clear(&mut encoder, target);
    context.record_reduce(&mut encoder, &target.depth_view, &camera, pyramid).unwrap();
    stage.submit(encoder);
    for set in [
        EarlySet::Given(&all),
        EarlySet::LastVisible,
        EarlySet::Largest { pixels: 1 },
        EarlySet::Largest { pixels: 10_000 },
    ] {
        queue.write_buffer(temporal.history(0), 16, &noise);
        let mut encoder = stage.encoder();
        context.record_early(&mut encoder, &instances, &camera, &temporal, set, &plain).unwrap();
        context.record_late(&mut encoder, &instances, &camera, pyramid, &temporal, &plain).unwrap();
        stage.submit(encoder);
        let mut drawn = 0;
        for visible in [temporal.early(), temporal.late()] {
            let mask = renderer.words(visible.mask(0).unwrap());
            let bits = (0..BODIES).filter(|i| mask[i / 32] >> (i % 32) & 1 == 1);
            for index in bits {
                assert!(!is_absent(index), "{set:?}: {index}");
                drawn += 1;
            }
        }
        // The depth is empty: all that is in the view is drawn, once.
        assert!(drawn > 100, "{set:?}: {drawn}");
    }
}
