//! The LODs that the shader chooses, without a cull around it.

use crate::cull::lod::LodRule;
use crate::cull::no_depth::bind_view;
use crate::cull::pipelines::{
    CullKey, Decision, NO_DEPTH, classify_constants, lod_constants, unexplained,
};
use crate::error::Result;
use crate::gpu::buffers::{STORAGE, entry};
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::headless::Engine;
use crate::headless::readback::{self, BufferRange};
use crate::input::bounds::BoundsKind;
use crate::instances::Instances;
use crate::instances::piece::RECORD_BINDINGS;
use crate::output::mesh_table::MAX_LODS;
use crate::pyramid::PyramidUniform;

/// Invocations of a workgroup.
pub(crate) const LANES: u32 = 64;

/// What a LOD is chosen for, besides the bounds.
///
/// Twin: `shaders/testing/choose_lods.wgsl`, `LodCase`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct LodCase {
    /// The number of the mesh.
    pub mesh: u32,
    /// How many LODs it has.
    pub count: u32,
    /// The instance's scale.
    pub scale: f32,
    /// Not read.
    pub padding: u32,
}

/// The shader that writes down LODs.
pub(crate) fn choose_lods_module(kind: BoundsKind) -> Source {
    let entry = [wgsl!("instances/piece"), wgsl!("cull/lod"), wgsl!("testing/choose_lods")];
    unexplained(NO_DEPTH, kind, Decision::Seen, &entry)
}

/// The LOD of each instance by the rule whose numbers `view` holds.
///
/// - `view` is the view's uniform in words, as [`words::view`](crate::testing::words::view) has it.
/// - `instances` are in the order given, in one piece, with a case each.
/// - `errors` has those of each mesh's LODs.
///
/// # Errors
/// [`Error::DeviceLost`](crate::Error::DeviceLost).
pub fn choose_lods(
    engine: &Engine,
    instances: &Instances,
    (rule, view): (&LodRule, &[u32]),
    errors: &[[f32; MAX_LODS]],
    cases: &[LodCase],
) -> Result<Vec<u32>> {
    let gpu = &engine.context().gpu;
    let read = |label, bytes: &[u8]| gpu.filled(label, bytes, wgpu::BufferUsages::STORAGE);
    let errors = read("hiz.choose_lods.errors", bytemuck::cast_slice(errors))?;
    let bytes = 4 * cases.len() as u64;
    let cases = read("hiz.choose_lods.cases", bytemuck::cast_slice(cases))?;
    let chosen = gpu.empty("hiz.choose_lods.chosen", bytes, STORAGE)?;
    let usage = wgpu::BufferUsages::UNIFORM;
    let view = gpu.filled("hiz.choose_lods.view", bytemuck::cast_slice(view), usage)?;
    let no_pyramid: PyramidUniform = bytemuck::Zeroable::zeroed();
    let pyramid = gpu.uniform("hiz.choose_lods.pyramid", &no_pyramid)?;
    let layouts = [
        NO_DEPTH.layout(gpu)?,
        gpu.layout("hiz.cull.instances_layout", RECORD_BINDINGS)?,
        gpu.layout(
            "hiz.choose_lods.layout",
            &[(0, Binding::Read), (1, Binding::Read), (2, Binding::Write)],
        )?,
    ];
    let view = bind_view(gpu, "hiz.choose_lods.view", &pyramid, &view)?;
    let buffers = [&errors, &cases, &chosen];
    let entries = (0..).zip(buffers).map(|(i, buffer)| entry(i, buffer.as_entire_binding()));
    let entries: Vec<_> = entries.collect();
    let buffers = gpu.bind_group("hiz.choose_lods.buffers", &layouts[2], &entries)?;
    let key = CullKey::without_depth(instances.kind, false);
    let pipeline = gpu.compute_pipeline(&Compute {
        label: "hiz.choose_lods.pipeline",
        source: choose_lods_module(instances.kind),
        entry_point: "choose_lods",
        layouts: &layouts,
        constants: &[&classify_constants(&key)[..], &lod_constants(rule)].concat(),
    })?;
    let device = engine.device();
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("hiz.choose_lods.encoder"),
    });
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    let piece = &instances.pieces[0];
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &view, &[]);
    pass.set_bind_group(1, &piece.bindings, &[]);
    pass.set_bind_group(2, &buffers, &[]);
    pass.dispatch_workgroups(piece.count().div_ceil(LANES), 1, 1);
    drop(pass);
    engine.queue().submit([encoder.finish()]);
    let range = [BufferRange::first(&chosen, bytes)];
    let read = readback::read_buffers(device, engine.queue(), &range)?;
    Ok(bytemuck::pod_collect_to_vec(&read[0]))
}
