//! A scene on the device: vertices and indices of all meshes, bodies, and what each kind draws.

use std::ops::Range;

use hiz_core::wgpu::{self, BufferUsages};
use hiz_core::{Camera, DrawTemplate};

use crate::gpu::Gpu;
use crate::mesh::{Mesh, Vertex};
use crate::scene::{Body, Scene};

/// Twin: `shaders/scene.wgsl`, `Body`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct BodyRecord {
    position: [f32; 3],
    scale: f32,
    turn: [f32; 2],
    tint: [u8; 4],
    kind: u32,
}

/// Twin: `shaders/scene.wgsl`, `View`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct View {
    clip_from_eye: [[f32; 4]; 4],
    eye: [f32; 3],
    tinted: f32,
    fog: [f32; 3],
    fog_density: f32,
}

/// The colour of the sky and of what is far.
pub(crate) const SKY: [f64; 3] = [0.66, 0.76, 0.88];

/// The buffers of a scene.
#[derive(Debug)]
pub(crate) struct OnDevice {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    pub(crate) bodies: wgpu::Buffer,
    /// The list 0, 1, 2, ..., which draws all bodies.
    everybody: wgpu::Buffer,
    pub(crate) view: wgpu::Buffer,
    /// Least and greatest corners of the bounds, for pictures of them.
    pub(crate) corners: wgpu::Buffer,
    /// For each kind, what each of its LODs draws.
    pub(crate) draws: Vec<Vec<DrawTemplate>>,
    /// For each kind, its bodies.
    pub(crate) ranges: Vec<Range<u32>>,
    /// Kinds of which all bodies are occluders.
    occluders: Vec<usize>,
    pub(crate) num_bodies: u32,
    /// The greatest coordinate of all bounds: how far there is something to see.
    pub(crate) reach: f32,
}

/// The rows of a camera as a matrix of the shaders, for positions relative to the eye.
pub(crate) fn clip_from_eye(camera: &Camera) -> [[f32; 4]; 4] {
    let rows = camera.rows();
    [0, 1, 2, 3].map(|column| [0, 1, 2, 3].map(|row| rows[row][column] as f32))
}

/// The eye; it is a float32 ([`Scene::camera`]).
pub(crate) fn eye(camera: &Camera) -> [f32; 3] {
    camera.origin().map(|v| v as f32)
}

impl OnDevice {
    pub(crate) fn new(gpu: &Gpu, scene: &Scene) -> Self {
        let (mut vertices, mut indices) = (Vec::<Vertex>::new(), Vec::<u32>::new());
        let mut append = |mesh: &Mesh| {
            let draw = DrawTemplate {
                index_count: mesh.indices.len() as u32,
                first_index: indices.len() as u32,
                base_vertex: vertices.len() as i32,
                first_instance: 0,
            };
            vertices.extend(&mesh.vertices);
            indices.extend(&mesh.indices);
            draw
        };
        let draws: Vec<Vec<_>> = scene
            .kinds
            .iter()
            .map(|kind| kind.lods.iter().map(|lod| append(&lod.mesh)).collect())
            .collect();
        let num_bodies = scene.bodies.len() as u32;
        let ranges: Vec<_> = (0..scene.kinds.len()).map(|kind| scene.range_of(kind)).collect();
        let is_occluder = |range: &Range<u32>| {
            scene.bodies[range.start as usize..range.end as usize].iter().all(|b| b.occluder)
        };
        let occluders = (0..ranges.len()).filter(|k| is_occluder(&ranges[*k])).collect();
        // The reach of the scene decides how dense the fog is.
        let corners = scene.corners();
        let reach = corners.iter().flatten().fold(0.0_f32, |most, v| most.max(v.abs()));
        let usage = BufferUsages::STORAGE;
        Self {
            vertices: gpu.buffer("viewer.vertices", &vertices, BufferUsages::VERTEX),
            indices: gpu.buffer("viewer.indices", &indices, BufferUsages::INDEX),
            bodies: gpu.buffer(
                "viewer.bodies",
                &records(&scene.bodies),
                usage | BufferUsages::COPY_DST,
            ),
            everybody: gpu.buffer(
                "viewer.everybody",
                &(0..num_bodies).collect::<Vec<_>>(),
                BufferUsages::VERTEX,
            ),
            view: gpu.empty(
                "viewer.view",
                size_of::<View>() as u64,
                BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            ),
            corners: gpu.buffer("viewer.corners", &corners, usage),
            draws,
            ranges,
            occluders,
            num_bodies,
            reach,
        }
    }

    /// What the vertex shader reads.
    pub(crate) fn bind_group(&self, gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::BindGroup {
        let resources = [self.view.as_entire_binding(), self.bodies.as_entire_binding()];
        gpu.bind_group("viewer.scene", layout, &resources)
    }

    /// Writes the camera, for commands that are submitted later.
    pub(crate) fn look(&self, gpu: &Gpu, camera: &Camera, tinted: bool) {
        let view = View {
            clip_from_eye: clip_from_eye(camera),
            eye: eye(camera),
            tinted: f32::from(u8::from(tinted)),
            fog: SKY.map(|v| v as f32),
            // Clear to the end of the scene, nearly.
            fog_density: 0.55 / self.reach,
        };
        gpu.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
    }

    /// Puts the bodies elsewhere, for commands that are submitted later.
    pub(crate) fn put(&self, gpu: &Gpu, bodies: &[Body]) {
        gpu.queue.write_buffer(&self.bodies, 0, bytemuck::cast_slice(&records(bodies)));
    }

    /// Binds vertices, indices, and the list of all bodies.
    pub(crate) fn set_buffers(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_vertex_buffer(1, self.everybody.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Draws all bodies, each at its finest.
    pub(crate) fn draw_all(&self, pass: &mut wgpu::RenderPass<'_>) {
        for kind in 0..self.draws.len() {
            self.draw_kind(pass, kind);
        }
    }

    /// Draws what hides before a cull of one pass.
    pub(crate) fn draw_occluders(&self, pass: &mut wgpu::RenderPass<'_>) {
        for kind in &self.occluders {
            self.draw_kind(pass, *kind);
        }
    }

    fn draw_kind(&self, pass: &mut wgpu::RenderPass<'_>, kind: usize) {
        self.draw_bodies(pass, kind, self.ranges[kind].clone());
    }

    /// Draws some bodies of one kind, each at its finest.
    pub(crate) fn draw_bodies(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        kind: usize,
        bodies: Range<u32>,
    ) {
        draw_one(pass, &self.draws[kind][0], bodies);
    }
}

fn draw_one(pass: &mut wgpu::RenderPass<'_>, draw: &DrawTemplate, bodies: Range<u32>) {
    let indices = draw.first_index..draw.first_index + draw.index_count;
    pass.draw_indexed(indices, draw.base_vertex, bodies);
}

/// The records of the bodies.
fn records(bodies: &[Body]) -> Vec<BodyRecord> {
    let byte = |tint: f32| (127.5 * tint.clamp(0.0, 2.0)).round() as u8;
    bodies
        .iter()
        .map(|body| BodyRecord {
            position: body.position,
            scale: body.scale,
            turn: body.turn,
            tint: [byte(body.tint[0]), byte(body.tint[1]), byte(body.tint[2]), 0],
            kind: body.kind,
        })
        .collect()
}
