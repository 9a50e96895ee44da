//! Occluders: triangle meshes on the device, and the depth-only pass that draws them.

use crate::bounds::Floats;
use crate::camera::{Camera, DepthConvention, Vec3, dot, sub};
use crate::error::{Error, Result};
use crate::gpu::{ContextId, Gpu, OccluderKey};
use crate::host;
use crate::occluder_surface::OccluderSurface;
use crate::pyramid::entry;
use crate::shader;
use crate::view::{ClipRows, split3};

/// The format of the depth that is drawn.
pub const OCCLUDER_DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Which triangles do not occlude.
/// A front face is counter-clockwise seen from outside.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum FaceCull {
    /// All occlude: two-sided.
    #[default]
    None,
    /// Back faces do not.
    Back,
    /// Front faces do not.
    Front,
}

/// A triangle mesh, borrowed from the caller.
#[derive(Debug, Clone, Copy)]
pub struct MeshData<'a> {
    /// V positions, 3 scalars each.
    pub vertices: Floats<'a>,
    /// T triangles, 3 indices below V each.
    pub triangles: &'a [u32],
    /// K affine matrices `world_from_mesh`, 16 row-major scalars each; `None`: the mesh once, in
    /// world coordinates.
    pub transforms: Option<Floats<'a>>,
}

/// How occluders are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OccluderOptions {
    /// Which triangles do not occlude.
    pub cull_mode: FaceCull,
}

/// A vertex: its world position as two halves; `shaders/occluders.wgsl`, locations 0 and 1.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Vertex {
    hi: [f32; 3],
    lo: [f32; 3],
}

/// `shaders/occluders.wgsl`, `OccluderView`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct OccluderView {
    rows: [[f32; 4]; 4],
    eye_hi: [f32; 4],
    eye_lo: [f32; 4],
}

/// One mesh in one place: a draw, if its bounds meet the frustum.
#[derive(Debug, Clone)]
struct Part {
    indices: std::ops::Range<u32>,
    base_vertex: i32,
    min: Vec3,
    max: Vec3,
}

/// Triangle meshes on the device, in world coordinates.
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

/// The host's side of the upload.
#[derive(Default)]
struct Baked {
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
    parts: Vec<Part>,
    /// The same in float64, indices counted through all parts.
    world: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl OccluderSurface {
    /// The surface of `meshes` without a device.
    ///
    /// # Errors
    /// As [`HizContext::create_occluders`](crate::HizContext::create_occluders).
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
            // An empty buffer cannot be bound.
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

    /// The triangles on the host, which give conservative depth.
    pub fn surface(&self) -> &OccluderSurface {
        &self.surface
    }

    /// Triangles in all places.
    pub fn num_triangles(&self) -> u64 {
        self.triangles
    }

    /// Meshes times the places that they stand in.
    pub fn num_parts(&self) -> usize {
        self.parts.len()
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        self.vertices.size() + self.indices.size()
    }
}

impl Baked {
    fn all(meshes: &[MeshData<'_>]) -> Result<Self> {
        let mut baked = Self::default();
        for mesh in meshes {
            baked.add(mesh)?;
        }
        Ok(baked)
    }

    fn add(&mut self, mesh: &MeshData<'_>) -> Result<()> {
        let (scalars, corners) = (mesh.vertices.len(), mesh.triangles.len());
        if !scalars.is_multiple_of(3) {
            return Err(Error::invalid(
                "vertices",
                format!("expected 3 numbers a vertex, got {scalars} numbers"),
            ));
        }
        if !corners.is_multiple_of(3) {
            return Err(Error::invalid(
                "triangles",
                format!("expected 3 indices a triangle, got {corners} indices"),
            ));
        }
        let num_vertices = scalars / 3;
        if let Some((i, index)) =
            mesh.triangles.iter().enumerate().find(|(_, v)| **v as usize >= num_vertices)
        {
            return Err(Error::invalid(
                "triangles",
                format!(
                    "expected indices below the {num_vertices} vertices, got {index} in triangle {}",
                    i / 3
                ),
            ));
        }
        let places: Vec<Option<[f64; 16]>> = match mesh.transforms {
            None => vec![None],
            Some(t) if t.len().is_multiple_of(16) => {
                (0..t.len() / 16).map(|k| Some(t.array(k))).collect()
            }
            Some(t) => {
                return Err(Error::invalid(
                    "transforms",
                    format!("expected 16 numbers a matrix, got {} numbers", t.len()),
                ));
            }
        };
        for (k, place) in places.iter().enumerate() {
            self.add_part(mesh, place.as_ref(), k)?;
        }
        Ok(())
    }

    fn add_part(&mut self, mesh: &MeshData<'_>, place: Option<&[f64; 16]>, k: usize) -> Result<()> {
        let world = |p: Vec3| match place {
            None => p,
            Some(m) => std::array::from_fn(|i| {
                dot([m[4 * i], m[4 * i + 1], m[4 * i + 2]], p) + m[4 * i + 3]
            }),
        };
        let mut mirrored = false;
        if let Some(m) = place {
            if m[12..] != [0.0, 0.0, 0.0, 1.0] || !m.iter().all(|v| v.is_finite()) {
                return Err(Error::invalid(
                    "transforms",
                    format!(
                        "expected finite affine matrices with last row (0, 0, 0, 1), got {:?} in matrix {k}",
                        &m[12..]
                    ),
                ));
            }
            let column = |c: usize| [m[c], m[4 + c], m[8 + c]];
            mirrored = dot(crate::camera::cross(column(0), column(1)), column(2)) < 0.0;
        }
        let too_many =
            |n: usize| Error::limit("occluder vertices or indices", n as u64, i32::MAX as u64);
        let base_vertex =
            i32::try_from(self.vertices.len()).map_err(|_| too_many(self.vertices.len()))?;
        let first_index =
            u32::try_from(self.indices.len()).map_err(|_| too_many(self.indices.len()))?;
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        host::reserve(&mut self.vertices, mesh.vertices.len() / 3, "vertices")?;
        host::reserve(&mut self.indices, mesh.triangles.len(), "triangles")?;
        for v in 0..mesh.vertices.len() / 3 {
            let p = world(mesh.vertices.array(v));
            // float32 must hold it: beyond, the halves would be infinite.
            if !p.iter().all(|x| x.abs() < 1e30) {
                return Err(Error::invalid(
                    "vertices",
                    format!("expected finite positions below 1e30, got {p:?} at vertex {v}"),
                ));
            }
            for i in 0..3 {
                min[i] = min[i].min(p[i]);
                max[i] = max[i].max(p[i]);
            }
            let (hi, lo) = split3(p);
            self.vertices.push(Vertex { hi, lo });
            self.world.push(p);
        }
        for t in mesh.triangles.chunks_exact(3) {
            // A mirror turns outside in: the order of the corners keeps it out.
            let corners = if mirrored { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] };
            self.indices.extend(corners);
            self.triangles.push(corners.map(|v| v + base_vertex.unsigned_abs()));
        }
        let end = u32::try_from(self.indices.len()).map_err(|_| too_many(self.indices.len()))?;
        if end > first_index {
            self.parts.push(Part { indices: first_index..end, base_vertex, min, max });
        }
        Ok(())
    }
}

/// Whether a box is surely outside one plane of the frustum.
/// Keeping too much costs time only; dropping a part that is seen would merely lose an occluder, so
/// float64 without a proof is enough.
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

fn pipeline(gpu: &Gpu, key: OccluderKey) -> wgpu::RenderPipeline {
    let device = gpu.device();
    let name = "hiz.occluders.pipeline";
    let label = Some(name);
    let module = gpu.shader_module(name, &shader::occluders());
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label,
        bind_group_layouts: &[Some(&gpu.layouts().occluder_view)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("occluder_vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Vertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
            })],
        },
        primitive: wgpu::PrimitiveState {
            front_face: wgpu::FrontFace::Ccw,
            cull_mode: key.cull_mode,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: OCCLUDER_DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(if key.reversed {
                wgpu::CompareFunction::Greater
            } else {
                wgpu::CompareFunction::Less
            }),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: None,
        multiview_mask: None,
        cache: gpu.pipeline_cache(),
    })
}

