//! What is made once and kept: buffers by their label, and the last bind groups by the words that
//! they stand for.

use std::collections::HashMap;

use crate::error::Result;
use crate::host::threads::Locked;

/// Buffers by their label.
#[derive(Debug, Default)]
pub(crate) struct KeptBuffers(Locked<HashMap<&'static str, wgpu::Buffer>>);

impl KeptBuffers {
    /// The buffer of this label, made if there is none.
    pub(crate) fn get(
        &self,
        label: &'static str,
        make: impl FnOnce() -> Result<wgpu::Buffer>,
    ) -> Result<wgpu::Buffer> {
        let mut kept = self.0.lock();
        if let Some(buffer) = kept.get(label) {
            return Ok(buffer.clone());
        }
        let buffer = make()?;
        kept.insert(label, buffer.clone());
        Ok(buffer)
    }
}

/// How many bind groups are kept: those of a test of instances and of a test of groups, for two
/// views.
const KEPT_BINDINGS: usize = 4;

/// The last bind groups, each by the words that tell it from others.
#[derive(Debug, Default)]
pub(crate) struct KeptBindings(Locked<Vec<(Vec<u32>, wgpu::BindGroup)>>);

impl KeptBindings {
    /// The bind group of these words, made where it is not among the last ones.
    pub(crate) fn get(
        &self,
        words: &[u32],
        make: impl FnOnce() -> Result<wgpu::BindGroup>,
    ) -> Result<wgpu::BindGroup> {
        let mut kept = self.0.lock();
        if let Some((_, bindings)) = kept.iter().find(|(theirs, _)| theirs == words) {
            return Ok(bindings.clone());
        }
        let bindings = make()?;
        if kept.len() == KEPT_BINDINGS {
            kept.remove(0);
        }
        kept.push((words.to_vec(), bindings.clone()));
        Ok(bindings)
    }

    /// Lets go of all.
    pub(crate) fn clear(&self) {
        self.0.lock().clear();
    }
}
