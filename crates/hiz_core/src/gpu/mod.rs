//! The device and what is made once on it: pipelines (when first used), bind group layouts, buffers
//! with contents.

mod checked;
mod layouts;

use std::cell::Cell;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::hash::Hash;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

pub(crate) use checked::checked;
use layouts::Layouts;

use crate::bounds::BoundsKind;
use crate::error::{Error, Result};
use crate::shader::{self, DepthStore, SourceKind};
use crate::visible::NO_SURVIVORS;

/// Tells objects of one context from those of another.
/// (wgpu's own handles compare equal across its instances.)
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ContextId(u64);

impl ContextId {
    fn next() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// The device, and everything that is made once on it.
#[derive(Debug)]
pub(crate) struct Gpu {
    id: ContextId,
    device: wgpu::Device,
    limits: wgpu::Limits,
    pipeline_cache: Option<wgpu::PipelineCache>,
    edits: Vec<(String, String)>,
    layouts: Layouts,
    sampler: wgpu::Sampler,
    /// What is bound where a pipeline asks for a buffer that a call does without.
    stand_in: [wgpu::Buffer; STAND_INS.len()],
    /// How the survivors of a cull of groups begin.
    no_survivors: OnceLock<wgpu::Buffer>,
    reduce: Cache<ReduceKey, wgpu::ComputePipeline>,
    cull: Cache<(CullKey, ReportKey), wgpu::ComputePipeline>,
    cull_groups: Cache<(CullKey, bool), wgpu::ComputePipeline>,
    yardstick_cull: Cache<(CullKey, ReportKey), wgpu::ComputePipeline>,
    cull_members: Cache<(CullKey, ReportKey), wgpu::ComputePipeline>,
    refine: Cache<(BoundsKind, bool), wgpu::ComputePipeline>,
    refine_groups: Cache<(), wgpu::ComputePipeline>,
    explain: Cache<CullKey, wgpu::ComputePipeline>,
    compact: Cache<&'static str, wgpu::ComputePipeline>,
    count: Cache<(), wgpu::ComputePipeline>,
    update: Cache<&'static str, wgpu::ComputePipeline>,
    occluders: Cache<OccluderKey, wgpu::RenderPipeline>,
}

/// What makes one pipeline of the reduction differ from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ReduceKey {
    pub(crate) source: SourceKind,
    pub(crate) reversed: bool,
    pub(crate) chunks: usize,
    /// Neighbouring invocations read below each other.
    pub(crate) tall: bool,
    pub(crate) shape: ReduceShape,
}

/// The shaders of the reduction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum ReduceShape {
    /// `shaders/reduce.wgsl`; `first`: the first level that is stored, above the one that is read.
    Blocks { from_source: bool, first: u32 },
    /// Its entry point for all levels that are left.
    Tail,
    /// `shaders/reduce_coarse.wgsl`; `shared`: a texel takes a workgroup.
    Coarse { shared: bool },
}

/// Buffers that a pipeline may ask for and a call do without.
/// Each has its own: one may not be bound twice to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StandIn {
    /// The second chunk of a pyramid.
    Chunk1,
    /// The third.
    Chunk2,
    /// A list of indices.
    List,
    /// Draw arguments.
    Draws,
    /// Counts of levels.
    Statistics,
}

const STAND_INS: [&str; 5] =
    ["hiz.no_chunk_1", "hiz.no_chunk_2", "hiz.no_list", "hiz.no_draws", "hiz.no_statistics"];

/// As large as the largest structure that is bound so.
const STAND_IN_BYTES: u64 = 256;

/// What makes one cull pipeline differ from another; each is compiled without the branches that it
/// does not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct CullKey {
    pub(crate) store: DepthStore,
    pub(crate) kind: BoundsKind,
    pub(crate) reversed: bool,
    pub(crate) chunks: usize,
    pub(crate) sample_coverage: bool,
    pub(crate) footprint_log2: u32,
    pub(crate) descent: bool,
    pub(crate) fit_volume: bool,
}

/// What a cull leaves behind; `shaders/shared/report.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct ReportKey {
    pub(crate) mask: bool,
    pub(crate) verdicts: bool,
    pub(crate) append: bool,
    pub(crate) list: bool,
    pub(crate) capped: bool,
    pub(crate) statistics: bool,
}

