//! Pyramids of which a part is renewed: by an image that was drawn into, or by an array.

use std::sync::atomic::Ordering;

use crate::error::{Error, Result};
use crate::headless::depth_image::DepthImage;
use crate::headless::engine::Engine;
use crate::headless::samples::Samples;
use crate::input::depth::DepthInput;
use crate::pyramid::Pyramid;
use crate::pyramid::ends::DepthEnd;
use crate::pyramid::layout::PIXELS;
use crate::pyramid::region::{check_rectangle, record_reduce_region};

impl Engine {
    /// Renews the levels of a pyramid where its depth image has changed.
    ///
    /// `depth` is the image that the pyramid was built from.
    /// `rectangle` is `[x0, y0, x1, y1]` with both ends, as
    /// [`render_depth_into`](Engine::render_depth_into) returns it; outside of it nothing may have
    /// changed.
    /// The levels are then those of a pyramid that is built anew, bit for bit.
    ///
    /// # Errors
    /// Those of
    /// [`HizContext::record_reduce_region`](crate::HizContext::record_reduce_region), and
    /// [`Error::DeviceLost`].
    ///
    /// # Examples
    /// ```
    /// use hiz_core::headless::Engine;
    /// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
    /// use hiz_core::{DrawOptions, Floats, MeshData, OccluderOptions};
    /// # let engine = Engine::new(None)?;
    /// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    /// # let convention = DepthConvention::Reversed;
    /// # let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention };
    /// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
    /// # let (vertices, triangles) =
    /// #     (Floats::F32(&[-9.0, -9.0, -9.0, 9.0, -9.0, -9.0, 0.0, 9.0, -9.0]), &[0, 1, 2]);
    /// # let walls = engine.occluders(
    /// #     &[MeshData { vertices, triangles, transforms: None }],
    /// #     &OccluderOptions::default(),
    /// # )?;
    ///
    /// let depth = engine.render_depth(&walls, &camera)?;
    /// let pyramid = engine.pyramid(&depth)?;
    /// // Later more is drawn into the image:
    /// let touched = engine.render_depth_into(&depth, &walls, &DrawOptions::default())?;
    /// if let Some(rectangle) = touched {
    ///     engine.renew_pyramid(&pyramid, &depth, rectangle)?;
    /// }
    /// # Ok::<(), hiz_core::Error>(())
    /// ```
    pub fn renew_pyramid(
        &self,
        pyramid: &Pyramid,
        depth: &DepthImage,
        rectangle: [u32; 4],
    ) -> Result<()> {
        self.renew(pyramid, depth, rectangle, |_| Ok(()))
    }

