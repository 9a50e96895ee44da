//! The inputs of a cull, and what its shaders see of them: the view, and where depth is read.
//!
//! Here each option goes one of two ways.
//! A number goes into the view uniform, and a choice into the key of the pipelines.

use std::sync::Arc;

use crate::cull::among::Among;
use crate::cull::descent::most_on_processors;
use crate::cull::groups::group_descent;
use crate::cull::options::{Coverage, CullOptions, Fit};
use crate::cull::pipelines::{CullKey, Decision, DepthStore};
use crate::cull::shadow::{check_receivers, check_shadow_options};
use crate::cull::view_uniform::{ViewUniform, packed};
use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::kept::Lent;
use crate::gpu::numbers::Numbers;
use crate::gpu::recorded_uniform::BoundParts;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::pyramid::Pyramid;
use crate::pyramid::built::Built;
use crate::pyramid::ends::check_culled;

/// What a cull reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CullInputs<'a> {
    pub(crate) instances: &'a Instances,
    pub(crate) camera: &'a Camera,
    pub(crate) pyramid: &'a Pyramid,
    pub(crate) options: &'a CullOptions,
    /// The instances that are asked for; `None`: all of them.
    pub(crate) among: Option<&'a Among>,
    /// Whether every dispatch has zero workgroups.
    /// Nothing is culled then, but a driver that compiles at the first dispatch does so.
    pub(crate) idle: bool,
    /// What the pyramid is taken to be built from; `None`: what it was last built from.
    pub(crate) built: Option<&'a Built>,
}

impl<'a> CullInputs<'a> {
    /// A cull that runs, against what the pyramid was last built from.
    pub(crate) fn new(
        instances: &'a Instances,
        camera: &'a Camera,
        pyramid: &'a Pyramid,
        options: &'a CullOptions,
    ) -> Self {
        Self { instances, camera, pyramid, options, among: None, idle: false, built: None }
    }

    /// What the pyramid is built from.
    ///
    /// # Errors
    /// Those of [`Pyramid::built_for`].
    pub(super) fn built(&self) -> Result<Built> {
        self.built.map_or_else(|| self.pyramid.built_for(self.camera), |built| Ok(built.clone()))
    }
}

pub(super) fn check_contexts(gpu: &Gpu, inputs: &CullInputs<'_>) -> Result<()> {
    gpu.check_context("instances", inputs.instances.context)?;
    if let Some(among) = inputs.among {
        among.check(gpu, inputs.instances)?;
    }
    gpu.check_context("pyramid", inputs.pyramid.context)
}

