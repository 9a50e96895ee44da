//! Ways to make a depth image's levels: the rows of Turitzin's table of timings.
//!
//! Source: Mike Turitzin, "Hierarchical Depth Buffers", 2020.
//! He compares a chain of fragment passes with one dispatch for level 4 alone, for the two eyes of
//! a headset.
//! The library's own reduction and mip textures stand beside them, on the same images.

use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::headless::Engine;
use crate::headless::readback::{self, BufferRange};
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::methods::fragment_levels::FragmentLevels;
use crate::pyramid::levels::StoredLevels;
use crate::pyramid::mips::{MipOptions, MipTexture};
use crate::pyramid::{Pyramid, PyramidOptions};

/// Pixels along a side of a texel of level 4; `shaders/methods/coarse_level.wgsl`, `TILE`.
pub(crate) const TILE: u32 = 16;

/// The shader of level 4 alone.
pub(crate) fn coarse_level_module() -> Source {
    Source::of(&[&[wgsl!("methods/coarse_level")]])
}

/// A way to make levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LevelWay {
    /// Every level, each by a fragment pass over the finer one.
    FragmentPasses,
    /// Level 4 alone, by atomic minima: width and height of a workgroup, one of [`SHAPES`].
    Atomic(u32, u32),
    /// Level 4 alone, by halving in shared memory.
    Tree,
    /// The library's own reduction, to these levels.
    Pyramid(StoredLevels),
    /// The library's mip texture: every level, by compute passes.
    Mips,
}

/// The shapes of workgroups of [`LevelWay::Atomic`]; each makes a texel of 16x16 pixels.
///
/// An invocation loads 256 pixels divided by the workgroup's size.
pub const SHAPES: [(u32, u32); 6] = [(16, 16), (16, 8), (16, 4), (8, 8), (8, 4), (4, 4)];

impl LevelWay {
    fn entry_point(self) -> Result<&'static str> {
        Ok(match self {
            Self::Atomic(16, 16) => "atomic_16x16",
            Self::Atomic(16, 8) => "atomic_16x8",
            Self::Atomic(16, 4) => "atomic_16x4",
            Self::Atomic(8, 8) => "atomic_8x8",
            Self::Atomic(8, 4) => "atomic_8x4",
            Self::Atomic(4, 4) => "atomic_4x4",
            Self::Tree => "tree",
            other => {
                return Err(Error::invalid(
                    "way",
                    format!("expected a workgroup of {SHAPES:?}, got {other:?}"),
                ));
            }
        })
    }
}

#[derive(Debug)]
enum Work {
    Fragment(FragmentLevels),
    Coarse { pipeline: wgpu::ComputePipeline, bindings: wgpu::BindGroup, level: wgpu::Buffer },
    Pyramid { source: wgpu::TextureView, pyramid: Box<Pyramid> },
    Mips { source: wgpu::TextureView, mips: Box<MipTexture> },
}

/// The levels of some images of one size, with everything made beforehand.
#[derive(Debug)]
pub struct MethodLevels {
    engine: Engine,
    /// Of no view: it says the size, and that depth is reversed.
    camera: Camera,
    size: ImageSize,
    work: Vec<Work>,
}

impl MethodLevels {
    /// Prepares the levels of `images`, each with the rows of an image of the camera's size.
    ///
    /// The numbers are taken as they are, in reversed Z: the least is the farthest.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a camera without reversed Z, an image of another size, or an
    ///   unknown workgroup.
    /// - [`Error::Limit`] and [`Error::Device`] if the device has no room.
    pub fn new(engine: &Engine, way: LevelWay, camera: &Camera, images: &[&[f32]]) -> Result<Self> {
        let (gpu, size) = (&*engine.context().gpu, camera.size());
        if !camera.convention().is_reversed() {
            return Err(Error::invalid("camera", "expected one with reversed depth"));
        }
        let work = images
            .iter()
            .map(|image| {
                let texture = upload(engine, size, image)?;
                match way {
                    LevelWay::FragmentPasses => {
                        FragmentLevels::new(gpu, &texture, size).map(Work::Fragment)
                    }
                    LevelWay::Pyramid(levels) => {
                        let options = PyramidOptions { levels, ..PyramidOptions::default() };
                        let pyramid = Box::new(engine.context().create_pyramid(size, &options)?);
                        Ok(Work::Pyramid { source: gpu.view(&texture)?, pyramid })
                    }
                    LevelWay::Mips => {
                        let options = MipOptions::default();
                        let mips = Box::new(engine.context().create_mip_texture(size, &options)?);
                        Ok(Work::Mips { source: gpu.view(&texture)?, mips })
                    }
                    _ => coarse(gpu, way.entry_point()?, &texture, size),
                }
            })
            .collect::<Result<_>>()?;
        Ok(Self { engine: engine.clone(), camera: camera.clone(), size, work })
    }

