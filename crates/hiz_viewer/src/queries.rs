//! Hardware occlusion queries on the same bounds, to compare with: one query per body in view.
//!
//! Each body's box is drawn against the depth of the occluders, and the device counts its samples.
//! The host reads the counts and draws what has any: at once, which stalls, or a frame late, which
//! loses what has just appeared.

use hiz_core::wgpu::{self, BufferUsages};
use hiz_core::{Camera, OCCLUDER_DEPTH_FORMAT};

use crate::Failure;
use crate::renderer::Renderer;
use crate::scene_on_device::SKY;
use crate::targets::Begin;

/// Queries of one set, the most that wgpu allows.
const SET: u32 = wgpu::QUERY_SET_MAX_QUERIES;
/// Vertices of the six faces of a box.
const FACE_VERTICES: u32 = 36;

/// When the host reads the counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Read {
    AtOnce,
    AFrameLate,
}

/// What the queries of one renderer need.
#[derive(Debug)]
pub(crate) struct Queries {
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    sets: Vec<wgpu::QuerySet>,
    counts: wgpu::Buffer,
    /// Corners of the bounds: least and greatest, in turns.
    corners: Vec<[f32; 4]>,
    /// Which bodies the last frame's queries found hidden.
    hidden: Vec<bool>,
    /// Bodies and triangles that the last frame drew.
    pub(crate) drawn: (u32, u64),
    /// The ranges of bodies that are drawn, with their kinds.
    runs: Vec<(usize, std::ops::Range<u32>)>,
}

