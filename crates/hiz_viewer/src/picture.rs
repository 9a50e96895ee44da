//! Pictures on the host: read, compared and written.

use std::path::Path;

use hiz_core::ImageSize;
use hiz_core::wgpu::{self, BufferUsages};

use crate::Failure;
use crate::gpu::Gpu;
use crate::pipelines::COUNT_FORMAT;
use crate::renderer::Renderer;
use crate::targets::view;

/// A picture with the depth of every sample, row 0 on top.
#[derive(Debug)]
pub(crate) struct Picture {
    pub(crate) size: ImageSize,
    pub(crate) samples: u32,
    /// RGBA, with 8 bits per channel.
    pub(crate) rgba: Vec<u8>,
    /// The bits of each sample's depth, pixel by pixel.
    pub(crate) depth: Vec<u32>,
    /// How many fragments have that depth.
    pub(crate) at_depth: Vec<u32>,
}

/// In what two pictures differ.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Difference {
    /// Samples whose depths differ in a bit.
    pub(crate) depths: usize,
    /// Pixels whose colours differ, without those of a tie.
    pub(crate) colours: usize,
    /// Pixels whose colours or depths differ, with those of a tie.
    pub(crate) differing_pixels: usize,
    /// Pixels of which two fragments share the nearest depth of a sample.
    /// Which of them shows depends on the order of drawing.
    pub(crate) ties: usize,
}

impl Picture {
    /// In what this picture differs from one of the same view without culling.
    pub(crate) fn difference(&self, reference: &Self) -> Difference {
        assert_eq!((self.size, self.samples), (reference.size, reference.samples));
        let samples = self.samples as usize;
        let pixels = self.rgba.chunks_exact(4).zip(reference.rgba.chunks_exact(4));
        let at_depth = reference.at_depth.chunks_exact(samples);
        let depths = self.depth.chunks_exact(samples).zip(reference.depth.chunks_exact(samples));
        let mut found = Difference::default();
        for (((a, b), fragments), (c, d)) in pixels.zip(at_depth).zip(depths) {
            found.differing_pixels += usize::from(a != b || c != d);
            if fragments.iter().any(|n| *n > 1) {
                found.ties += 1;
            } else if a != b {
                found.colours += 1;
            }
        }
        found.depths = self.depth.iter().zip(&reference.depth).filter(|(a, b)| a != b).count();
        found
    }

    /// How many samples show something, and how many of those no fragment has the depth of.
    ///
    /// The second is 0 if all pipelines compute the same depth, without which ties are not found.
    #[cfg(test)]
    pub(crate) fn shown_and_unmatched(&self) -> [usize; 2] {
        let samples = || self.depth.iter().zip(&self.at_depth).filter(|(bits, _)| **bits != 0);
        [samples().count(), samples().filter(|(_, fragments)| **fragments == 0).count()]
    }
}

/// Reads the last frame of a renderer.
///
/// # Errors
/// If the device fails.
pub(crate) fn read(renderer: &Renderer) -> Result<Picture, Failure> {
    let (gpu, targets) = (&renderer.gpu, &renderer.targets);
    let (size, samples) = (targets.size, targets.samples);
    let count = view(&gpu.texture("viewer.at_depth", size, samples, COUNT_FORMAT));
    let mut encoder = gpu.encoder("viewer.at_depth");
    let attachment = wgpu::RenderPassColorAttachment {
        view: &count,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            store: wgpu::StoreOp::Store,
        },
    };
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("viewer.at_depth"),
        color_attachments: &[Some(attachment)],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &targets.depth,
            depth_ops: None,
            stencil_ops: None,
        }),
        ..Default::default()
    });
    renderer.set_up(&mut pass);
    pass.set_pipeline(&renderer.pipelines.equal);
    renderer.draw_again(&mut pass);
    drop(pass);

    let found = record_samples(gpu, &mut encoder, [&targets.depth, &count], size, samples);
    gpu.submit(encoder);

    let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&found)?);
    Ok(Picture {
        size,
        samples,
        rgba: gpu.read_texture(&targets.picture_texture)?,
        depth: words.iter().map(|w| w[0]).collect(),
        at_depth: words.iter().map(|w| w[1]).collect(),
    })
}

/// Records the copy of all samples into a buffer: the bits of the depth, and the count.
pub(crate) fn record_samples(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    [depth, count]: [&wgpu::TextureView; 2],
    size: ImageSize,
    samples: u32,
) -> wgpu::Buffer {
    let mut source = include_str!("shaders/samples.wgsl").to_owned();
    if samples == 1 {
        source = source
            .replace("texture_depth_multisampled_2d", "texture_depth_2d")
            .replace("texture_multisampled_2d", "texture_2d");
    }
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("viewer.samples"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    // With one sample the last argument is the mip level, which is 0 as the sample is.
    let constants = [("SAMPLES", f64::from(samples))];
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("viewer.samples"),
        layout: None,
        module: &module,
        entry_point: Some("read_samples"),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..Default::default()
        },
        cache: None,
    });
    let num_samples = u64::from(size.width) * u64::from(size.height) * u64::from(samples);
    let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
    let found = gpu.empty("viewer.samples", 8 * num_samples, usage);
    let bindings = gpu.bind_group(
        "viewer.samples",
        &pipeline.get_bind_group_layout(0),
        &[
            wgpu::BindingResource::TextureView(depth),
            wgpu::BindingResource::TextureView(count),
            found.as_entire_binding(),
        ],
    );
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bindings, &[]);
    pass.dispatch_workgroups(size.width.div_ceil(8), size.height.div_ceil(8), 1);
    drop(pass);
    found
}

/// How many fragments the last frame's draws have per pixel, whichever of them shows.
///
/// # Errors
/// If the device fails.
pub(crate) fn depth_complexity(renderer: &Renderer) -> Result<f64, Failure> {
    let (gpu, size) = (&renderer.gpu, renderer.targets.size);
    let count = gpu.texture("viewer.fragments", size, 1, COUNT_FORMAT);
    let mut encoder = gpu.encoder("viewer.fragments");
    let nothing = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
    let target = view(&count);
    let mut pass = crate::targets::begin_flat(&mut encoder, "viewer.fragments", &target, nothing);
    renderer.set_up(&mut pass);
    pass.set_pipeline(&renderer.pipelines.fragments);
    renderer.draw_again(&mut pass);
    drop(pass);
    gpu.submit(encoder);
    let texels: Vec<u16> = bytemuck::pod_collect_to_vec(&gpu.read_texture(&count)?);
    Ok(texels.iter().map(|bits| half(*bits)).sum::<f64>() / texels.len() as f64)
}

/// The value of a 16-bit float that is positive and finite.
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10), f64::from(bits & 0x3FF) / 1024.0);
    if exponent == 0 {
        fraction * 2.0_f64.powi(-14)
    } else {
        (1.0 + fraction) * 2.0_f64.powi(exponent - 15)
    }
}

/// Writes RGBA pixels as a PNG file.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn save(path: &Path, size: ImageSize, rgba: &[u8]) -> Result<(), Failure> {
    let wrong = |error: std::io::Error| format!("{}: {error}", path.display());
    let file = std::fs::File::create(path).map_err(wrong)?;
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), size.width, size.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(rgba)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::half;

    #[test]
    fn halves_are_read() {
        let known = [(0, 0.0), (0x3C00, 1.0), (0x4000, 2.0), (0x4200, 3.0), (0x6800, 2048.0)];
        for (bits, value) in known {
            assert_eq!(half(bits), value, "{bits:#x}");
        }
    }
}
