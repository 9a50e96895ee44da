//! Objects that are made once and kept: buffers by label, and the last bind groups by key.

use std::collections::HashMap;

use crate::error::Result;
use crate::host::threads::Locked;

/// Buffers by their label.
#[derive(Debug, Default)]
pub(crate) struct KeptBuffers(Locked<HashMap<&'static str, wgpu::Buffer>>);

impl KeptBuffers {
    /// The buffer with this label, made by `make` on first use.
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

/// The last bind groups, each with the key words that identify it.
///
/// The words are opaque here: the stage that asks for a bind group chooses them.
#[derive(Debug)]
pub(crate) struct KeptBindings {
    most: usize,
    last: Locked<Vec<(Vec<u32>, wgpu::BindGroup)>>,
}

impl KeptBindings {
    /// Keeps `most` bind groups, at least one.
    pub(crate) fn new(most: usize) -> Self {
        Self { most, last: Locked::default() }
    }

    /// The bind group with these key words, made by `make` if it is not among the last ones.
    ///
    /// The oldest one gives way.
    pub(crate) fn get(
        &self,
        words: &[u32],
        make: impl FnOnce() -> Result<wgpu::BindGroup>,
    ) -> Result<wgpu::BindGroup> {
        let mut kept = self.last.lock();
        if let Some((_, bindings)) = kept.iter().find(|(theirs, _)| theirs == words) {
            return Ok(bindings.clone());
        }
        let bindings = make()?;
        if kept.len() == self.most {
            kept.remove(0);
        }
        kept.push((words.to_vec(), bindings.clone()));
        Ok(bindings)
    }

    /// Releases all bind groups, and with them the resources that they hold.
    pub(crate) fn clear(&self) {
        self.last.lock().clear();
    }
}
