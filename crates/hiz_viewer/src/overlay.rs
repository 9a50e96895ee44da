//! What is drawn over a picture: bounds, a level of the pyramid, and lines of numbers.

use hiz_core::Camera;
use hiz_core::wgpu::{self, BufferUsages};

use crate::font;
use crate::gpu::Gpu;
use crate::pipelines::COLOUR_FORMAT;
use crate::renderer::Renderer;
use crate::scene_on_device::{clip_from_eye, eye};
use crate::targets::{Targets, begin_flat, view};

/// Twin: `shaders/boxes.wgsl`, `BoxView`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct BoxView {
    clip_from_eye: [[f32; 4]; 4],
    eye: [f32; 3],
    padding: f32,
}

/// Twin: `shaders/level.wgsl`, `LevelView`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct LevelView {
    size: [u32; 2],
    offset: u32,
    stride: u32,
    pixels_per_texel: f32,
    a: f32,
    b: f32,
    nearest: f32,
    farthest: f32,
    is_image: u32,
    step: u32,
    padding: u32,
}

/// Twin: `shaders/copy.wgsl`, `Placement`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Placement {
    origin: [f32; 2],
    texels_per_pixel: [f32; 2],
}

/// Vertices of the twelve edges of a box.
const EDGE_VERTICES: u32 = 24;
/// Pixels of the target per pixel of the font.
const TEXT_SCALE: u32 = 2;

/// The pipelines of what is drawn over a picture.
#[derive(Debug)]
pub(crate) struct Overlay {
    boxes: wgpu::RenderPipeline,
    level: wgpu::RenderPipeline,
    copy: wgpu::RenderPipeline,
    /// Bound where a level is the depth image.
    no_texels: wgpu::Buffer,
}

impl Overlay {
    /// For frames of `samples` samples per pixel.
    pub(crate) fn new(gpu: &Gpu, samples: u32) -> Self {
        let image = if samples > 1 { LEVEL_SAMPLES } else { LEVEL_IMAGE };
        let level = format!("{LEVEL}{image}");
        let boxes = gpu.device.create_shader_module(wgpu::include_wgsl!("shaders/boxes.wgsl"));
        let lines = wgpu::PrimitiveTopology::LineList;
        let ends = [(&boxes, "box_vertex"), (&boxes, "box_fragment")];
        Self {
            boxes: flat_pipeline(gpu, "viewer.boxes", ends, lines, COLOUR_FORMAT),
            level: screen_pipeline(gpu, &level, "level_fragment", COLOUR_FORMAT),
            copy: screen_pipeline(gpu, COPY, "copy_fragment", COLOUR_FORMAT),
            no_texels: gpu.buffer("viewer.no_texels", &[0_u32; 8], BufferUsages::STORAGE),
        }
    }

    /// The bounds of all bodies, white if drawn and red if culled.
    pub(crate) fn record_boxes(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        renderer: &Renderer,
        camera: &Camera,
    ) {
        let view = BoxView { clip_from_eye: clip_from_eye(camera), eye: eye(camera), padding: 0.0 };
        let view = gpu.buffer("viewer.box_view", &[view], BufferUsages::UNIFORM);
        let [drawn, drawn_too] = renderer.drawn();
        let bindings = gpu.bind_group(
            "viewer.boxes",
            &self.boxes.get_bind_group_layout(0),
            &[
                view.as_entire_binding(),
                renderer.on_device.corners.as_entire_binding(),
                drawn.as_entire_binding(),
                drawn_too.as_entire_binding(),
            ],
        );
        let picture = &renderer.targets.picture;
        let mut pass = begin_flat(encoder, "viewer.boxes", picture, wgpu::LoadOp::Load);
        pass.set_pipeline(&self.boxes);
        pass.set_bind_group(0, &bindings, &[]);
        pass.draw(0..EDGE_VERTICES, 0..renderer.on_device.num_bodies);
    }

