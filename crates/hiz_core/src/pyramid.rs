//! The depth pyramid: its storage, and the pass that fills it.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::camera::{Camera, ImageSize};
use crate::error::{Error, Result};
use crate::gpu::{ContextId, Gpu};
use crate::layout::{Level, MAX_LEVELS, PYRAMID_CHUNKS, PyramidLayout};
use crate::shader::SourceKind;

/// Texels that one invocation of the reduction reads along a side; `shaders/reduce.wgsl`.
const BLOCK: u32 = 8;
/// Levels that one dispatch of the reduction writes.
const LEVELS_PER_STEP: u32 = 3;
/// Invocations of a workgroup of the reduction, all in a row.
const REDUCE_WORKGROUP: u32 = 64;

/// `shaders/shared/pyramid.wgsl`, `Pyramid`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PyramidUniform {
    pub(crate) levels: [Level; MAX_LEVELS],
    pub(crate) num_levels: u32,
    pub(crate) chunk_shift: u32,
    pub(crate) padding: [u32; 2],
}

const _: () = assert!(size_of::<PyramidUniform>() == 272);

/// How a pyramid is stored.
#[derive(Debug, Clone, Default)]
pub struct PyramidOptions {
    /// Texels of one chunk as a power of two; `None`: what one storage binding of the device holds. Tests make it small.
    pub chunk_shift: Option<u32>,
}

/// A depth pyramid on the device: for every level, the farthest depth of each block of pixels.
///
/// Level 0 is the depth texture itself, which the pyramid keeps alive but does not copy: **do not write to that texture
/// between the reduction and the culls that use it**.
#[derive(Debug)]
pub struct Pyramid {
    pub(crate) context: ContextId,
    pub(crate) layout: PyramidLayout,
    pub(crate) chunks: Vec<wgpu::Buffer>,
    pub(crate) uniform: wgpu::Buffer,
    /// Levels that the dispatches read.
    steps: Vec<u32>,
    built: Mutex<Option<Built>>,
}

/// What a pyramid was last built from.
#[derive(Debug, Clone)]
pub(crate) struct Built {
    /// The number of the reduction, which stands in the pyramid's header once it has run.
    pub(crate) reduction: u32,
    pub(crate) source: wgpu::TextureView,
    pub(crate) source_kind: SourceKind,
    pub(crate) camera: Camera,
}

impl Pyramid {
    pub(crate) fn new(gpu: &Gpu, size: ImageSize, options: &PyramidOptions) -> Result<Self> {
        let device = gpu.device();
        let side = size.width.max(size.height);
        let allowed = device.limits().max_texture_dimension_2d;
        if side > allowed {
            return Err(Error::limit("max_texture_dimension_2d", u64::from(side), u64::from(allowed)));
        }
        if side == 0 || size.width.min(size.height) == 0 {
            return Err(Error::invalid("size", format!("expected at least one pixel a side, got {size}")));
        }
        let most = crate::layout::chunk_shift(&device.limits());
        let chunk_shift = options.chunk_shift.unwrap_or(most);
        if !(2..=most).contains(&chunk_shift) {
            return Err(Error::invalid("chunk_shift", format!("expected 2 to {most}, got {chunk_shift}")));
        }
        let layout = PyramidLayout::new(size, chunk_shift)?;
        let chunks = layout
            .chunk_sizes()
            .iter()
            .map(|texels| {
                device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("hiz.pyramid.chunk"),
                    size: texels * 4,
                    usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                })
            })
            .collect();
        let mut levels = [Level { offset: 0, stride: 0, width: 0, height: 0 }; MAX_LEVELS];
        levels[..layout.levels.len()].copy_from_slice(&layout.levels);
        let uniform = gpu.uniform(
            "hiz.pyramid.layout",
            &PyramidUniform { levels, num_levels: layout.num_levels(), chunk_shift, padding: [0; 2] },
        )?;
        // One at least: it also writes the header.
        let steps = (0..layout.num_levels().max(2) - 1).step_by(LEVELS_PER_STEP as usize).collect();
        Ok(Self { context: gpu.id(), layout, chunks, uniform, steps, built: Mutex::new(None) })
    }

    /// The depth image's size.
    pub fn size(&self) -> ImageSize {
        self.layout.size
    }

    /// The number of levels, down to 1x1, level 0 included.
    pub fn num_levels(&self) -> u32 {
        self.layout.num_levels()
    }

    /// The size of a level, or nothing past the last.
    pub fn level_size(&self, level: u32) -> Option<ImageSize> {
        self.layout.levels.get(level as usize).map(|l| ImageSize::new(l.width, l.height))
    }

    /// Bytes on the device, the depth texture not counted.
    pub fn device_bytes(&self) -> u64 {
        self.chunks.iter().map(wgpu::Buffer::size).sum()
    }

    /// The camera of the depth image that the pyramid was last built from.
    pub fn camera(&self) -> Option<Camera> {
        self.built().map(|b| b.camera)
    }

    /// Chunk `i`, or what stands in for it.
    pub(crate) fn chunk<'a>(&'a self, gpu: &'a Gpu, i: usize) -> &'a wgpu::Buffer {
        self.chunks.get(i).unwrap_or_else(|| gpu.no_chunk(i))
    }

    pub(crate) fn built(&self) -> Option<Built> {
        self.built.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
    }

    /// The built state for a cull with `camera`, or why there is none.
    pub(crate) fn built_for(&self, camera: &Camera) -> Result<Built> {
        let built = self.built().ok_or_else(|| {
            Error::mismatch("pyramid", "expected one that was built from a depth image, got one that never was")
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
                format!("expected the camera of the pyramid's depth image, size {theirs}, got one of size {ours}")
            },
        ))
    }
}

