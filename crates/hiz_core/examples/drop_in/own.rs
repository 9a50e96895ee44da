//! The same culling written by hand, as many renderers have it: a reduction by 2x2 texels, and a
//! shader that compares each box with four of them.
//!
//! It stands here to be compared with; `own.wgsl` has the shader.

use super::app::Body;
use super::culling::{CRATES, HOUSES, SIZE, Town, body};
use hiz_core::wgpu::{BufferUsages as Buf, TextureUsages as Tex, util::*, *};

/// Levels of the farthest depths; the first one has half the size of the depth buffer.
const LEVELS: u32 = 10;

pub(crate) struct Own {
    reduce_depth: ComputePipeline,
    reduce: ComputePipeline,
    cull: ComputePipeline,
    levels: Vec<BindGroup>,
    group: BindGroup,
    list: Buffer,
    no_draw: Buffer,
    pub(crate) draw: Buffer,
}

fn seen(binding: u32, view: &TextureView) -> BindGroupEntry<'_> {
    BindGroupEntry { binding, resource: BindingResource::TextureView(view) }
}

fn entry(binding: u32, of: &Buffer) -> BindGroupEntry<'_> {
    BindGroupEntry { binding, resource: of.as_entire_binding() }
}

impl Own {
    pub(crate) fn new(device: &Device, town: &Town) -> Own {
        let source = ShaderSource::Wgsl(include_str!("own.wgsl").into());
        let module = &device.create_shader_module(ShaderModuleDescriptor { label: None, source });
        let [reduce_depth, reduce, cull] = ["reduce_depth", "reduce", "cull"].map(|entry_point| {
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: None,
                layout: None,
                module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                cache: None,
            })
        });
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let rows = town.camera.clip_from_world().map(|row| row.map(|v| v as f32));
        let rows = buffer(bytemuck::bytes_of(&rows), Buf::UNIFORM);
        let boxes: Vec<Body> = (0..CRATES).map(body).collect();
        let boxes = buffer(bytemuck::cast_slice(&boxes), Buf::STORAGE);
        let list = buffer(&[0; 4 * CRATES as usize], Buf::STORAGE | Buf::VERTEX);
        let no_draw: [u32; 8] = [14, 0, 0, 0, 0, 0, 0, 0];
        let no_draw = buffer(bytemuck::bytes_of(&no_draw), Buf::COPY_SRC);
        let of_draw = Buf::STORAGE | Buf::INDIRECT | Buf::COPY_DST | Buf::COPY_SRC;
        let draw = buffer(&[0; 32], of_draw);

        let texture = device.create_texture(&TextureDescriptor {
            label: None,
            size: Extent3d { width: SIZE.width / 2, height: SIZE.height / 2, ..Default::default() },
            mip_level_count: LEVELS,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::R32Float,
            usage: Tex::STORAGE_BINDING | Tex::TEXTURE_BINDING,
            view_formats: &[],
        });
        let view = |base_mip_level| {
            let mip_level_count = Some(1);
            texture.create_view(&TextureViewDescriptor {
                base_mip_level,
                mip_level_count,
                ..Default::default()
            })
        };
        let bind = |pipeline: &ComputePipeline, entries: &[BindGroupEntry<'_>]| {
            let layout = &pipeline.get_bind_group_layout(0);
            device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries })
        };
        let depth = town.app.depth.create_view(&Default::default());
        let mut levels = vec![bind(&reduce_depth, &[seen(0, &depth), seen(2, &view(0))])];
        levels.extend(
            (1..LEVELS).map(|k| bind(&reduce, &[seen(1, &view(k - 1)), seen(2, &view(k))])),
        );
        let all = texture.create_view(&Default::default());
        let buffers = [entry(3, &rows), entry(4, &boxes), entry(6, &draw), entry(7, &list)];
        let group = bind(&cull, &[&buffers[..], &[seen(5, &all)]].concat());
        Own { reduce_depth, reduce, cull, levels, group, list, no_draw, draw }
    }

    /// The frame of `Town::frame`, with this culling.
    pub(crate) fn frame(&self, device: &Device, town: &Town) -> CommandBuffer {
        let mut encoder = device.create_command_encoder(&Default::default());
        town.app.pass(&mut encoder, true).draw_indexed(0..14, 0, HOUSES);
        encoder.copy_buffer_to_buffer(&self.no_draw, 0, &self.draw, 0, 32);
        let mut pass = encoder.begin_compute_pass(&Default::default());
        for (k, level) in self.levels.iter().enumerate() {
            pass.set_pipeline(if k == 0 { &self.reduce_depth } else { &self.reduce });
            pass.set_bind_group(0, level, &[]);
            let groups = |side: u32| (side >> (k + 1)).max(1).div_ceil(8);
            pass.dispatch_workgroups(groups(SIZE.width), groups(SIZE.height), 1);
        }
        pass.set_pipeline(&self.cull);
        pass.set_bind_group(0, &self.group, &[]);
        pass.dispatch_workgroups(CRATES.div_ceil(64), 1, 1);
        drop(pass);
        let mut pass = town.app.pass(&mut encoder, false);
        pass.set_vertex_buffer(0, self.list.slice(..));
        pass.draw_indexed_indirect(&self.draw, 0);
        drop(pass);
        encoder.finish()
    }
}
