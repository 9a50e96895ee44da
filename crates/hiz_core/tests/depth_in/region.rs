//! A changed rectangle: the levels are those of a full reduction, bit for bit.

use std::sync::Arc;

use hiz_core::headless::Engine;
use hiz_core::{
    AtlasUse, Bounds, Camera, CullOptions, DepthConvention, DepthSource, Floats, ImageSize,
    InstanceOptions, Instances, Outputs, Pyramid, PyramidOptions, StoredLevels, wgpu,
};
use wgpu::TextureFormat as Format;

use crate::common::{
    BLOCK_SIZES, CONVENTIONS, Random, camera_along_z, depth_descriptor, engine, ndc,
};
use crate::{COPIED, SAMPLED, STORED, differing_levels, encoder, image};

/// Beside those at which blocks begin and end: more than one workgroup, and a common screen.
const LARGER_SIZES: [(u32, u32); 3] = [(255, 257), (1100, 9), (1920, 1080)];

/// How the image lies in its texture: alone, four pixels per texel, or within a larger one.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Whole,
    Packed,
    Part,
}

const KINDS: [Kind; 3] = [Kind::Whole, Kind::Packed, Kind::Part];
const ORIGIN: [u32; 2] = [5, 3];

/// An image on the device, of which rectangles change.
struct Changing<'a> {
    engine: &'a Engine,
    kind: Kind,
    size: ImageSize,
    texture: wgpu::Texture,
    depth: Vec<f32>,
}

impl<'a> Changing<'a> {
    fn new(engine: &'a Engine, kind: Kind, size: ImageSize, depth: Vec<f32>) -> Self {
        let (format, usage, extent) = match kind {
            Kind::Whole => (Format::R32Float, SAMPLED, (size.width, size.height)),
            Kind::Packed => (
                Format::Rgba32Uint,
                wgpu::TextureUsages::STORAGE_BINDING,
                (size.width.div_ceil(4), size.height),
            ),
            Kind::Part => (Format::R32Float, SAMPLED, (size.width + 9, size.height + 8)),
        };
        let descriptor = depth_descriptor(extent, format, usage | COPIED);
        let texture = engine.device().create_texture(&descriptor);
        let changing = Self { engine, kind, size, texture, depth };
        changing.write([0, 0, size.width - 1, size.height - 1]);
        changing
    }

    fn source(&self) -> DepthSource<'_> {
        let whole = DepthSource::from(&self.texture);
        match self.kind {
            Kind::Part => DepthSource { origin: ORIGIN, size: Some(self.size), ..whole },
            _ => whole,
        }
    }

    /// Writes a rectangle of the image into the texture; of packed pixels whole rows.
    fn write(&self, [x0, y0, x1, y1]: [u32; 4]) {
        let width = self.size.width;
        let (x0, x1) = if self.kind == Kind::Packed { (0, width - 1) } else { (x0, x1) };
        let rows = (y0..=y1).flat_map(|y| {
            let row = &self.depth[(y * width) as usize..((y + 1) * width) as usize];
            let mut row = row[x0 as usize..=x1 as usize].to_vec();
            if self.kind == Kind::Packed {
                // Spare pixels repeat the last one.
                let last = row[row.len() - 1];
                row.resize(row.len().next_multiple_of(4), last);
            }
            row
        });
        let rows: Vec<f32> = rows.collect();
        let height = y1 - y0 + 1;
        let row_bytes = 4 * rows.len() as u32 / height;
        let texels = if self.kind == Kind::Packed { row_bytes / 16 } else { row_bytes / 4 };
        let [x, y] = if self.kind == Kind::Part { ORIGIN } else { [0, 0] };
        self.engine.queue().write_texture(
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x: x + x0, y: y + y0, z: 0 },
                ..self.texture.as_image_copy()
            },
            bytemuck::cast_slice(&rows),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row_bytes),
                rows_per_image: None,
            },
            wgpu::Extent3d { width: texels, height, depth_or_array_layers: 1 },
        );
    }

    /// Changes a random rectangle, which is returned.
    fn change(&mut self, random: &mut Random) -> [u32; 4] {
        let mut span = |n: u32| {
            let first = random.below(n);
            // Small, large, or up to the edge.
            let last = match random.below(3) {
                0 => (first + random.below(8)).min(n - 1),
                1 => first + random.below(n - first),
                _ => n - 1,
            };
            (first, last)
        };
        let ((x0, x1), (y0, y1)) = (span(self.size.width), span(self.size.height));
        // Half of them get nearer as a whole, half get farther or anything.
        let whole = [0.0, 1.0, 0.5, f32::NAN][random.below(4) as usize];
        let is_whole = random.below(2) == 0;
        for y in y0..=y1 {
            for x in x0..=x1 {
                let d = if is_whole { whole } else { random.unit() as f32 };
                self.depth[(y * self.size.width + x) as usize] = d;
            }
        }
        let rectangle = [x0, y0, x1, y1];
        self.write(rectangle);
        rectangle
    }
}

