//! The depth pyramid: its storage, and the pass that fills it.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use crate::atlas::{self, Atlas, AtlasUse};
use crate::camera::{Camera, ImageSize};
use crate::cull::ViewUniform;
use crate::error::{Error, Result};
use crate::gpu::{ContextId, Gpu, ReduceKey, ReduceShape, StandIn};
use crate::layout::{Level, MAX_LEVELS, PYRAMID_CHUNKS, PyramidLayout, Step, StoredLevels};
use crate::shader::{DepthStore, SourceKind};
use crate::tolerance::DepthTolerance;

/// Invocations of a workgroup of the reduction, all in a row; `shaders/shared/pyramid_write.wgsl`,
/// `place_of`.
const REDUCE_WORKGROUP: u32 = 64;
/// Or the side of a square of them, `TALL`.
const TALL_SIDE: u32 = 8;
/// Pixels of 4 KiB.
const PAGE_PIXELS: u32 = 1024;
/// From this level on a workgroup shares one texel, if it is made alone: 8x8 pixels an invocation.
const SHARED_LEVEL: u32 = 6;

/// `shaders/shared/pyramid.wgsl`, `Pyramid`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PyramidUniform {
    pub(crate) levels: [Level; MAX_LEVELS],
    pub(crate) origins: [[u32; 4]; MAX_LEVELS],
    pub(crate) chunk_shift: u32,
    pub(crate) first_stored: u32,
    pub(crate) last_stored: u32,
    pub(crate) padding: u32,
}

const _: () = assert!(size_of::<PyramidUniform>() == 528);

/// `shaders/reduce.wgsl`, `Step`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct StepUniform {
    pub(crate) source: u32,
    pub(crate) last: u32,
    pub(crate) reduction: u32,
    pub(crate) padding: u32,
    pub(crate) blocks: [u32; 2],
    pub(crate) padding_1: [u32; 2],
}

const _: () = assert!(size_of::<StepUniform>() == 32);

/// How a pyramid is stored.
#[derive(Debug, Clone, Default)]
pub struct PyramidOptions {
    /// Which levels are stored: all, if nothing else is asked for.
    pub levels: StoredLevels,
    /// Texels of one chunk as a power of two; `None`: what one storage binding of the device holds.
    /// Tests make it small.
    pub chunk_shift: Option<u32>,
    /// Whether culls read all levels from one texture.
    pub atlas: AtlasUse,
}

/// A depth pyramid on the device: for every level, the farthest depth of each block of pixels.
///
/// Level 0 is the depth texture itself, which the pyramid keeps alive but does not copy: **do not
/// write to that texture between the reduction and the culls that use it**.
#[derive(Debug)]
pub struct Pyramid {
    pub(crate) context: ContextId,
    pub(crate) layout: PyramidLayout,
    pub(crate) chunks: Vec<wgpu::Buffer>,
    pub(crate) uniform: wgpu::Buffer,
    built: Mutex<Option<Built>>,
    atlas_use: AtlasUse,
    /// There was no memory for one.
    no_atlas: AtomicBool,
    atlas: Mutex<Option<Atlas>>,
    /// The last reduction that is known to have run: what was only recorded may never do so.
    reduced: Arc<AtomicU32>,
    /// The last bindings of culls, of instances and of groups: many culls see the same view.
    bindings: Mutex<Vec<(BindingsKey, wgpu::BindGroup)>>,
}

/// Where a cull reads depth, and the words of its view (`ViewUniform`), which name the reduction.
pub(crate) type BindingsKey = (DepthStore, [u32; size_of::<ViewUniform>() / 4]);

/// How many bindings are kept.
const KEPT_BINDINGS: usize = 4;

/// What a pyramid was last built from.
#[derive(Debug, Clone)]
pub(crate) struct Built {
    /// The number of the reduction, which stands in the pyramid's header once it has run.
    pub(crate) reduction: u32,
    pub(crate) source: wgpu::TextureView,
    pub(crate) source_kind: SourceKind,
    pub(crate) camera: Camera,
    /// What the image's depths have been rounded by, for every cull to count.
    pub(crate) tolerance: DepthTolerance,
}

