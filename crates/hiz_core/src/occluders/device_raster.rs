//! The depth-only pass that draws occluders.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::pipelines::{Depth, DepthState};
use crate::gpu::shader::{Source, wgsl};
use crate::host::linear::Vec3;
use crate::host::memory;
use crate::host::rounding::split3;
use crate::input::camera::Camera;
use crate::input::image::{DepthConvention, ImageSize};
use crate::input::mesh::FaceCull;
use crate::occluders::Occluders;
use crate::occluders::drawing::{DepthLoad, DrawOptions, Ranked, Touched, both};
use crate::occluders::placement::Placement;
use crate::occluders::shapes::{Mesh, Shapes};
use crate::occluders::view::{PlacedView, View};

/// The format of the texture that occluders are drawn into.
pub const OCCLUDER_DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The least triangles of a part of a mesh that is left out alone where it is out of view.
///
/// A draw costs about as much as a few hundred triangles outside of the view.
const PART_TRIANGLES: u32 = 512;

/// A position as two float32, `hi + lo`.
///
/// Its twin is `Vertex` in `shaders/occluders/occluders.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct VertexRecord {
    hi: [f32; 3],
    lo: [f32; 3],
}

/// The camera in the space of one copy of a mesh.
///
/// Its twin is `Copy` in `shaders/occluders/occluders.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct CopyRecord {
    rows: [[f32; 4]; 4],
    eye_hi: [f32; 3],
    eye_lo: [f32; 3],
}

const BUFFERS: &[wgpu::VertexBufferLayout<'static>] = &[
    wgpu::VertexBufferLayout {
        array_stride: size_of::<VertexRecord>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
    },
    wgpu::VertexBufferLayout {
        array_stride: size_of::<CopyRecord>() as u64,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &wgpu::vertex_attr_array![
            2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4,
            6 => Float32x3, 7 => Float32x3
        ],
    },
];

/// Neighbouring triangles of a mesh, with the box around them in mesh coordinates.
#[derive(Debug)]
struct Part {
    indices: Range<u32>,
    min: Vec3,
    max: Vec3,
}

/// The meshes on the device: each once, however often it stands.
#[derive(Debug)]
pub(super) struct DeviceMeshes {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    /// By mesh.
    parts: Vec<Vec<Part>>,
}

impl DeviceMeshes {
    /// # Errors
    /// [`Error::Limit`] for meshes beyond the largest buffer, and [`Error::OutOfMemory`].
    pub(super) fn new(gpu: &Gpu, shapes: &Shapes) -> Result<Self> {
        let halves = |p: &Vec3| {
            let (hi, lo) = split3(*p);
            VertexRecord { hi, lo }
        };
        let vertices = memory::collected(shapes.positions.iter().map(halves), "vertices")?;
        let allowed = gpu.limits().max_buffer_size;
        let mut made = [
            ("hiz.occluders.vertices", bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
            (
                "hiz.occluders.indices",
                bytemuck::cast_slice(&shapes.triangles),
                wgpu::BufferUsages::INDEX,
            ),
        ]
        .into_iter()
        .map(|(label, contents, usage): (_, &[u8], _)| {
            if contents.len() as u64 > allowed {
                return Err(Error::limit("max_buffer_size", contents.len() as u64, allowed));
            }
            // A vertex or index buffer may not be empty.
            gpu.filled(label, if contents.is_empty() { &[0; 24] } else { contents }, usage)
        });
        let (Some(vertices), Some(indices)) = (made.next(), made.next()) else {
            unreachable!("two buffers were listed")
        };
        let parts = shapes.meshes.iter().map(|mesh| parts(shapes, mesh)).collect();
        Ok(Self { vertices: vertices?, indices: indices?, parts })
    }

    /// Bytes on the device.
    pub(super) fn bytes(&self) -> u64 {
        self.vertices.size() + self.indices.size()
    }
}

/// Joins meshlets to parts of at least [`PART_TRIANGLES`].
fn parts(shapes: &Shapes, mesh: &Mesh) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    for i in mesh.meshlets.clone() {
        let meshlet = &shapes.meshlets[i as usize];
        let end = 3 * meshlet.triangles.end;
        match parts.last_mut().filter(|part| part.indices.len() < 3 * PART_TRIANGLES as usize) {
            Some(part) => {
                part.indices.end = end;
                part.min = std::array::from_fn(|k| part.min[k].min(meshlet.min[k]));
                part.max = std::array::from_fn(|k| part.max[k].max(meshlet.max[k]));
            }
            None => parts.push(Part {
                indices: 3 * meshlet.triangles.start..end,
                min: meshlet.min,
                max: meshlet.max,
            }),
        }
    }
    parts
}

