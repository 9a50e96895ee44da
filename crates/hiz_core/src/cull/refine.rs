//! The refinement: verdicts for the members of groups that were hidden as a whole.
//!
//! A cull does not write them; they are written before verdicts or counts are first read.

use std::sync::Arc;

use crate::cull::among::Among;
use crate::cull::groups::is_grouped;
use crate::cull::no_depth::{NO_REDUCTION, bind_view};
use crate::cull::options::{Coverage, CullOptions};
use crate::cull::pipelines::{
    CullKey, Decision, NO_DEPTH, TWO_STORAGES, classify_constants, layouts, unexplained,
};
use crate::cull::view_uniform::ViewUniform;
use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::stage_pass;
use crate::input::bounds::BoundsKind;
use crate::input::camera::Camera;
use crate::input::tolerance::DepthTolerance;
use crate::instances::Instances;
use crate::instances::piece::RECORD_BINDINGS;
use crate::instances::watch::Refine;
use crate::output::visible::Visible;
use crate::pyramid::Pyramid;

/// Groups whose members one workgroup refines; `shaders/cull/refine.wgsl`.
pub(crate) const WORKGROUP: u32 = 64;

/// The shader that writes the verdicts of the members of hidden groups.
pub(crate) fn refine_module(kind: BoundsKind, decision: Decision) -> Source {
    let entry = [wgsl!("instances/piece"), wgsl!("instances/groups"), wgsl!("cull/refine")];
    unexplained(NO_DEPTH, kind, decision, &entry)
}

/// The shader that finds the groups that lie within the view.
pub(crate) fn refine_groups_module() -> Source {
    let entry = [wgsl!("instances/tier"), wgsl!("cull/refine_groups")];
    unexplained(NO_DEPTH, BoundsKind::Box, Decision::Seen, &entry)
}

/// The pipeline that refines members.
fn refine_pipeline(gpu: &Gpu, key: &CullKey) -> Result<wgpu::ComputePipeline> {
    let source = refine_module(key.kind, key.decision);
    without_depth(gpu, "hiz.refine.pipeline", source, "refine", key)
}

/// The pipeline that refines groups.
/// It is only valid for area coverage.
fn refine_groups_pipeline(gpu: &Gpu) -> Result<wgpu::ComputePipeline> {
    let label = "hiz.refine_groups.pipeline";
    let key = CullKey::without_depth(BoundsKind::Box, false);
    without_depth(gpu, label, refine_groups_module(), "refine_groups", &key)
}

fn without_depth(
    gpu: &Gpu,
    label: &'static str,
    source: Source,
    entry_point: &'static str,
    key: &CullKey,
) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label,
        source,
        entry_point,
        layouts: &layouts(gpu, key.store, RECORD_BINDINGS, ("hiz.storage_layout", TWO_STORAGES))?,
        constants: &classify_constants(key),
    })
}

/// What a cull that tested groups leaves undone.
#[derive(Debug)]
pub(crate) struct Refinement {
    view: ViewUniform,
    options: CullOptions,
    instances: Arc<Instances>,
    /// The shader asks its layout which level a test would read.
    pyramid: Arc<Pyramid>,
    visible: Arc<Visible>,
    among: Option<Arc<Among>>,
}

impl Refinement {
    /// The refinement of a cull that was recorded.
    /// `None` if every place has a verdict of its own already, or if no verdicts were asked for.
    pub(crate) fn new(
        instances: &Arc<Instances>,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
        visible: &Arc<Visible>,
        among: Option<&Arc<Among>>,
    ) -> Result<Option<Self>> {
        let is_needed =
            visible.outputs().verdicts && instances.pieces.iter().any(|p| is_grouped(p, options));
        if !is_needed {
            return Ok(None);
        }
        let view =
            ViewUniform::new(camera, instances.kind, NO_REDUCTION, options, DepthTolerance::NONE)?;
        Ok(Some(Self {
            view,
            options: options.clone(),
            instances: Arc::clone(instances),
            pyramid: Arc::clone(pyramid),
            visible: Arc::clone(visible),
            among: among.cloned(),
        }))
    }
}

impl Refine for Refinement {
    fn record(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) -> Result<()> {
        let instances = &*self.instances;
        let view = gpu.uniform("hiz.refine.view_uniform", &self.view)?;
        let view = bind_view(gpu, "hiz.refine.view", &self.pyramid.uniform, &view)?;
        let is_sample = self.options.coverage == Coverage::Sample;
        let is_shadow = self.options.shadow.is_some();
        let key = CullKey {
            among: self.among.is_some(),
            decision: if is_shadow { Decision::Shadow } else { Decision::Seen },
            ..CullKey::without_depth(instances.kind, is_sample)
        };
        let (of_groups, of_members) = (refine_groups_pipeline(gpu)?, refine_pipeline(gpu, &key)?);
        let mut pass = stage_pass(encoder, "hiz.refine.pass", "refine");
        pass.set_bind_group(0, &view, &[]);
        for (p, (piece, output)) in instances.pieces.iter().zip(&self.visible.pieces).enumerate() {
            let Some(groups) = output.groups().filter(|_| is_grouped(piece, &self.options)) else {
                continue;
            };
            let verdicts = gpu.bind_group(
                "hiz.refine.verdicts",
                &gpu.layout("hiz.storage_layout", TWO_STORAGES)?,
                &[
                    entry(0, output.mask.as_entire_binding()),
                    entry(1, groups.verdicts.as_entire_binding()),
                ],
            )?;
            pass.set_bind_group(2, &verdicts, &[]);
            // A caster within the view may still shadow no receiver.
            if !is_sample && !is_shadow {
                pass.set_pipeline(&of_groups);
                pass.set_bind_group(1, &piece.group_bindings, &[]);
                pass.dispatch_workgroups(piece.groups().div_ceil(WORKGROUP), 1, 1);
            }
            pass.set_pipeline(&of_members);
            let records = self.among.as_ref().map_or(&piece.bindings, |among| among.records(p));
            pass.set_bind_group(1, records, &[]);
            pass.dispatch_workgroups(piece.groups().div_ceil(WORKGROUP), 1, 1);
        }
        Ok(())
    }
}
