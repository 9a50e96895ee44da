//! What joins the masks of several views, lent from call to call.

use std::sync::{Arc, Weak};

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::host::threads::Locked;
use crate::instances::Instances;
use crate::output::outputs::Outputs;
use crate::output::views::Joined;

/// How many are kept at most.
const MOST_KEPT: usize = 8;
/// The most bytes on the device of one that is kept.
const MOST_BYTES: u64 = 1 << 24;

#[derive(Debug, Default)]
pub(super) struct JoinedPool(Locked<Vec<Kept>>);

#[derive(Debug)]
struct Kept {
    instances: Weak<Instances>,
    any: Outputs,
    joined: Arc<Joined>,
}

impl JoinedPool {
    /// Buffers for so many views, those of a dropped answer if they fit.
    pub(super) fn lend(
        &self,
        gpu: &Gpu,
        instances: &Arc<Instances>,
        views: usize,
        any: &Outputs,
    ) -> Result<Arc<Joined>> {
        let mut kept = self.0.lock();
        kept.retain(|kept| kept.instances.strong_count() > 0);
        let free = kept.iter_mut().find(|kept| {
            kept.joined.views == views
                && kept.any == *any
                && std::ptr::eq(kept.instances.as_ptr(), Arc::as_ptr(instances))
                && Arc::strong_count(&kept.joined) == 1
        });
        if let Some(free) = free {
            return Ok(Arc::clone(&free.joined));
        }
        drop(kept);
        let joined = Arc::new(Joined::new(gpu, instances, views, any)?);
        // Lists start as 0xFFFFFFFF, which only new ones do.
        if joined.any.lists.is_none() && joined.device_bytes() <= MOST_BYTES {
            let mut kept = self.0.lock();
            if kept.len() == MOST_KEPT {
                kept.remove(0);
            }
            let instances = Arc::downgrade(instances);
            kept.push(Kept { instances, any: any.clone(), joined: Arc::clone(&joined) });
        }
        Ok(joined)
    }

    /// Lends none of these again, after an error on the device.
    pub(super) fn forget(&self) {
        self.0.lock().clear();
    }
}