/// What makes one occluder pipeline differ from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct OccluderKey {
    pub(crate) reversed: bool,
    pub(crate) cull_mode: Option<wgpu::Face>,
}

/// Pipelines by what makes them differ.
#[derive(Debug)]
struct Cache<K, P>(Mutex<HashMap<K, P>>);

impl<K: Hash + Eq, P: Clone> Cache<K, P> {
    fn new() -> Self {
        Self(Mutex::new(HashMap::new()))
    }

    /// The lock is held while a pipeline is made: two threads that want the same one compile it
    /// once.
    fn get(&self, key: K, make: impl FnOnce() -> Result<P>) -> Result<P> {
        let start = Instant::now();
        let mut made = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (pipeline, count) = match made.entry(key) {
            Entry::Occupied(there) => (there.get().clone(), 0),
            Entry::Vacant(free) => (free.insert(make()?).clone(), 1),
        };
        drop(made);
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
    static MADE: Cell<PipelinesMade> = const { Cell::new(PipelinesMade { count: 0, time: Duration::ZERO }) };
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

impl Gpu {
    /// See `HizContext::with_planted_faults`.
    pub(crate) fn new(
        device: &wgpu::Device,
        cache: Option<wgpu::PipelineCache>,
        faults: &[(&str, &str)],
    ) -> Result<Self> {
        let planted = |what: &str| shader::all().iter().any(|module| module.contains(what));
        if let Some((what, _)) = faults.iter().find(|(what, _)| !planted(what)) {
            panic!("planted fault: no shader says {what:?}");
        }
        checked(device, || {
            let stand_in = STAND_INS.map(|label| {
                device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size: STAND_IN_BYTES,
                    usage: wgpu::BufferUsages::STORAGE,
                    mapped_at_creation: false,
                })
            });
            let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("hiz.reduce.sampler"),
                address_mode_u: wgpu::AddressMode::ClampToEdge,
                address_mode_v: wgpu::AddressMode::ClampToEdge,
                ..Default::default()
            });
            Self {
                id: ContextId::next(),
                device: device.clone(),
                limits: device.limits(),
                pipeline_cache: cache,
                edits: faults
                    .iter()
                    .map(|(what, by)| ((*what).to_owned(), (*by).to_owned()))
                    .collect(),
                layouts: Layouts::new(device),
                sampler,
                stand_in,
                no_survivors: OnceLock::new(),
                reduce: Cache::new(),
                cull: Cache::new(),
                refine: Cache::new(),
                refine_groups: Cache::new(),
                explain: Cache::new(),
                compact: Cache::new(),
                count: Cache::new(),
                cull_groups: Cache::new(),
                yardstick_cull: Cache::new(),
                cull_members: Cache::new(),
                update: Cache::new(),
                occluders: Cache::new(),
            }
        })
    }

    /// The device.
    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The caller's cache of compiled pipelines.
    pub(crate) fn pipeline_cache(&self) -> Option<&wgpu::PipelineCache> {
        self.pipeline_cache.as_ref()
    }

    pub(crate) fn limits(&self) -> &wgpu::Limits {
        &self.limits
    }

    pub(crate) fn layouts(&self) -> &Layouts {
        &self.layouts
    }

    pub(crate) fn sampler(&self) -> &wgpu::Sampler {
        &self.sampler
    }

    /// What stands in for a buffer that there is none of.
    pub(crate) fn stand_in(&self, what: StandIn) -> &wgpu::Buffer {
        &self.stand_in[what as usize]
    }

    /// A buffer that holds [`NO_SURVIVORS`].
    pub(crate) fn no_survivors(&self) -> Result<&wgpu::Buffer> {
        if let Some(buffer) = self.no_survivors.get() {
            return Ok(buffer);
        }
        let contents = bytemuck::bytes_of(&NO_SURVIVORS);
        let buffer =
            self.filled("hiz.cull.no_survivors", contents, wgpu::BufferUsages::COPY_SRC)?;
        Ok(self.no_survivors.get_or_init(|| buffer))
    }

    pub(crate) fn id(&self) -> ContextId {
        self.id
    }

    pub(crate) fn check_context(&self, parameter: &str, theirs: ContextId) -> Result<()> {
        if theirs == self.id {
            Ok(())
        } else {
            Err(Error::mismatch(
                parameter,
                "expected an object of this device and context, got one of another",
            ))
        }
    }

    pub(crate) fn reduce_pipeline(&self, key: ReduceKey) -> Result<wgpu::ComputePipeline> {
        let layouts = self.layouts();
        self.reduce.get(key, || {
            let mut constants = vec![
                ("REVERSED", flag(key.reversed)),
                ("CHUNKS", key.chunks as f64),
                ("TALL", flag(key.tall)),
            ];
            let (source, entry_point) = match key.shape {
                ReduceShape::Blocks { from_source, first } => {
                    constants
                        .extend([("FROM_SOURCE", flag(from_source)), ("FIRST", f64::from(first))]);
                    (shader::reduce(key.source), "reduce")
                }
                ReduceShape::Tail => {
                    constants.extend([("FROM_SOURCE", flag(false)), ("FIRST", 1.0)]);
                    (shader::reduce(key.source), "reduce_tail")
                }
                ReduceShape::Coarse { shared } => {
                    constants.push(("SHARED", flag(shared)));
                    (shader::reduce_coarse(key.source), "reduce_coarse")
                }
            };
            self.pipeline(
                "hiz.reduce.pipeline",
                &source,
                entry_point,
                &[layouts.reduce(key.source), &layouts.one_uniform],
                &constants,
            )
        })
    }

    pub(crate) fn cull_pipeline(
        &self,
        key: CullKey,
        report: ReportKey,
    ) -> Result<wgpu::ComputePipeline> {
        let layouts = self.layouts();
        self.cull.get((key, report), || {
            self.pipeline(
                "hiz.cull.pipeline",
                &shader::cull(key.store, key.kind),
                "cull",
                &[layouts.cull(key.store), &layouts.instances, &layouts.visible],
                &[&classify_constants(&key)[..], &report_constants(&report)].concat(),
            )
        })
    }

    /// See `yardstick`.
    pub(crate) fn yardstick_cull_pipeline(
        &self,
        key: CullKey,
        report: ReportKey,
    ) -> Result<wgpu::ComputePipeline> {
        let layouts = self.layouts();
        self.yardstick_cull.get((key, report), || {
            self.pipeline(
                "hiz.yardstick.cull",
                &shader::yardstick_cull(key.store),
                "cull",
                &[layouts.cull(key.store), &layouts.instances, &layouts.visible],
                &[&classify_constants(&key)[..], &report_constants(&report)].concat(),
            )
        })
    }

    pub(crate) fn cull_groups_pipeline(
        &self,
        key: CullKey,
        statistics: bool,
    ) -> Result<wgpu::ComputePipeline> {
        let layouts = self.layouts();
        self.cull_groups.get((key, statistics), || {
            self.pipeline(
                "hiz.cull_groups.pipeline",
                &shader::cull_groups(key.store),
                "cull_groups",
                &[layouts.cull(key.store), &layouts.instances, &layouts.survivors],
                &[&classify_constants(&key)[..], &[("STATISTICS", flag(statistics))]].concat(),
            )
        })
    }

    pub(crate) fn refine_pipeline(
        &self,
        kind: BoundsKind,
        sample_coverage: bool,
    ) -> Result<wgpu::ComputePipeline> {
        self.refine.get((kind, sample_coverage), || {
            self.refining(
                "hiz.refine.pipeline",
                &shader::refine(kind),
                "refine",
                (kind, sample_coverage),
            )
        })
    }

    pub(crate) fn refine_groups_pipeline(&self) -> Result<wgpu::ComputePipeline> {
        let kind = BoundsKind::Box;
        self.refine_groups.get((), || {
            self.refining(
                "hiz.refine_groups.pipeline",
                &shader::refine_groups(),
                "refine_groups",
                (kind, false),
            )
        })
    }

    fn refining(
        &self,
        label: &str,
        source: &str,
        entry_point: &str,
        (kind, sample_coverage): (BoundsKind, bool),
    ) -> Result<wgpu::ComputePipeline> {
        let layouts = self.layouts();
        let store = DepthStore::Nowhere;
        // What is said of depth is all the same: none is read.
        let (reversed, descent, fit_volume) = (false, false, false);
        let key = CullKey {
            store,
            kind,
            reversed,
            chunks: 1,
            sample_coverage,
            footprint_log2: 1,
            descent,
            fit_volume,
        };
        let groups = [layouts.cull(store), &layouts.instances, &layouts.two_storages];
        self.pipeline(label, source, entry_point, &groups, &classify_constants(&key))
    }

    pub(crate) fn cull_members_pipeline(
        &self,
        key: CullKey,
        report: ReportKey,
    ) -> Result<wgpu::ComputePipeline> {
        let layouts = self.layouts();
        self.cull_members.get((key, report), || {
            self.pipeline(
                "hiz.cull_members.pipeline",
                &shader::cull_members(key.store, key.kind),
                "cull_members",
                &[layouts.cull(key.store), &layouts.instances, &layouts.visible, &layouts.members],
                &[&classify_constants(&key)[..], &report_constants(&report)].concat(),
            )
        })
    }

    pub(crate) fn count_pipeline(&self) -> Result<wgpu::ComputePipeline> {
        self.count.get((), || {
            self.pipeline(
                "hiz.count.pipeline",
                &shader::count(),
                "count",
                &[&self.layouts().count],
                &[],
            )
        })
    }

    pub(crate) fn explain_pipeline(&self, key: CullKey) -> Result<wgpu::ComputePipeline> {
        let layouts = self.layouts();
        self.explain.get(key, || {
            self.pipeline(
                "hiz.explain.pipeline",
                &shader::explain(key.store, key.kind),
                "explain",
                &[layouts.cull(key.store), &layouts.instances, &layouts.two_storages],
                &classify_constants(&key),
            )
        })
    }

    pub(crate) fn compact_pipeline(
        &self,
        entry_point: &'static str,
    ) -> Result<wgpu::ComputePipeline> {
        self.compact.get(entry_point, || {
            self.pipeline(
                "hiz.compact.pipeline",
                &shader::compact(),
                entry_point,
                &[&self.layouts().compact],
                &[],
            )
        })
    }

    pub(crate) fn update_pipeline(
        &self,
        entry_point: &'static str,
    ) -> Result<wgpu::ComputePipeline> {
        self.update.get(entry_point, || {
            self.pipeline(
                "hiz.update.pipeline",
                &shader::update(),
                entry_point,
                &[&self.layouts().update],
                &[],
            )
        })
    }

    pub(crate) fn occluder_pipeline(
        &self,
        key: OccluderKey,
        make: impl FnOnce() -> wgpu::RenderPipeline,
    ) -> Result<wgpu::RenderPipeline> {
        self.occluders.get(key, || self.render_pipeline(make))
    }
}

