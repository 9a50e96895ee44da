//! Occluders: triangle meshes that hide other things.
//!
//! They exist twice, made from the same vertices (`bake`):
//!
//! - on the device, where `raster` draws them as depth;
//! - on the host in float64, where `surface` computes conservative depth from them.
//!
//! The drawing is recorded into the caller's encoder; nothing here submits or reads back.

mod bake;
pub(crate) mod raster;
pub(crate) mod surface;

use crate::error::{Error, Result};
use crate::gpu::device::{ContextId, Gpu};
use crate::input::mesh::{FaceCull, MeshData};
use crate::occluders::bake::{Baked, Part};
use crate::occluders::surface::OccluderSurface;

/// How occluders are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OccluderOptions {
    /// Which triangles do not occlude; all occlude by default.
    pub cull_mode: FaceCull,
}

/// Triangle meshes on the device, in world coordinates.
///
/// Each mesh is stored once per transform, 24 bytes per vertex and 4 bytes per index.
#[derive(Debug)]
pub struct Occluders {
    pub(crate) context: ContextId,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    parts: Vec<Part>,
    cull_mode: FaceCull,
    triangles: u64,
    surface: OccluderSurface,
}

impl OccluderSurface {
    /// The surface of `meshes`, made without a device.
    pub fn from_meshes(meshes: &[MeshData<'_>], options: &OccluderOptions) -> Result<Self> {
        let baked = Baked::all(meshes)?;
        Ok(Self::new(baked.world, baked.triangles, options.cull_mode))
    }
}

impl Occluders {
    pub(crate) fn new(
        gpu: &Gpu,
        meshes: &[MeshData<'_>],
        options: &OccluderOptions,
    ) -> Result<Self> {
        let baked = Baked::all(meshes)?;
        let allowed = gpu.limits().max_buffer_size;
        for bytes in [size_of_val(&baked.vertices[..]), size_of_val(&baked.indices[..])] {
            if bytes as u64 > allowed {
                return Err(Error::limit("max_buffer_size", bytes as u64, allowed));
            }
        }
        let buffer = |label, contents: &[u8], usage| {
            // A vertex or index buffer may not be empty.
            let contents = if contents.is_empty() { &[0; 24][..] } else { contents };
            gpu.filled(label, contents, usage)
        };
        Ok(Self {
            context: gpu.id(),
            vertices: buffer(
                "hiz.occluders.vertices",
                bytemuck::cast_slice(&baked.vertices),
                wgpu::BufferUsages::VERTEX,
            )?,
            indices: buffer(
                "hiz.occluders.indices",
                bytemuck::cast_slice(&baked.indices),
                wgpu::BufferUsages::INDEX,
            )?,
            triangles: (baked.indices.len() / 3) as u64,
            parts: baked.parts,
            cull_mode: options.cull_mode,
            surface: OccluderSurface::new(baked.world, baked.triangles, options.cull_mode),
        })
    }

    /// The triangles on the host, from which conservative depth is computed.
    pub fn surface(&self) -> &OccluderSurface {
        &self.surface
    }

    /// The number of triangles, counted once per transform of their mesh.
    pub fn num_triangles(&self) -> u64 {
        self.triangles
    }

    /// The number of meshes, counted once per transform; meshes without triangles do not count.
    pub fn num_parts(&self) -> usize {
        self.parts.len()
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        self.vertices.size() + self.indices.size()
    }
}
