//! The reduction: the passes that fill a pyramid from a depth image.
//!
//! Each pass reads one level, and writes up to three coarser ones, or all of the rest.
//! The passes follow AMD's Single Pass Downsampler (SPD, 2020).
//! `shaders/pyramid/reduce.wgsl` says where they differ from it.
//! Levels that the host has made with the image are copied instead (`host_levels`).

use std::sync::atomic::Ordering;

use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{File, Source, wgsl};
use crate::gpu::stage_times::stage_pass;
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::pyramid::blocks::Blocks;
use crate::pyramid::built::Built;
use crate::pyramid::ends::Depths;
use crate::pyramid::host_levels::Copied;
use crate::pyramid::layout::Step;
use crate::pyramid::numbering::next_number;
use crate::pyramid::source::{DepthSource, Part, Sampling};
use crate::pyramid::steps::{Recording, STEP_BINDINGS, Staged, Steps};
use crate::pyramid::{BoundSource, Pyramid};

/// The bindings of the depth image and the pyramid.
fn bindings(source: SourceKind) -> Vec<(u32, Binding)> {
    use Binding::{Depth, Sampler, Uniform, Write};
    let one = [(0, Depth(source)), (1, Sampler), (2, Uniform), (3, Write), (4, Write), (5, Write)];
    let nearest = (source == SourceKind::Pair).then_some((7, Depth(source)));
    one.into_iter().chain(nearest).collect()
}

/// Which shader and entry point make a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    /// `shaders/pyramid/reduce.wgsl`, `reduce`.
    /// `first` is the first stored level, counted from the level that is read.
    Blocks { from_source: bool, first: u32 },
    /// `shaders/pyramid/reduce.wgsl`, `reduce_tail`, which makes all remaining levels.
    Tail,
    /// `shaders/pyramid/reduce_coarse.wgsl`; if `shared`, a whole workgroup makes each texel.
    /// `by_two_rows`: see there.
    Coarse { shared: bool, by_two_rows: bool },
}

/// The ends that the reduction makes: one, of farthest depths, or both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EndFiles {
    One,
    Both,
}

impl EndFiles {
    fn of(depths: Depths) -> Self {
        if depths.count() > 1 { Self::Both } else { Self::One }
    }

    fn files(self) -> &'static [File] {
        match self {
            Self::One => &[wgsl!("gpu/ends_one"), wgsl!("pyramid/store_one")],
            Self::Both => &[wgsl!("gpu/ends_both"), wgsl!("pyramid/store_both")],
        }
    }
}

fn reduce_module(source: SourceKind, ends: EndFiles, entry: File) -> Source {
    Source::of(&[
        &[wgsl!("gpu/depth_bits")],
        source.files(),
        source.quad_files(),
        ends.files(),
        &[wgsl!("pyramid/pyramid"), wgsl!("pyramid/pyramid_write"), entry],
    ])
}

/// The shader module of the reduction, three levels per pass.
pub(crate) fn blocks_module(source: SourceKind, ends: EndFiles) -> Source {
    reduce_module(source, ends, wgsl!("pyramid/reduce"))
}

/// The shader module of the reduction to one coarse level.
pub(crate) fn coarse_module(source: SourceKind, ends: EndFiles) -> Source {
    reduce_module(source, ends, wgsl!("pyramid/reduce_coarse"))
}

/// `tall`: neighbouring invocations read below each other; `region`: not all blocks are read.
///
/// Nearest depths alone are the farthest in the other convention, invalid pixels included.
fn reduce_pipeline(
    gpu: &Gpu,
    source: SourceKind,
    shape: Shape,
    (reversed, depths, chunks): (bool, Depths, usize),
    (tall, region): (bool, bool),
) -> Result<wgpu::ComputePipeline> {
    let mut constants = vec![
        ("REVERSED", flag(reversed == depths.has_farthest())),
        ("RECEIVERS", flag(depths.of_receivers())),
        ("CHUNKS", chunks as f64),
        ("TALL", flag(tall)),
        ("REGION", flag(region)),
    ];
    let ends = EndFiles::of(depths);
    let (module, entry_point) = match shape {
        Shape::Blocks { from_source, first } => {
            constants.extend([("FROM_SOURCE", flag(from_source)), ("FIRST", f64::from(first))]);
            (blocks_module(source, ends), "reduce")
        }
        Shape::Tail => {
            constants.extend([("FROM_SOURCE", flag(false)), ("FIRST", 1.0)]);
            (blocks_module(source, ends), "reduce_tail")
        }
        Shape::Coarse { shared, by_two_rows } => {
            constants.extend([("SHARED", flag(shared)), ("BY_TWO_ROWS", flag(by_two_rows))]);
            (coarse_module(source, ends), "reduce_coarse")
        }
    };
    gpu.compute_pipeline(&Compute {
        label: "hiz.reduce.pipeline",
        source: module,
        entry_point,
        layouts: &[
            gpu.layout("hiz.reduce.layout", &bindings(source))?,
            gpu.layout("hiz.reduce.step_layout", STEP_BINDINGS)?,
        ],
        constants: &constants,
    })
}

