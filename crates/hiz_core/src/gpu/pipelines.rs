//! The one cache of pipelines.
//!
//! The key of a pipeline is its module, its entry point and its constants.
//! A render pipeline's key contains its fixed-function state as well.

use std::cell::Cell;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::error::Result;
use crate::gpu::shader::Source;
use crate::host::threads::Locked;

/// A compute pipeline, described by the stage that asks for it.
#[derive(Debug)]
pub(crate) struct Compute<'a> {
    pub(crate) label: &'static str,
    pub(crate) source: Source,
    pub(crate) entry_point: &'static str,
    /// The module determines the layouts, so they are no part of the key.
    pub(crate) layouts: &'a [wgpu::BindGroupLayout],
    pub(crate) constants: &'a [(&'static str, f64)],
}

/// A render pipeline without a fragment stage, which draws triangles into a depth attachment.
#[derive(Debug)]
pub(crate) struct Depth<'a> {
    pub(crate) label: &'static str,
    pub(crate) source: Source,
    pub(crate) entry_point: &'static str,
    pub(crate) layouts: &'a [wgpu::BindGroupLayout],
    pub(crate) state: DepthState,
}

/// The fixed-function state of a [`Depth`] pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct DepthState {
    pub(crate) format: wgpu::TextureFormat,
    pub(crate) compare: wgpu::CompareFunction,
    /// Faces that are not drawn; the corners of a front face run counter-clockwise.
    pub(crate) cull_mode: Option<wgpu::Face>,
    /// The vertex buffers, in the order of their slots.
    pub(crate) buffers: &'static [wgpu::VertexBufferLayout<'static>],
}

/// 1 for true and 0 for false: the value of a WGSL `override` constant.
pub(crate) fn flag(value: bool) -> f64 {
    f64::from(u8::from(value))
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Key {
    source: Source,
    entry_point: &'static str,
    /// The values as bits, which can be compared and hashed.
    constants: Vec<(&'static str, u64)>,
    state: Option<DepthState>,
}

#[derive(Debug, Clone)]
enum Pipeline {
    Compute(wgpu::ComputePipeline),
    Depth(wgpu::RenderPipeline),
}

type Slot = Arc<Locked<Option<Pipeline>>>;

/// All pipelines of a device.
#[derive(Debug, Default)]
pub(crate) struct Pipelines(Locked<HashMap<Key, Slot>>);

impl Pipelines {
    /// The compute pipeline that `recipe` describes, made by `make` on first use.
    pub(crate) fn compute(
        &self,
        recipe: &Compute<'_>,
        make: impl FnOnce() -> Result<wgpu::ComputePipeline>,
    ) -> Result<wgpu::ComputePipeline> {
        let key = Key {
            source: recipe.source.clone(),
            entry_point: recipe.entry_point,
            constants: recipe.constants.iter().map(|(name, v)| (*name, v.to_bits())).collect(),
            state: None,
        };
        match self.get(key, || make().map(Pipeline::Compute))? {
            Pipeline::Compute(pipeline) => Ok(pipeline),
            Pipeline::Depth(_) => unreachable!("a key without a depth state"),
        }
    }

    /// The render pipeline that `recipe` describes, made by `make` on first use.
    pub(crate) fn depth(
        &self,
        recipe: &Depth<'_>,
        make: impl FnOnce() -> Result<wgpu::RenderPipeline>,
    ) -> Result<wgpu::RenderPipeline> {
        let key = Key {
            source: recipe.source.clone(),
            entry_point: recipe.entry_point,
            constants: Vec::new(),
            state: Some(recipe.state),
        };
        match self.get(key, || make().map(Pipeline::Depth))? {
            Pipeline::Depth(pipeline) => Ok(pipeline),
            Pipeline::Compute(_) => unreachable!("a key with a depth state"),
        }
    }

    /// The pipeline with this key, made by `make` on first use.
    ///
    /// While a pipeline is made only the lock of its own slot is held.
    /// Two threads that want the same pipeline compile it once.
    /// Threads that want other pipelines do not wait.
    fn get(&self, key: Key, make: impl FnOnce() -> Result<Pipeline>) -> Result<Pipeline> {
        let start = Instant::now();
        let slot = Arc::clone(self.0.lock().entry(key).or_default());
        let mut held = slot.lock();
        let (pipeline, count) = match &*held {
            Some(there) => (there.clone(), 0),
            None => (held.insert(make()?).clone(), 1),
        };
        drop(held);
        MADE.with(|all| all.set(all.get().and(count, start.elapsed())));
        Ok(pipeline)
    }
}

/// How many pipelines a thread has made, and the time it spent on getting pipelines.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PipelinesMade {
    /// The number of pipelines made.
    pub(crate) count: u32,
    /// The time spent on getting pipelines, those from the cache included.
    pub(crate) time: Duration,
}

thread_local! {
    static MADE: Cell<PipelinesMade> =
        const { Cell::new(PipelinesMade { count: 0, time: Duration::ZERO }) };
}

impl PipelinesMade {
    /// The totals of this thread.
    pub(crate) fn so_far() -> Self {
        MADE.get()
    }

    /// The difference from `earlier`, which must come from the same thread.
    pub(crate) fn since(self, earlier: Self) -> Self {
        Self { count: self.count - earlier.count, time: self.time - earlier.time }
    }

    fn and(self, count: u32, time: Duration) -> Self {
        Self { count: self.count.wrapping_add(count), time: self.time + time }
    }
}