/// How many comparisons differ after 100 rectangles a size, for these levels.
fn differing(engine: &Engine, sizes: &[(u32, u32)], stored: &[StoredLevels]) -> usize {
    let context = engine.context();
    let (mut random, mut wrong, mut turn) = (Random(21), 0, 0);
    for (width, height) in sizes {
        for convention in CONVENTIONS {
            let camera = camera_along_z(*width, *height, convention);
            let size = camera.size();
            // Large images take turns, small ones have every combination.
            let is_large = size.pixels() > 40_000;
            for levels in stored {
                for kind in KINDS {
                    turn += 1;
                    if is_large && turn % 5 != 0 {
                        continue;
                    }
                    let depth = image(size, &mut random);
                    let mut changing = Changing::new(engine, kind, size, depth);
                    let options = PyramidOptions { levels: *levels, ..Default::default() };
                    let pyramid = context.create_pyramid(size, &options).unwrap();
                    let mut commands = encoder(engine.device());
                    let source = changing.source();
                    context.record_reduce(&mut commands, source, &camera, &pyramid).unwrap();
                    engine.queue().submit([commands.finish()]);
                    for i in 1..=100 {
                        let rectangle = changing.change(&mut random);
                        let mut commands = encoder(engine.device());
                        let source = changing.source();
                        context
                            .record_reduce_region(&mut commands, source, rectangle, &pyramid)
                            .unwrap();
                        engine.queue().submit([commands.finish()]);
                        if i % 25 != 0 {
                            continue;
                        }
                        let reversed = convention.is_reversed();
                        let found = differing_levels(engine, &pyramid, &changing.depth, reversed);
                        if !found.is_empty() {
                            eprintln!(
                                "{width}x{height} {convention:?} {levels:?} {kind:?} after {i}, \
                                 last {rectangle:?}: {found:?}"
                            );
                            wrong += 1;
                        }
                    }
                }
            }
        }
    }
    wrong
}

#[test]
fn a_hundred_rectangles_a_size_end_as_a_full_reduction() {
    let sizes = [&BLOCK_SIZES[..], &LARGER_SIZES].concat();
    assert_eq!(differing(&engine(), &sizes, &STORED), 0);
}

const BLOCKS: &str = "if block.x < step.end.x && block.y < step.end.y {";
const TEXELS: &str = "if at.x < step.end.x && at.y < step.end.y {";

#[test]
fn planted_faults_of_regions_show() {
    // Their blocks are no multiple of four, so each level has padding that the next step reads.
    let padded: &[(u32, u32)] = &[(65, 63), (137, 129), (203, 75)];
    // The tail reads its own padding at the third level that it reads, where that is 3 texels wide.
    let long: &[(u32, u32)] = &[(1100, 9)];
    let (all, four, six) = (StoredLevels::ALL, StoredLevels::only(4), StoredLevels::only(6));
    let faults = [
        (
            BLOCKS,
            "if block.x < step.end.x && block.y < step.end.y && (step.base == 0u
                || block.x * BLOCK < pyramid.levels[step.source].width) {",
            ("padding dropped", all, padded),
        ),
        (
            "end.x = select(end.x, (all + VECTOR_MASK) & ~VECTOR_MASK, end.x >= all);",
            "",
            ("padding of the tail dropped", all, long),
        ),
        (
            BLOCKS,
            "if block.x + select(1u, 0u, step.base == 0u) < step.end.x && block.y < step.end.y {",
            ("one column short", all, padded),
        ),
        (
            BLOCKS,
            "if block.x < step.end.x && block.y + select(1u, 0u, step.base == 0u) < step.end.y {",
            ("one row short", all, padded),
        ),
        (
            TEXELS,
            "if at.x + select(1u, 0u, step.base == 0u) < step.end.x && at.y < step.end.y {",
            ("one texel of a coarse level short", four, padded),
        ),
        (
            "let block = first_block() + place;",
            "let block = place;",
            ("the rectangle at the corner", all, padded),
        ),
        (
            "let texel = first_block() + group.xy;",
            "let texel = group.xy;",
            ("the same of shared texels", six, padded),
        ),
    ];
    for (what, by, (name, levels, sizes)) in faults {
        let faulty = Engine::with_planted_faults(None, &[(what, by)]).unwrap();
        assert!(differing(&faulty, sizes, &[levels]) > 0, "{name}");
    }
}

/// A near sphere, and one behind what the tests put into the image.
fn two_spheres(engine: &Engine) -> Arc<Instances> {
    let (centers, radii) = ([0.0, 0.0, 2.0, 0.0, 0.0, 20.0], [0.2, 0.2]);
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    engine.instances(&bounds, &InstanceOptions::default()).unwrap()
}

struct Scene<'a> {
    engine: &'a Engine,
    camera: Camera,
    pyramid: Arc<Pyramid>,
    crowd: Arc<Instances>,
}

