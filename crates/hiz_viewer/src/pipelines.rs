//! The render pipelines of the scene: the picture, the depth before it, and what is measured.

use hiz_core::OCCLUDER_DEPTH_FORMAT;
use hiz_core::wgpu::{self, CompareFunction};

use crate::gpu::Gpu;
use crate::mesh::Vertex;

pub(crate) const COLOUR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Of counts per sample; it is blended, and exact up to 2048.
pub(crate) const COUNT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;

/// Pipelines that draw bodies; all have one bind group.
#[derive(Debug)]
pub(crate) struct Pipelines {
    pub(crate) layout: wgpu::BindGroupLayout,
    /// Colour and depth.
    pub(crate) picture: wgpu::RenderPipeline,
    /// Depth alone.
    pub(crate) depth: wgpu::RenderPipeline,
    /// Darkens where a fragment lies behind the depth that is there.
    pub(crate) in_vain: wgpu::RenderPipeline,
    /// Counts fragments whose depth is the one that is there.
    pub(crate) equal: wgpu::RenderPipeline,
    /// Counts all fragments, without a depth buffer.
    pub(crate) fragments: wgpu::RenderPipeline,
}

/// What is added where fragments are counted.
const ADDED: wgpu::BlendState = {
    let component = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState { color: component, alpha: component }
};

/// What one pipeline differs from another in.
struct Kind {
    label: &'static str,
    /// How a fragment's depth has to compare with the one that is there; `None`: no depth buffer.
    compare: Option<CompareFunction>,
    writes_depth: bool,
    /// The entry point, and the target.
    fragment: Option<(&'static str, wgpu::TextureFormat, Option<wgpu::BlendState>)>,
    samples: u32,
}

impl Pipelines {
    /// For targets of `samples` samples per pixel.
    pub(crate) fn new(gpu: &Gpu, samples: u32) -> Self {
        let buffer = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("viewer.scene"),
            entries: &[
                buffer(0, wgpu::BufferBindingType::Uniform),
                buffer(1, wgpu::BufferBindingType::Storage { read_only: true }),
            ],
        });
        let module = gpu.device.create_shader_module(wgpu::include_wgsl!("shaders/scene.wgsl"));
        let make = |kind: Kind| pipeline(gpu, &layout, &module, &kind);
        // Reversed Z: nearer is greater.
        let picture = make(Kind {
            label: "viewer.picture",
            compare: Some(CompareFunction::Greater),
            writes_depth: true,
            fragment: Some(("shaded", COLOUR_FORMAT, None)),
            samples,
        });
        let depth = make(Kind {
            label: "viewer.depth",
            compare: Some(CompareFunction::Greater),
            writes_depth: true,
            fragment: None,
            samples,
        });
        let dark = wgpu::BlendState::ALPHA_BLENDING;
        let in_vain = make(Kind {
            label: "viewer.in_vain",
            compare: Some(CompareFunction::Less),
            writes_depth: false,
            fragment: Some(("darkened", COLOUR_FORMAT, Some(dark))),
            samples,
        });
        let equal = make(Kind {
            label: "viewer.equal",
            compare: Some(CompareFunction::Equal),
            writes_depth: false,
            fragment: Some(("counted", COUNT_FORMAT, Some(ADDED))),
            samples,
        });
        let fragments = make(Kind {
            label: "viewer.fragments",
            compare: None,
            writes_depth: false,
            fragment: Some(("counted", COUNT_FORMAT, Some(ADDED))),
            samples: 1,
        });
        Self { picture, depth, in_vain, equal, fragments, layout }
    }
}

fn pipeline(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    module: &wgpu::ShaderModule,
    kind: &Kind,
) -> wgpu::RenderPipeline {
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(kind.label),
        bind_group_layouts: &[Some(layout)],
        ..Default::default()
    });
    let targets = kind.fragment.map(|(_, format, blend)| wgpu::ColorTargetState {
        format,
        blend,
        write_mask: wgpu::ColorWrites::ALL,
    });
    let targets = [targets];
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(kind.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("body_vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[
                Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<Vertex>() as u64,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &wgpu::vertex_attr_array![
                        0 => Float32x3, 1 => Sint8x4, 2 => Unorm8x4
                    ],
                }),
                // One body's number per instance, from the list.
                Some(wgpu::VertexBufferLayout {
                    array_stride: 4,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: &wgpu::vertex_attr_array![3 => Uint32],
                }),
            ],
        },
        // Both sides are drawn: the promise is about surfaces, whichever way they face.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: kind.compare.map(|compare| wgpu::DepthStencilState {
            format: OCCLUDER_DEPTH_FORMAT,
            depth_write_enabled: Some(kind.writes_depth),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: kind.samples, ..Default::default() },
        fragment: kind.fragment.map(|(entry, ..)| wgpu::FragmentState {
            module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
