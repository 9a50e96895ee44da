//! The inputs of a cull, and what its shaders see of them: the view, and where depth is read.
//!
//! Here each option goes one of two ways.
//! A number goes into the view uniform, and a choice into the key of the pipelines.

use crate::cull::groups::group_descent;
use crate::cull::options::{Coverage, CullOptions, Fit};
use crate::cull::pipelines::{CullKey, DepthStore};
use crate::cull::view_uniform::ViewUniform;
use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::pyramid::Pyramid;
use crate::pyramid::built::Built;

/// What a cull reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CullInputs<'a> {
    pub(crate) instances: &'a Instances,
    pub(crate) camera: &'a Camera,
    pub(crate) pyramid: &'a Pyramid,
    pub(crate) options: &'a CullOptions,
    /// Whether every dispatch has zero workgroups.
    /// Nothing is culled then, but a driver that compiles at the first dispatch does so.
    pub(crate) idle: bool,
}

pub(super) fn check_contexts(gpu: &Gpu, inputs: &CullInputs<'_>) -> Result<()> {
    gpu.check_context("instances", inputs.instances.context)?;
    gpu.check_context("pyramid", inputs.pyramid.context)
}

/// What the shaders know of camera and pyramid, and the key of the pipelines that read it.
#[derive(Debug)]
pub(super) struct PreparedView {
    built: Built,
    /// All levels in one texture, if that pays.
    atlas: Option<wgpu::TextureView>,
    view: ViewUniform,
    pub(super) key: CullKey,
}

impl PreparedView {
    /// Prepares the view of a cull.
    ///
    /// `encoder` takes the copies into an atlas if one is wanted; without it no atlas is used.
    pub(super) fn new(
        gpu: &Gpu,
        inputs: &CullInputs<'_>,
        encoder: Option<&mut wgpu::CommandEncoder>,
    ) -> Result<Self> {
        let CullInputs { instances, camera, pyramid, options, .. } = *inputs;
        check_contexts(gpu, inputs)?;
        let built = pyramid.built_for(camera)?;
        // Bad options are refused before anything is recorded.
        let view = ViewUniform::new(camera, built.reduction, options, built.tolerance)?;
        Pyramid::check_source(gpu, &built)?;
        let atlas = match encoder.filter(|_| pyramid.wants_atlas(gpu, &built, instances.len())) {
            Some(encoder) => pyramid.record_atlas(gpu, encoder, &built)?,
            None => None,
        };
        let key = CullKey {
            store: if atlas.is_some() {
                DepthStore::Atlas
            } else {
                DepthStore::Apart(built.source_kind)
            },
            kind: instances.kind,
            reversed: camera.convention().is_reversed(),
            chunks: if atlas.is_some() { 1 } else { pyramid.chunks.len() },
            sample_coverage: options.coverage == Coverage::Sample,
            footprint_log2: options.footprint.log2(),
            descent: options.descent > 0,
            fit_volume: options.fit == Fit::Volume,
        };
        Ok(Self { built, atlas, view, key })
    }

    /// The bindings for a test of instances.
    /// They are those of the last cull if it asked for the same.
    pub(super) fn bind(&self, gpu: &Gpu, pyramid: &Pyramid) -> Result<wgpu::BindGroup> {
        self.bind_view(gpu, pyramid, self.view)
    }

    /// The bindings for a test of groups.
    pub(super) fn bind_for_groups(&self, gpu: &Gpu, pyramid: &Pyramid) -> Result<wgpu::BindGroup> {
        let descent_budget = group_descent(self.view.descent_budget);
        self.bind_view(gpu, pyramid, ViewUniform { descent_budget, ..self.view })
    }

    fn bind_view(
        &self,
        gpu: &Gpu,
        pyramid: &Pyramid,
        view: ViewUniform,
    ) -> Result<wgpu::BindGroup> {
        let words: [u32; size_of::<ViewUniform>() / 4] = bytemuck::cast(view);
        let words = [&[self.key.store.code()], &words[..]].concat();
        pyramid.bindings.get(&words, || self.create(gpu, pyramid, &view))
    }

    fn create(
        &self,
        gpu: &Gpu,
        pyramid: &Pyramid,
        uniform: &ViewUniform,
    ) -> Result<wgpu::BindGroup> {
        let view = gpu.uniform("hiz.cull.view_uniform", uniform)?;
        let mut entries =
            vec![entry(2, pyramid.uniform.as_entire_binding()), entry(6, view.as_entire_binding())];
        let chunks;
        if let Some(atlas) = &self.atlas {
            entries.push(entry(3, wgpu::BindingResource::TextureView(atlas)));
        } else {
            chunks = [pyramid.chunk(gpu, 0)?, pyramid.chunk(gpu, 1)?, pyramid.chunk(gpu, 2)?];
            entries.push(entry(0, wgpu::BindingResource::TextureView(&self.built.source)));
            entries.push(entry(1, wgpu::BindingResource::Sampler(gpu.sampler())));
            let chunks = (3..).zip(&chunks);
            entries.extend(chunks.map(|(i, chunk)| entry(i, chunk.as_entire_binding())));
        }
        gpu.bind_group("hiz.cull.view", &self.key.store.layout(gpu)?, &entries)
    }
}