impl Pyramid {
    pub(crate) fn new(gpu: &Gpu, size: ImageSize, options: &PyramidOptions) -> Result<Self> {
        let side = size.width.max(size.height);
        let allowed = gpu.limits().max_texture_dimension_2d;
        if side > allowed {
            return Err(Error::limit(
                "max_texture_dimension_2d",
                u64::from(side),
                u64::from(allowed),
            ));
        }
        if side == 0 || size.width.min(size.height) == 0 {
            return Err(Error::invalid(
                "size",
                format!("expected at least one pixel a side, got {size}"),
            ));
        }
        let most = crate::layout::chunk_shift(gpu.limits());
        let chunk_shift = options.chunk_shift.unwrap_or(most);
        if !(2..=most).contains(&chunk_shift) {
            return Err(Error::invalid(
                "chunk_shift",
                format!("expected 2 to {most}, got {chunk_shift}"),
            ));
        }
        let layout = PyramidLayout::new(size, options.levels, chunk_shift)?;
        let chunks = layout
            .chunk_sizes()
            .iter()
            .map(|texels| {
                let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
                gpu.empty("hiz.pyramid.chunk", texels * 4, usage)
            })
            .collect::<Result<_>>()?;
        let mut levels = [Level { offset: 0, stride: 0, width: 0, height: 0 }; MAX_LEVELS];
        levels[..layout.levels.len()].copy_from_slice(&layout.levels);
        let (StoredLevels { first, last }, origins) = (layout.stored, layout.atlas.origins);
        let uniform = gpu.uniform(
            "hiz.pyramid.layout",
            &PyramidUniform {
                levels,
                origins,
                chunk_shift,
                first_stored: first,
                last_stored: last,
                padding: 0,
            },
        )?;
        Ok(Self {
            context: gpu.id(),
            layout,
            chunks,
            uniform,
            built: Mutex::new(None),
            atlas_use: options.atlas,
            no_atlas: AtomicBool::new(false),
            atlas: Mutex::new(None),
            reduced: Arc::default(),
            bindings: Mutex::new(Vec::new()),
        })
    }

    /// The depth image's size.
    pub fn size(&self) -> ImageSize {
        self.layout.size
    }

    /// The number of levels, down to 1x1, level 0 included.
    pub fn num_levels(&self) -> u32 {
        self.layout.num_levels()
    }

    /// Which levels above 0 are stored, cut to those that there are; nothing for an image of one
    /// pixel.
    pub fn stored_levels(&self) -> Option<StoredLevels> {
        let stored = self.layout.stored;
        (stored.first <= stored.last).then_some(stored)
    }

    /// The size of a level, or nothing past the last.
    pub fn level_size(&self, level: u32) -> Option<ImageSize> {
        self.layout.levels.get(level as usize).map(|l| ImageSize::new(l.width, l.height))
    }

    /// Bytes on the device, the depth texture not counted.
    pub fn device_bytes(&self) -> u64 {
        let atlas = self.atlas.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let atlas = atlas.as_ref().map_or(0, Atlas::bytes);
        self.chunks.iter().map(wgpu::Buffer::size).sum::<u64>() + atlas
    }

