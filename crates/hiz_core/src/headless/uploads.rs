//! What is uploaded: instances and their updates, and occluders.

use std::sync::Arc;

use crate::error::Result;
use crate::headless::engine::Engine;
use crate::headless::readback;
use crate::input::bounds::Bounds;
use crate::input::mesh::MeshData;
use crate::instances::update::record_update;
use crate::instances::{InstanceOptions, Instances};
use crate::occluders::{OccluderOptions, Occluders};

impl Engine {
    /// Uploads bounding volumes.
    ///
    /// # Errors
    /// As [`HizContext::record_instances`](crate::HizContext::record_instances), and [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn instances(
        &self,
        bounds: &Bounds<'_>,
        options: &InstanceOptions,
    ) -> Result<Arc<Instances>> {
        // One piece at a time, so that only one has its copy in a staging area.
        let copy = |copies: &dyn Fn(&mut wgpu::CommandEncoder), more: bool| {
            let mut encoder = self.encoder("hiz.instances.encoder");
            copies(&mut encoder);
            let submission = self.queue().submit([encoder.finish()]);
            if more { readback::wait(self.device(), Some(submission)) } else { Ok(()) }
        };
        self.scoped(|| Instances::new(&self.context().gpu, bounds, options, copy)).map(Arc::new)
    }

    /// Replaces instances `first..first + n`: records and submits.
    /// A cull that was submitted before sees the old bounds, whenever its answer is read.
    /// May be called from any thread; updates of the same instances run in the order in which they
    /// come here.
    ///
    /// # Errors
    /// As [`HizContext::record_update`](crate::HizContext::record_update).
    pub fn update(
        &self,
        instances: &Instances,
        first: u32,
        bounds: &Bounds<'_>,
        strict: bool,
    ) -> Result<()> {
        self.scoped(|| {
            let _in_order = instances.submitting.lock();
            let gpu = &self.context().gpu;
            let mut encoder = self.encoder("hiz.update.encoder");
            let mut updated = 0..0;
            record_update(gpu, &mut encoder, instances, first, bounds, strict, |_, range| {
                updated = range;
                Ok(())
            })?;
            // Short, so that culls on other threads do not wait for the packing above.
            let watches = instances.watches();
            let mut before = self.encoder("hiz.refine.encoder");
            let before = watches.record_refinements(gpu, &mut before)?.then(|| before.finish());
            self.queue().submit(before.into_iter().chain([encoder.finish()]));
            watches.all_refined();
            watches.note(&updated);
            Ok(())
        })
    }

    /// Uploads triangle meshes.
    ///
    /// # Errors
    /// As [`HizContext::create_occluders`](crate::HizContext::create_occluders), and [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn occluders(
        &self,
        meshes: &[MeshData<'_>],
        options: &OccluderOptions,
    ) -> Result<Arc<Occluders>> {
        self.scoped(|| self.context().create_occluders(meshes, options)).map(Arc::new)
    }
}
