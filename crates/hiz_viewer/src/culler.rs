//! The library at work: what `hiz_core` records for each kind of frame, and what it leaves.
//!
//! The renderer knows of culling only what this file offers.

use hiz_core::wgpu;
use hiz_core::{
    Bounds, Camera, CullOptions, DepthResolve, EarlySet, Emit, Floats, HizContext, InstanceOptions,
    Instances, Lod, MeshLods, MeshTable, OCCLUDER_DEPTH_FORMAT, Outputs, Placement, Pyramid,
    PyramidOptions, ResolveOptions, StageTimer, StageTimesInFlight, Temporal, Visible,
};

use crate::Failure;
use crate::gpu::Gpu;
use crate::scene::{Scene, Volumes};
use crate::scene_on_device::OnDevice;
use crate::targets::Targets;

/// The lists that a cull has left on the device, a bin for each kind and LOD.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DrawList<'a> {
    visible: &'a Visible,
    /// The kinds' numbers of LODs.
    meshes: &'a MeshTable,
    /// Whether the device reads the number of draws by itself.
    counted: bool,
}

impl DrawList<'_> {
    /// Draws what is listed; vertices, indices and bodies are bound.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let visible = self.visible;
        for piece in 0..visible.num_pieces() {
            let list = visible.list(piece).expect("indices were asked for");
            let begin = visible.draw_offset(piece);
            let Some(count) = visible.draw_count() else {
                self.draw_bins(pass, piece, list);
                continue;
            };
            pass.set_vertex_buffer(1, list.slice(..));
            let most = visible.max_draws();
            if self.counted {
                let place = visible.draw_count_offset(piece);
                let arguments = self.arguments();
                pass.multi_draw_indexed_indirect_count(arguments, begin, count, place, most);
            } else {
                // Records behind the last draw are zeros, and draw nothing.
                pass.multi_draw_indexed_indirect(self.arguments(), begin, most);
            }
        }
    }

    /// Draws each bin by itself, for devices without `INDIRECT_FIRST_INSTANCE`.
    fn draw_bins(&self, pass: &mut wgpu::RenderPass<'_>, piece: usize, list: &wgpu::Buffer) {
        for mesh in 0..self.meshes.len() {
            for lod in 0..self.meshes.lods(mesh) {
                let bin = self.visible.bin(piece, mesh, lod);
                let (draw, bytes) = bin.expect("bins have reserved places");
                if !bytes.is_empty() {
                    pass.set_vertex_buffer(1, list.slice(bytes));
                    pass.draw_indexed_indirect(self.arguments(), draw);
                }
            }
        }
    }

    /// The draw arguments: records of zeros, or without instances, draw nothing.
    pub(crate) fn arguments(&self) -> &wgpu::Buffer {
        self.visible.draw_arguments().expect("draws were asked for")
    }
}

/// How much nearer than its bounds a body may be rasterised, in proportion to the depth.
///
/// `docs/accuracy.md` says how this was measured, for reversed Z and perspective views.
pub(crate) fn depth_slack(adapter: &wgpu::AdapterInfo) -> f64 {
    if adapter.name.contains("SwiftShader") { 2e-3 } else { 1e-2 }
}

/// [`depth_slack`] as users read it.
pub(crate) fn slack_in_words(adapter: &wgpu::AdapterInfo) -> String {
    let slack = depth_slack(adapter);
    format!("depth slack: {slack}, the share by which bodies may be drawn nearer than their bounds")
}

/// What the library keeps between frames.
#[derive(Debug)]
pub(crate) struct Culler {
    hiz: HizContext,
    crowd: Instances,
    meshes: MeshTable,
    counted: bool,
    /// What a cull of one pass leaves.
    kept: Visible,
    /// What the two passes leave, and what was visible.
    passes: Temporal,
    sized: OfSize,
    options: CullOptions,
    /// Masks of nothing, and of everything.
    no_bits: wgpu::Buffer,
    all_bits: wgpu::Buffer,
}

/// What depends on the size of the picture.
#[derive(Debug)]
struct OfSize {
    pyramid: Pyramid,
    /// A depth image of nothing: reversed Z, so the zeros of a new texture are far.
    nothing: wgpu::Texture,
    /// With several samples per pixel.
    resolve: Option<DepthResolve>,
}