impl Queries {
    pub(crate) fn new(renderer: &Renderer) -> Result<Self, Failure> {
        let (gpu, on_device) = (&renderer.gpu, &renderer.on_device);
        let module =
            gpu.device.create_shader_module(wgpu::include_wgsl!("shaders/query_boxes.wgsl"));
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("viewer.query"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("face_vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: OCCLUDER_DEPTH_FORMAT,
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: renderer.targets.samples,
                ..Default::default()
            },
            fragment: None,
            multiview_mask: None,
            cache: None,
        });
        let resources = [on_device.view.as_entire_binding(), on_device.corners.as_entire_binding()];
        let bindings =
            gpu.bind_group("viewer.query", &pipeline.get_bind_group_layout(0), &resources);
        let bodies = on_device.num_bodies;
        let set = |_| {
            gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("viewer.query"),
                ty: wgpu::QueryType::Occlusion,
                count: SET,
            })
        };
        let sets: Vec<_> = (0..bodies.div_ceil(SET)).map(set).collect();
        let usage = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
        Ok(Self {
            counts: gpu.empty("viewer.counts", 8 * u64::from(SET) * sets.len() as u64, usage),
            corners: renderer.scene.corners(),
            hidden: vec![false; bodies as usize],
            drawn: (0, 0),
            runs: Vec::new(),
            pipeline,
            bindings,
            sets,
        })
    }

    /// Draws a frame, and waits for it.
    pub(crate) fn draw(
        &mut self,
        renderer: &Renderer,
        camera: &Camera,
        read: Read,
    ) -> Result<(), Failure> {
        let gpu = &renderer.gpu;
        renderer.on_device.look(gpu, camera, renderer.shown.tint);
        let (asked, in_view) = self.in_view(camera);
        let mut encoder = gpu.encoder("viewer.queries");
        renderer.record_occluders(&mut encoder);
        for (set, bodies) in self.sets.iter().zip(asked.chunks(SET as usize)) {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("viewer.queries"),
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &renderer.targets.depth,
                    depth_ops: None,
                    stencil_ops: None,
                }),
                occlusion_query_set: Some(set),
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            for (body, query) in bodies.iter().zip(0..) {
                pass.begin_occlusion_query(query);
                pass.draw(0..FACE_VERTICES, *body..*body + 1);
                pass.end_occlusion_query();
            }
        }
        for ((set, i), bodies) in self.sets.iter().zip(0_u64..).zip(asked.chunks(SET as usize)) {
            let offset = 8 * u64::from(SET) * i;
            encoder.resolve_query_set(set, 0..bodies.len() as u32, &self.counts, offset);
        }
        if read == Read::AFrameLate {
            // What the frame before has found.
            self.choose(renderer, &in_view);
            self.record_picture(renderer, &mut encoder);
            gpu.submit(encoder);
            return self.read(renderer, &asked);
        }
        gpu.submit(encoder);
        self.read(renderer, &asked)?;
        self.choose(renderer, &in_view);
        let mut encoder = gpu.encoder("viewer.queries");
        self.record_picture(renderer, &mut encoder);
        gpu.submit_and_wait(encoder)
    }

    /// The bodies whose boxes are asked about, and which are in view.
    /// A box that reaches to the near plane or behind it is in view, and not asked about.
    fn in_view(&self, camera: &Camera) -> (Vec<u32>, Vec<bool>) {
        let (rows, eye) = (camera.rows(), camera.origin());
        let mut asked = Vec::new();
        let boxes = self.corners.chunks_exact(2);
        let of = |(number, corners): (usize, &[[f32; 4]])| {
            // How far the box reaches along a plane, at most and at least.
            let ends = |plane: [f64; 4]| {
                let mut ends = [plane[3]; 2];
                for k in 0..3 {
                    let [a, b] = [0, 1].map(|i| plane[k] * (f64::from(corners[i][k]) - eye[k]));
                    ends[0] += a.min(b);
                    ends[1] += a.max(b);
                }
                ends
            };
            let plane =
                |row: usize, sign: f64| [0, 1, 2, 3].map(|k| rows[3][k] + sign * rows[row][k]);
            let borders = [plane(0, 1.0), plane(0, -1.0), plane(1, 1.0), plane(1, -1.0), rows[2]];
            // Reversed Z: the near plane is where z is w.
            let near = ends(plane(2, -1.0));
            let is_in = near[1] >= 0.0 && borders.into_iter().all(|border| ends(border)[1] >= 0.0);
            if is_in && near[0] > 0.0 {
                asked.push(number as u32);
            }
            is_in
        };
        let in_view = boxes.enumerate().map(of).collect();
        (asked, in_view)
    }

    /// Reads the counts of the bodies that were asked about.
    fn read(&mut self, renderer: &Renderer, asked: &[u32]) -> Result<(), Failure> {
        let bytes = renderer.gpu.read_buffer(&self.counts)?;
        let counts: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes);
        self.hidden.fill(false);
        for (body, count) in asked.iter().zip(counts) {
            self.hidden[*body as usize] = count == 0;
        }
        Ok(())
    }

    /// What is drawn: bodies in view that are not known to be hidden, in runs of one kind.
    fn choose(&mut self, renderer: &Renderer, in_view: &[bool]) {
        self.runs.clear();
        self.drawn = (0, 0);
        for (kind, range) in renderer.on_device.ranges.iter().enumerate() {
            let triangles = u64::from(renderer.on_device.draws[kind][0].index_count / 3);
            for body in range.clone() {
                if !in_view[body as usize] || self.hidden[body as usize] {
                    continue;
                }
                self.drawn.0 += 1;
                self.drawn.1 += triangles;
                match self.runs.last_mut() {
                    Some((last, run)) if *last == kind && run.end == body => run.end += 1,
                    _ => self.runs.push((kind, body..body + 1)),
                }
            }
        }
    }

    fn record_picture(&self, renderer: &Renderer, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = renderer.targets.begin(encoder, Begin::Empty, SKY, true);
        renderer.set_up(&mut pass);
        pass.set_pipeline(&renderer.pipelines.picture);
        for (kind, run) in &self.runs {
            renderer.on_device.draw_bodies(&mut pass, *kind, run.clone());
        }
    }
}
