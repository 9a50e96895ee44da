//! The face of instances: their bounds and their meshes.

use super::HizContext;
use crate::error::Result;
use crate::input::bounds::{Bounds, BoundsKind};
use crate::instances::from_buffer::{BoundsBuffer, record_instances_from, record_update_from};
use crate::instances::update::record_update;
use crate::instances::{InstanceOptions, Instances};
use crate::output::mesh_table::{MeshLods, MeshTable};

#[cfg(doc)]
use crate::error::Error;

/// Instances: their bounds and their meshes.
impl HizContext {
    /// Makes instances from bounding volumes, and records the copies that bring them to the device.
    /// Commands that are recorded later see the bounds.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for arrays whose lengths disagree and, with `strict`, for invalid
    ///   bounds.
    /// - [`Error::Limit`] for more than 2^32 - 1 instances.
    /// - [`Error::OutOfMemory`].
    pub fn record_instances(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        bounds: &Bounds<'_>,
        options: &InstanceOptions<'_>,
    ) -> Result<Instances> {
        Instances::new(&self.gpu, bounds, options, true, |copies, _| {
            self.gpu.recorded(|| {
                copies(encoder);
                Ok(())
            })
        })
    }

    /// Records the replacement of instances `first..first + n` by the `n` given bounds.
    ///
    /// The bounds must be of the same kind as before.
    /// The instances keep their places in the stored order, and the boxes of their groups of 64
    /// follow.
    /// As members drift apart, group boxes grow and cull less.
    /// New [`Instances`] are faster to cull once most instances have moved farther than their
    /// spacing.
    /// With `strict`, invalid bounds are refused, and then nothing has changed.
    ///
    /// Commands that were submitted before see the old bounds; commands that are submitted later
    /// see the new ones.
    /// Submit every update of the same instances, in the order in which they were recorded.
    /// If one is dropped or overtaken, each group that a later update touches is never culled as a
    /// whole again.
    /// This costs time, but nothing visible is culled.
    /// The new records occupy device memory until the submit.
    ///
    /// This call also refines the verdicts of an [`Engine`](crate::headless::Engine)'s earlier
    /// culls from the old bounds.
    /// A cull that is submitted between this call and the submit of its commands is not among them.
    /// Read the verdicts of such a cull before you submit the update.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for another kind of bounds, for instances of another context, and for
    ///   instances whose bounds come from a buffer.
    /// - [`Error::Invalid`] for instances that do not exist, for arrays whose lengths disagree and,
    ///   with `strict`, for invalid bounds.
    /// - [`Error::OutOfMemory`].
    pub fn record_update(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        first: u32,
        bounds: &Bounds<'_>,
        strict: bool,
    ) -> Result<()> {
        record_update(&self.gpu, encoder, instances, first, bounds, strict, |encoder, range| {
            // A recorded command may never run, so the verdicts still count as unrefined.
            // Refining them twice changes nothing.
            let watches = instances.watches();
            watches.record_refinements(&self.gpu, encoder)?;
            watches.note(&range);
            Ok(())
        })
    }

    /// Makes `count` instances whose bounds lie in the caller's buffer, and records that they are
    /// taken from there.
    ///
    /// A shader of the caller's writes the buffer, and the bounds never visit the host.
    /// [`BoundsBuffer`] has the layout of its records.
    /// [`record_update_from`](Self::record_update_from) takes them again, for instance each frame.
    ///
    /// The device validates the bounds, by the same rules as the host.
    /// Invalid ones are kept by every cull, with [`Verdict::Invalid`](crate::Verdict::Invalid).
    /// The instances are stored in the order of the buffer, in groups of 64.
    /// So let neighbours in the buffer be neighbours in space.
    /// Submit these commands before the first cull, or with it.
    ///
    /// Instances from [`record_instances`](Self::record_instances) can take bounds from a buffer,
    /// too.
    /// They stay in the order in which their first bounds were sorted.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for [`BoundsKind::OrientedBox`] and [`BoundsKind::WidePoint`], for an
    ///   offset or a stride that is no multiple of 4, for a stride shorter than a record, and for a
    ///   buffer that is too short or lacks the usage `STORAGE`.
    /// - [`Error::Mismatch`] for a buffer of another device and for a destroyed one.
    /// - [`Error::Limit`] for a stride with which the records exceed one binding.
    /// - [`Error::OutOfMemory`].
    pub fn record_instances_from<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        source: impl Into<BoundsBuffer<'a>>,
        kind: BoundsKind,
        count: u32,
    ) -> Result<Instances> {
        record_instances_from(&self.gpu, encoder, &source.into(), kind, count)
    }

    /// Records that the bounds of all instances are taken from the caller's buffer.
    ///
    /// They are what the buffer holds when these commands run.
    /// Records and group boxes are made anew on the device.
    /// The host does nothing per instance, and from the second call with a buffer on it makes
    /// nothing.
    /// Commands that were submitted before see the old bounds.
    /// Such a recording may be dropped, or submitted in another order than it was recorded.
    ///
    /// From the first call on, the host does not know the bounds.
    /// So it refuses [`record_update`](Self::record_update) and [`Instances::invalid`].
    ///
    /// Like [`record_update`](Self::record_update), this refines the verdicts of an
    /// [`Engine`](crate::headless::Engine)'s earlier culls.
    ///
    /// # Errors
    /// - Those of [`record_instances_from`](Self::record_instances_from).
    /// - [`Error::Mismatch`] for instances of another context, and for instances of which any is
    ///   [`ABSENT`](crate::ABSENT).
    pub fn record_update_from<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        source: impl Into<BoundsBuffer<'a>>,
    ) -> Result<()> {
        record_update_from(&self.gpu, encoder, instances, &source.into(), |encoder| {
            let watches = instances.watches();
            watches.record_refinements(&self.gpu, encoder)?;
            watches.note(&(0..instances.len()));
            Ok(())
        })
    }

    /// Makes a table of meshes, each with its levels of detail.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for no meshes, a mesh without a level of detail, errors that are not
    ///   finite and at least 0, a `first_instance` other than 0, and for draws of which some have
    ///   an index buffer and others have none.
    /// - [`Error::Limit`] for more than [`MAX_LODS`](crate::MAX_LODS) levels of detail of a mesh,
    ///   and for more than 65,536 meshes.
    /// - [`Error::OutOfMemory`].
    pub fn create_mesh_table(&self, meshes: &[MeshLods<'_>]) -> Result<MeshTable> {
        MeshTable::new(&self.gpu, meshes)
    }
}
