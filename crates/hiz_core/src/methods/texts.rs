//! Visibility tests as published texts print them, on the device.
//!
//! Sources, each a shader's entry point in `shaders/methods/texts.wgsl`:
//!
//! - Daniel Rakos, "Hierarchical-Z map based occlusion culling", 2010.
//! - ARM, "Occlusion Culling with Hierarchical-Z" (OpenGL ES SDK), with the bounds of a sphere of
//!   2013 that `shaders/methods/texts.wgsl` cites.
//! - Nick Darnell, "Hierarchical Z-Buffer Occlusion Culling", 2010.
//! - One lookup at the middle of a rectangle, which the first text compares with four.
//!
//! Nothing certifies them, and they hide instances that can be seen.

use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::headless::Engine;
use crate::headless::readback::{self, BufferRange};
use crate::input::image::ImageSize;
use crate::pyramid::levels::MAX_LEVELS;

/// Invocations of a workgroup; `shaders/methods/texts.wgsl`, `WORKGROUP`.
pub(crate) const WORKGROUP: u32 = 64;

/// The shader of all tests.
pub(crate) fn texts_module() -> Source {
    Source::of(&[&[wgsl!("methods/texts")]])
}

/// A published test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Text {
    /// Boxes: four lookups at the corners of the rectangle, at the level `ceil(log2(side / 2))`.
    Rakos,
    /// Spheres: their exact bounds of a centred projection, and a comparing sampler.
    Arm,
    /// Spheres: a square about them, and the depth of the nearest point in space.
    Darnell,
    /// Boxes: one lookup at the middle of the rectangle, at the level `ceil(log2(side))`.
    OneLookup,
}

impl Text {
    fn entry_point(self) -> &'static str {
        match self {
            Self::Rakos => "cull_rakos",
            Self::Arm => "cull_arm",
            Self::Darnell => "cull_darnell",
            Self::OneLookup => "cull_one_lookup",
        }
    }

    /// Vectors of four numbers that describe an instance.
    ///
    /// A box has its least and its greatest corner, and a sphere its centre and radius.
    pub fn vectors(self) -> usize {
        match self {
            Self::Rakos | Self::OneLookup => 2,
            Self::Arm | Self::Darnell => 1,
        }
    }
}

/// What the tests know of the camera, in float32 as in the texts.
#[derive(Debug, Clone, Copy, Default)]
pub struct TextCamera {
    /// Rows of the matrix from world to clip space, in reversed Z.
    pub clip_from_world: [[f32; 4]; 4],
    /// Rows of the matrix from world to view space, which looks along -z.
    pub view_from_world: [[f32; 4]; 4],
    /// Rows of the projection.
    pub clip_from_view: [[f32; 4]; 4],
    /// Planes of the frustum, with unit normals that look inside.
    pub planes: [[f32; 4]; 6],
    /// The position of the camera; the fourth number is not used.
    pub eye: [f32; 4],
    /// What is up in the image, in the world; the fourth number is not used.
    pub up: [f32; 4],
    /// The distance of the near plane.
    pub near: f32,
}

/// Twin: `shaders/methods/texts.wgsl`, `TextView`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct TextUniform {
    pub(crate) clip_from_world: [[f32; 4]; 4],
    pub(crate) view_from_world: [[f32; 4]; 4],
    pub(crate) clip_from_view: [[f32; 4]; 4],
    pub(crate) planes: [[f32; 4]; 6],
    pub(crate) eye: [f32; 4],
    pub(crate) up: [f32; 4],
    pub(crate) size: [f32; 2],
    pub(crate) near: f32,
    pub(crate) count: u32,
    pub(crate) levels: [[u32; 4]; MAX_LEVELS],
    pub(crate) num_levels: u32,
    pub(crate) padding: [u32; 3],
}

/// A published test of some instances in one view, with everything made beforehand.
#[derive(Debug)]
pub struct TextCull {
    engine: Engine,
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    kept: wgpu::Buffer,
    count: u32,
}