impl OfSize {
    fn new(gpu: &Gpu, hiz: &HizContext, targets: &Targets) -> Result<Self, Failure> {
        let size = targets.size;
        let resolve = (targets.samples > 1)
            .then(|| hiz.create_depth_resolve(size, &ResolveOptions::default()))
            .transpose()?;
        Ok(Self {
            pyramid: hiz.create_pyramid(size, &PyramidOptions::default())?,
            nothing: gpu.texture("viewer.nothing", size, 1, OCCLUDER_DEPTH_FORMAT),
            resolve,
        })
    }
}

impl Culler {
    pub(crate) fn new(
        gpu: &Gpu,
        hiz: HizContext,
        scene: &Scene,
        on_device: &OnDevice,
        targets: &Targets,
    ) -> Result<Self, Failure> {
        let bounds = bounds(&scene.volumes);
        let mesh_ids: Vec<u32> = scene.bodies.iter().map(|body| body.kind).collect();
        let scales: Vec<f32> = scene.bodies.iter().map(|body| body.scale).collect();
        let options = InstanceOptions {
            strict: true,
            mesh_ids: Some(&mesh_ids),
            scales: Some(Floats::F32(&scales)),
            ..InstanceOptions::default()
        };
        let mut encoder = gpu.encoder("viewer.upload");
        let crowd = hiz.record_instances(&mut encoder, &bounds, &options)?;
        gpu.submit(encoder);

        let features = gpu.device.features();
        let packs = features.contains(wgpu::Features::INDIRECT_FIRST_INSTANCE);
        let placement = if packs { Placement::Packed } else { Placement::Reserved };
        let meshes = mesh_table(&hiz, scene, on_device)?;
        let emit = Emit::Binned { meshes: meshes.clone(), placement };
        let outputs = Outputs { mask: true, indices: true, draws: true, emit, ..Outputs::NONE };
        let kept = hiz.create_visible(&crowd, &outputs)?;
        let mask = kept.mask(0).ok_or("a mask was asked for")?;
        let ones = vec![u32::MAX; mask.size() as usize / 4];
        Ok(Self {
            all_bits: gpu.buffer("viewer.all_bits", &ones, wgpu::BufferUsages::STORAGE),
            no_bits: gpu.empty("viewer.no_bits", mask.size(), wgpu::BufferUsages::STORAGE),
            passes: hiz.create_temporal(&crowd, &outputs)?,
            sized: OfSize::new(gpu, &hiz, targets)?,
            options: CullOptions {
                depth_slack: depth_slack(&gpu.adapter),
                lod: scene.rule.clone(),
                ..CullOptions::default()
            },
            counted: features.contains(wgpu::Features::MULTI_DRAW_INDIRECT_COUNT),
            hiz,
            crowd,
            meshes,
            kept,
        })
    }

    /// Makes what depends on the size of the picture anew.
    pub(crate) fn resize(&mut self, gpu: &Gpu, targets: &Targets) -> Result<(), Failure> {
        self.sized = OfSize::new(gpu, &self.hiz, targets)?;
        Ok(())
    }

    /// Gives all bodies new bounds.
    pub(crate) fn update(&self, gpu: &Gpu, volumes: &Volumes) -> Result<(), Failure> {
        let mut encoder = gpu.encoder("viewer.update");
        self.hiz.record_update(&mut encoder, &self.crowd, 0, &bounds(volumes), true)?;
        gpu.submit(encoder);
        Ok(())
    }

    /// A timer of the library's stages.
    pub(crate) fn timer(&self, gpu: &Gpu) -> Result<StageTimer, Failure> {
        Ok(self.hiz.create_stage_timer(&gpu.queue)?)
    }

    /// Records the copy of what the timer has measured.
    pub(crate) fn record_times(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &StageTimer,
    ) -> Result<StageTimesInFlight, Failure> {
        Ok(self.hiz.record_stage_times(encoder, timer)?)
    }

    /// Forgets what was visible, where the camera jumps.
    pub(crate) fn cut(&self) {
        self.passes.reset();
    }

