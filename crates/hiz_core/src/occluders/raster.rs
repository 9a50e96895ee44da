//! The depth-only pass that draws occluders.

use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Depth, DepthState};
use crate::gpu::shader::{Source, wgsl};
use crate::host::linear::{Vec3, dot, sub};
use crate::input::camera::Camera;
use crate::input::image::DepthConvention;
use crate::input::mesh::FaceCull;
use crate::input::view::ClipRows;
use crate::occluders::Occluders;
use crate::occluders::bake::{VERTEX_ATTRIBUTES, Vertex};

/// The format of the texture that occluders are drawn into.
pub const OCCLUDER_DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Twin of `OccluderView` in `shaders/occluders/occluders.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct OccluderView {
    pub(crate) rows: [[f32; 4]; 4],
    pub(crate) eye_hi: [f32; 4],
    pub(crate) eye_lo: [f32; 4],
}

/// Whether a box is outside one plane of the frustum.
///
/// float64 without a proof is enough.
/// A part kept wrongly costs time; a part dropped wrongly is a lost occluder, not a false cull.
fn outside_frustum(camera: &Camera, min: Vec3, max: Vec3) -> bool {
    let rows = camera.rows();
    let clip: [[f64; 4]; 8] = std::array::from_fn(|corner| {
        let p = std::array::from_fn(|i| if corner >> i & 1 == 0 { min[i] } else { max[i] });
        let d = sub(p, camera.origin());
        rows.map(|r| dot([r[0], r[1], r[2]], d) + r[3])
    });
    let all = |f: &dyn Fn(&[f64; 4]) -> f64| {
        clip.iter().all(|c| f(c) < -1e-9 * c.iter().fold(0.0_f64, |m, v| m.max(v.abs())))
    };
    all(&|c| c[0] + c[3])
        || all(&|c| c[3] - c[0])
        || all(&|c| c[1] + c[3])
        || all(&|c| c[3] - c[1])
        || all(&|c| c[2])
        || all(&|c| c[3] - c[2])
}

/// The binding of a draw.
const BINDINGS: &[(u32, Binding)] = &[(0, Binding::VertexUniform)];

/// The shader module of the occluder pass.
pub(crate) fn occluders_module() -> Source {
    Source::of(&[&[wgsl!("occluders/occluders")]])
}

fn occluders_pipeline(gpu: &Gpu, reversed: bool, faces: FaceCull) -> Result<wgpu::RenderPipeline> {
    gpu.depth_pipeline(&Depth {
        label: "hiz.occluders.pipeline",
        source: occluders_module(),
        entry_point: "occluder_vertex",
        layouts: &[gpu.layout("hiz.occluders.layout", BINDINGS)?],
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
            stride: size_of::<Vertex>() as u64,
            attributes: &VERTEX_ATTRIBUTES,
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

/// Records the pass that clears `target` and draws `occluders` into it.
///
/// # Errors
/// As [`HizContext::record_occluders`](crate::HizContext::record_occluders).
pub(crate) fn record_occluders(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    occluders: &Occluders,
    camera: &Camera,
    target: &wgpu::TextureView,
) -> Result<()> {
    gpu.check_context("occluders", occluders.context)?;
    check_target(camera, target)?;
    let ClipRows { rows, eye_hi, eye_lo } = ClipRows::new(camera)?;
    let wide = |v: [f32; 3]| [v[0], v[1], v[2], 0.0];
    let view = gpu.uniform(
        "hiz.occluders.view",
        &OccluderView { rows, eye_hi: wide(eye_hi), eye_lo: wide(eye_lo) },
    )?;
    let layout = gpu.layout("hiz.occluders.layout", BINDINGS)?;
    let entries = [entry(0, view.as_entire_binding())];
    let bind_group = gpu.bind_group("hiz.occluders.view", &layout, &entries)?;
    let reversed = camera.convention() == DepthConvention::Reversed;
    let pipeline = occluders_pipeline(gpu, reversed, occluders.cull_mode.as_seen_by(camera))?;
    let depth_ops = wgpu::Operations {
        load: wgpu::LoadOp::Clear(camera.convention().far()),
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
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("hiz.occluders.pass"),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: target,
                depth_ops: Some(depth_ops),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.set_vertex_buffer(0, occluders.vertices.slice(..));
        pass.set_index_buffer(occluders.indices.slice(..), wgpu::IndexFormat::Uint32);
        for part in &occluders.parts {
            if !outside_frustum(camera, part.min, part.max) {
                pass.draw_indexed(part.indices.clone(), part.base_vertex, 0..1);
            }
        }
        Ok(())
    })
}