impl<'a> Scene<'a> {
    fn new(engine: &'a Engine, atlas: AtlasUse) -> Self {
        let camera = camera_along_z(32, 32, DepthConvention::Standard);
        let options = PyramidOptions { atlas, ..PyramidOptions::default() };
        let pyramid = Arc::new(engine.context().create_pyramid(camera.size(), &options).unwrap());
        Self { engine, camera, pyramid, crowd: two_spheres(engine) }
    }

    fn reduce(&self, depth: &Changing<'_>) -> wgpu::CommandBuffer {
        let mut commands = encoder(self.engine.device());
        let (camera, pyramid) = (&self.camera, &self.pyramid);
        self.engine
            .context()
            .record_reduce(&mut commands, depth.source(), camera, pyramid)
            .unwrap();
        commands.finish()
    }

    fn region(&self, depth: &Changing<'_>) -> wgpu::CommandBuffer {
        let mut commands = encoder(self.engine.device());
        let context = self.engine.context();
        context
            .record_reduce_region(&mut commands, depth.source(), [8, 8, 23, 23], &self.pyramid)
            .unwrap();
        commands.finish()
    }

    fn mask(&self) -> Vec<bool> {
        let (options, outputs) = (CullOptions::default(), Outputs::default());
        let Self { engine, camera, pyramid, crowd } = self;
        engine.cull(crowd, camera, pyramid, &options, &outputs).unwrap().mask().unwrap()
    }
}

/// An image that is empty, and one with a wall at a depth of 4 in its middle.
fn walls(engine: &Engine) -> Changing<'_> {
    Changing::new(engine, Kind::Whole, ImageSize::new(32, 32), vec![1.0; 32 * 32])
}

fn build_wall(depth: &mut Changing<'_>) {
    for y in 8..24 {
        depth.depth[y * 32 + 8..y * 32 + 24].fill(ndc(4.0, DepthConvention::Standard));
    }
    depth.write([8, 8, 23, 23]);
}

fn open_gap(depth: &mut Changing<'_>) {
    depth.depth[16 * 32 + 16] = 1.0;
    depth.write([16, 16, 16, 16]);
}

/// A region on top of a reduction that never ran, or of one that came later, keeps everything.
fn out_of_order(engine: &Engine, atlas: AtlasUse) -> Vec<Vec<bool>> {
    let mut found = Vec::new();
    let mut depth = walls(engine);
    let scene = Scene::new(engine, atlas);
    let submit = |commands| {
        engine.queue().submit([commands]);
    };
    submit(scene.reduce(&depth));
    found.push(scene.mask());
    build_wall(&mut depth);
    submit(scene.region(&depth));
    // 1: what the wall hides is hidden.
    found.push(scene.mask());
    open_gap(&mut depth);
    submit(scene.region(&depth));
    // 2: the gap shows it.
    found.push(scene.mask());
    depth.write([8, 8, 23, 23]);
    build_wall(&mut depth);
    drop(scene.region(&depth));
    submit(scene.region(&depth));
    // 3: a region was dropped.
    found.push(scene.mask());
    submit(scene.region(&depth));
    // 4: one more does not mend that.
    found.push(scene.mask());
    submit(scene.reduce(&depth));
    // 5: a full reduction does.
    found.push(scene.mask());
    let (early, late) = (scene.region(&depth), scene.region(&depth));
    submit(late);
    submit(early);
    // 6: two regions in the wrong order.
    found.push(scene.mask());
    found
}

const KEPT: [bool; 2] = [true, true];
const HIDDEN: [bool; 2] = [true, false];
const IN_ORDER: [[bool; 2]; 7] = [KEPT, HIDDEN, KEPT, KEPT, KEPT, HIDDEN, KEPT];

#[test]
fn culls_keep_everything_until_a_full_reduction_where_a_region_was_lost() {
    let engine = engine();
    for atlas in [AtlasUse::Never, AtlasUse::Always] {
        assert_eq!(out_of_order(&engine, atlas), IN_ORDER, "{atlas:?}");
    }
}

#[test]
fn planted_faults_of_the_header_show() {
    for (what, by) in [
        ("step.base == 0u || chunk_0[0].x == step.base", "true"),
        (
            "select(0u, step.reduction, follows)",
            "select(step.base, step.reduction, step.base == 0u)",
        ),
    ] {
        let faulty = Engine::with_planted_faults(None, &[(what, by)]).unwrap();
        assert_ne!(out_of_order(&faulty, AtlasUse::Never), IN_ORDER, "{what:?}");
    }
}

/// Regions make nothing anew after the first of them, as frames do.
#[test]
fn regions_make_nothing_anew() {
    let engine = engine();
    let context = engine.context();
    let depth = walls(&engine);
    let scene = Scene::new(&engine, AtlasUse::Never);
    engine.queue().submit([scene.reduce(&depth)]);
    engine.queue().submit([scene.region(&depth)]);
    engine.wait().unwrap();
    let before = context.made();
    for _ in 0..8 {
        engine.queue().submit([scene.region(&depth)]);
        engine.wait().unwrap();
    }
    assert_eq!(context.made(), before);
}
