//! Pipelines and bind group layouts on the caller's device, made when first used.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use crate::bounds::{Bounds, BoundsKind};
use crate::camera::{Camera, DepthConvention, ImageSize};
use crate::cull::{self, CullInputs, CullOptions};
use crate::error::{Error, Result};
use crate::instances::{InstanceOptions, Instances};
use crate::layout::CULL_WORKGROUP;
use crate::occluders::{self, MeshData, OccluderOptions, Occluders};
use crate::pyramid::{self, Pyramid, PyramidOptions};
use crate::shader::{self, SourceKind};
use crate::visible::{Visible, VisibleOptions};

/// Everything that is made once a device. Cheap to clone.
///
/// Nothing here submits, polls or maps: `record_*` writes into the caller's encoder, `create_*` makes buffers.
#[derive(Debug, Clone)]
pub struct HizContext {
    shared: Arc<Shared>,
}

/// Tells objects of one context from those of another. (wgpu's own handles compare equal across its instances.)
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ContextId(u64);

impl ContextId {
    fn next() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

#[derive(Debug)]
struct Shared {
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
    occluders: Cache<occluders::PipelineKey, wgpu::RenderPipeline>,
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
    pub(crate) append: bool,
    pub(crate) statistics: bool,
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

impl HizContext {
    /// A context on the caller's device.
    ///
    /// # Errors
    /// [`Error::Limit`] where the device offers less than [`HizContext::required_limits`].
    pub fn new(device: &wgpu::Device) -> Result<Self> {
        Self::with_planted_faults(device, &[])
    }

    /// For tests: a context whose shaders have texts replaced, `(what, by what)`. A suite is trusted once a planted fault
    /// turns it red.
    #[doc(hidden)]
    pub fn with_planted_faults(device: &wgpu::Device, faults: &[(&str, &str)]) -> Result<Self> {
        let (have, need) = (device.limits(), Self::required_limits());
        for (name, need, have) in [
            (
                "max_storage_buffers_per_shader_stage",
                need.max_storage_buffers_per_shader_stage,
                have.max_storage_buffers_per_shader_stage,
            ),
            (
                "max_compute_invocations_per_workgroup",
                need.max_compute_invocations_per_workgroup,
                have.max_compute_invocations_per_workgroup,
            ),
            ("max_compute_workgroup_size_x", need.max_compute_workgroup_size_x, have.max_compute_workgroup_size_x),
            ("max_bind_groups", need.max_bind_groups, have.max_bind_groups),
        ] {
            if have < need {
                return Err(Error::limit(name, u64::from(need), u64::from(have)));
            }
        }
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
        let shared = Shared {
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
            occluders: Cache::new(),
        };
        Ok(Self { shared: Arc::new(shared) })
    }

    /// The limits that a device needs: WebGPU's defaults are enough.
    pub fn required_limits() -> wgpu::Limits {
        wgpu::Limits::default()
    }

    /// The features that a device needs: none. (`DrawTemplate::first_instance` other than 0 needs
    /// `INDIRECT_FIRST_INSTANCE` in the caller's own draw.)
    pub fn required_features() -> wgpu::Features {
        wgpu::Features::empty()
    }

    /// The device that everything of this context lives on.
    pub fn device(&self) -> &wgpu::Device {
        &self.shared.device
    }

    /// An empty pyramid for depth images of `size`.
    ///
    /// # Errors
    /// [`Error::Limit`] past the device's textures or bindings.
    pub fn create_pyramid(&self, size: ImageSize, options: &PyramidOptions) -> Result<Pyramid> {
        Pyramid::new(self, size, options)
    }

    /// Uploads bounding volumes.
    ///
    /// # Errors
    /// [`Error::Invalid`] for arrays that do not agree and, with `strict`, for bad bounds.
    pub fn create_instances(&self, bounds: &Bounds<'_>, options: &InstanceOptions) -> Result<Instances> {
        Instances::new(self, bounds, options)
    }

    /// Buffers for what a cull of `instances` finds.
    ///
    /// # Errors
    /// [`Error::Device`] where the device has no memory for them, or is lost.
    pub fn create_visible(&self, instances: &Instances, options: &VisibleOptions) -> Result<Visible> {
        Visible::new(self, instances, options)
    }