/// Invocations per workgroup of the reduction, in one row.
/// The shader's side is `place_of` in `shaders/pyramid/pyramid_write.wgsl`.
pub(crate) const REDUCE_WORKGROUP: u32 = 64;
/// The side of the square that a workgroup forms instead if `TALL` is set.
pub(crate) const TALL_SIDE: u32 = 8;
/// Pixels of 4 KiB, a page, at 4 bytes per pixel.
const PAGE_PIXELS: u32 = 1024;
/// The finest level whose texels are shared by a workgroup if it is made alone.
/// Each invocation then reads at least 8x8 pixels.
pub(crate) const SHARED_LEVEL: u32 = 6;
/// The finest level that is made of two rows of blocks at a time if it is made alone;
/// `shaders/pyramid/reduce_coarse.wgsl` says why.
const TWO_ROWS_LEVEL: u32 = 14;

/// A reduction whose pipelines and bindings are made.
pub(super) struct Prepared {
    source: wgpu::BindGroup,
    /// The pipeline and the workgroups of each step.
    dispatches: Vec<(wgpu::ComputePipeline, [u32; 2])>,
    built: Built,
}

impl Prepared {
    /// Makes what the reduction `number` needs, which reads these blocks in each step.
    /// `region`: they need not be all of them.
    pub(super) fn new(
        gpu: &Gpu,
        (part, camera, number): (Part, Camera, u32),
        (blocks, region): (&[Blocks], bool),
        pyramid: &Pyramid,
    ) -> Result<Self> {
        let kind = part.kind;
        let (source, view, nearest) = source_bindings(gpu, &part, pyramid)?;
        let built = Built {
            reduction: number,
            source: view,
            nearest,
            part,
            camera,
            in_place: None,
            owner: None,
        };
        let dispatch = |(step, blocks): (&Step, &Blocks)| {
            let tall = step.source == 0 && reads_tall(step, kind, pyramid.size());
            let (shape, workgroups) = shape_of(step, blocks.size(), tall);
            let reversed = built.camera.convention().is_reversed();
            let constants = (reversed, pyramid.depths(), pyramid.chunks.len());
            let pipeline = reduce_pipeline(gpu, kind, shape, constants, (tall, region))?;
            Ok((pipeline, workgroups))
        };
        let dispatches =
            pyramid.layout.steps.iter().zip(blocks).map(dispatch).collect::<Result<_>>()?;
        Ok(Self { source, dispatches, built })
    }

    /// Makes what the reduction `number` of all of an image needs.
    fn of_all(
        gpu: &Gpu,
        part: Part,
        camera: &Camera,
        pyramid: &Pyramid,
        number: u32,
    ) -> Result<Self> {
        let blocks: Vec<_> = pyramid.layout.steps.iter().map(Blocks::all).collect();
        Self::new(gpu, (part, camera.clone(), number), (&blocks, false), pyramid)
    }

    /// Records the pass.
    /// `workgroups` says how many of those of a step there are.
    pub(super) fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        steps: &Steps,
        workgroups: impl Fn([u32; 2]) -> [u32; 2],
    ) {
        let mut pass = stage_pass(encoder, "hiz.reduce.pass", "reduce");
        pass.set_bind_group(0, &self.source, &[]);
        for ((pipeline, of_step), step) in self.dispatches.iter().zip(&steps.bindings) {
            let [columns, rows] = workgroups(*of_step);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(1, step, &[]);
            pass.dispatch_workgroups(columns, rows, 1);
        }
    }
}