/// Records the reduction of `depth` (all of its texture's first mip level) into `pyramid`.
pub(crate) fn record_reduce(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &wgpu::TextureView,
    camera: &Camera,
    pyramid: &Pyramid,
) -> Result<()> {
    gpu.check_context("pyramid", pyramid.context)?;
    let texture = depth.texture();
    let size = ImageSize::new(texture.width(), texture.height());
    if size != pyramid.size() {
        return Err(Error::mismatch("depth", format!("expected the pyramid's size {}, got {size}", pyramid.size())));
    }
    if size != camera.size() {
        return Err(Error::mismatch(
            "camera",
            format!("expected the depth image's size {size}, got {}", camera.size()),
        ));
    }
    let source_kind = SourceKind::of(texture.format()).ok_or_else(|| {
        Error::invalid(
            "depth",
            format!("expected a depth format, R32Float or R32Uint (float bits), got {:?}", texture.format()),
        )
    })?;
    // A view does not say which part of its texture it shows, so there must be one part only.
    let parts = (texture.mip_level_count(), texture.sample_count(), texture.depth_or_array_layers());
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
    if !texture.usage().contains(wgpu::TextureUsages::TEXTURE_BINDING) {
        return Err(Error::invalid("depth", format!("expected the usage TEXTURE_BINDING, got {:?}", texture.usage())));
    }
    let reduction = next_reduction();
    let layouts = gpu.layouts();
    let pipeline =
        |from_source| gpu.reduce_pipeline(source_kind, camera.convention(), pyramid.chunks.len(), from_source);
    let source = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("hiz.reduce.pyramid"),
        layout: layouts.reduce(source_kind),
        entries: &[
            entry(0, wgpu::BindingResource::TextureView(depth)),
            entry(1, wgpu::BindingResource::Sampler(gpu.sampler())),
            entry(2, pyramid.uniform.as_entire_binding()),
            entry(3, pyramid.chunk(gpu, 0).as_entire_binding()),
            entry(4, pyramid.chunk(gpu, 1).as_entire_binding()),
            entry(5, pyramid.chunk(gpu, 2).as_entire_binding()),
        ],
    });
    let uniforms = pyramid
        .steps
        .iter()
        .map(|from| gpu.uniform("hiz.reduce.step", &[*from, reduction, 0, 0]))
        .collect::<Result<Vec<_>>>()?;
    let mut pass = encoder
        .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("hiz.reduce.pass"), timestamp_writes: None });
    pass.set_bind_group(0, &source, &[]);
    for (from, uniform) in pyramid.steps.iter().zip(&uniforms) {
        let size = pyramid.layout.levels[*from as usize];
        let bind_group = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("hiz.reduce.step"),
            layout: &layouts.one_uniform,
            entries: &[entry(0, uniform.as_entire_binding())],
        });
        pass.set_pipeline(&pipeline(*from == 0));
        pass.set_bind_group(1, &bind_group, &[]);
        pass.dispatch_workgroups(size.width.div_ceil(BLOCK).div_ceil(REDUCE_WORKGROUP), size.height.div_ceil(BLOCK), 1);
    }
    drop(pass);
    *pyramid.built.lock().unwrap_or_else(std::sync::PoisonError::into_inner) =
        Some(Built { reduction, source: depth.clone(), source_kind, camera: camera.clone() });
    Ok(())
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