    /// Makes the levels of all images in one submission and waits for it.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn run(&self) -> Result<()> {
        let device = self.engine.device();
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("hiz.methods.encoder"),
        });
        let [width, height] = [self.size.width, self.size.height].map(|side| side.div_ceil(TILE));
        for work in &self.work {
            match work {
                Work::Fragment(levels) => levels.record(&mut encoder),
                Work::Pyramid { source, pyramid } => {
                    self.engine.context().record_reduce(
                        &mut encoder,
                        source,
                        &self.camera,
                        pyramid,
                    )?;
                }
                Work::Mips { source, mips } => {
                    let convention = self.camera.convention();
                    self.engine.context().record_mips(&mut encoder, source, convention, mips)?;
                }
                Work::Coarse { pipeline, bindings, .. } => {
                    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                        label: Some("hiz.methods.coarse_level"),
                        timestamp_writes: None,
                    });
                    pass.set_pipeline(pipeline);
                    pass.set_bind_group(0, bindings, &[]);
                    pass.dispatch_workgroups(width, height, 1);
                }
            }
        }
        let submission = self.engine.queue().submit([encoder.finish()]);
        readback::wait(device, Some(submission))
    }

    /// The texels of level `k` of image `image` in row order, with the level's size.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for an image or a level that was not made.
    /// - [`Error::DeviceLost`].
    pub fn read(&self, image: usize, k: u32) -> Result<(ImageSize, Vec<f32>)> {
        let missing = |expected: String| {
            Error::invalid("level", format!("expected {expected}, got {k} of image {image}"))
        };
        let work = self.work.get(image).ok_or_else(|| missing("an image that was given".into()))?;
        let level = match work {
            Work::Fragment(levels) => {
                return levels
                    .read(&self.engine, k)?
                    .ok_or_else(|| missing(format!("1 to {}", levels.last())));
            }
            Work::Pyramid { pyramid, .. } => {
                let [width, height] =
                    [self.size.width, self.size.height].map(|side| side.div_ceil(1 << k.min(31)));
                let texels = self.engine.read_level(pyramid, k)?;
                return Ok((ImageSize::new(width, height), texels));
            }
            Work::Mips { mips, .. } => {
                let size = mips.level_size(k).ok_or_else(|| missing("a level".into()))?;
                return Ok((size, self.engine.read_mip(mips, k)?));
            }
            Work::Coarse { .. } if k != TILE.ilog2() => return Err(missing("4".into())),
            Work::Coarse { level, .. } => level,
        };
        let range = BufferRange::first(level, level.size());
        let bytes = readback::read_buffers(self.engine.device(), self.engine.queue(), &[range])?;
        let size = ImageSize::new(self.size.width.div_ceil(TILE), self.size.height.div_ceil(TILE));
        Ok((size, readback::to_u32(&bytes[0]).map(f32::from_bits).collect()))
    }
}

fn coarse(
    gpu: &Gpu,
    entry_point: &'static str,
    texture: &wgpu::Texture,
    size: ImageSize,
) -> Result<Work> {
    let texels = u64::from(size.width.div_ceil(TILE)) * u64::from(size.height.div_ceil(TILE));
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let level = gpu.empty("hiz.methods.level", 4 * texels, usage)?;
    let layout = gpu.layout(
        "hiz.methods.coarse_level",
        &[(0, Binding::Depth(SourceKind::Float)), (1, Binding::Write)],
    )?;
    let pipeline = gpu.compute_pipeline(&Compute {
        label: "hiz.methods.coarse_level",
        source: coarse_level_module(),
        entry_point,
        layouts: std::slice::from_ref(&layout),
        constants: &[],
    })?;
    let view = gpu.view(texture)?;
    let bindings = gpu.bind_group(
        "hiz.methods.coarse_level",
        &layout,
        &[entry(0, wgpu::BindingResource::TextureView(&view)), entry(1, level.as_entire_binding())],
    )?;
    Ok(Work::Coarse { pipeline, bindings, level })
}

/// A texture of floats with these rows.
fn upload(engine: &Engine, size: ImageSize, image: &[f32]) -> Result<wgpu::Texture> {
    if image.len() as u64 != size.pixels() {
        return Err(Error::invalid(
            "images",
            format!("expected {} numbers of an image {size}, got {}", size.pixels(), image.len()),
        ));
    }
    let texture = engine.context().gpu.texture(
        "hiz.methods.image",
        (size.width, size.height),
        wgpu::TextureFormat::R32Float,
        wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
    )?;
    engine.queue().write_texture(
        texture.as_image_copy(),
        bytemuck::cast_slice(image),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * size.width),
            rows_per_image: None,
        },
        wgpu::Extent3d { width: size.width, height: size.height, depth_or_array_layers: 1 },
    );
    Ok(texture)
}
