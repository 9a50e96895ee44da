//! The reduction with one dispatch per level, into a flat buffer or a texture's mip levels.

use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{File, Source, wgsl};
use crate::headless::readback::{self, BufferRange};
use crate::headless::{DepthImage, Engine};
use crate::input::image::ImageSize;
use crate::pyramid::Pyramid;

fn yardstick_module(source: SourceKind, entry: File) -> Source {
    Source::of(&[
        &[wgsl!("gpu/depth_bits")],
        source.files(),
        source.quad_files(),
        &[wgsl!("gpu/ends_one"), entry],
    ])
}

const IN_BUFFER: File = wgsl!("yardstick/reduce_buffer");
const IN_TEXTURE: File = wgsl!("yardstick/reduce_texture");

/// Invocations of a workgroup; `shaders/yardstick/reduce_buffer.wgsl`, `WORKGROUP`.
pub(crate) const BUFFER_WORKGROUP: u32 = 64;
/// Along a side of a workgroup; `shaders/yardstick/reduce_texture.wgsl`, `SIDE`.
pub(crate) const TEXTURE_WORKGROUP_SIDE: u32 = 8;

/// A name and the module of each shape.
#[cfg(feature = "testing")]
pub(crate) fn yardstick_modules(source: SourceKind) -> [(&'static str, Source); 2] {
    [
        ("one dispatch a level, buffer", yardstick_module(source, IN_BUFFER)),
        ("one dispatch a level, textures", yardstick_module(source, IN_TEXTURE)),
    ]
}

/// What each dispatch writes into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReductionShape {
    /// A storage buffer, by vectors of four texels.
    Buffer,
    /// The mip levels of an `R32Float` texture, texel by texel.
    Textures,
}

/// Twin: `shaders/yardstick/reduce_buffer.wgsl`, `YardstickLevel`.
/// Offset and stride are in vectors of four texels.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PlainLevel {
    pub(crate) offset: u32,
    pub(crate) stride: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

#[derive(Debug)]
struct LevelPass {
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    workgroups: [u32; 2],
}

#[derive(Debug)]
enum Storage {
    Buffer(wgpu::Buffer),
    Textures(wgpu::Texture),
}

/// All levels of a depth image's pyramid, reduced by one dispatch each.
/// Everything that can be made beforehand is made beforehand.
#[derive(Debug)]
pub struct PerLevelReduction {
    levels: Vec<PlainLevel>,
    storage: Storage,
    steps: Vec<LevelPass>,
}

impl PerLevelReduction {
    /// Prepares the reduction of `depth`, which must have more than one pixel.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) if the device has no memory for it.
    pub fn new(engine: &Engine, depth: &DepthImage, shape: ReductionShape) -> Result<Self> {
        let gpu = &*engine.context().gpu;
        let levels = levels(depth.size());
        let storage = match shape {
            ReductionShape::Buffer => {
                let last = levels[levels.len() - 1];
                Storage::Buffer(gpu.device().create_buffer(&wgpu::BufferDescriptor {
                    label: Some("hiz.yardstick.levels"),
                    size: 16 * u64::from(last.offset + last.stride * last.height),
                    usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                }))
            }
            ReductionShape::Textures => Storage::Textures(mip_levels(gpu, &levels)?),
        };
        let steps = (1..levels.len())
            .map(|k| step(gpu, depth, &levels, &storage, k))
            .collect::<Result<_>>()?;
        Ok(Self { levels, storage, steps })
    }

    /// Records all dispatches.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("hiz.yardstick.pass"),
            timestamp_writes: None,
        });
        for LevelPass { pipeline, bindings, workgroups: [x, y] } in &self.steps {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(*x, *y, 1);
        }
    }

    /// The texels of level `k`, which is at least 1, in row order.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn read(&self, engine: &Engine, k: usize) -> Result<Vec<f32>> {
        let PlainLevel { offset, stride, width, height } = self.levels[k];
        let device = engine.device();
        let bytes = match &self.storage {
            Storage::Buffer(buffer) => {
                let range = BufferRange {
                    buffer,
                    offset: 16 * u64::from(offset),
                    size: 16 * u64::from(stride * height),
                };
                readback::read_buffers(device, engine.queue(), &[range])?.swap_remove(0)
            }
            Storage::Textures(texture) => {
                let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
                let copied = device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("hiz.yardstick.copied"),
                    size: u64::from(row * height),
                    usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                });
                let mut encoder =
                    device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                encoder.copy_texture_to_buffer(
                    wgpu::TexelCopyTextureInfo {
                        mip_level: k as u32 - 1,
                        ..texture.as_image_copy()
                    },
                    wgpu::TexelCopyBufferInfo {
                        buffer: &copied,
                        layout: wgpu::TexelCopyBufferLayout {
                            offset: 0,
                            bytes_per_row: Some(row),
                            rows_per_image: None,
                        },
                    },
                    wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                );
                engine.queue().submit([encoder.finish()]);
                readback::read_buffers(
                    device,
                    engine.queue(),
                    &[BufferRange::first(&copied, copied.size())],
                )?
                .swap_remove(0)
            }
        };
        Ok(bytes
            .chunks_exact(bytes.len() / height as usize)
            .flat_map(|row| bytemuck::pod_collect_to_vec::<u8, f32>(&row[..4 * width as usize]))
            .collect())
    }
}