/// One draw: triangles of one mesh, at one place or at several that follow one another.
#[derive(Debug, PartialEq)]
struct Draw {
    indices: Range<u32>,
    copies: Range<u32>,
    mirrored: bool,
}

/// A part of one copy that a camera may see.
struct Seen<'a> {
    /// The index of the copy's record.
    record: u32,
    copy: u32,
    placement: &'a Placement,
    part: &'a Part,
    /// Where it is in the image.
    rectangle: [u32; 4],
}

/// What a camera sees of some copies: their parts, and a record of each copy.
fn seen<'a>(
    view: &View,
    size: ImageSize,
    shapes: &Shapes,
    meshes: &'a DeviceMeshes,
    copies: &[(u32, &'a Placement)],
) -> (Vec<Seen<'a>>, Vec<CopyRecord>) {
    let (mut found, mut records) = (Vec::new(), Vec::new());
    for (copy, placement) in copies {
        let mesh = &shapes.meshes[placement.mesh as usize];
        let placed = view.placed(mesh, placement);
        if mesh.triangles.is_empty() || placed.is_outside(mesh.min, mesh.max) {
            continue;
        }
        let parts = &meshes.parts[placement.mesh as usize];
        let before = found.len();
        for part in parts {
            if parts.len() > 1 && placed.is_outside(part.min, part.max) {
                continue;
            }
            let rectangle = placed.rectangle(part.min, part.max, size);
            let record = records.len() as u32;
            found.push(Seen { record, copy: *copy, placement, part, rectangle });
        }
        if found.len() > before {
            let PlacedView { rows, eye_hi, eye_lo, .. } = placed;
            records.push(CopyRecord { rows, eye_hi, eye_lo });
        }
    }
    (found, records)
}

/// Joins what follows one another into as few draws as possible.
fn draws(seen: &[Seen<'_>]) -> Vec<Draw> {
    let mut draws = Vec::<Draw>::new();
    for Seen { record, placement, part, .. } in seen {
        let draw = Draw {
            indices: part.indices.clone(),
            copies: *record..record + 1,
            mirrored: placement.mirrored,
        };
        match draws.last_mut().filter(|last| last.mirrored == draw.mirrored) {
            // The next part of the same copy.
            Some(last) if last.copies == draw.copies && last.indices.end == draw.indices.start => {
                last.indices.end = draw.indices.end;
            }
            // The next copy of the same triangles.
            Some(last) if last.copies.end == *record && last.indices == draw.indices => {
                last.copies.end = record + 1;
            }
            _ => draws.push(draw),
        }
    }
    draws
}

/// Those of the parts that a limit leaves.
fn within_limits<'a>(seen: Vec<Seen<'a>>, options: &DrawOptions<'_>) -> Vec<Seen<'a>> {
    let ranked = seen.iter().map(|seen| {
        let [x0, y0, x1, y1] = seen.rectangle;
        Ranked {
            copy: seen.copy,
            triangles: seen.part.indices.len() as u32 / 3,
            area: (x1 - x0 + 1) as f32 * (y1 - y0 + 1) as f32,
            // The device does not tell what it found hidden.
            is_useful: false,
        }
    });
    let is_kept = options.within_limits(&ranked.collect::<Vec<_>>());
    seen.into_iter().zip(is_kept).filter_map(|(seen, kept)| kept.then_some(seen)).collect()
}

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
