//! The device, and the objects that are made on it once.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};
use crate::gpu::checked::checked;
use crate::gpu::kept::{Kept, KeptBuffers, Known, Ring, Rings};
use crate::gpu::layouts::{Binding, Layouts};
use crate::gpu::made::Making;
use crate::gpu::pipelines::{Compute, Depth, Pipelines};
#[cfg(feature = "testing")]
use crate::gpu::shader::FILES;
use crate::gpu::shader::Source;

/// Distinguishes the objects of one context from those of another.
///
/// wgpu's handles cannot do that: those of two wgpu instances may compare equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ContextId(u64);

impl ContextId {
    fn next() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// Staging buffers for the numbers of recordings that are kept at most.
const STAGING_KEPT: usize = 16;

/// Large staging buffers are kept for so many sizes, and of each size so many, within so many
/// bytes.
const STAGING_SIZES: usize = 2;
const STAGING_OF_A_SIZE: u64 = 3;
const STAGING_BYTES_OF_A_SIZE: u64 = 64 << 20;

/// A device, its limits, and the objects that are made on it once.
#[derive(Debug)]
pub(crate) struct Gpu {
    id: ContextId,
    device: wgpu::Device,
    limits: wgpu::Limits,
    pipeline_cache: Option<wgpu::PipelineCache>,
    sampler: wgpu::Sampler,
    pub(super) layouts: Layouts,
    pub(super) pipelines: Pipelines,
    /// What the stages keep.
    pub(crate) known: Known,
    pub(super) buffers: KeptBuffers,
    pub(super) ring: Ring,
    /// Staging buffers by their size; see [`Gpu::kept_staging`].
    staging: Kept<u64, Ring>,
    /// Those that images of one size share.
    pub(crate) rings: Rings,
    /// Bound in place of a sampled texture that a call does not read.
    pub(super) no_texels: OnceLock<wgpu::TextureView>,
    /// Bound in place of an atlas.
    pub(super) no_atlas: OnceLock<wgpu::TextureView>,
    pub(crate) making: Making,
    /// Texts of the shaders that are replaced, as (what, by what).
    #[cfg(feature = "testing")]
    faults: Vec<(String, String)>,
}

impl Gpu {
    pub(crate) fn new(device: &wgpu::Device, cache: Option<wgpu::PipelineCache>) -> Result<Self> {
        let sampler = checked(device, || {
            device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("hiz.depth_source.sampler"),
                address_mode_u: wgpu::AddressMode::ClampToEdge,
                address_mode_v: wgpu::AddressMode::ClampToEdge,
                ..Default::default()
            })
        })?;
        Ok(Self {
            id: ContextId::next(),
            device: device.clone(),
            limits: device.limits(),
            pipeline_cache: cache,
            sampler,
            layouts: Layouts::default(),
            pipelines: Pipelines::default(),
            known: Known::default(),
            buffers: KeptBuffers::default(),
            ring: Ring::new(STAGING_KEPT),
            staging: Kept::new(STAGING_SIZES),
            rings: Rings::default(),
            no_texels: OnceLock::new(),
            no_atlas: OnceLock::new(),
            making: Making::default(),
            #[cfg(feature = "testing")]
            faults: Vec::new(),
        })
    }

    /// This device with texts of the shaders replaced, as `(what, by what)`.
    ///
    /// # Panics
    /// If no shader contains one of the texts.
    #[cfg(feature = "testing")]
    pub(crate) fn with_planted_faults(self, faults: &[(&str, &str)]) -> Self {
        for (what, _) in faults {
            let is_there = FILES.iter().any(|file| file.text.contains(what));
            assert!(is_there, "planted fault: no shader says {what:?}");
        }
        let faults = faults.iter().map(|(what, by)| ((*what).to_owned(), (*by).to_owned()));
        Self { faults: faults.collect(), ..self }
    }

    /// The large staging buffers of this size that are free; see [`Ring`].
    ///
    /// A buffer that is made anew is zeroed by wgpu, and its pages may be new to the process.
    pub(crate) fn kept_staging(&self, bytes: u64) -> Result<Ring> {
        let most = (STAGING_BYTES_OF_A_SIZE / bytes.max(1)).min(STAGING_OF_A_SIZE);
        self.staging.get(bytes, || Ok(Ring::new(most as usize)))
    }

    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    pub(crate) fn limits(&self) -> &wgpu::Limits {
        &self.limits
    }

    /// A sampler with nearest filtering, which clamps to the border pixels.
    pub(crate) fn sampler(&self) -> &wgpu::Sampler {
        &self.sampler
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

    pub(crate) fn checked<T>(&self, make: impl FnOnce(&wgpu::Device) -> T) -> Result<T> {
        checked(&self.device, || make(&self.device))
    }

    /// The layout of these bindings, made on first use.
    pub(crate) fn layout(
        &self,
        label: &str,
        bindings: &[(u32, Binding)],
    ) -> Result<wgpu::BindGroupLayout> {
        self.layouts.get(bindings, |entries| {
            self.checked(|device| {
                device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                    label: Some(label),
                    entries,
                })
            })
        })
    }

    /// The pipeline that `recipe` describes, made on first use.
    pub(crate) fn compute_pipeline(&self, recipe: &Compute<'_>) -> Result<wgpu::ComputePipeline> {
        let Compute { label, source, entry_point, layouts, constants } = recipe;
        self.pipelines.compute(recipe, || {
            self.making.pipelines.add();
            self.checked(|device| {
                device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(label),
                    layout: Some(&self.pipeline_layout(label, layouts)),
                    module: &self.shader_module(label, source),
                    entry_point: Some(entry_point),
                    // Not needed: the shaders write workgroup memory before they read it.
                    compilation_options: wgpu::PipelineCompilationOptions {
                        constants,
                        zero_initialize_workgroup_memory: false,
                    },
                    cache: self.pipeline_cache.as_ref(),
                })
            })
        })
    }

    /// Whether the device is a processor, such as lavapipe or SwiftShader.
    pub(crate) fn is_processor(&self) -> bool {
        self.device.adapter_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Whether shaders may read buffers that the host has mapped before: on a processor, where both
    /// share the memory, with the feature for it.
    pub(crate) fn reads_mapped(&self) -> bool {
        let feature = wgpu::Features::MAPPABLE_PRIMARY_BUFFERS;
        self.is_processor() && self.device.features().contains(feature)
    }

    /// The pipeline that `recipe` describes, made on first use.
    pub(crate) fn depth_pipeline(&self, recipe: &Depth<'_>) -> Result<wgpu::RenderPipeline> {
        let Depth { label, source, entry_point, layouts, state } = recipe;
        self.pipelines.depth(recipe, || {
            self.making.pipelines.add();
            self.checked(|device| {
                device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                    label: Some(label),
                    layout: Some(&self.pipeline_layout(label, layouts)),
                    vertex: wgpu::VertexState {
                        module: &self.shader_module(label, source),
                        entry_point: Some(entry_point),
                        compilation_options: wgpu::PipelineCompilationOptions::default(),
                        buffers: &state.buffers.iter().cloned().map(Some).collect::<Vec<_>>(),
                    },
                    primitive: wgpu::PrimitiveState {
                        front_face: wgpu::FrontFace::Ccw,
                        cull_mode: state.cull_mode,
                        ..Default::default()
                    },
                    depth_stencil: Some(wgpu::DepthStencilState {
                        format: state.format,
                        depth_write_enabled: Some(true),
                        depth_compare: Some(state.compare),
                        stencil: wgpu::StencilState::default(),
                        bias: wgpu::DepthBiasState::default(),
                    }),
                    multisample: wgpu::MultisampleState::default(),
                    fragment: None,
                    multiview_mask: None,
                    cache: self.pipeline_cache.as_ref(),
                })
            })
        })
    }

    fn pipeline_layout(
        &self,
        label: &str,
        layouts: &[wgpu::BindGroupLayout],
    ) -> wgpu::PipelineLayout {
        let layouts: Vec<_> = layouts.iter().map(Some).collect();
        self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &layouts,
            immediate_size: 0,
        })
    }

    fn shader_module(&self, label: &str, source: &Source) -> wgpu::ShaderModule {
        let text = source.text();
        #[cfg(feature = "testing")]
        let text = self.faults.iter().fold(text, |text, (what, by)| text.replace(what, by));
        self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        })
    }
}
