//! Where a driver's samples lie in a pixel, and where it computes their depths.
//!
//! The two should be the same places.
//! Where they are not, a fragment has the depth of its plane beside the sample.
//! Of a surface seen edge-on that is any depth, which no slack covers (`docs/accuracy.md`).

use hiz_core::wgpu;
use hiz_core::{ImageSize, OCCLUDER_DEPTH_FORMAT};

use crate::Failure;
use crate::gpu::Gpu;
use crate::picture::record_samples;
use crate::pipelines::COUNT_FORMAT;
use crate::targets::view;

/// Steps of a pixel in which places are found; twin: `shaders/sample_places.wgsl`.
const STEPS: u32 = 16;
/// Of the target; twin: `shaders/sample_places.wgsl`.
const SIZE: ImageSize = ImageSize { width: 25, height: 4 };
/// A pixel whose depths grow to the right, and one whose depths grow downwards.
const SLOPES: [[u32; 2]; 2] = [[20, 0], [20, 2]];

/// The places of one sample: columns and rows from the pixel's upper left corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// The least place at which it may lie: a multiple of a step, and it lies less than one behind.
    pub(crate) lies: [f64; 2],
    /// Where its depth is computed.
    pub(crate) depth_of: [f64; 2],
}

impl Place {
    /// Whether the depth is that of the sample, within a step.
    pub(crate) fn agrees(&self) -> bool {
        let step = 1.0 / f64::from(STEPS);
        (0..2).all(|k| {
            let behind = self.depth_of[k] - self.lies[k];
            (-0.25 * step..1.25 * step).contains(&behind)
        })
    }
}

/// Whether depths are those of the samples.
///
/// # Errors
/// If the device fails.
pub(crate) fn agree(gpu: &Gpu, samples: u32) -> Result<bool, Failure> {
    Ok(measure(gpu, samples)?.iter().all(Place::agrees))
}

/// Says so where depths are not those of the samples: pictures may then differ.
///
/// # Errors
/// If the device fails.
pub(crate) fn tell(gpu: &Gpu, samples: u32) -> Result<(), Failure> {
    if !agree(gpu, samples)? {
        println!(
            "depths: this driver computes them beside the samples, so with {samples} samples a few \
             may differ from a picture without culling"
        );
    }
    Ok(())
}

/// Draws squares and reads which samples they cover, with which depths.
///
/// # Errors
/// If the device fails.
pub(crate) fn measure(gpu: &Gpu, samples: u32) -> Result<Vec<Place>, Failure> {
    let label = "viewer.sample_places";
    let depth = view(&gpu.texture(label, SIZE, samples, OCCLUDER_DEPTH_FORMAT));
    let count = view(&gpu.texture(label, SIZE, samples, COUNT_FORMAT));
    let pipeline = pipeline(gpu, samples);
    let mut encoder = gpu.encoder(label);
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.draw(0..4, 0..2 * (STEPS + 1) + 2);
    drop(pass);
    let found = record_samples(gpu, &mut encoder, [&depth, &count], SIZE, samples);
    gpu.submit(encoder);
    let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&found)?);
    let at = |[x, y]: [u32; 2], sample: u32| {
        let place = (y * SIZE.width + x) * samples + sample;
        f64::from(f32::from_bits(words[place as usize][0]))
    };
    let places = (0..samples).map(|s| {
        // A square that begins at or before the sample covers it.
        let last = |row: u32| (0..=STEPS).filter(|x| at([*x, row], s) > 0.0).count();
        let lies = [0, 2].map(|row| (last(row) as f64 - 1.0) / f64::from(STEPS));
        let [across, down] = SLOPES.map(|pixel| at(pixel, s));
        Place { lies, depth_of: [8.0 * across - 3.0, 3.0 * down - 1.0] }
    });
    Ok(places.collect())
}

fn pipeline(gpu: &Gpu, samples: u32) -> wgpu::RenderPipeline {
    let label = Some("viewer.sample_places");
    let module = gpu.device.create_shader_module(wgpu::include_wgsl!("shaders/sample_places.wgsl"));
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("square"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: OCCLUDER_DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}
