//! The device and what is made once on it: pipelines (when first used), bind group layouts, buffers with contents.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::bounds::BoundsKind;
use crate::camera::DepthConvention;
use crate::error::{Error, Result};
use crate::shader::{self, SOURCES, SourceKind};

/// Tells objects of one context from those of another. (wgpu's own handles compare equal across its instances.)
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
    edits: Vec<(String, String)>,
    layouts: Layouts,
    sampler: wgpu::Sampler,
    /// Stand in for the chunks that a small pyramid does not have.
    no_chunk: [wgpu::Buffer; 2],
    reduce: Cache<ReduceKey, wgpu::ComputePipeline>,
    cull: Cache<CullKey, wgpu::ComputePipeline>,
    explain: Cache<CullKey, wgpu::ComputePipeline>,
    compact: Cache<&'static str, wgpu::ComputePipeline>,
    renumber: Cache<&'static str, wgpu::ComputePipeline>,
    update: Cache<&'static str, wgpu::ComputePipeline>,
    occluders: Cache<OccluderKey, wgpu::RenderPipeline>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct ReduceKey {
    source: SourceKind,
    reversed: bool,
    chunks: usize,
    from_source: bool,
}

/// What makes one cull pipeline differ from another; each is compiled without the branches that it does not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct CullKey {
    pub(crate) source: SourceKind,
    pub(crate) kind: BoundsKind,
    pub(crate) reversed: bool,
    pub(crate) chunks: usize,
    pub(crate) sample_coverage: bool,
    pub(crate) footprint_log2: u32,
    pub(crate) descent: bool,
    pub(crate) fit_volume: bool,
    pub(crate) append: bool,
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

    /// The lock is held while a pipeline is made: two threads that want the same one compile it once.
    fn get(&self, key: K, make: impl FnOnce() -> P) -> P {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).entry(key).or_insert_with(make).clone()
    }
}

