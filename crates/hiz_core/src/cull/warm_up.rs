//! The warm-up: makes everything that frames need before the first of them.

use crate::cull::early::record_idle_early;
use crate::cull::history::Temporal;
use crate::cull::inputs::CullInputs;
use crate::cull::late::record_idle_late;
use crate::cull::options::CullOptions;
use crate::cull::record::record_cull;
use crate::cull::views::{View, ViewsInputs, record_cull_views};
use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::instances::update::record_idle_update;
use crate::occluders::device_raster::record_occluders;
use crate::occluders::drawing::DrawOptions;
use crate::occluders::uploaded::Occluders;
use crate::output::views::VisibleViews;
use crate::output::visible::Visible;
use crate::pyramid::Pyramid;
use crate::pyramid::reduce::record_idle_reduce;
use crate::pyramid::region::record_idle_region;
use crate::pyramid::resolve::{DepthResolve, record_idle_resolve};

/// A frame for which [`HizContext::record_warm_up`](crate::HizContext::record_warm_up) makes
/// everything.
///
/// It consists of the objects that the frames use, and of their options.
/// A camera only has to be like the frames' cameras in image size, depth convention and
/// handedness.
#[derive(Debug, Clone, Copy)]
pub struct WarmUp<'a> {
    /// What [`HizContext::record_occluders`](crate::HizContext::record_occluders) draws into the
    /// depth image, if it does.
    pub occluders: Option<&'a Occluders>,
    /// The depth image.
    pub depth: &'a wgpu::TextureView,
    /// A camera of the depth image.
    pub camera: &'a Camera,
    /// The pyramid that the depth image is reduced into; it need not have been built.
    pub pyramid: &'a Pyramid,
    /// The instances that are culled.
    pub instances: &'a Instances,
    /// What takes the answers.
    pub visible: &'a Visible,
    /// The options of the culls.
    pub options: &'a CullOptions,
    /// Whether the instances are updated, too.
    pub updates: bool,
    /// What else the frames do.
    pub more: WarmUpMore<'a>,
}

/// What the frames of a [`WarmUp`] do besides; nothing by default.
#[derive(Debug, Clone, Copy, Default)]
pub struct WarmUpMore<'a> {
    /// Two passes, with [`WarmUp::options`] in both and any [`EarlySet`](crate::EarlySet).
    pub temporal: Option<&'a Temporal>,
    /// Culls for several views like [`WarmUp::camera`].
    pub views: Option<&'a VisibleViews>,
    /// The resolve of a multisampled depth texture, with that texture.
    /// The pyramid is then built from its farthest samples instead of [`WarmUp::depth`].
    pub resolve: Option<(&'a wgpu::TextureView, &'a DepthResolve)>,
    /// Whether [`HizContext::record_reduce_region`](crate::HizContext::record_reduce_region) renews
    /// parts of the pyramid.
    pub regions: bool,
}

/// Records the warm-up of `frame`.
///
/// # Errors
/// As [`HizContext::record_warm_up`](crate::HizContext::record_warm_up).
pub(crate) fn record_warm_up(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    frame: &WarmUp<'_>,
) -> Result<()> {
    let WarmUp { depth, camera, pyramid, instances, visible, options, .. } = *frame;
    if let Some(occluders) = frame.occluders {
        record_occluders(gpu, encoder, occluders, camera, depth, &DrawOptions::default())?;
    }
    // Where samples are resolved, the pyramid is built from what that leaves.
    let resolved = frame.more.resolve.and_then(|(_, resolve)| resolve.unresolved());
    let source = resolved.unwrap_or_else(|| depth.into());
    let built = record_idle_reduce(gpu, encoder, &source, camera, pyramid)?;
    let inputs = CullInputs {
        idle: true,
        built: Some(&built),
        ..CullInputs::new(instances, camera, pyramid, options)
    };
    record_cull(gpu, encoder, &inputs, visible)?;
    let WarmUpMore { temporal, views, resolve, regions } = frame.more;
    if let Some(temporal) = temporal {
        record_idle_early(gpu, encoder, instances, temporal, options)?;
        record_idle_late(gpu, encoder, &inputs, temporal)?;
    }
    if let Some(views) = views {
        let of_views = vec![View { camera, pyramid }; views.num_views()];
        let inputs = ViewsInputs {
            instances,
            views: &of_views,
            among: None,
            options,
            idle: true,
            built: Some(&built),
        };
        record_cull_views(gpu, encoder, &inputs, &views.each(), views.joined())?;
    }
    if let Some((samples, resolve)) = resolve {
        record_idle_resolve(gpu, encoder, &samples.into(), camera, resolve)?;
    }
    if regions {
        record_idle_region(gpu, encoder, &source, camera, pyramid)?;
    }
    if frame.updates {
        record_idle_update(gpu, encoder, instances)?;
    }
    Ok(())
}
