//! A shader that moves the spheres: it writes the buffer that the library takes their bounds from.

use hiz_core::wgpu::{self, util::DeviceExt};

/// Turns all spheres about the eye, lets them bob and breathe, and spoils one of 500.
const SHADER: &str = "
struct Frame { sin: f32, cos: f32, time: f32, nan_bits: u32 }
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> resting: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> bounds: array<vec4<f32>>;

@compute @workgroup_size(64) fn move_spheres(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if i >= arrayLength(&resting) { return; }
    let s = resting[i];
    let phase = frame.time + 0.37 * f32(i % 64u);
    let x = frame.cos * s.x + frame.sin * s.z;
    let z = frame.cos * s.z - frame.sin * s.x;
    var radius = s.w * (1.0 + 0.3 * sin(1.7 * phase));
    if i % 500u == 7u { radius = bitcast<f32>(frame.nan_bits); }
    bounds[i] = vec4(x, s.y + 0.3 * sin(phase), z, radius);
}
";

/// Degrees that the spheres turn in a frame; 0.6 m at the outermost ones.
const TURN_DEG: f32 = 2.0;

pub(crate) struct Mover {
    pipeline: wgpu::ComputePipeline,
    resting: wgpu::Buffer,
    /// What the shader writes and the library reads: x, y, z and radius.
    pub(crate) bounds: wgpu::Buffer,
    count: u32,
}

impl Mover {
    pub(crate) fn new(device: &wgpu::Device, spheres: &[[f32; 4]]) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("arm.move"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("arm.move"),
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let resting = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("arm.resting"),
            contents: bytemuck::cast_slice(spheres),
            usage: wgpu::BufferUsages::STORAGE,
        });
        let bounds = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("arm.bounds"),
            size: resting.size(),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Self { pipeline, resting, bounds, count: spheres.len() as u32 }
    }

    /// Records that the shader writes the bounds of a frame.
    pub(crate) fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        frame: u32,
    ) {
        let turned = (TURN_DEG * frame as f32).to_radians();
        let time = 0.31 * frame as f32;
        let words = [turned.sin(), turned.cos(), time, f32::NAN].map(f32::to_bits);
        let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("arm.frame"),
            contents: bytemuck::bytes_of(&words),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("arm.move"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[entry(0, &uniform), entry(1, &self.resting), entry(2, &self.bounds)],
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.dispatch_workgroups(self.count.div_ceil(64), 1, 1);
    }

    /// The bounds that the shader has written, for the rays.
    pub(crate) fn read(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Vec<[f32; 4]> {
        let (told, answer) = std::sync::mpsc::channel();
        wgpu::util::DownloadBuffer::read_buffer(device, queue, &self.bounds.slice(..), move |b| {
            told.send(b.expect("a small buffer can be read").to_vec()).expect("it is waited for");
        });
        device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
        bytemuck::pod_collect_to_vec(&answer.recv().expect("the callback ran"))
    }
}

fn entry(binding: u32, buffer: &wgpu::Buffer) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }
}