    /// Uploads triangle meshes.
    ///
    /// # Errors
    /// [`Error::Invalid`] for arrays that do not fit and indices out of range.
    pub fn create_occluders(&self, meshes: &[MeshData<'_>], options: &OccluderOptions) -> Result<Occluders> {
        Occluders::new(self, meshes, options)
    }

    /// Records the drawing of `occluders` into `target`, a `Depth32Float` texture view of the camera's size, which is cleared first.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a target of another size or format, [`Error::Invalid`] for a camera that float32 cannot hold.
    pub fn record_occluders(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        occluders: &Occluders,
        camera: &Camera,
        target: &wgpu::TextureView,
    ) -> Result<()> {
        occluders::record(self, encoder, occluders, camera, target)
    }

    /// Records the reduction of a depth image of `camera` into `pyramid`.
    ///
    /// `depth` is a view of a whole 2D texture of one mip level, sample and layer, with the usage `TEXTURE_BINDING` and a depth
    /// format (with stencil: the view's aspect is `DepthOnly`), `R32Float`, or `R32Uint` holding float bits. The reduction has
    /// to be submitted before a cull that uses it, or with it: a cull that runs before it keeps everything.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for sizes or devices that do not agree, [`Error::Invalid`] for other formats.
    pub fn record_reduce(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: &wgpu::TextureView,
        camera: &Camera,
        pyramid: &Pyramid,
    ) -> Result<()> {
        pyramid::record_reduce(self, encoder, depth, camera, pyramid)
    }

    /// Records the cull of `instances` against `pyramid`, whose depth image must be `camera`'s; `visible` takes what is found.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for objects that do not belong together, [`Error::Invalid`] for unusable options or cameras.
    pub fn record_cull(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Pyramid,
        visible: &Visible,
        options: &CullOptions,
    ) -> Result<()> {
        cull::record(self, encoder, &CullInputs { instances, camera, pyramid, options }, visible)
    }

    pub(crate) fn layouts(&self) -> &Layouts {
        &self.shared.layouts
    }

    pub(crate) fn sampler(&self) -> &wgpu::Sampler {
        &self.shared.sampler
    }

    /// Chunk `i` of a pyramid, or what stands in for it.
    pub(crate) fn chunk<'a>(&'a self, pyramid: &'a Pyramid, i: usize) -> &'a wgpu::Buffer {
        pyramid.chunks.get(i).unwrap_or_else(|| &self.shared.no_chunk[i - 1])
    }

    /// A uniform buffer that holds `value` from the start: no queue is needed, and every recording has its own.
    pub(crate) fn uniform<T: bytemuck::Pod>(&self, label: &str, value: &T) -> Result<wgpu::Buffer> {
        self.filled(label, bytemuck::bytes_of(value), wgpu::BufferUsages::UNIFORM)
    }

    /// A buffer that holds `contents` (a multiple of 4 bytes) from the start. (wgpu's own helper panics where a lost device or
    /// memory that ran out leave nothing to map.)
    pub(crate) fn filled(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        let buffer = self.shared.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: contents.len() as u64,
            usage,
            mapped_at_creation: true,
        });
        write_mapped(label, &buffer, 0, contents)?;
        buffer.unmap();
        Ok(buffer)
    }

    pub(crate) fn id(&self) -> ContextId {
        self.shared.id
    }

    pub(crate) fn check_context(&self, parameter: &str, theirs: ContextId) -> Result<()> {
        if theirs == self.shared.id {
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
        self.shared.reduce.get(key, || {
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
        self.shared.cull.get(key, || {
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
        self.shared.explain.get(key, || {
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
        self.shared.compact.get(entry_point, || {
            self.pipeline("hiz.compact.pipeline", &shader::compact(), entry_point, &[&self.layouts().compact], &[])
        })
    }

    pub(crate) fn occluder_pipeline(&self, key: occluders::PipelineKey) -> wgpu::RenderPipeline {
        self.shared.occluders.get(key, || occluders::pipeline(self, key))
    }

    fn pipeline(
        &self,
        label: &str,
        source: &str,
        entry_point: &str,
        groups: &[&wgpu::BindGroupLayout],
        constants: &[(&str, f64)],
    ) -> wgpu::ComputePipeline {
        let device = &self.shared.device;
        let source = self.shared.edits.iter().fold(source.to_owned(), |text, (what, by)| text.replace(what, by));
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

fn classify_constants(key: &CullKey) -> [(&'static str, f64); 5] {
    [
        ("REVERSED", flag(key.reversed)),
        ("CHUNKS", key.chunks as f64),
        ("SAMPLE_COVERAGE", flag(key.sample_coverage)),
        ("FOOTPRINT_LOG2", f64::from(key.footprint_log2)),
        ("DESCENT", flag(key.descent)),
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
    pub(crate) one_uniform: wgpu::BindGroupLayout,
    pub(crate) one_storage: wgpu::BindGroupLayout,
    pub(crate) occluder_view: wgpu::BindGroupLayout,
}

const SOURCES: [SourceKind; 3] = [SourceKind::Depth, SourceKind::Float, SourceKind::Bits];

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

// `required_limits` promises what WebGPU's defaults give.
const _: () = assert!(CULL_WORKGROUP <= 256);