    /// The bindings of this key, made where they are not among the last ones.
    pub(crate) fn bindings(
        &self,
        key: BindingsKey,
        make: impl FnOnce() -> Result<wgpu::BindGroup>,
    ) -> Result<wgpu::BindGroup> {
        let mut kept = self.bindings.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, bindings)) = kept.iter().find(|(k, _)| *k == key) {
            return Ok(bindings.clone());
        }
        let bindings = make()?;
        if kept.len() == KEPT_BINDINGS {
            kept.remove(0);
        }
        kept.push((key, bindings.clone()));
        Ok(bindings)
    }

    /// Whether culls of so many instances against `built` (no later reduction, of what may be
    /// another kind of image) read an atlas: where it can be, and pays.
    pub(crate) fn wants_atlas(&self, gpu: &Gpu, built: &Built, instances: u32) -> bool {
        self.atlas_use.pays(&self.layout, instances)
            && !self.no_atlas.load(Ordering::Relaxed)
            && atlas::is_possible(&self.layout, built.source.texture(), gpu.limits())
    }

    /// Something failed on the device: nothing that was made for culls is kept.
    /// Whether an atlas was among it.
    pub(crate) fn forget(&self) -> bool {
        self.bindings.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clear();
        self.atlas.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take().is_some()
    }

    /// There is no memory for an atlas: culls read the depth image and the levels where they are
    /// from now on.
    pub(crate) fn do_without_atlas(&self) {
        self.no_atlas.store(true, Ordering::Relaxed);
    }

    /// The atlas of what the pyramid was built from; its copies are recorded if they are not known
    /// to have run, behind that reduction.
    /// `None` where there is no memory for it, now and from now on.
    pub(crate) fn record_atlas(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        built: &Built,
    ) -> Result<Option<wgpu::TextureView>> {
        let mut kept = self.atlas.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let made = match kept.take() {
            Some(there) => Ok(there),
            None => Atlas::new(gpu, &self.layout),
        };
        let recorded = made.and_then(|mut atlas| {
            if !atlas.holds(built.reduction) {
                atlas.record(gpu, encoder, &self.layout, &self.chunks[0], built)?;
                self.note_copies(encoder, &atlas, built.reduction);
            }
            Ok(atlas)
        });
        let error = match recorded {
            Ok(atlas) => return Ok(Some(kept.insert(atlas).view())),
            Err(error) => error,
        };
        // They may hold the one that is gone.
        self.bindings.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clear();
        if matches!(error, Error::OutOfMemory(_)) {
            self.do_without_atlas();
            return Ok(None);
        }
        Err(error)
    }

    /// Once the copies into an atlas have run it is known what it holds.
    fn note_copies(&self, encoder: &wgpu::CommandEncoder, atlas: &Atlas, reduction: u32) {
        let (contents, reduced) = (atlas.contents(), Arc::clone(&self.reduced));
        encoder.on_submitted_work_done(move || {
            // Copies that ran before their reduction, or after the next one, have spoiled what was
            // there.
            let ran_behind_it = reduced.load(Ordering::Acquire) == reduction;
            contents.store(if ran_behind_it { reduction } else { 0 }, Ordering::Release);
        });
    }

    /// The camera of the depth image that the pyramid was last built from.
    pub fn camera(&self) -> Option<Camera> {
        self.built().map(|b| b.camera)
    }

    /// How far the depths that the pyramid was last built from may lie from those that were stored,
    /// by the format of the image ([`DepthTolerance::of`]) or by what was uploaded into it.
    /// Every cull counts it, beside the slack of its options.
    pub fn tolerance(&self) -> Option<DepthTolerance> {
        self.built().map(|b| b.tolerance)
    }

    /// Whether the depth image that `built` was made of is still there: a cull would bind it, and
    /// what was destroyed ends the caller's encoder.
    pub(crate) fn check_source(gpu: &Gpu, built: &Built) -> Result<()> {
        gpu.view(built.source.texture()).map(drop).map_err(|error| match error {
            Error::Device(why) => Error::mismatch(
                "pyramid",
                format!("expected one whose depth image has not been destroyed since it was reduced, but {why}"),
            ),
            other => other,
        })
    }

    /// Chunk `i`, or what stands in for it.
    pub(crate) fn chunk<'a>(&'a self, gpu: &'a Gpu, i: usize) -> &'a wgpu::Buffer {
        self.chunks
            .get(i)
            .unwrap_or_else(|| gpu.stand_in(if i == 1 { StandIn::Chunk1 } else { StandIn::Chunk2 }))
    }

    pub(crate) fn built(&self) -> Option<Built> {
        self.built.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
    }

    /// The built state for a cull with `camera`, or why there is none.
    pub(crate) fn built_for(&self, camera: &Camera) -> Result<Built> {
        let built = self.built().ok_or_else(|| {
            Error::mismatch(
                "pyramid",
                "expected one that was built from a depth image, got one that never was",
            )
        })?;
        if built.camera == *camera {
            return Ok(built);
        }
        let (theirs, ours) = (built.camera.size(), camera.size());
        Err(Error::mismatch(
            "camera",
            if theirs == ours {
                "expected the camera of the pyramid's depth image, got another one".to_owned()
            } else {
                format!(
                    "expected the camera of the pyramid's depth image, size {theirs}, got one of size {ours}"
                )
            },
        ))
    }
}