/// Records the library's own reduction of `depth` into `pyramid`.
///
/// # Errors
/// Those of [`HizContext::record_reduce`](crate::HizContext::record_reduce).
pub fn reduce(
    engine: &Engine,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthImage,
    pyramid: &Pyramid,
) -> Result<()> {
    let view = depth.texture().create_view(&wgpu::TextureViewDescriptor::default());
    engine.context().record_reduce(encoder, &view, depth.camera(), pyramid)
}

/// Records the library's own reduction of a rectangle of `depth` into `pyramid`, which was built
/// from it.
///
/// # Errors
/// Those of [`HizContext::record_reduce_region`](crate::HizContext::record_reduce_region).
pub fn reduce_region(
    engine: &Engine,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthImage,
    rectangle: [u32; 4],
    pyramid: &Pyramid,
) -> Result<()> {
    engine.context().record_reduce_region(encoder, depth.texture(), rectangle, pyramid)
}

fn levels(size: ImageSize) -> Vec<PlainLevel> {
    let mut levels =
        vec![PlainLevel { offset: 0, stride: 0, width: size.width, height: size.height }];
    let mut offset = 0;
    while let Some(PlainLevel { width, height, .. }) =
        levels.last().filter(|l| l.width > 1 || l.height > 1)
    {
        let (width, height) = (width.div_ceil(2), height.div_ceil(2));
        let stride = width.div_ceil(4);
        levels.push(PlainLevel { offset, stride, width, height });
        offset += stride * height;
    }
    levels
}

/// A texture's mip levels round odd sizes down, and a pyramid's levels round them up.
/// Sides that are powers of two are large enough for both.
fn mip_levels(gpu: &Gpu, levels: &[PlainLevel]) -> Result<wgpu::Texture> {
    gpu.texture_of_levels(
        "hiz.yardstick.mips",
        (levels[1].width.next_power_of_two(), levels[1].height.next_power_of_two()),
        wgpu::TextureFormat::R32Float,
        wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        levels.len() as u32 - 1,
    )
}

/// The dispatch that makes level `k` from the level before.
fn step(
    gpu: &Gpu,
    depth: &DepthImage,
    levels: &[PlainLevel],
    storage: &Storage,
    k: usize,
) -> Result<LevelPass> {
    let kind = SourceKind::of(depth.texture().format()).expect("a depth image's own format");
    let (read, written) = (levels[k - 1], levels[k]);
    let source = depth.texture().create_view(&wgpu::TextureViewDescriptor::default());
    let mip = |texture: &wgpu::Texture, k: usize| {
        texture.create_view(&wgpu::TextureViewDescriptor {
            base_mip_level: k as u32 - 1,
            mip_level_count: Some(1),
            ..Default::default()
        })
    };
    let constants = [
        ("REVERSED", flag(depth.camera().convention().is_reversed())),
        ("FROM_SOURCE", flag(k == 1)),
    ];
    let mut bindings =
        vec![(0, Binding::Depth(kind)), (1, Binding::Sampler), (2, Binding::Uniform)];
    let (source_module, entry_point, uniform, workgroups) = match storage {
        Storage::Buffer(_) => {
            bindings.push((3, Binding::Write));
            (
                yardstick_module(kind, IN_BUFFER),
                "reduce_buffer",
                gpu.uniform("hiz.yardstick.step", &[read, written])?,
                [written.stride.div_ceil(BUFFER_WORKGROUP), written.height],
            )
        }
        Storage::Textures(_) => {
            bindings.extend([(3, Binding::Depth(SourceKind::Float)), (4, Binding::WriteFloats)]);
            (
                yardstick_module(kind, IN_TEXTURE),
                "reduce_texture",
                gpu.uniform(
                    "hiz.yardstick.step",
                    &[written.width, written.height, read.width, read.height],
                )?,
                [written.width, written.height].map(|n| n.div_ceil(TEXTURE_WORKGROUP_SIDE)),
            )
        }
    };
    let layout = gpu.layout("hiz.yardstick.layout", &bindings)?;
    let pipeline = gpu.compute_pipeline(&Compute {
        label: "hiz.yardstick.pipeline",
        source: source_module,
        entry_point,
        layouts: std::slice::from_ref(&layout),
        constants: &constants,
    })?;
    let mut bound = vec![
        entry(0, wgpu::BindingResource::TextureView(&source)),
        entry(1, wgpu::BindingResource::Sampler(gpu.sampler())),
        entry(2, uniform.as_entire_binding()),
    ];
    let views;
    match storage {
        Storage::Buffer(buffer) => bound.push(entry(3, buffer.as_entire_binding())),
        Storage::Textures(mips) => {
            // The first dispatch reads the depth image, so any level can be bound as the level
            // before.
            let finer = if k == 1 {
                let usage = wgpu::TextureUsages::TEXTURE_BINDING;
                gpu.texture("hiz.yardstick.idle", (1, 1), wgpu::TextureFormat::R32Float, usage)?
            } else {
                mips.clone()
            };
            views = [mip(&finer, if k == 1 { 1 } else { k - 1 }), mip(mips, k)];
            bound.push(entry(3, wgpu::BindingResource::TextureView(&views[0])));
            bound.push(entry(4, wgpu::BindingResource::TextureView(&views[1])));
        }
    }
    let bindings = gpu.bind_group("hiz.yardstick.bindings", &layout, &bound)?;
    Ok(LevelPass { pipeline, bindings, workgroups })
}
