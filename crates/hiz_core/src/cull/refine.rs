//! The verdicts of the members of groups that were hidden as a whole, which a cull leaves to whoever reads them.

use std::sync::Arc;

use super::{CullInputs, CullKey, CullOptions, GROUPS_OF_RUN, Seen, is_grouped};
use crate::camera::Camera;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::instances::Instances;
use crate::pyramid::{Pyramid, entry};
use crate::visible::Visible;

/// Of a group's word, what is its verdict; the next bit says that its members have theirs (`shaders/refine.wgsl`, `TOLD`).
pub(crate) const VERDICT_MASK: u8 = 3;

/// What is left to be done of a cull that tested groups.
#[derive(Debug)]
pub(crate) struct Refinement {
    seen: Seen,
    pyramid: Arc<Pyramid>,
    options: CullOptions,
    visible: Arc<Visible>,
}

impl Refinement {
    /// Of a cull that was recorded; nothing where every place has a verdict of its own, or none was asked for.
    pub(crate) fn new(
        gpu: &Gpu,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
        visible: &Arc<Visible>,
    ) -> Result<Option<Self>> {
        let is_needed = visible.outputs().verdicts && instances.pieces.iter().any(|p| is_grouped(p, options));
        if !is_needed {
            return Ok(None);
        }
        let inputs = CullInputs { instances, camera, pyramid, options, certified: true, idle: false };
        let seen = Seen::new(gpu, &inputs, None)?;
        // What is outside is so whatever the depth image shows: a test of it need not look closely.
        let key = CullKey { footprint_log2: 1, descent: false, fit_volume: false, ..seen.key };
        Ok(Some(Self {
            seen: Seen { key, ..seen },
            pyramid: Arc::clone(pyramid),
            options: options.clone(),
            visible: Arc::clone(visible),
        }))
    }

    /// Records it. It may run more than once, and the first time counts.
    pub(crate) fn record(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, instances: &Instances) -> Result<()> {
        let (view, pipeline) = (self.seen.bind(gpu, &self.pyramid)?, gpu.refine_pipeline(self.seen.key)?);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("hiz.refine.pass"),
            timestamp_writes: None,
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &view, &[]);
        for (piece, output) in instances.pieces.iter().zip(&self.visible.pieces) {
            let Some(groups) = output.groups().filter(|_| is_grouped(piece, &self.options)) else { continue };
            let verdicts = gpu.bind_group(
                "hiz.refine.verdicts",
                &gpu.layouts().two_storages,
                &[entry(0, output.mask.as_entire_binding()), entry(1, groups.verdicts.as_entire_binding())],
            )?;
            pass.set_bind_group(1, &piece.bindings, &[]);
            pass.set_bind_group(2, &verdicts, &[]);
            pass.dispatch_workgroups(piece.groups().div_ceil(GROUPS_OF_RUN), 1, 1);
        }
        Ok(())
    }
}
