//! The reduction of a part: what a changed rectangle of the depth image touches in every step.
//!
//! `blocks` says which blocks these are.

use crate::error::{Error, Result};
use crate::gpu::buffers::made;
use crate::gpu::device::Gpu;
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::pyramid::Pyramid;
use crate::pyramid::blocks::{Blocks, touched_blocks};
use crate::pyramid::numbering::next_number;
use crate::pyramid::reduce::{Prepared, finish};
use crate::pyramid::source::{DepthSource, Part, Sampling};
use crate::pyramid::steps::{Recording, Steps};

/// Records the reduction of a rectangle of `depth` into `pyramid`, which was built from it.
///
/// # Errors
/// As [`HizContext::record_reduce_region`](crate::HizContext::record_reduce_region).
pub(crate) fn record_reduce_region(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthSource<'_>,
    rectangle: [u32; 4],
    pyramid: &Pyramid,
) -> Result<()> {
    gpu.check_context("pyramid", pyramid.context)?;
    let built = pyramid.built().ok_or_else(|| {
        Error::mismatch(
            "pyramid",
            "expected one that was built from a depth image, got one that never was; record_reduce \
             builds it",
        )
    })?;
    let part = Part::new(depth, Sampling::Single, (pyramid.size(), "pyramid"), pyramid.depths())?;
    if part != built.part {
        return Err(Error::mismatch(
            "depth",
            "expected the depth image that the pyramid was built from, got another one; \
             record_reduce builds the pyramid from it",
        ));
    }
    check_rectangle(rectangle, pyramid.size())?;
    // Everything that can fail comes before the first command is recorded.
    let numbers =
        Recording { reduction: next_number(), base: built.reduction, origin: part.origin };
    let layout = &pyramid.layout;
    let blocks = touched_blocks(layout, rectangle);
    let steps = made(&pyramid.part_steps, || Steps::new(gpu, &layout.steps))?;
    let renewed = (part, built.camera, numbers.reduction);
    let prepared = Prepared::new(gpu, renewed, (&blocks, true), pyramid)?;
    let staged = Steps::numbers_of_part(gpu, &layout.steps, &blocks, &numbers)?;
    finish(gpu, encoder, pyramid, prepared, (steps, staged, None))?;
    if let Some(owner) = built.owner {
        pyramid.keep_with_it(owner);
    }
    Ok(())
}

/// Records the reduction of no rectangle, for a driver that compiles at the first dispatch.
pub(crate) fn record_idle_region(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthSource<'_>,
    camera: &Camera,
    pyramid: &Pyramid,
) -> Result<()> {
    let part = Part::new(depth, Sampling::Single, (pyramid.size(), "pyramid"), pyramid.depths())?;
    let layout = &pyramid.layout;
    let blocks: Vec<_> = layout.steps.iter().map(Blocks::all).collect();
    let steps = made(&pyramid.part_steps, || Steps::new(gpu, &layout.steps))?;
    let prepared = Prepared::new(gpu, (part, camera.clone(), 0), (&blocks, true), pyramid)?;
    gpu.recorded(|| {
        prepared.record(encoder, steps, |_| [0, 0]);
        Ok(())
    })
}

/// Checks a rectangle of an image.
///
/// # Errors
/// [`Error::Invalid`] for one that is empty or reaches past the image.
pub(crate) fn check_rectangle(rectangle: [u32; 4], size: ImageSize) -> Result<()> {
    let [x0, y0, x1, y1] = rectangle;
    if x0 <= x1 && y0 <= y1 && x1 < size.width && y1 < size.height {
        return Ok(());
    }
    Err(Error::invalid(
        "rectangle",
        format!(
            "expected [x0, y0, x1, y1] with x0 <= x1 < {} and y0 <= y1 < {}, both ends included, \
             got {rectangle:?}",
            size.width, size.height
        ),
    ))
}
