//! The depth-only pass that draws occluders.

use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::pipelines::{Depth, DepthState};
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::{TimedPass, timed_pass};
use crate::input::camera::Camera;
use crate::input::image::DepthConvention;
use crate::input::mesh::FaceCull;
use crate::occluders::device_meshes::{BUFFERS, draws, seen, within_limits};
use crate::occluders::drawing::{DepthLoad, DrawOptions, Touched, both};
use crate::occluders::uploaded::Occluders;
use crate::occluders::view::View;

/// The format of the texture that occluders are drawn into.
pub const OCCLUDER_DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The shader module of the occluder pass.
pub(crate) fn occluders_module() -> Source {
    Source::of(&[&[wgsl!("occluders/occluders")]])
}

fn occluders_pipeline(gpu: &Gpu, reversed: bool, faces: FaceCull) -> Result<wgpu::RenderPipeline> {
    gpu.depth_pipeline(&Depth {
        label: "hiz.occluders.pipeline",
        source: occluders_module(),
        entry_point: "occluder_vertex",
        layouts: &[],
        state: DepthState {
            format: OCCLUDER_DEPTH_FORMAT,
            compare: if reversed {
                wgpu::CompareFunction::Greater
            } else {
                wgpu::CompareFunction::Less
            },
            cull_mode: match faces {
                FaceCull::None => None,
                FaceCull::Back => Some(wgpu::Face::Back),
                FaceCull::Front => Some(wgpu::Face::Front),
            },
            buffers: BUFFERS,
        },
    })
}

/// Checks what a texture reports: size, format, dimension, mip levels, samples and usage.
fn check_target(camera: &Camera, target: &wgpu::TextureView) -> Result<()> {
    let texture = target.texture();
    let (want, have) = (camera.size(), (texture.width(), texture.height()));
    if have != (want.width, want.height) || texture.format() != OCCLUDER_DEPTH_FORMAT {
        return Err(Error::mismatch(
            "target",
            format!(
                "expected a {OCCLUDER_DEPTH_FORMAT:?} texture of the camera's size {want}, got \
                 {:?} of (height {}, width {})",
                texture.format(),
                have.1,
                have.0
            ),
        ));
    }
    let (mips, samples) = (texture.mip_level_count(), texture.sample_count());
    if (mips, samples) != (1, 1) || texture.dimension() != wgpu::TextureDimension::D2 {
        return Err(Error::invalid(
            "target",
            format!(
                "expected a 2D texture of one mip level and one sample a pixel, got {:?} with \
                 {mips} mip levels, {samples} samples",
                texture.dimension()
            ),
        ));
    }
    if !texture.usage().contains(wgpu::TextureUsages::RENDER_ATTACHMENT) {
        return Err(Error::invalid(
            "target",
            format!("expected the usage RENDER_ATTACHMENT, got {:?}", texture.usage()),
        ));
    }
    Ok(())
}

/// Records the pass that draws `occluders` into `target`; returns the rectangle around them.
///
/// # Errors
/// As [`HizContext::record_occluders`](crate::HizContext::record_occluders).
pub(crate) fn record_occluders(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    occluders: &Occluders,
    camera: &Camera,
    target: &wgpu::TextureView,
    options: &DrawOptions<'_>,
) -> Result<Touched> {
    gpu.check_context("occluders", occluders.context)?;
    check_target(camera, target)?;
    let placements = occluders.placements();
    let (mut seen, records) = seen(
        &View::new(camera)?,
        camera.size(),
        occluders.shapes(),
        &occluders.on_device,
        &options.only.of(&placements)?,
    );
    if options.is_limited() {
        seen = within_limits(seen, options);
    }
    let draws = draws(&seen);
    let touched = seen.iter().fold(None, |all, seen| both(all, Some(seen.rectangle)));
    let reversed = camera.convention() == DepthConvention::Reversed;
    let faces = occluders.surface.cull_mode().as_seen_by(camera);
    let pipeline = occluders_pipeline(gpu, reversed, faces)?;
    // A mirroring matrix turns a mesh inside out; drawing its other faces undoes that.
    let mirrored = occluders_pipeline(gpu, reversed, faces.reversed())?;
    let copies = match &records[..] {
        [] => None,
        records => Some(gpu.filled(
            "hiz.occluders.copies",
            bytemuck::cast_slice(records),
            wgpu::BufferUsages::VERTEX,
        )?),
    };
    let depth_ops = wgpu::Operations {
        load: match options.load {
            DepthLoad::Clear => wgpu::LoadOp::Clear(camera.convention().far()),
            DepthLoad::Load => wgpu::LoadOp::Load,
        },
        store: wgpu::StoreOp::Store,
    };
    gpu.can_draw_into(target, depth_ops).map_err(|error| match error {
        Error::Device(why) => Error::mismatch(
            "target",
            format!(
                "expected a view of one layer of a texture of this device that has not been \
                 destroyed, but {why}"
            ),
        ),
        other => other,
    })?;
    gpu.recorded(|| {
        let timed = timed_pass("raster");
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("hiz.occluders.pass"),
            timestamp_writes: timed.as_ref().and_then(TimedPass::of_render_pass),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: target,
                depth_ops: Some(depth_ops),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        if let Some(copies) = &copies {
            pass.set_vertex_buffer(0, occluders.on_device.vertices.slice(..));
            pass.set_vertex_buffer(1, copies.slice(..));
            pass.set_index_buffer(occluders.on_device.indices.slice(..), wgpu::IndexFormat::Uint32);
        }
        let mut current = None;
        for draw in draws {
            if current != Some(draw.mirrored) {
                pass.set_pipeline(if draw.mirrored { &mirrored } else { &pipeline });
                current = Some(draw.mirrored);
            }
            pass.draw_indexed(draw.indices, 0, draw.copies);
        }
        Ok(touched)
    })
}