impl Gpu {
    /// See `HizContext::with_planted_faults`.
    pub(crate) fn new(device: &wgpu::Device, faults: &[(&str, &str)]) -> Self {
        let no_chunk = ["hiz.pyramid.no_chunk_1", "hiz.pyramid.no_chunk_2"].map(|label| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: 16,
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
        let planted = |what: &str| shader::all().iter().any(|module| module.contains(what));
        if let Some((what, _)) = faults.iter().find(|(what, _)| !planted(what)) {
            panic!("planted fault: no shader says {what:?}");
        }
        Self {
            id: ContextId::next(),
            device: device.clone(),
            edits: faults.iter().map(|(what, by)| ((*what).to_owned(), (*by).to_owned())).collect(),
            layouts: Layouts::new(device),
            sampler,
            no_chunk,
            reduce: Cache::new(),
            cull: Cache::new(),
            explain: Cache::new(),
            compact: Cache::new(),
            renumber: Cache::new(),
            update: Cache::new(),
            occluders: Cache::new(),
        }
    }

    /// The device.
    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    pub(crate) fn layouts(&self) -> &Layouts {
        &self.layouts
    }

    pub(crate) fn sampler(&self) -> &wgpu::Sampler {
        &self.sampler
    }

    /// What stands in for chunk `i`, 1 or 2, of a pyramid that does not have it.
    pub(crate) fn no_chunk(&self, i: usize) -> &wgpu::Buffer {
        &self.no_chunk[i - 1]
    }

    /// A uniform buffer that holds `value` from the start: no queue is needed, and every recording has its own.
    pub(crate) fn uniform<T: bytemuck::Pod>(&self, label: &str, value: &T) -> Result<wgpu::Buffer> {
        self.filled(label, bytemuck::bytes_of(value), wgpu::BufferUsages::UNIFORM)
    }

    /// A buffer that holds `contents` (a multiple of 4 bytes) from the start. (wgpu's own helper panics where a lost device or
    /// memory that ran out leave nothing to map.)
    pub(crate) fn filled(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: contents.len() as u64,
            usage,
            mapped_at_creation: true,
        });
        write_mapped(label, &buffer, 0, contents)?;
        buffer.unmap();
        Ok(buffer)
    }

    /// A buffer of `size` bytes (a multiple of 4) that `fill` writes part by part, by a function of an offset and the bytes that
    /// belong there.
    pub(crate) fn written<T>(
        &self,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
        fill: impl FnOnce(&(dyn Fn(u64, &[u8]) -> Result<()> + Sync)) -> Result<T>,
    ) -> Result<(wgpu::Buffer, T)> {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: true,
        });
        let filled = fill(&|offset, bytes| write_mapped(label, &buffer, offset, bytes))?;
        buffer.unmap();
        Ok((buffer, filled))
    }

    pub(crate) fn id(&self) -> ContextId {
        self.id
    }

    pub(crate) fn check_context(&self, parameter: &str, theirs: ContextId) -> Result<()> {
        if theirs == self.id {
            Ok(())
        } else {
            Err(Error::mismatch(parameter, "expected an object of this device and context, got one of another"))
        }
    }

    pub(crate) fn reduce_pipeline(
        &self,
        source: SourceKind,
        convention: DepthConvention,
        chunks: usize,
        from_source: bool,
    ) -> wgpu::ComputePipeline {
        let key = ReduceKey { source, reversed: convention.is_reversed(), chunks, from_source };
        let layouts = self.layouts();
        self.reduce.get(key, || {
            self.pipeline(
                "hiz.reduce.pipeline",
                &shader::reduce(source),
                "reduce",
                &[layouts.reduce(source), &layouts.one_uniform],
                &[("REVERSED", flag(key.reversed)), ("CHUNKS", chunks as f64), ("FROM_SOURCE", flag(from_source))],
            )
        })
    }

    pub(crate) fn cull_pipeline(&self, key: CullKey) -> wgpu::ComputePipeline {
        let layouts = self.layouts();
        self.cull.get(key, || {
            let mut constants = classify_constants(&key).to_vec();
            constants.extend([("APPEND", flag(key.append)), ("STATISTICS", flag(key.statistics))]);
            self.pipeline(
                "hiz.cull.pipeline",
                &shader::cull(key.source, key.kind),
                "cull",
                &[layouts.cull(key.source), &layouts.instances, &layouts.visible],
                &constants,
            )
        })
    }

    pub(crate) fn explain_pipeline(&self, key: CullKey) -> wgpu::ComputePipeline {
        let layouts = self.layouts();
        self.explain.get(key, || {
            self.pipeline(
                "hiz.explain.pipeline",
                &shader::explain(key.source, key.kind),
                "explain",
                &[layouts.cull(key.source), &layouts.instances, &layouts.one_storage],
                &classify_constants(&key),
            )
        })
    }

    pub(crate) fn compact_pipeline(&self, entry_point: &'static str) -> wgpu::ComputePipeline {
        self.compact.get(entry_point, || {
            self.pipeline("hiz.compact.pipeline", &shader::compact(), entry_point, &[&self.layouts().compact], &[])
        })
    }

    pub(crate) fn renumber_pipeline(&self, entry_point: &'static str) -> wgpu::ComputePipeline {
        self.renumber.get(entry_point, || {
            self.pipeline("hiz.renumber.pipeline", &shader::renumber(), entry_point, &[&self.layouts().renumber], &[])
        })
    }

    pub(crate) fn update_pipeline(&self, entry_point: &'static str) -> wgpu::ComputePipeline {
        self.update.get(entry_point, || {
            self.pipeline("hiz.update.pipeline", &shader::update(), entry_point, &[&self.layouts().update], &[])
        })
    }

    pub(crate) fn occluder_pipeline(
        &self,
        key: OccluderKey,
        make: impl FnOnce() -> wgpu::RenderPipeline,
    ) -> wgpu::RenderPipeline {
        self.occluders.get(key, make)
    }

    fn pipeline(
        &self,
        label: &str,
        source: &str,
        entry_point: &str,
        groups: &[&wgpu::BindGroupLayout],
        constants: &[(&str, f64)],
    ) -> wgpu::ComputePipeline {
        let device = &self.device;
        let source = self.edits.iter().fold(source.to_owned(), |text, (what, by)| text.replace(what, by));
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let groups: Vec<_> = groups.iter().map(|g| Some(*g)).collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(entry_point),
            // The shaders write workgroup memory before they read it.
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        })
    }
}