/// Records the reduction of `depth` (all of its texture's first mip level) into `pyramid`.
/// `uploaded` is what its depths were rounded by before they came into the texture.
pub(crate) fn record_reduce(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &wgpu::TextureView,
    camera: &Camera,
    pyramid: &Pyramid,
    uploaded: DepthTolerance,
) -> Result<()> {
    gpu.check_context("pyramid", pyramid.context)?;
    let texture = depth.texture();
    let format = texture.format();
    let (Some(source_kind), Some(of_format)) = (SourceKind::of(format), DepthTolerance::of(format))
    else {
        return Err(Error::invalid(
            "depth",
            format!(
                "expected a depth format, R32Float, R16Float or Rgba32Uint (the bits of four pixels), got {format:?}"
            ),
        ));
    };
    let (size, texels) = (pyramid.size(), ImageSize::new(texture.width(), texture.height()));
    let expected = source_kind.texture_size(size);
    if texels != expected {
        let packed = if expected == size {
            String::new()
        } else {
            format!(" as {expected} texels of four pixels")
        };
        return Err(Error::mismatch(
            "depth",
            format!("expected the pyramid's size {size}{packed}, got {texels}"),
        ));
    }
    if size != camera.size() {
        return Err(Error::mismatch(
            "camera",
            format!("expected the depth image's size {size}, got {}", camera.size()),
        ));
    }
    // A view does not say which part of its texture it shows, so there must be one part only.
    let parts =
        (texture.mip_level_count(), texture.sample_count(), texture.depth_or_array_layers());
    if parts != (1, 1, 1) || texture.dimension() != wgpu::TextureDimension::D2 {
        return Err(Error::invalid(
            "depth",
            format!(
                "expected a 2D texture of one mip level, sample and layer, got {:?} with {} mip levels, {} samples, {} layers",
                texture.dimension(),
                parts.0,
                parts.1,
                parts.2
            ),
        ));
    }
    let needed = source_kind.usage();
    if !texture.usage().contains(needed) {
        let name =
            if source_kind == SourceKind::Bits { "STORAGE_BINDING" } else { "TEXTURE_BINDING" };
        return Err(Error::invalid(
            "depth",
            format!("expected the usage {name}, got {:?}", texture.usage()),
        ));
    }
    let (source, view) = bind_source(gpu, depth, source_kind, pyramid)?;
    // Everything is there before anything is recorded.
    let reduction = next_reduction();
    let dispatch = |step: &Step| {
        let tall = step.source == 0 && reads_tall(step, source_kind, size);
        let (shape, workgroups) = shape_of(step, tall);
        let pipeline = gpu.reduce_pipeline(ReduceKey {
            source: source_kind,
            reversed: camera.convention().is_reversed(),
            chunks: pyramid.chunks.len(),
            tall,
            shape,
        })?;
        let uniform = gpu.uniform("hiz.reduce.step", &step_uniform(step, reduction))?;
        let entries = [entry(0, uniform.as_entire_binding())];
        Ok((
            pipeline,
            gpu.bind_group("hiz.reduce.step", &gpu.layouts().one_uniform, &entries)?,
            workgroups,
        ))
    };
    let dispatches = pyramid.layout.steps.iter().map(dispatch).collect::<Result<Vec<_>>>()?;
    gpu.recorded(|| {
        let descriptor =
            wgpu::ComputePassDescriptor { label: Some("hiz.reduce.pass"), timestamp_writes: None };
        let mut pass = encoder.begin_compute_pass(&descriptor);
        pass.set_bind_group(0, &source, &[]);
        for (pipeline, bind_group, [columns, rows]) in &dispatches {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(1, bind_group, &[]);
            // One at least, for the header, where nothing is stored.
            pass.dispatch_workgroups((*columns).max(1), (*rows).max(1), 1);
        }
        Ok(())
    })?;
    let reduced = Arc::clone(&pyramid.reduced);
    encoder.on_submitted_work_done(move || reduced.store(reduction, Ordering::Release));
    // They hold the last depth image.
    pyramid.bindings.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clear();
    let tolerance = of_format.after(uploaded);
    *pyramid.built.lock().unwrap_or_else(std::sync::PoisonError::into_inner) =
        Some(Built { reduction, source: view, source_kind, camera: camera.clone(), tolerance });
    Ok(())
}

