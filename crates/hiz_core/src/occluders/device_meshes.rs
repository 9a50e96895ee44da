//! The meshes on the device, and which parts of them a camera may see.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::host::linear::Vec3;
use crate::host::memory;
use crate::host::rounding::split3;
use crate::input::image::ImageSize;
use crate::occluders::drawing::{DrawOptions, Last, Ranked};
use crate::occluders::placement::Placement;
use crate::occluders::shapes::{Mesh, Shapes};
use crate::occluders::view::{PlacedView, View};

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
pub(super) struct CopyRecord {
    rows: [[f32; 4]; 4],
    eye_hi: [f32; 3],
    eye_lo: [f32; 3],
}

pub(super) const BUFFERS: &[wgpu::VertexBufferLayout<'static>] = &[
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
    pub(super) vertices: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
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
pub(super) struct Draw {
    pub(super) indices: Range<u32>,
    pub(super) copies: Range<u32>,
    pub(super) mirrored: bool,
}

/// A part of one copy that a camera may see.
pub(super) struct Seen<'a> {
    /// The index of the copy's record.
    record: u32,
    copy: u32,
    placement: &'a Placement,
    part: &'a Part,
    /// Where it is in the image.
    pub(super) rectangle: [u32; 4],
}

/// What a camera sees of some copies: their parts, and a record of each copy.
pub(super) fn seen<'a>(
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
pub(super) fn draws(seen: &[Seen<'_>]) -> Vec<Draw> {
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
pub(super) fn within_limits<'a>(seen: Vec<Seen<'a>>, options: &DrawOptions<'_>) -> Vec<Seen<'a>> {
    let ranked = seen.iter().map(|seen| {
        let [x0, y0, x1, y1] = seen.rectangle;
        Ranked {
            copy: seen.copy,
            triangles: seen.part.indices.len() as u32 / 3,
            area: (x1 - x0 + 1) as f32 * (y1 - y0 + 1) as f32,
            // The device does not tell what it found hidden.
            last: Last::Unknown,
        }
    });
    let is_kept = options.within_limits(&ranked.collect::<Vec<_>>());
    seen.into_iter().zip(is_kept).filter_map(|(seen, kept)| kept.then_some(seen)).collect()
}