    /// A level of the pyramid, over the whole picture.
    pub(crate) fn record_level(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        renderer: &Renderer,
        level: u32,
    ) {
        let (pyramid, scene) = (renderer.culler.pyramid(), &renderer.scene);
        let texels = pyramid.level_texels(level);
        let Some(size) = pyramid.level_size(level) else { return };
        // Depth is a + b / w for a perspective view, with reversed Z: 1 at near, 0 at far.
        let (near, far) = (scene.near, scene.far.unwrap_or(f64::INFINITY));
        let a = if far.is_finite() { -near / (far - near) } else { 0.0 };
        let constants = LevelView {
            size: [size.width, size.height],
            offset: texels.as_ref().map_or(0, |t| t.first),
            stride: texels.as_ref().map_or(0, |t| t.stride),
            pixels_per_texel: (1_u32 << level) as f32,
            a: a as f32,
            b: (near * (1.0 - a)) as f32,
            nearest: (2.0 * near).max(1.0) as f32,
            farthest: renderer.on_device.reach,
            is_image: u32::from(level == 0),
            step: texels.as_ref().map_or(1, |t| t.step),
            padding: 0,
        };
        let constants = gpu.buffer("viewer.level_view", &[constants], BufferUsages::UNIFORM);
        let texels = texels.as_ref().map_or(&self.no_texels, |t| t.buffer);
        let bindings = gpu.bind_group(
            "viewer.level",
            &self.level.get_bind_group_layout(0),
            &[
                constants.as_entire_binding(),
                texels.as_entire_binding(),
                wgpu::BindingResource::TextureView(&renderer.targets.depth),
            ],
        );
        let picture = &renderer.targets.picture;
        let mut pass = begin_flat(encoder, "viewer.level", picture, wgpu::LoadOp::Load);
        pass.set_pipeline(&self.level);
        pass.set_bind_group(0, &bindings, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Lines of text in the upper left corner.
    pub(crate) fn record_text(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets,
        lines: &[String],
    ) {
        let sheet = font::draw(lines);
        let size =
            wgpu::Extent3d { width: sheet.width, height: sheet.height, depth_or_array_layers: 1 };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("viewer.text"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: COLOUR_FORMAT,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * sheet.width),
            rows_per_image: None,
        };
        gpu.queue.write_texture(texture.as_image_copy(), &sheet.rgba, layout, size);
        // Small pictures get small letters.
        let scale = if targets.size.width >= 600 { TEXT_SCALE } else { 1 };
        let placement = Placement { origin: [4.0; 2], texels_per_pixel: [1.0 / scale as f32; 2] };
        let picture = &targets.picture;
        let mut pass = begin_flat(encoder, "viewer.text", picture, wgpu::LoadOp::Load);
        copy_texture(gpu, &mut pass, &self.copy, &texture, placement);
    }
}

/// Copies a picture to a target of any size, such as a window's.
#[derive(Debug)]
pub(crate) struct ToWindow {
    pipeline: wgpu::RenderPipeline,
}

impl ToWindow {
    pub(crate) fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Self {
        Self { pipeline: screen_pipeline(gpu, COPY, "copy_fragment", format) }
    }

    pub(crate) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        picture: &wgpu::Texture,
        target: &wgpu::Texture,
    ) {
        let scale = [
            picture.width() as f32 / target.width() as f32,
            picture.height() as f32 / target.height() as f32,
        ];
        let placement = Placement { origin: [0.0; 2], texels_per_pixel: scale };
        let black = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        let mut pass = begin_flat(encoder, "viewer.window", &view(target), black);
        copy_texture(gpu, &mut pass, &self.pipeline, picture, placement);
    }
}

fn copy_texture(
    gpu: &Gpu,
    pass: &mut wgpu::RenderPass<'_>,
    pipeline: &wgpu::RenderPipeline,
    source: &wgpu::Texture,
    placement: Placement,
) {
    let placement = gpu.buffer("viewer.placement", &[placement], BufferUsages::UNIFORM);
    let bindings = gpu.bind_group(
        "viewer.copy",
        &pipeline.get_bind_group_layout(0),
        &[placement.as_entire_binding(), wgpu::BindingResource::TextureView(&view(source))],
    );
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &bindings, &[]);
    pass.draw(0..3, 0..1);
}

const SCREEN: &str = include_str!("shaders/screen.wgsl");
const COPY: &str = include_str!("shaders/copy.wgsl");
const LEVEL: &str = include_str!("shaders/level.wgsl");
const LEVEL_IMAGE: &str = include_str!("shaders/level_image.wgsl");
const LEVEL_SAMPLES: &str = include_str!("shaders/level_samples.wgsl");

/// A pipeline whose triangle covers the target.
fn screen_pipeline(
    gpu: &Gpu,
    fragment: &str,
    entry: &str,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(entry),
        source: wgpu::ShaderSource::Wgsl(format!("{SCREEN}{fragment}").into()),
    });
    let ends = [(&module, "screen_vertex"), (&module, entry)];
    flat_pipeline(gpu, entry, ends, wgpu::PrimitiveTopology::TriangleList, format)
}

/// A pipeline without depth and without vertex buffers, blended by alpha.
fn flat_pipeline(
    gpu: &Gpu,
    label: &str,
    [vertex, fragment]: [(&wgpu::ShaderModule, &str); 2],
    topology: wgpu::PrimitiveTopology,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: None,
        vertex: wgpu::VertexState {
            module: vertex.0,
            entry_point: Some(vertex.1),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { topology, ..Default::default() },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: fragment.0,
            entry_point: Some(fragment.1),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(wgpu::BlendState::ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
