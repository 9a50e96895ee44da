//! The library at work: what `hiz_core` records for each kind of frame, and what it leaves.
//!
//! The renderer knows of culling only what this file offers.

use hiz_core::wgpu::{self, BufferUsages};
use hiz_core::{
    Bounds, Camera, CullOptions, Emit, Floats, HizContext, ImageSize, InstanceOptions, Instances,
    Lod, MeshLods, MeshTable, OCCLUDER_DEPTH_FORMAT, Outputs, Placement, Pyramid, PyramidOptions,
    Visible,
};

use crate::Failure;
use crate::gpu::Gpu;
use crate::scene::{Scene, Volumes};
use crate::scene_on_device::OnDevice;
use crate::targets::{Targets, view};

/// A list of bodies on the device, with the arguments of the draws that consume it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DrawList<'a> {
    pub(crate) list: &'a wgpu::Buffer,
    pub(crate) arguments: &'a wgpu::Buffer,
    pub(crate) max_draws: u32,
}

impl DrawList<'_> {
    /// Draws what is listed; vertices, indices and bodies are bound.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(1, self.list.slice(..));
        pass.multi_draw_indexed_indirect(self.arguments, 0, self.max_draws);
    }
}

/// How much nearer than its bounds a body may be rasterised, in proportion to the depth.
///
/// `docs/accuracy.md` says how this was measured, for reversed Z and perspective views.
pub(crate) fn depth_slack(adapter: &wgpu::AdapterInfo) -> f64 {
    if adapter.name.contains("SwiftShader") { 2e-3 } else { 1e-2 }
}

/// Twin: `shaders/bin.wgsl`, `Kind`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct KindRecord {
    first: u32,
    count: u32,
    index_count: u32,
    first_index: u32,
    base_vertex: i32,
}

/// What a frame draws in one of its passes.
#[derive(Debug)]
struct Lists {
    list: wgpu::Buffer,
    arguments: wgpu::Buffer,
    bindings: wgpu::BindGroup,
}

/// What the library keeps between frames.
#[derive(Debug)]
pub(crate) struct Culler {
    hiz: HizContext,
    crowd: Instances,
    visible: Visible,
    pyramid: Pyramid,
    /// A depth image of nothing.
    nothing: wgpu::TextureView,
    options: CullOptions,
    /// What the frame before has kept.
    before: wgpu::Buffer,
    /// Which are left out of a list: none.
    none: wgpu::Buffer,
    bin: wgpu::ComputePipeline,
    /// With several samples per pixel.
    resolve: Option<Resolve>,
    max_draws: u32,
    early: Lists,
    late: Lists,
}

