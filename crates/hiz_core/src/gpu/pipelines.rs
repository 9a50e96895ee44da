//! The one cache of pipelines.
//! A pipeline is told from others by its module, its entry point and its constants, and one that
//! draws by its fixed-function state besides.

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
    /// Those of the module, so they tell no pipeline from another.
    pub(crate) layouts: &'a [wgpu::BindGroupLayout],
    pub(crate) constants: &'a [(&'static str, f64)],
}

/// A pipeline of a vertex shader that draws triangles into a depth attachment alone.
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
    /// Front faces are counter-clockwise.
    pub(crate) cull_mode: Option<wgpu::Face>,
    /// Bytes from one vertex to the next.
    pub(crate) stride: u64,
    pub(crate) attributes: &'static [wgpu::VertexAttribute],
}

/// 1 for true: a constant of WGSL that a module compares with 0 or reads as a bool.
pub(crate) fn flag(value: bool) -> f64 {
    f64::from(u8::from(value))
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Key {
    source: Source,
    entry_point: &'static str,
    /// The numbers as their bits, which can be compared.
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
    /// The pipeline of `recipe`, made if it was not asked for before.
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

    /// The same for one that draws.
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

    /// A slot's own lock is held while its pipeline is made: two threads that want the same one
    /// compile it once, and nobody who wants another one waits.
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

/// What a thread has spent on getting pipelines.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PipelinesMade {
    /// How many it made.
    pub(crate) count: u32,
    /// How long it took to get them, also those that were there.
    pub(crate) time: Duration,
}

thread_local! {
    static MADE: Cell<PipelinesMade> =
        const { Cell::new(PipelinesMade { count: 0, time: Duration::ZERO }) };
}

impl PipelinesMade {
    /// All that this thread has.
    pub(crate) fn so_far() -> Self {
        MADE.get()
    }

    /// Since `earlier`, on the same thread.
    pub(crate) fn since(self, earlier: Self) -> Self {
        Self { count: self.count - earlier.count, time: self.time - earlier.time }
    }

    fn and(self, count: u32, time: Duration) -> Self {
        Self { count: self.count.wrapping_add(count), time: self.time + time }
    }
}