/// Checks the arguments of [`record_reduce`]; returns the image that is reduced.
fn checked(gpu: &Gpu, depth: &DepthSource<'_>, camera: &Camera, pyramid: &Pyramid) -> Result<Part> {
    gpu.check_context("pyramid", pyramid.context)?;
    let size = pyramid.size();
    let part = Part::new(depth, Sampling::Single, (size, "pyramid"), pyramid.depths())?;
    if size != camera.size() {
        return Err(Error::mismatch(
            "camera",
            format!("expected the depth image's size {size}, got {}", camera.size()),
        ));
    }
    Ok(part)
}

/// Records the reduction of `depth` into `pyramid`.
///
/// # Errors
/// As [`HizContext::record_reduce`](crate::HizContext::record_reduce).
pub(crate) fn record_reduce(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthSource<'_>,
    camera: &Camera,
    pyramid: &Pyramid,
) -> Result<()> {
    // Everything that can fail comes before the first command is recorded.
    let part = checked(gpu, depth, camera, pyramid)?;
    let levels = depth.levels.and_then(|levels| {
        levels.for_pyramid(&part.subresource.texture, camera.convention(), &pyramid.layout)
    });
    let bring_image = |encoder: &mut wgpu::CommandEncoder| {
        gpu.recorded(|| {
            depth.levels.inspect(|levels| levels.record_image(encoder));
            Ok(())
        })
    };
    if let Some(levels) = levels {
        if levels.in_place.is_none() {
            bring_image(encoder)?;
        }
        return record_copies(gpu, encoder, (part, camera), pyramid, &levels);
    }
    let reduction = next_number();
    let prepared = Prepared::of_all(gpu, part, camera, pyramid, reduction)?;
    let numbers = Recording { reduction, base: 0, origin: prepared.built.part.origin };
    let staged = Steps::numbers(gpu, &pyramid.layout.steps, &numbers)?;
    bring_image(encoder)?;
    let header = Some(&pyramid.chunks[0]);
    finish(gpu, encoder, pyramid, prepared, (&pyramid.steps, staged, header))
}

/// Records the copies of levels that the host has made, as the reduction of `part`.
///
/// The pyramid has the number of the drawing then.
fn record_copies(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    (part, camera): (Part, &Camera),
    pyramid: &Pyramid,
    levels: &Copied<'_>,
) -> Result<()> {
    let (_, source, nearest) = source_bindings(gpu, &part, pyramid)?;
    gpu.recorded(|| {
        levels.record(encoder, &pyramid.chunks[0]);
        Ok(())
    })?;
    let (camera, reduction, in_place) = (camera.clone(), levels.number, levels.in_place.clone());
    let built = Built { reduction, source, nearest, part, camera, in_place, owner: None };
    note(encoder, pyramid, built);
    #[cfg(feature = "testing")]
    pyramid.are_copied.store(true, Ordering::Relaxed);
    Ok(())
}

/// Notes what a pyramid is built from, by commands that are recorded.
fn note(encoder: &wgpu::CommandEncoder, pyramid: &Pyramid, built: Built) {
    #[cfg(feature = "testing")]
    pyramid.are_copied.store(false, Ordering::Relaxed);
    let (reduced, reduction) = (pyramid.reduced(), built.reduction);
    encoder.on_submitted_work_done(move || reduced.store(reduction, Ordering::Release));
    pyramid.set_built(built);
}

/// Records a reduction that is prepared, and notes what the pyramid is built from.
pub(super) fn finish(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    pyramid: &Pyramid,
    prepared: Prepared,
    (steps, staged, header): (&Steps, Staged, Option<&wgpu::Buffer>),
) -> Result<()> {
    gpu.recorded(|| {
        steps.record(encoder, staged, header);
        // At least one workgroup, which writes the header of a part even if nothing is stored.
        prepared.record(encoder, steps, |workgroups| workgroups.map(|n| n.max(1)));
        Ok(())
    })?;
    note(encoder, pyramid, prepared.built);
    Ok(())
}