impl Culler {
    pub(crate) fn new(
        gpu: &Gpu,
        hiz: HizContext,
        scene: &Scene,
        on_device: &OnDevice,
        targets: &Targets,
    ) -> Result<Self, Failure> {
        let size = targets.size;
        let bounds = match &scene.volumes {
            Volumes::Boxes { min, max } => {
                Bounds::Boxes { min: Floats::F64(min), max: Floats::F64(max) }
            }
            Volumes::Spheres { centers, radii } => {
                Bounds::Spheres { centers: Floats::F64(centers), radii: Floats::F64(radii) }
            }
        };
        let mut encoder = gpu.encoder("viewer.upload");
        let mesh_ids: Vec<u32> = scene.bodies.iter().map(|body| body.kind).collect();
        let scales: Vec<f32> = scene.bodies.iter().map(|body| body.scale).collect();
        let options = InstanceOptions {
            strict: true,
            mesh_ids: Some(&mesh_ids),
            scales: Some(Floats::F32(&scales)),
            ..InstanceOptions::default()
        };
        let crowd = hiz.record_instances(&mut encoder, &bounds, &options)?;
        gpu.submit(encoder);
        let emit = Emit::Binned {
            meshes: mesh_table(&hiz, scene, on_device)?,
            placement: Placement::Packed,
        };
        let outputs = Outputs { mask: true, indices: true, draws: true, emit, ..Outputs::NONE };
        let visible = hiz.create_visible(&crowd, &outputs)?;
        let mask = visible.mask(0).ok_or("a mask was asked for")?.clone();
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let [before, none] =
            ["viewer.before", "viewer.none"].map(|label| gpu.empty(label, mask.size(), usage));

        let kinds: Vec<_> = on_device
            .draws
            .iter()
            .zip(&on_device.ranges)
            .map(|(lods, range)| KindRecord {
                first: range.start,
                count: range.end - range.start,
                index_count: lods[0].index_count,
                first_index: lods[0].first_index,
                base_vertex: lods[0].base_vertex,
            })
            .collect();
        let max_draws = kinds.len() as u32;
        let kinds = gpu.buffer("viewer.kinds", &kinds, BufferUsages::STORAGE);
        let module = gpu.device.create_shader_module(wgpu::include_wgsl!("shaders/bin.wgsl"));
        let bin = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("viewer.bin"),
            layout: None,
            module: &module,
            entry_point: Some("bin"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let lists = |kept: &wgpu::Buffer, without: &wgpu::Buffer| {
            let list_usage = BufferUsages::STORAGE | BufferUsages::VERTEX;
            let list = gpu.empty("viewer.list", 4 * u64::from(on_device.num_bodies), list_usage);
            let usage = BufferUsages::STORAGE | BufferUsages::INDIRECT | BufferUsages::COPY_SRC;
            let arguments = gpu.empty("viewer.arguments", 20 * u64::from(max_draws), usage);
            let bindings = gpu.bind_group(
                "viewer.bin",
                &bin.get_bind_group_layout(0),
                &[
                    kinds.as_entire_binding(),
                    kept.as_entire_binding(),
                    without.as_entire_binding(),
                    list.as_entire_binding(),
                    arguments.as_entire_binding(),
                ],
            );
            Lists { list, arguments, bindings }
        };
        Ok(Self {
            early: lists(&before, &none),
            late: lists(&mask, &before),
            pyramid: hiz.create_pyramid(size, &PyramidOptions::default())?,
            nothing: nothing(gpu, size),
            resolve: (targets.samples > 1).then(|| Resolve::new(gpu, targets)),
            options: CullOptions {
                depth_slack: depth_slack(&gpu.adapter),
                lod: scene.rule.clone(),
                ..CullOptions::default()
            },
            hiz,
            crowd,
            visible,
            before,
            none,
            bin,
            max_draws,
        })
    }

    /// Makes what depends on the size of the picture anew.
    pub(crate) fn resize(&mut self, gpu: &Gpu, targets: &Targets) -> Result<(), Failure> {
        let size = targets.size;
        self.resolve = (targets.samples > 1).then(|| Resolve::new(gpu, targets));
        self.pyramid = self.hiz.create_pyramid(size, &PyramidOptions::default())?;
        self.nothing = nothing(gpu, size);
        Ok(())
    }

    /// Lists what is in view, whatever hides it.
    pub(crate) fn record_frustum(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
    ) -> Result<(), Failure> {
        self.record_cull(encoder, camera, &self.nothing)
    }

    /// Lists what the depth image of occluders does not hide.
    pub(crate) fn record_one_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
        targets: &Targets,
    ) -> Result<(), Failure> {
        self.record_resolve(encoder);
        self.record_cull(encoder, camera, self.image(targets))
    }

    /// Lists what the frame before has kept.
    pub(crate) fn record_early(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        _camera: &Camera,
    ) -> Result<(), Failure> {
        self.record_lists(encoder, &self.early);
        Ok(())
    }

    /// Lists what the early ones do not hide, and are not themselves.
    pub(crate) fn record_late(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
        targets: &Targets,
    ) -> Result<(), Failure> {
        self.record_resolve(encoder);
        self.record_cull(encoder, camera, self.image(targets))?;
        self.record_lists(encoder, &self.late);
        let mask = self.visible.mask(0).ok_or("a mask was asked for")?;
        encoder.copy_buffer_to_buffer(mask, 0, &self.before, 0, mask.size());
        Ok(())
    }

    /// Builds the pyramid of what was drawn, to be shown.
    pub(crate) fn record_pyramid(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
        targets: &Targets,
    ) -> Result<(), Failure> {
        self.record_resolve(encoder);
        Ok(self.hiz.record_reduce(encoder, self.image(targets), camera, &self.pyramid)?)
    }