    /// Replaces a rectangle of an uploaded depth image, and renews the levels of its pyramid there.
    ///
    /// `rows` has an image for each sample, one without multisampling.
    /// Each holds whole rows of the depth image, those of the rectangle.
    /// What lies beside the rectangle's columns is not used.
    ///
    /// # Errors
    /// Those of [`Engine::renew_pyramid`] and [`Engine::upload_depth_of_samples`], and
    /// [`Error::Invalid`] for an image that was drawn.
    pub fn replace_depth(
        &self,
        pyramid: &Pyramid,
        depth: &DepthImage,
        rectangle: [u32; 4],
        rows: &[DepthInput<'_>],
    ) -> Result<()> {
        if depth.drawn.is_some() || depth.texture.format() != wgpu::TextureFormat::Rgba32Uint {
            return Err(Error::invalid(
                "depth",
                "expected an image that was uploaded, got one that occluders were drawn into",
            ));
        }
        check_rectangle(rectangle, depth.size())?;
        let samples = Samples::new(rows, &depth.camera, (rectangle[1], depth.far_pixels))?;
        let (count, left) = (samples.count(), samples.tolerance());
        let is_alike = count == depth.samples && left == depth.tolerance;
        if !is_alike || samples.near_slack() != depth.near_slack {
            return Err(Error::invalid(
                "depth",
                format!(
                    "expected the image's {} samples and its tolerance {:?}, got {count} and \
                     {left:?}",
                    depth.samples, depth.tolerance
                ),
            ));
        }
        self.renew(pyramid, depth, rectangle, |encoder| {
            depth.record_patch(encoder, rectangle, &samples, DepthEnd::Farthest)?;
            if depth.nearest.is_some() {
                depth.record_patch(encoder, rectangle, &samples, DepthEnd::Nearest)?;
            }
            let has_lost = samples.have_lost_no_data();
            pyramid.no_data_is_far.fetch_or(has_lost, Ordering::Relaxed);
            Ok(())
        })
    }

    /// Records what `before` records and the reduction of the rectangle, and submits both.
    fn renew(
        &self,
        pyramid: &Pyramid,
        depth: &DepthImage,
        rectangle: [u32; 4],
        before: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
    ) -> Result<()> {
        self.context().gpu.check_context("depth", depth.engine.context().gpu.id())?;
        self.scoped(|| {
            // Each renewal builds on the one that was submitted before.
            let _in_order = pyramid.submitting.lock();
            let mut encoder = self.encoder("hiz.reduce.encoder");
            before(&mut encoder)?;
            let gpu = &self.context().gpu;
            record_reduce_region(gpu, &mut encoder, &depth.source(), rectangle, pyramid)?;
            self.queue().submit([encoder.finish()]);
            Ok(())
        })
    }
}

impl DepthImage {
    /// Records copies that put new pixels into a rectangle.
    ///
    /// A texel holds four pixels, and the rectangle may begin and end within one.
    /// So the texels that it touches are copied out, get the new pixels, and are copied back.
    fn record_patch(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        [x0, y0, x1, y1]: [u32; 4],
        samples: &Samples<'_>,
        end: DepthEnd,
    ) -> Result<()> {
        let texture = match &self.nearest {
            Some(nearest) if end == DepthEnd::Nearest => nearest,
            _ => &self.texture,
        };
        let (gpu, width) = (&self.engine.context().gpu, self.size().width);
        let height = y1 - y0 + 1;
        let mut rows = vec![0.0; (width * height) as usize];
        samples.rows(y0, &mut rows, end);
        // The spare pixels of the last texel repeat the row's last pixel.
        let end = if x1 + 1 == width { width.next_multiple_of(PIXELS) } else { x1 + 1 };
        let columns = (end - x0) as usize;
        let mut pixels = Vec::with_capacity(columns * height as usize);
        for row in rows.chunks_exact(width as usize) {
            pixels.extend((x0..end).map(|x| row[x.min(width - 1) as usize]));
        }
        let (first, last) = (x0 / PIXELS, (end - 1) / PIXELS);
        let texel_bytes = 4 * u64::from(PIXELS);
        let pitch = (texel_bytes * u64::from(last - first + 1))
            .next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT.into());
        let usage = wgpu::BufferUsages::COPY_SRC;
        let new = gpu.filled("hiz.depth.new", bytemuck::cast_slice(&pixels), usage)?;
        let usage = usage | wgpu::BufferUsages::COPY_DST;
        let merged = gpu.empty("hiz.depth.merged", pitch * u64::from(height), usage)?;
        let in_buffer = wgpu::TexelCopyBufferInfo {
            buffer: &merged,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(pitch as u32),
                rows_per_image: None,
            },
        };
        let in_texture = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: first, y: y0, z: 0 },
            ..texture.as_image_copy()
        };
        let extent = wgpu::Extent3d { width: last - first + 1, height, depth_or_array_layers: 1 };
        encoder.copy_texture_to_buffer(in_texture, in_buffer, extent);
        let (skipped, row_bytes) = (4 * u64::from(x0 - first * PIXELS), 4 * columns as u64);
        for row in 0..u64::from(height) {
            let to = row * pitch + skipped;
            encoder.copy_buffer_to_buffer(&new, row * row_bytes, &merged, to, row_bytes);
        }
        encoder.copy_buffer_to_texture(in_buffer, in_texture, extent);
        Ok(())
    }
}
