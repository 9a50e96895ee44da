//! A plain wgpu renderer of boxes, in 100 lines, which knows nothing of culling.

use hiz_core::wgpu::{BufferUsages as Buf, TextureUsages as Tex, util::*, *};

/// The low and the high corner, with 1 as the fourth coordinate.
pub(crate) type Body = [[f32; 4]; 2];

/// The targets, of which the depth is reversed, and how boxes are drawn.
pub(crate) struct App {
    pub(crate) picture: Texture,
    pub(crate) depth: Texture,
    /// The numbers of all boxes; the first 14 are the corners of a strip, too.
    list: Buffer,
    group: BindGroup,
    pipeline: RenderPipeline,
}

impl App {
    pub(crate) fn new(device: &Device, size: Extent3d, rows: [[f32; 4]; 4], boxes: &[Body]) -> App {
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let numbers: Vec<u32> = (0..boxes.len() as u32).collect();
        let list = buffer(bytemuck::cast_slice(&numbers), Buf::VERTEX | Buf::INDEX);
        let rows = buffer(bytemuck::bytes_of(&rows), Buf::UNIFORM);
        let boxes = buffer(bytemuck::cast_slice(boxes), Buf::STORAGE);
        let target = |format, usage| {
            device.create_texture(&TextureDescriptor {
                label: None,
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: usage | Tex::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let picture = target(TextureFormat::Rgba8Unorm, Tex::COPY_SRC);
        let depth = target(TextureFormat::Depth32Float, Tex::TEXTURE_BINDING | Tex::COPY_SRC);

        let source = ShaderSource::Wgsl(include_str!("boxes.wgsl").into());
        let module = &device.create_shader_module(ShaderModuleDescriptor { label: None, source });
        let (step_mode, attributes) = (VertexStepMode::Instance, &vertex_attr_array![0 => Uint32]);
        let buffers = &[Some(VertexBufferLayout { array_stride: 4, step_mode, attributes })];
        let (entry_point, compilation_options) = (None, PipelineCompilationOptions::default());
        let vertex = VertexState { module, entry_point, compilation_options, buffers };
        let (targets, compilation_options) = (&[Some(picture.format().into())], Default::default());
        let fragment = FragmentState { module, entry_point, compilation_options, targets };
        let (topology, u32s) = (PrimitiveTopology::TriangleStrip, Some(IndexFormat::Uint32));
        let pipeline = device.create_render_pipeline(&RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex,
            primitive: PrimitiveState { topology, strip_index_format: u32s, ..Default::default() },
            depth_stencil: Some(DepthStencilState {
                format: depth.format(),
                depth_write_enabled: Some(true),
                depth_compare: Some(CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(fragment),
            multiview_mask: None,
            cache: None,
        });
        let layout = &pipeline.get_bind_group_layout(0);
        let entry = |binding, of| (binding, Buffer::as_entire_binding(of));
        let entries = &[entry(0, &rows), entry(1, &boxes)]
            .map(|(binding, resource)| BindGroupEntry { binding, resource });
        let group = device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries });
        Self { picture, depth, list, group, pipeline }
    }

    /// A pass that draws boxes: the first one of a frame clears.
    pub(crate) fn pass<'a>(&self, encoder: &'a mut CommandEncoder, first: bool) -> RenderPass<'a> {
        let view = &self.picture.create_view(&Default::default());
        let depth = &self.depth.create_view(&Default::default());
        let (depth_slice, resolve_target, store) = (None, None, StoreOp::Store);
        let load = if first { LoadOp::Clear(Color::WHITE) } else { LoadOp::Load };
        let ops = Operations { load, store };
        let colour = RenderPassColorAttachment { view, depth_slice, resolve_target, ops };
        let load = if first { LoadOp::Clear(0.0) } else { LoadOp::Load };
        let depth_ops = Some(Operations { load, store });
        let depth = RenderPassDepthStencilAttachment { view: depth, depth_ops, stencil_ops: None };
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            color_attachments: &[Some(colour)],
            depth_stencil_attachment: Some(depth),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_index_buffer(self.list.slice(..), IndexFormat::Uint32);
        pass.set_vertex_buffer(0, self.list.slice(..));
        pass
    }
}