    /// The depth image with one sample per pixel that pyramids are built from.
    pub(crate) fn image<'a>(&'a self, targets: &'a Targets) -> &'a wgpu::TextureView {
        self.resolve.as_ref().map_or(&targets.depth, |resolve| &resolve.farthest)
    }

    fn record_resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(resolve) = &self.resolve {
            resolve.record(encoder);
        }
    }

    fn record_cull(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
        depth: &wgpu::TextureView,
    ) -> Result<(), Failure> {
        let Self { hiz, crowd, pyramid, visible, options, .. } = self;
        hiz.record_reduce(encoder, depth, camera, pyramid)?;
        Ok(hiz.record_cull(encoder, crowd, camera, pyramid, visible, options)?)
    }

    fn record_lists(&self, encoder: &mut wgpu::CommandEncoder, lists: &Lists) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("viewer.bin"),
            timestamp_writes: None,
        });
        pass.set_pipeline(&self.bin);
        pass.set_bind_group(0, &lists.bindings, &[]);
        pass.dispatch_workgroups(self.max_draws.div_ceil(64), 1, 1);
    }

    fn draw_list<'a>(&'a self, lists: &'a Lists) -> DrawList<'a> {
        DrawList { list: &lists.list, arguments: &lists.arguments, max_draws: self.max_draws }
    }

    /// What a frame of one pass draws.
    pub(crate) fn kept(&self) -> DrawList<'_> {
        of_visible(&self.visible)
    }

    /// What the first of two passes draws.
    pub(crate) fn early(&self) -> DrawList<'_> {
        self.draw_list(&self.early)
    }

    /// What the second of two passes draws.
    pub(crate) fn late(&self) -> DrawList<'_> {
        self.draw_list(&self.late)
    }

    /// Bits of the bodies that were drawn: those of either buffer.
    pub(crate) fn drawn(&self) -> [&wgpu::Buffer; 2] {
        let mask = self.visible.mask(0).expect("a mask was asked for");
        [mask, &self.none]
    }

    /// The pyramid of the last cull.
    pub(crate) fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }
}

/// The list that a cull has left, with its draws.
fn of_visible(visible: &Visible) -> DrawList<'_> {
    DrawList {
        list: visible.list(0).expect("indices were asked for"),
        arguments: visible.draw_arguments().expect("draws were asked for"),
        max_draws: visible.max_draws(),
    }
}

/// What each LOD of each kind draws, and how far it is from the finest.
fn mesh_table(hiz: &HizContext, scene: &Scene, on_device: &OnDevice) -> Result<MeshTable, Failure> {
    let lods: Vec<Vec<Lod>> = scene
        .kinds
        .iter()
        .zip(&on_device.draws)
        .map(|(kind, draws)| {
            kind.lods.iter().zip(draws).map(|(lod, draw)| Lod::new(*draw, lod.error)).collect()
        })
        .collect();
    let meshes: Vec<_> = lods.iter().map(|lods| MeshLods::new(lods)).collect();
    Ok(hiz.create_mesh_table(&meshes)?)
}

/// A depth image of nothing: reversed Z, so 0 is far.
fn nothing(gpu: &Gpu, size: ImageSize) -> wgpu::TextureView {
    // A new texture holds zeros.
    view(&gpu.texture("viewer.nothing", size, 1, OCCLUDER_DEPTH_FORMAT))
}

/// The farthest sample of each pixel.
#[derive(Debug)]
struct Resolve {
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    farthest: wgpu::TextureView,
}

impl Resolve {
    fn new(gpu: &Gpu, targets: &Targets) -> Self {
        let source = format!(
            "{}{}",
            include_str!("shaders/screen.wgsl"),
            include_str!("shaders/resolve.wgsl")
        );
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("viewer.resolve"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("viewer.resolve"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("screen_vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: OCCLUDER_DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("resolve"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[],
            }),
            multiview_mask: None,
            cache: None,
        });
        let bindings = gpu.bind_group(
            "viewer.resolve",
            &pipeline.get_bind_group_layout(0),
            &[wgpu::BindingResource::TextureView(&targets.depth)],
        );
        let farthest =
            view(&gpu.texture("viewer.farthest", targets.size, 1, OCCLUDER_DEPTH_FORMAT));
        Self { pipeline, bindings, farthest }
    }

    fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("viewer.resolve"),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.farthest,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.draw(0..3, 0..1);
    }
}
