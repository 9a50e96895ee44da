//! A chain of levels by fragment passes, one per level.
//!
//! Source: Mike Turitzin, "Hierarchical Depth Buffers", 2020, "Generating the mip chain".
//! His passes write the mip levels of a depth texture.
//! These write a colour texture of one float channel, which can be copied out.

use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::gpu::shader::{Source, wgsl};
use crate::headless::Engine;
use crate::headless::readback::{self, BufferRange};
use crate::input::image::ImageSize;
use crate::pyramid::mips_plan::{level_count, level_size};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// The shader of a pass.
pub(crate) fn fragment_levels_module() -> Source {
    Source::of(&[&[wgsl!("methods/fragment_levels")]])
}

/// All levels above 0 of an image, with everything made beforehand.
#[derive(Debug)]
pub(crate) struct FragmentLevels {
    size: ImageSize,
    pipeline: wgpu::RenderPipeline,
    /// Level 1 is its mip level 0.
    mips: wgpu::Texture,
    /// What each pass reads, and what it draws into.
    passes: Vec<(wgpu::BindGroup, wgpu::TextureView)>,
}

impl FragmentLevels {
    /// Prepares the levels of `image`, a texture of floats with more than one pixel.
    pub(crate) fn new(gpu: &Gpu, image: &wgpu::Texture, size: ImageSize) -> Result<Self> {
        let last = level_count(size) - 1;
        let first = level_size(size, 1);
        let mips = gpu.texture_of_levels(
            "hiz.methods.mips",
            (first.width, first.height),
            FORMAT,
            wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            last.max(1),
        )?;
        let layout = gpu.checked(|device| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("hiz.methods.fragment_levels"),
                entries: &[wgpu::BindGroupLayoutEntry {
                    binding: 0,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: SourceKind::Float.binding(false),
                    count: None,
                }],
            })
        })?;
        let pipeline = pipeline(gpu, &layout)?;
        let view_of = |level: u32| {
            mips.create_view(&wgpu::TextureViewDescriptor {
                base_mip_level: level - 1,
                mip_level_count: Some(1),
                ..Default::default()
            })
        };
        let passes = (1..=last)
            .map(|level| {
                let finer = if level == 1 { gpu.view(image)? } else { view_of(level - 1) };
                let bound = entry(0, wgpu::BindingResource::TextureView(&finer));
                let bindings = gpu.bind_group("hiz.methods.fragment_levels", &layout, &[bound])?;
                Ok((bindings, view_of(level)))
            })
            .collect::<Result<_>>()?;
        Ok(Self { size, pipeline, mips, passes })
    }

    /// The coarsest level.
    pub(crate) fn last(&self) -> u32 {
        self.passes.len() as u32
    }

    /// Records all passes.
    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        for (bindings, target) in &self.passes {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("hiz.methods.fragment_levels"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: target,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, bindings, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    /// The size and the texels of level `k`; none if there is no such level above 0.
    pub(crate) fn read(&self, engine: &Engine, k: u32) -> Result<Option<(ImageSize, Vec<f32>)>> {
        if !(1..=self.last()).contains(&k) {
            return Ok(None);
        }
        let size = level_size(self.size, k);
        let row = (4 * size.width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let bytes = u64::from(row) * u64::from(size.height);
        let copied = engine.context().gpu.empty("hiz.methods.copied", bytes, usage)?;
        let mut encoder =
            engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo { mip_level: k - 1, ..self.mips.as_image_copy() },
            wgpu::TexelCopyBufferInfo {
                buffer: &copied,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d { width: size.width, height: size.height, depth_or_array_layers: 1 },
        );
        engine.queue().submit([encoder.finish()]);
        let range = BufferRange::first(&copied, bytes);
        let read = readback::read_buffers(engine.device(), engine.queue(), &[range])?;
        let texels = read[0]
            .chunks_exact(row as usize)
            .flat_map(|row| readback::to_u32(&row[..4 * size.width as usize]).map(f32::from_bits));
        Ok(Some((size, texels.collect())))
    }
}

fn pipeline(gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> Result<wgpu::RenderPipeline> {
    gpu.checked(|device| {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("hiz.methods.fragment_levels"),
            source: wgpu::ShaderSource::Wgsl(fragment_levels_module().text().into()),
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("hiz.methods.fragment_levels"),
            bind_group_layouts: &[Some(layout)],
            immediate_size: 0,
        });
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("hiz.methods.fragment_levels"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("whole_image"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("farther_level"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    })
}
