//! The verdicts of the members of groups that were hidden as a whole, which a cull leaves to
//! whoever reads them.

use std::sync::Arc;

use super::{Coverage, CullOptions, ViewUniform, is_grouped};
use crate::camera::Camera;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::instances::Instances;
use crate::pyramid::{Pyramid, entry};
use crate::shader::DepthStore;
use crate::tolerance::DepthTolerance;
use crate::visible::Visible;

/// Groups that one workgroup tells; `shaders/refine.wgsl`.
const WORKGROUP: u32 = 64;

/// Of a group's word, what is its verdict; the next bit says that its members have theirs
/// (`shaders/refine.wgsl`, `TOLD`).
pub(crate) const VERDICT_MASK: u8 = 3;

/// What is left to be done of a cull that tested groups.
#[derive(Debug)]
pub(crate) struct Refinement {
    view: ViewUniform,
    options: CullOptions,
    /// Its levels are asked which one would be read.
    pyramid: Arc<Pyramid>,
    visible: Arc<Visible>,
}

impl Refinement {
    /// Of a cull that was recorded; nothing where every place has a verdict of its own, or none was
    /// asked for.
    pub(crate) fn new(
        instances: &Instances,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
        visible: &Arc<Visible>,
    ) -> Result<Option<Self>> {
        let is_needed =
            visible.outputs().verdicts && instances.pieces.iter().any(|p| is_grouped(p, options));
        if !is_needed {
            return Ok(None);
        }
        // Of no reduction in particular: no depth is read.
        let view = ViewUniform::new(camera, 1, options, DepthTolerance::NONE)?;
        let (pyramid, visible) = (Arc::clone(pyramid), Arc::clone(visible));
        Ok(Some(Self { view, options: options.clone(), pyramid, visible }))
    }

    /// Records it.
    /// It may run more than once, and the first time counts.
    pub(crate) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
    ) -> Result<()> {
        let view = gpu.uniform("hiz.refine.view", &self.view)?;
        let view = gpu.bind_group(
            "hiz.refine.view",
            gpu.layouts().cull(DepthStore::Nowhere),
            &[
                entry(2, self.pyramid.uniform.as_entire_binding()),
                entry(6, view.as_entire_binding()),
            ],
        )?;
        let is_sample = self.options.coverage == Coverage::Sample;
        let (of_groups, of_members) =
            (gpu.refine_groups_pipeline()?, gpu.refine_pipeline(instances.kind, is_sample)?);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("hiz.refine.pass"),
            timestamp_writes: None,
        });
        pass.set_bind_group(0, &view, &[]);
        for (piece, output) in instances.pieces.iter().zip(&self.visible.pieces) {
            let Some(groups) = output.groups().filter(|_| is_grouped(piece, &self.options)) else {
                continue;
            };
            let verdicts = gpu.bind_group(
                "hiz.refine.verdicts",
                &gpu.layouts().two_storages,
                &[
                    entry(0, output.mask.as_entire_binding()),
                    entry(1, groups.verdicts.as_entire_binding()),
                ],
            )?;
            pass.set_bind_group(2, &verdicts, &[]);
            if !is_sample {
                pass.set_pipeline(&of_groups);
                pass.set_bind_group(1, &piece.group_bindings, &[]);
                pass.dispatch_workgroups(piece.groups().div_ceil(WORKGROUP), 1, 1);
            }
            pass.set_pipeline(&of_members);
            pass.set_bind_group(1, &piece.bindings, &[]);
            pass.dispatch_workgroups(piece.groups().div_ceil(WORKGROUP), 1, 1);
        }
        Ok(())
    }
}