/// Writes into a buffer that was mapped at its creation.
pub(crate) fn write_mapped(label: &str, buffer: &wgpu::Buffer, offset: u64, contents: &[u8]) -> Result<()> {
    let range = offset..offset + contents.len() as u64;
    let mut view =
        buffer.get_mapped_range_mut(range).map_err(|e| Error::Device(format!("{label} could not be mapped: {e}")))?;
    view.copy_from_slice(contents);
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

/// The bind group layouts, one place for all passes.
#[derive(Debug)]
pub(crate) struct Layouts {
    reduce: [wgpu::BindGroupLayout; 3],
    cull: [wgpu::BindGroupLayout; 3],
    /// A piece and its records.
    pub(crate) instances: wgpu::BindGroupLayout,
    /// What a cull writes.
    pub(crate) visible: wgpu::BindGroupLayout,
    pub(crate) compact: wgpu::BindGroupLayout,
    pub(crate) renumber: wgpu::BindGroupLayout,
    pub(crate) update: wgpu::BindGroupLayout,
    pub(crate) one_uniform: wgpu::BindGroupLayout,
    pub(crate) one_storage: wgpu::BindGroupLayout,
    pub(crate) occluder_view: wgpu::BindGroupLayout,
}

#[derive(Clone, Copy)]
enum Binding {
    Texture(SourceKind),
    Sampler,
    Uniform,
    Read,
    Write,
}

impl Layouts {
    fn new(device: &wgpu::Device) -> Self {
        use Binding::{Read, Sampler, Texture, Uniform, Write};
        let layout = |label: &str, entries: &[(u32, Binding)]| {
            let entries: Vec<_> = entries.iter().map(|(binding, kind)| layout_entry(*binding, *kind)).collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
        };
        Self {
            reduce: SOURCES.map(|s| {
                layout(
                    "hiz.reduce.layout",
                    &[(0, Texture(s)), (1, Sampler), (2, Uniform), (3, Write), (4, Write), (5, Write)],
                )
            }),
            cull: SOURCES.map(|s| {
                layout(
                    "hiz.cull.view_layout",
                    &[(0, Texture(s)), (2, Uniform), (3, Read), (4, Read), (5, Read), (6, Uniform)],
                )
            }),
            instances: layout("hiz.cull.instances_layout", &[(0, Uniform), (1, Read)]),
            visible: layout("hiz.cull.visible_layout", &[(0, Write), (1, Write), (2, Write), (3, Write), (4, Uniform)]),
            compact: layout(
                "hiz.compact.layout",
                &[(0, Uniform), (1, Read), (2, Write), (3, Write), (4, Write), (5, Uniform)],
            ),
            renumber: layout(
                "hiz.renumber.layout",
                &[(0, Uniform), (1, Read), (2, Read), (3, Write), (4, Write), (5, Read)],
            ),
            update: layout("hiz.update.layout", &[(0, Uniform), (1, Read), (2, Read), (3, Write), (4, Write)]),
            one_uniform: layout("hiz.uniform_layout", &[(0, Uniform)]),
            one_storage: layout("hiz.storage_layout", &[(0, Write)]),
            occluder_view: device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("hiz.occluders.layout"),
                entries: &[wgpu::BindGroupLayoutEntry {
                    visibility: wgpu::ShaderStages::VERTEX,
                    ..layout_entry(0, Uniform)
                }],
            }),
        }
    }

    pub(crate) fn reduce(&self, source: SourceKind) -> &wgpu::BindGroupLayout {
        &self.reduce[source as usize]
    }

    pub(crate) fn cull(&self, source: SourceKind) -> &wgpu::BindGroupLayout {
        &self.cull[source as usize]
    }
}

fn layout_entry(binding: u32, kind: Binding) -> wgpu::BindGroupLayoutEntry {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: match kind {
            Binding::Texture(source) => wgpu::BindingType::Texture {
                sample_type: source.sample_type(),
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            Binding::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering),
            Binding::Uniform => buffer(wgpu::BufferBindingType::Uniform),
            Binding::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            Binding::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        },
        count: None,
    }
}