impl TextCull {
    /// Prepares a test.
    ///
    /// `bounds` has [`Text::vectors`] vectors for each instance.
    /// `levels` are the sizes of a chain's levels, the image first, and `texels` their reversed
    /// depths in row order, level after level.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for no instances, for a number of vectors that is no multiple, and for
    ///   levels without texels or with another number of them.
    /// - [`Error::Limit`] and [`Error::Device`] if the device has no room.
    pub fn new(
        engine: &Engine,
        text: Text,
        bounds: &[[f32; 4]],
        camera: &TextCamera,
        (levels, texels): (&[ImageSize], &[f32]),
    ) -> Result<Self> {
        let gpu = &*engine.context().gpu;
        let vectors = text.vectors();
        if bounds.is_empty() || !bounds.len().is_multiple_of(vectors) {
            return Err(Error::invalid(
                "bounds",
                format!(
                    "expected {vectors} vectors for each of at least one instance, got {}",
                    bounds.len()
                ),
            ));
        }
        let count = bounds.len() / vectors;
        let workgroups = count.div_ceil(WORKGROUP as usize) as u64;
        let allowed = gpu.limits().max_compute_workgroups_per_dimension;
        if workgroups > u64::from(allowed) {
            return Err(Error::limit(
                "max_compute_workgroups_per_dimension",
                workgroups,
                u64::from(allowed),
            ));
        }
        let uniform = uniform(camera, count as u32, levels, texels.len())?;
        let storage = wgpu::BufferUsages::STORAGE;
        let view = gpu.uniform("hiz.methods.view", &uniform)?;
        let bounds = gpu.filled("hiz.methods.bounds", bytemuck::cast_slice(bounds), storage)?;
        let texels = gpu.filled("hiz.methods.texels", bytemuck::cast_slice(texels), storage)?;
        let kept = gpu.empty(
            "hiz.methods.kept",
            4 * count as u64,
            storage | wgpu::BufferUsages::COPY_SRC,
        )?;
        let layout = gpu.layout(
            "hiz.methods.texts",
            &[(0, Binding::Uniform), (1, Binding::Read), (2, Binding::Read), (3, Binding::Write)],
        )?;
        let pipeline = gpu.compute_pipeline(&Compute {
            label: "hiz.methods.texts",
            source: texts_module(),
            entry_point: text.entry_point(),
            layouts: std::slice::from_ref(&layout),
            constants: &[],
        })?;
        let bindings = gpu.bind_group(
            "hiz.methods.texts",
            &layout,
            &[
                entry(0, view.as_entire_binding()),
                entry(1, bounds.as_entire_binding()),
                entry(2, texels.as_entire_binding()),
                entry(3, kept.as_entire_binding()),
            ],
        )?;
        Ok(Self { engine: engine.clone(), pipeline, bindings, kept, count: count as u32 })
    }

    /// Runs the test and waits for it.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn run(&self) -> Result<()> {
        let device = self.engine.device();
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("hiz.methods.encoder"),
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("hiz.methods.texts"),
            timestamp_writes: None,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.dispatch_workgroups(self.count.div_ceil(WORKGROUP), 1, 1);
        drop(pass);
        let submission = self.engine.queue().submit([encoder.finish()]);
        readback::wait(device, Some(submission))
    }

    /// Whether each instance is kept, by the last run.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn mask(&self) -> Result<Vec<bool>> {
        let range = BufferRange::first(&self.kept, self.kept.size());
        let bytes = readback::read_buffers(self.engine.device(), self.engine.queue(), &[range])?;
        Ok(readback::to_u32(&bytes[0]).map(|word| word != 0).collect())
    }
}

fn uniform(
    camera: &TextCamera,
    count: u32,
    levels: &[ImageSize],
    texels: usize,
) -> Result<TextUniform> {
    let mut places = [[0; 4]; MAX_LEVELS];
    let mut offset = 0;
    for (place, size) in places.iter_mut().zip(levels) {
        *place = [offset as u32, size.width, size.height, 0];
        offset += size.pixels();
    }
    let has_texels = levels.iter().all(|size| size.pixels() > 0);
    if !(1..=MAX_LEVELS).contains(&levels.len()) || !has_texels || offset != texels as u64 {
        return Err(Error::invalid(
            "levels",
            format!(
                "expected 1 to {MAX_LEVELS} levels of together {texels} texels, got {} of {offset}",
                levels.len()
            ),
        ));
    }
    let size = levels[0];
    Ok(TextUniform {
        clip_from_world: camera.clip_from_world,
        view_from_world: camera.view_from_world,
        clip_from_view: camera.clip_from_view,
        planes: camera.planes,
        eye: camera.eye,
        up: camera.up,
        size: [size.width as f32, size.height as f32],
        near: camera.near,
        count,
        levels: places,
        num_levels: levels.len() as u32,
        padding: [0; 3],
    })
}