    /// Lists what is in view, whatever hides it.
    pub(crate) fn record_frustum(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
    ) -> Result<(), Failure> {
        self.hiz.record_reduce(encoder, &self.sized.nothing, camera, &self.sized.pyramid)?;
        self.record_cull(encoder, camera)
    }

    /// Lists what the depth image of occluders does not hide.
    pub(crate) fn record_one_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
        targets: &Targets,
    ) -> Result<(), Failure> {
        self.record_pyramid(encoder, camera, targets)?;
        self.record_cull(encoder, camera)
    }

    fn record_cull(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
    ) -> Result<(), Failure> {
        let Self { hiz, crowd, sized: OfSize { pyramid, .. }, kept, options, .. } = self;
        Ok(hiz.record_cull(encoder, crowd, camera, pyramid, kept, options)?)
    }

    /// Lists what the frame before has shown.
    pub(crate) fn record_early(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
    ) -> Result<(), Failure> {
        let Self { hiz, crowd, passes, options, .. } = self;
        let set = EarlySet::LastVisible;
        Ok(hiz.record_early(encoder, crowd, camera, passes, set, options)?)
    }

    /// Lists what the early ones do not hide, and are not themselves.
    pub(crate) fn record_late(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
        targets: &Targets,
    ) -> Result<(), Failure> {
        self.record_pyramid(encoder, camera, targets)?;
        let Self { hiz, crowd, sized: OfSize { pyramid, .. }, passes, options, .. } = self;
        Ok(hiz.record_late(encoder, crowd, camera, pyramid, passes, options)?)
    }

    /// Builds the pyramid of what was drawn, from the farthest sample of each pixel.
    pub(crate) fn record_pyramid(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
        targets: &Targets,
    ) -> Result<(), Failure> {
        let OfSize { pyramid, resolve, .. } = &self.sized;
        if let Some(resolve) = resolve {
            self.hiz.record_resolve(encoder, &targets.depth, camera, resolve)?;
            return Ok(self.hiz.record_reduce(encoder, resolve.farthest()?, camera, pyramid)?);
        }
        Ok(self.hiz.record_reduce(encoder, &targets.depth, camera, pyramid)?)
    }

    fn draw_list<'a>(&'a self, visible: &'a Visible) -> DrawList<'a> {
        DrawList { visible, meshes: &self.meshes, counted: self.counted }
    }

    /// What a frame of one pass draws.
    pub(crate) fn kept(&self) -> DrawList<'_> {
        self.draw_list(&self.kept)
    }

    /// What the first of two passes draws.
    pub(crate) fn early(&self) -> DrawList<'_> {
        self.draw_list(self.passes.early())
    }

    /// What the second of two passes draws.
    pub(crate) fn late(&self) -> DrawList<'_> {
        self.draw_list(self.passes.late())
    }

    /// Bits of the bodies that a frame of one pass drew; those of either buffer.
    pub(crate) fn drawn_in_one(&self) -> [&wgpu::Buffer; 2] {
        [self.kept.mask(0).expect("a mask was asked for"), &self.no_bits]
    }

    /// Bits of all bodies.
    pub(crate) fn drawn_in_all(&self) -> [&wgpu::Buffer; 2] {
        [&self.all_bits, &self.no_bits]
    }

    /// Bits of the bodies that a frame of two passes drew.
    pub(crate) fn drawn_in_two(&self) -> [&wgpu::Buffer; 2] {
        [self.passes.early(), self.passes.late()].map(|v| v.mask(0).expect("a mask was asked for"))
    }

    /// The pyramid of the last cull.
    pub(crate) fn pyramid(&self) -> &Pyramid {
        &self.sized.pyramid
    }
}

fn bounds(volumes: &Volumes) -> Bounds<'_> {
    match volumes {
        Volumes::Boxes { min, max } => {
            Bounds::Boxes { min: Floats::F64(min), max: Floats::F64(max) }
        }
        Volumes::Spheres { centers, radii } => {
            Bounds::Spheres { centers: Floats::F64(centers), radii: Floats::F64(radii) }
        }
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