/// What a texture tells of itself.
fn check_target(camera: &Camera, target: &wgpu::TextureView) -> Result<()> {
    let texture = target.texture();
    let (want, have) = (camera.size(), (texture.width(), texture.height()));
    if have != (want.width, want.height) || texture.format() != OCCLUDER_DEPTH_FORMAT {
        return Err(Error::mismatch(
            "target",
            format!(
                "expected a {OCCLUDER_DEPTH_FORMAT:?} texture of the camera's size {want}, got {:?} of (height {}, width {})",
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
                "expected a 2D texture of one mip level and one sample a pixel, got {:?} with {mips} mip levels, {samples} samples",
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

pub(crate) fn record(
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
    let entries = [entry(0, view.as_entire_binding())];
    let bind_group =
        gpu.bind_group("hiz.occluders.view", &gpu.layouts().occluder_view, &entries)?;
    let key = OccluderKey {
        reversed: camera.convention() == DepthConvention::Reversed,
        cull_mode: occluders.cull_mode.as_seen_by(camera).face(),
    };
    let pipeline = gpu.occluder_pipeline(key, || pipeline(gpu, key))?;
    let depth_ops = wgpu::Operations {
        load: wgpu::LoadOp::Clear(camera.convention().far()),
        store: wgpu::StoreOp::Store,
    };
    gpu.can_draw_into(target, depth_ops).map_err(|error| match error {
        Error::Device(why) => Error::mismatch(
            "target",
            format!("expected a view of one layer of a texture of this device that has not been destroyed, but {why}"),
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

impl FaceCull {
    /// The faces that do not occlude as they appear in `camera`'s image: one that mirrors the world
    /// (a left-handed one) turns every triangle around.
    pub(crate) fn as_seen_by(self, camera: &Camera) -> Self {
        let rows = camera.rows();
        let lin = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
        let (x, y) = (lin(0), lin(1));
        // Towards the scene: w grows in front of a perspective camera; orthographic depth grows or,
        // reversed, falls.
        let forward = if lin(3) != [0.0; 3] {
            lin(3)
        } else if camera.convention().is_reversed() {
            lin(2).map(|v| -v)
        } else {
            lin(2)
        };
        let mirrored = dot(crate::camera::cross(x, y), forward) > 0.0;
        match (self, mirrored) {
            (Self::Back, true) => Self::Front,
            (Self::Front, true) => Self::Back,
            (as_it_is, _) => as_it_is,
        }
    }

    fn face(self) -> Option<wgpu::Face> {
        match self {
            Self::None => None,
            Self::Back => Some(wgpu::Face::Back),
            Self::Front => Some(wgpu::Face::Front),
        }
    }
}