/// Refuses sample coverage where a pixel's depth belongs to several samples.
fn check_coverage(built: &Built, options: &CullOptions) -> Result<()> {
    if options.coverage == Coverage::Sample && built.part.samples > 1 {
        return Err(Error::invalid(
            "coverage",
            format!(
                "expected Coverage::Area for a pyramid of the farthest of {} samples per \
                 pixel, which lie beside the pixels' centres, got Coverage::Sample",
                built.part.samples
            ),
        ));
    }
    Ok(())
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

/// What a cull binds of its view.
#[derive(Debug)]
pub(super) struct BoundView {
    pub(super) instances: wgpu::BindGroup,
    pub(super) groups: Option<wgpu::BindGroup>,
    numbers: Option<Numbers>,
    /// The buffer that is read in place of pyramid and image.
    in_place: Option<Arc<Lent>>,
}

impl BoundView {
    /// Records what must run before the tests that bind it.
    pub(super) fn record(&mut self, encoder: &mut wgpu::CommandEncoder, pyramid: &Pyramid) {
        if let Some(numbers) = self.numbers.take() {
            pyramid.view.record(encoder, numbers);
        }
        if let Some(buffer) = &self.in_place {
            buffer.read_by(encoder);
        }
    }
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
        let built = inputs.built()?;
        // Bad options are refused before anything is recorded.
        let mut view = ViewUniform {
            source_origin: packed(built.part.origin),
            ..ViewUniform::new(
                camera,
                instances.kind,
                built.reduction,
                options,
                built.part.tolerance,
            )?
            .with_near_slack(
                camera.convention(),
                built.part.near_slack,
                options,
                built.part.tolerance,
            )
        };
        if gpu.is_processor() {
            let most = most_on_processors(options.fit, pyramid.has_nearest());
            view.descent_budget = view.descent_budget.min(most);
        }
        if options.shadow.is_some() {
            check_receivers(pyramid.depths())?;
        } else {
            check_culled(pyramid.depths())?;
        }
        check_shadow_options(options)?;
        check_coverage(&built, options)?;
        Pyramid::check_source(gpu, &built)?;
        let atlas = match encoder.filter(|_| pyramid.wants_atlas(gpu, &built, instances.len())) {
            Some(encoder) => pyramid.record_atlas(gpu, encoder, &built)?,
            None => None,
        };
        let store = if atlas.is_some() {
            DepthStore::Atlas
        } else if built.in_place.is_some() {
            DepthStore::InPlace
        } else {
            DepthStore::Apart(built.part.kind)
        };
        let is_apart = matches!(store, DepthStore::Apart(_));
        let key = CullKey {
            store,
            kind: instances.kind,
            reversed: camera.convention().is_reversed(),
            chunks: if is_apart { pyramid.chunks.len() } else { 1 },
            sample_coverage: options.coverage == Coverage::Sample,
            footprint_log2: options.footprint.log2(),
            descent: view.descent_budget > 0,
            by_rows: false,
            fit_volume: options.fit == Fit::Volume,
            among: inputs.among.is_some(),
            nearest: pyramid.has_nearest(),
            both: pyramid.depths().count() > 1,
            receivers: options.shadow.is_some(),
            decision: if options.shadow.is_some() { Decision::Shadow } else { Decision::Seen },
        };
        Ok(Self { built, atlas, view, key })
    }

    /// Whether a pixel of level 0 is one sample, and not the farthest of several.
    pub(super) fn has_one_sample(&self) -> bool {
        self.built.part.samples <= 1
    }

    /// The bindings for a test of instances and, if `grouped`, for one of groups.
    pub(super) fn bind(&self, gpu: &Gpu, pyramid: &Pyramid, grouped: bool) -> Result<BoundView> {
        let descent_budget = group_descent(self.view.descent_budget);
        let views = [self.view, ViewUniform { descent_budget, ..self.view }];
        let parts = views.each_ref().map(bytemuck::bytes_of);
        let texture = self.atlas.as_ref().unwrap_or(&self.built.source).clone();
        let buffer = self.in_place().map(|lent| lent.buffer().clone());
        let key = (self.key.store.code(), texture, self.built.nearest.clone(), buffer);
        let bound = pyramid.view.bind(gpu, &key, &parts[..1 + usize::from(grouped)], |view| {
            self.create(gpu, pyramid, view)
        })?;
        let BoundParts { mut parts, numbers } = bound;
        let groups = parts.split_off(1).pop();
        let instances = parts.swap_remove(0);
        Ok(BoundView { instances, groups, numbers, in_place: self.in_place().cloned() })
    }

    /// The buffer that is read in place of pyramid and image, if no atlas is read.
    fn in_place(&self) -> Option<&Arc<Lent>> {
        let in_place = self.built.in_place.as_ref().map(|all| &all.buffer);
        in_place.filter(|_| self.key.store == DepthStore::InPlace)
    }

    fn create(
        &self,
        gpu: &Gpu,
        pyramid: &Pyramid,
        view: wgpu::BindingResource<'_>,
    ) -> Result<wgpu::BindGroup> {
        let mut entries = vec![entry(2, pyramid.uniform.as_entire_binding()), entry(6, view)];
        let chunks;
        if let Some(atlas) = &self.atlas {
            entries.push(entry(3, wgpu::BindingResource::TextureView(atlas)));
        } else if let Some(lent) = self.in_place() {
            entries.push(entry(3, lent.buffer().as_entire_binding()));
        } else {
            chunks = [pyramid.chunk(gpu, 0)?, pyramid.chunk(gpu, 1)?, pyramid.chunk(gpu, 2)?];
            entries.push(entry(0, wgpu::BindingResource::TextureView(&self.built.source)));
            entries.push(entry(1, wgpu::BindingResource::Sampler(gpu.sampler())));
            if let Some(nearest) = &self.built.nearest {
                entries.push(entry(7, wgpu::BindingResource::TextureView(nearest)));
            }
            let chunks = (3..).zip(&chunks);
            entries.extend(chunks.map(|(i, chunk)| entry(i, chunk.as_entire_binding())));
        }
        gpu.bind_group("hiz.cull.view", &self.key.store.layout(gpu)?, &entries)
    }
}
