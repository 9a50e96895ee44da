//! Uploads: instances with their updates, and occluders.

use std::sync::Arc;

use crate::error::Result;
use crate::headless::engine::Engine;
use crate::headless::readback;
use crate::input::bounds::{Bounds, BoundsKind};
use crate::input::mesh::MeshData;
use crate::instances::from_buffer::{BoundsBuffer, record_instances_from, record_update_from};
use crate::instances::update::record_update;
use crate::instances::{InstanceOptions, Instances};
use crate::occluders::drawing::OccluderOptions;
use crate::occluders::uploaded::Occluders;

impl Engine {
    /// Uploads bounding volumes.
    ///
    /// # Errors
    /// Those of [`HizContext::record_instances`](crate::HizContext::record_instances), and
    /// [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn instances(
        &self,
        bounds: &Bounds<'_>,
        options: &InstanceOptions<'_>,
    ) -> Result<Arc<Instances>> {
        // One part is copied while the next one is packed.
        // So no more than two have a staging buffer at a time.
        let mut before = None;
        let copy = |copies: &dyn Fn(&mut wgpu::CommandEncoder), more: bool| {
            let mut encoder = self.encoder("hiz.instances.encoder");
            copies(&mut encoder);
            let submission = self.queue().submit([encoder.finish()]);
            let before = before.replace(submission);
            if before.is_some() && more { readback::wait(self.device(), before) } else { Ok(()) }
        };
        let gpu = &self.context().gpu;
        self.scoped(|| Instances::new(gpu, bounds, options, true, copy)).map(Arc::new)
    }

    /// [`Engine::instances`] for a single cull, and the commands that have to run before it.
    /// Without groups, the cull tests none.
    pub(super) fn instances_for_one(
        &self,
        bounds: &Bounds<'_>,
        options: &InstanceOptions<'_>,
        has_groups: bool,
    ) -> Result<(Arc<Instances>, Vec<wgpu::CommandBuffer>)> {
        let mut commands = Vec::new();
        let copy = |copies: &dyn Fn(&mut wgpu::CommandEncoder), _: bool| {
            let mut encoder = self.encoder("hiz.instances.encoder");
            copies(&mut encoder);
            commands.push(encoder.finish());
            Ok(())
        };
        let gpu = &self.context().gpu;
        let made = self.scoped(|| Instances::new(gpu, bounds, options, has_groups, copy))?;
        Ok((Arc::new(made), commands))
    }

    /// Replaces the bounds of instances `first..first + n`: it records and submits.
    ///
    /// A cull that was submitted before sees the old bounds, whenever its answer is read.
    /// Any thread may call this.
    /// Updates of the same instances run in the order of the calls.
    ///
    /// # Errors
    /// Those of [`HizContext::record_update`](crate::HizContext::record_update), and
    /// [`Error::DeviceLost`](crate::Error::DeviceLost).
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
            self.timed(&mut encoder, |encoder| {
                record_update(gpu, encoder, instances, first, bounds, strict, |_, range| {
                    updated = range;
                    Ok(())
                })
            })?;
            // Taken late, so that culls on other threads need not wait for the packing above.
            let watches = instances.watches();
            let mut before = self.encoder("hiz.refine.encoder");
            let before = watches.record_refinements(gpu, &mut before)?.then(|| before.finish());
            self.queue().submit(before.into_iter().chain([encoder.finish()]));
            watches.all_refined();
            watches.note(&updated);
            Ok(())
        })
    }

    /// Makes `count` instances whose bounds lie in a buffer of this engine's device.
    ///
    /// # Errors
    /// Those of
    /// [`HizContext::record_instances_from`](crate::HizContext::record_instances_from), and
    /// [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn instances_from<'a>(
        &self,
        source: impl Into<BoundsBuffer<'a>>,
        kind: BoundsKind,
        count: u32,
    ) -> Result<Arc<Instances>> {
        self.scoped(|| {
            let mut encoder = self.encoder("hiz.instances.encoder");
            let gpu = &self.context().gpu;
            let made = record_instances_from(gpu, &mut encoder, &source.into(), kind, count)?;
            self.queue().submit([encoder.finish()]);
            Ok(Arc::new(made))
        })
    }

    /// Takes the bounds of all instances from a buffer of this engine's device: it records and
    /// submits.
    ///
    /// # Errors
    /// Those of [`HizContext::record_update_from`](crate::HizContext::record_update_from), and
    /// [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn update_from<'a>(
        &self,
        instances: &Instances,
        source: impl Into<BoundsBuffer<'a>>,
    ) -> Result<()> {
        self.scoped(|| {
            let _in_order = instances.submitting.lock();
            let gpu = &self.context().gpu;
            let mut encoder = self.encoder("hiz.update.encoder");
            let watches = instances.watches();
            self.timed(&mut encoder, |encoder| {
                record_update_from(gpu, encoder, instances, &source.into(), |encoder| {
                    watches.record_refinements(gpu, encoder).map(drop)
                })
            })?;
            self.queue().submit([encoder.finish()]);
            watches.all_refined();
            watches.note(&(0..instances.len()));
            Ok(())
        })
    }

    /// Uploads triangle meshes as occluders.
    ///
    /// # Errors
    /// Those of [`HizContext::create_occluders`](crate::HizContext::create_occluders), and
    /// [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn occluders(
        &self,
        meshes: &[MeshData<'_>],
        options: &OccluderOptions,
    ) -> Result<Arc<Occluders>> {
        self.scoped(|| self.context().create_occluders(meshes, options)).map(Arc::new)
    }
}