/// Records a reduction without workgroups, which reduces nothing but makes what one needs.
/// Returns what the pyramid would be built from, with a number that no reduction has.
///
/// # Errors
/// As [`record_reduce`].
pub(crate) fn record_idle_reduce(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthSource<'_>,
    camera: &Camera,
    pyramid: &Pyramid,
) -> Result<Built> {
    let part = checked(gpu, depth, camera, pyramid)?;
    let prepared = Prepared::of_all(gpu, part, camera, pyramid, 0)?;
    gpu.recorded(|| {
        prepared.record(encoder, &pyramid.steps, |_| [0, 0]);
        Ok(())
    })?;
    Ok(prepared.built)
}

/// The bind group of the reduction and the view of the depth image that it binds, kept from an
/// earlier reduction of the same image if there was one.
fn source_bindings(gpu: &Gpu, part: &Part, pyramid: &Pyramid) -> Result<BoundSource> {
    let key = (part.subresource.clone(), part.nearest.clone(), part.kind);
    let Some(kept) = pyramid.sources.find(&key) else {
        let bound = bind_source(gpu, part, pyramid).map_err(refused)?;
        return pyramid.sources.get(key, || Ok(bound));
    };
    // A bind group does not tell that a texture was destroyed since, but a new view does.
    for texture in [&part.subresource.texture].into_iter().chain(&part.nearest) {
        gpu.view(texture).map_err(refused)?;
    }
    Ok(kept)
}

/// The error for a depth image that wgpu refuses.
pub(super) fn refused(error: Error) -> Error {
    match error {
        Error::Device(why) => Error::mismatch(
            "depth",
            format!(
                "expected a texture of this device and context that has not been destroyed, but \
                 {why}"
            ),
        ),
        other => other,
    }
}

/// The bind group of the reduction, and the view of the depth image that it binds.
fn bind_source(gpu: &Gpu, part: &Part, pyramid: &Pyramid) -> Result<BoundSource> {
    let layout = gpu.layout("hiz.reduce.layout", &bindings(part.kind))?;
    let chunks = [pyramid.chunk(gpu, 0)?, pyramid.chunk(gpu, 1)?, pyramid.chunk(gpu, 2)?];
    let view = part.subresource.view(gpu)?;
    let nearest = part.nearest.as_ref().map(|texture| {
        gpu.check_owned(texture)?;
        gpu.view(texture)
    });
    let nearest = nearest.transpose()?;
    let mut entries = vec![
        entry(0, wgpu::BindingResource::TextureView(&view)),
        entry(1, wgpu::BindingResource::Sampler(gpu.sampler())),
        entry(2, pyramid.uniform.as_entire_binding()),
        entry(3, chunks[0].as_entire_binding()),
        entry(4, chunks[1].as_entire_binding()),
        entry(5, chunks[2].as_entire_binding()),
    ];
    entries.extend(nearest.as_ref().map(|n| entry(7, wgpu::BindingResource::TextureView(n))));
    let bound = gpu.bind_group("hiz.reduce.pyramid", &layout, &entries)?;
    Ok((bound, view, nearest))
}

/// The shader of a step, and its workgroups for so many columns and rows of blocks.
fn shape_of(step: &Step, blocks: [u32; 2], tall: bool) -> (Shape, [u32; 2]) {
    let [columns, rows] = blocks;
    let of_places = if tall {
        blocks.map(|n| n.div_ceil(TALL_SIDE))
    } else {
        [columns.div_ceil(REDUCE_WORKGROUP), rows]
    };
    if step.is_tail() {
        (Shape::Tail, [1, 1])
    } else if !step.is_coarse() {
        let (from_source, first) = (step.source == 0, step.first - step.source);
        (Shape::Blocks { from_source, first }, of_places)
    } else if step.last < SHARED_LEVEL {
        (Shape::Coarse { shared: false, by_two_rows: false }, of_places)
    } else {
        let by_two_rows = step.last >= TWO_ROWS_LEVEL;
        (Shape::Coarse { shared: true, by_two_rows }, [columns, rows])
    }
}

/// Whether neighbouring invocations of a step that reads the depth image read below each other.
///
/// Two cases gain nothing (`docs/performance.md`):
///
/// - Images with four pixels per texel, except in coarse steps.
/// - Rows that begin at multiples of a page, which would all fall into the same lines of a cache.
fn reads_tall(step: &Step, source: SourceKind, size: ImageSize) -> bool {
    (!source.is_packed() || step.is_coarse()) && !size.width.is_multiple_of(PAGE_PIXELS)
}