/// A buffer that is mapped at its creation.
/// Threads open ranges of their own.
pub(crate) struct Mapped<'a> {
    label: &'a str,
    buffer: &'a wgpu::Buffer,
}

impl Mapped<'_> {
    /// Bytes of `range`, not empty, which begins at a multiple of 8.
    /// Opening costs more than writing a record.
    pub(crate) fn range(&self, range: std::ops::Range<u64>) -> Result<wgpu::BufferViewMut> {
        let Self { label, buffer } = self;
        buffer
            .get_mapped_range_mut(range)
            .map_err(|e| Error::Device(format!("{label} could not be mapped: {e}")))
    }
}

/// Writes into a buffer that was mapped at its creation.
pub(crate) fn write_mapped(
    label: &str,
    buffer: &wgpu::Buffer,
    offset: u64,
    contents: &[u8],
) -> Result<()> {
    let range = offset..offset + contents.len() as u64;
    Mapped { label, buffer }.range(range)?.copy_from_slice(contents);
    Ok(())
}

fn flag(value: bool) -> f64 {
    f64::from(u8::from(value))
}

fn classify_constants(key: &CullKey) -> [(&'static str, f64); 6] {
    [
        ("REVERSED", flag(key.reversed)),
        ("CHUNKS", key.chunks as f64),
        ("SAMPLE_COVERAGE", flag(key.sample_coverage)),
        ("FOOTPRINT_LOG2", f64::from(key.footprint_log2)),
        ("DESCENT", flag(key.descent)),
        ("FIT_VOLUME", flag(key.fit_volume)),
    ]
}

fn report_constants(key: &ReportKey) -> [(&'static str, f64); 6] {
    [
        ("MASK", flag(key.mask)),
        ("VERDICTS", flag(key.verdicts)),
        ("APPEND", flag(key.append)),
        ("LIST", flag(key.list)),
        ("CAPPED", flag(key.capped)),
        ("STATISTICS", flag(key.statistics)),
    ]
}