/// What the reduction reads and writes; and the view of the image's depth that can be bound: the
/// caller's, or where that shows another part or use of the texture, as the default view of a
/// texture with a stencil does, the whole depth of it.
fn bind_source(
    gpu: &Gpu,
    depth: &wgpu::TextureView,
    source_kind: SourceKind,
    pyramid: &Pyramid,
) -> Result<(wgpu::BindGroup, wgpu::TextureView)> {
    let bind = |view: &wgpu::TextureView| {
        gpu.bind_group(
            "hiz.reduce.pyramid",
            gpu.layouts().reduce(source_kind),
            &[
                entry(0, wgpu::BindingResource::TextureView(view)),
                entry(1, wgpu::BindingResource::Sampler(gpu.sampler())),
                entry(2, pyramid.uniform.as_entire_binding()),
                entry(3, pyramid.chunk(gpu, 0).as_entire_binding()),
                entry(4, pyramid.chunk(gpu, 1).as_entire_binding()),
                entry(5, pyramid.chunk(gpu, 2).as_entire_binding()),
            ],
        )
    };
    let error = match bind(depth) {
        Ok(bound) => return Ok((bound, depth.clone())),
        Err(error) => error,
    };
    let refused = |error| match error {
        Error::Device(why) => Error::mismatch(
            "depth",
            format!(
                "expected a texture of this device and context that has not been destroyed, but {why}"
            ),
        ),
        other => other,
    };
    // A view of another device's texture would tell that device of its errors, whose handler may
    // end the process.
    if error.to_string().contains(OF_ANOTHER_DEVICE) {
        return Err(refused(error));
    }
    let view = gpu.view(depth.texture()).map_err(refused)?;
    Ok((bind(&view).map_err(refused)?, view))
}

/// What wgpu says of objects of another device.
const OF_ANOTHER_DEVICE: &str = "doesn't match";

/// The shader of a step, and its workgroups.
fn shape_of(step: &Step, tall: bool) -> (ReduceShape, [u32; 2]) {
    let [columns, rows] = step.blocks;
    let of_places = if tall {
        step.blocks.map(|n| n.div_ceil(TALL_SIDE))
    } else {
        [columns.div_ceil(REDUCE_WORKGROUP), rows]
    };
    if step.is_tail() {
        (ReduceShape::Tail, [1, 1])
    } else if !step.is_coarse() {
        let (from_source, first) = (step.source == 0, step.first - step.source);
        (ReduceShape::Blocks { from_source, first }, of_places)
    } else if step.last < SHARED_LEVEL {
        (ReduceShape::Coarse { shared: false }, of_places)
    } else {
        (ReduceShape::Coarse { shared: true }, [columns, rows])
    }
}

/// Whether neighbouring invocations of a step that reads the image read below each other.
/// Blocks next to each other, four pixels a texel, are loaded in a way that gains nothing; and rows
/// that begin at multiples of a page would all fall into the same lines of a cache
/// (`docs/performance.md`).
fn reads_tall(step: &Step, source: SourceKind, size: ImageSize) -> bool {
    (source != SourceKind::Bits || step.is_coarse()) && !size.width.is_multiple_of(PAGE_PIXELS)
}

fn step_uniform(step: &Step, reduction: u32) -> StepUniform {
    let reduction = if step.source == 0 { reduction } else { 0 };
    StepUniform {
        source: step.source,
        last: step.last,
        reduction,
        padding: 0,
        blocks: step.blocks,
        padding_1: [0; 2],
    }
}

/// Numbers reductions, never 0.
fn next_reduction() -> u32 {
    static NEXT: AtomicU32 = AtomicU32::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed).max(1)
}

pub(crate) fn entry(binding: u32, resource: wgpu::BindingResource<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource }
}

const _: () = assert!(PYRAMID_CHUNKS == 3, "the bind groups list three chunks");
