//! Objects that are made once and kept: buffers by label, and the last values by key.

use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Weak};

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

/// Staging buffers that are mapped, free and all of one size.
#[derive(Debug, Clone)]
pub(crate) struct Ring(Arc<Locked<Free>>);

/// What a ring keeps, and how many of them at most.
#[derive(Debug)]
struct Free {
    buffers: Vec<wgpu::Buffer>,
    most: usize,
}

impl Ring {
    /// Keeps `most` buffers; more than that are released.
    pub(crate) fn new(most: usize) -> Self {
        Self(Arc::new(Locked::new(Free { buffers: Vec::new(), most })))
    }

    /// A free buffer, if there is one: the last that came back, which the caches may still hold.
    pub(crate) fn take(&self) -> Option<wgpu::Buffer> {
        self.0.lock().buffers.pop()
    }

    /// Takes a buffer back, which must be mapped.
    fn give(&self, buffer: wgpu::Buffer) {
        let mut free = self.0.lock();
        if free.buffers.len() < free.most {
            free.buffers.push(buffer);
        }
    }

    /// Has a buffer come back, mapped, when the submission of `encoder` is done.
    pub(crate) fn come_back(&self, encoder: &wgpu::CommandEncoder, buffer: &wgpu::Buffer) {
        let (ring, mapped) = (self.clone(), buffer.clone());
        encoder.map_buffer_on_submit(buffer, wgpu::MapMode::Write, .., move |outcome| {
            if outcome.is_ok() {
                ring.give(mapped);
            }
        });
    }
}

/// Rings by the label and the size of their buffers, each as long as somebody has a share of it.
///
/// Images that take turns write into the same memory then, which the caches hold.
#[derive(Debug, Default)]
pub(crate) struct Rings(Locked<Vec<(RingKey, Weak<Locked<Free>>)>>);

/// What the buffers of a ring are for, and their size in bytes.
type RingKey = (&'static str, u64);

impl Rings {
    /// A share of the ring with this key, for which `kept` more buffers are kept.
    pub(crate) fn share(&self, key: RingKey, kept: usize) -> RingShare {
        let mut rings = self.0.lock();
        rings.retain(|(_, ring)| ring.strong_count() > 0);
        let mut with_key = rings.iter().filter(|(theirs, _)| *theirs == key);
        let ring = with_key.find_map(|(_, ring)| ring.upgrade()).map_or_else(
            || {
                let new = Ring::new(0);
                rings.push((key, Arc::downgrade(&new.0)));
                new
            },
            Ring,
        );
        ring.0.lock().most += kept;
        RingShare { ring, kept }
    }
}

/// A share of a ring that others use, too.
#[derive(Debug)]
pub(crate) struct RingShare {
    ring: Ring,
    kept: usize,
}

impl RingShare {
    pub(crate) fn ring(&self) -> &Ring {
        &self.ring
    }
}

impl Drop for RingShare {
    fn drop(&mut self) {
        let mut free = self.ring.0.lock();
        free.most -= self.kept;
        let most = free.most.min(free.buffers.len());
        let too_many = free.buffers.split_off(most);
        drop(free);
        drop(too_many);
    }
}

/// A buffer of a ring that several recordings read or copy from, in encoders of their own.
///
/// It comes back, mapped, once nobody holds it and each recording is done or dropped.
#[derive(Debug)]
pub(crate) struct Lent {
    buffer: wgpu::Buffer,
    /// Weak, so that no buffer is mapped for a ring that is gone.
    ring: Weak<Locked<Free>>,
}

impl Lent {
    /// Lends a buffer that is not mapped.
    pub(crate) fn new(buffer: wgpu::Buffer, ring: &Ring) -> Arc<Self> {
        Arc::new(Self { buffer, ring: Arc::downgrade(&ring.0) })
    }

    /// The buffer, for bind groups.
    pub(crate) fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// The buffer, which the commands of `encoder` are about to read.
    pub(crate) fn read_by(self: &Arc<Self>, encoder: &wgpu::CommandEncoder) -> &wgpu::Buffer {
        // An encoder that is never submitted drops this, too.
        let held = Arc::clone(self);
        encoder.on_submitted_work_done(move || drop(held));
        &self.buffer
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        let Some(ring) = self.ring.upgrade() else { return };
        let (ring, mapped) = (Ring(ring), self.buffer.clone());
        self.buffer.map_async(wgpu::MapMode::Write, .., move |outcome| {
            if outcome.is_ok() {
                ring.give(mapped);
            }
        });
    }
}

/// What stages have made, by keys of their own types.
///
/// A stage keeps here what takes microseconds to look up part by part, such as its pipelines.
#[derive(Debug, Default)]
pub(crate) struct Known(Locked<Maps>);

/// A `HashMap<K, V>` for the type of each `(K, V)`.
type Maps = HashMap<TypeId, Box<dyn Any + Send>>;

impl Known {
    /// The value with this key, made by `make` on first use.
    pub(crate) fn get<K: Any + Send + Eq + Hash, V: Any + Send + Clone>(
        &self,
        key: K,
        make: impl FnOnce() -> Result<V>,
    ) -> Result<V> {
        if let Some(found) = map_of::<K, V>(&mut self.0.lock()).get(&key) {
            return Ok(found.clone());
        }
        // Without the lock, because a driver may compile here.
        let made = make()?;
        map_of(&mut self.0.lock()).insert(key, made.clone());
        Ok(made)
    }
}

fn map_of<K: Any + Send, V: Any + Send>(maps: &mut Maps) -> &mut HashMap<K, V> {
    let map =
        maps.entry(TypeId::of::<(K, V)>()).or_insert_with(|| Box::new(HashMap::<K, V>::new()));
    map.downcast_mut().expect("a map of these types")
}

/// The last values that were asked for, each with the key that identifies it.
///
/// The key is opaque here: the stage that asks for a value chooses it.
#[derive(Debug)]
pub(crate) struct Kept<K, V> {
    most: usize,
    last: Locked<Vec<(K, V)>>,
}

/// The last bind groups.
pub(crate) type KeptBindings<K> = Kept<K, wgpu::BindGroup>;

impl<K: PartialEq, V: Clone> Kept<K, V> {
    /// Keeps `most` values, at least one.
    pub(crate) fn new(most: usize) -> Self {
        Self { most, last: Locked::default() }
    }

    /// The value with this key, if it is among the last ones.
    pub(crate) fn find(&self, key: &K) -> Option<V> {
        let mut kept = self.last.lock();
        let at = kept.iter().position(|(theirs, _)| theirs == key)?;
        let found = kept.remove(at);
        let value = found.1.clone();
        kept.push(found);
        Some(value)
    }

    /// The value with this key, made by `make` if it is not among the last ones.
    ///
    /// The one that was asked for the longest ago gives way.
    pub(crate) fn get(&self, key: K, make: impl FnOnce() -> Result<V>) -> Result<V> {
        if let Some(value) = self.find(&key) {
            return Ok(value);
        }
        let value = make()?;
        let mut kept = self.last.lock();
        if kept.len() == self.most {
            kept.remove(0);
        }
        kept.push((key, value.clone()));
        Ok(value)
    }

    /// Releases all values, and with them the resources that they hold.
    pub(crate) fn clear(&self) {
        self.last.lock().clear();
    }
}
