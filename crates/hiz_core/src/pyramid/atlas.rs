//! All levels of a pyramid, the depth image included, in one texture for culls of many instances.
//!
//! A software driver takes both ways of every branch.
//! If level 0 and the stored levels are apart, it fetches from both.
//! A word of a buffer costs it four times as much as a texel (`docs/performance.md`).
//! The shader's side is `shaders/pyramid/texels_atlas.wgsl`.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::input::image::ImageSize;
use crate::pyramid::built::Built;
use crate::pyramid::layout::{AtlasLayout, HEADERS, PIXELS, PyramidLayout};
use crate::pyramid::levels::Level;
use crate::pyramid::source::Part;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// Whether culls read the depth image and the stored levels from one texture, the atlas.
///
/// Both are copied into it once per reduction.
/// The results of culls are the same.
///
/// An atlas is possible under these conditions; otherwise culls read the levels in place:
///
/// - The depth image has the format
///   [`Depth32Float`](wgpu::TextureFormat::Depth32Float),
///   [`R32Float`](wgpu::TextureFormat::R32Float) or
///   [`Rgba32Uint`](wgpu::TextureFormat::Rgba32Uint).
/// - It has the usage [`COPY_SRC`](wgpu::TextureUsages::COPY_SRC).
/// - It is all of its mip level, and no rectangle of it ([`DepthSource`](crate::DepthSource)).
/// - It is one image, and no pair of farthest and nearest samples.
/// - The stored levels fit one storage binding.
/// - The atlas fits a texture of the device, and the depth image a buffer to copy it through.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum AtlasUse {
    /// Where a cull has enough instances for the copy to pay.
    ///
    /// That takes a quarter as many instances as the depth image and the stored levels have texels.
    #[default]
    Auto,
    /// Whatever the number of instances.
    Always,
    /// Never: no copy, and no memory for it.
    Never,
}

/// The texture of an atlas, and what it is known to hold.
#[derive(Debug)]
pub(crate) struct Atlas {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    /// The buffer through which a depth image of another format is copied.
    staging: Option<wgpu::Buffer>,
    /// The reduction whose levels it is known to hold; 0 for none.
    contents: Arc<AtomicU32>,
}

/// Whether these levels and the depth image `part` can be copied into an atlas.
///
/// A rectangle of a texture cannot: a copy of depth takes all of a mip level.
pub(crate) fn is_possible(layout: &PyramidLayout, part: &Part, limits: &wgpu::Limits) -> bool {
    let source = &part.subresource.texture;
    travels(source.format())
        && !part.kind.is_part()
        && part.nearest.is_none()
        && source.usage().contains(wgpu::TextureUsages::COPY_SRC)
        && layout.chunk_sizes().len() == 1
        && layout.atlas.fits(limits)
        && (source.format() == FORMAT || staging_bytes(layout.size) <= limits.max_buffer_size)
}

/// Whether images of a format can be copied as the bits of float32.
///
/// `Depth24Plus` cannot be copied, and other formats hold other bits.
pub(crate) fn travels(format: wgpu::TextureFormat) -> bool {
    matches!(format, wgpu::TextureFormat::Depth32Float | wgpu::TextureFormat::R32Float | FORMAT)
}

impl AtlasUse {
    /// Whether culls of `instances` instances ask for an atlas.
    ///
    /// Copying a pixel costs about a quarter of what the atlas saves per instance
    /// (`docs/performance.md`).
    pub(crate) fn pays(self, layout: &PyramidLayout, instances: u32) -> bool {
        match self {
            Self::Auto => 4 * u64::from(instances) >= layout.size.pixels() + layout.texels,
            Self::Always => true,
            Self::Never => false,
        }
    }
}

impl Atlas {
    pub(crate) fn new(gpu: &Gpu, layout: &PyramidLayout) -> Result<Self> {
        let AtlasLayout { width, height, .. } = layout.atlas;
        let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = gpu.texture("hiz.pyramid.atlas", (width, height), FORMAT, usage)?;
        Ok(Self { view: gpu.view(&texture)?, texture, staging: None, contents: Arc::default() })
    }

    pub(crate) fn view(&self) -> wgpu::TextureView {
        self.view.clone()
    }

    /// Whether the atlas is known to hold the levels of this reduction.
    pub(crate) fn holds(&self, reduction: u32) -> bool {
        self.contents.load(Ordering::Acquire) == reduction
    }

    /// The number of the reduction whose levels it holds, shared with the callback that sets it.
    pub(crate) fn contents(&self) -> Arc<AtomicU32> {
        Arc::clone(&self.contents)
    }

    /// Bytes on the device.
    pub(crate) fn bytes(&self) -> u64 {
        let texture = 16 * u64::from(self.texture.width()) * u64::from(self.texture.height());
        texture + self.staging.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// Records the copies of all levels, and of two headers.
    ///
    /// What is copied is settled at different times.
    /// For the depth image, and for levels in place, that is now; for other stored levels it is when
    /// the copies run, which may be after the next reduction.
    /// A header therefore goes with each.
    /// A cull keeps everything if either header differs from the reduction that it expects.
    pub(crate) fn record(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        layout: &PyramidLayout,
        stored: &wgpu::Buffer,
        built: &Built,
    ) -> Result<()> {
        let source = &built.part.subresource;
        let format = source.texture.format();
        let texels = source.texels();
        let extent =
            wgpu::Extent3d { width: texels.width, height: texels.height, depth_or_array_layers: 1 };
        let made = built.in_place.as_ref().zip(layout.image());
        // Everything that can fail comes before the first command is recorded.
        let staging = if format == FORMAT { None } else { Some(self.staging_or_new(gpu, layout)?) };
        let stored = made.map_or(stored, |(made, _)| made.buffer.read_by(encoder));
        let of_image = gpu.numbers(bytemuck::cast_slice(&[built.reduction, 0, 0, 0]))?;
        of_image.record_with(encoder, |encoder, of_image| {
            for (column, buffer) in (layout.atlas.width - HEADERS..).zip([of_image, stored]) {
                self.record_rows(
                    encoder,
                    buffer,
                    [column, 0],
                    Rows { offset: 0, pitch: 0, width: PIXELS, height: 1 },
                );
            }
        });
        for (k, level) in layout.stored_levels() {
            let Level { offset, stride, width, height } = *level;
            let width = layout.depths.count() as u32 * width;
            let rows = Rows { offset: 4 * u64::from(offset), pitch: 4 * stride, width, height };
            let [x, y, ..] = layout.atlas.origins[k];
            self.record_rows(encoder, stored, [x, y], rows);
        }
        if let Some((_, Level { offset, stride, width, height })) = made {
            let rows = Rows { offset: 4 * u64::from(offset), pitch: 4 * stride, width, height };
            self.record_rows(encoder, stored, [0; 2], rows);
            return Ok(());
        }
        let Some(staging) = staging else {
            encoder.copy_texture_to_texture(
                source.as_image_copy(),
                self.texture.as_image_copy(),
                extent,
            );
            return Ok(());
        };
        let (width, height) = (layout.size.width, layout.size.height);
        let pitch = staging_pitch(layout.size);
        // All at once, since a depth texture cannot be copied in parts.
        encoder.copy_texture_to_buffer(
            source.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &staging, layout: copy_layout(0, pitch) },
            extent,
        );
        self.record_rows(encoder, &staging, [0; 2], Rows { offset: 0, pitch, width, height });
        Ok(())
    }

    fn staging_or_new(&mut self, gpu: &Gpu, layout: &PyramidLayout) -> Result<wgpu::Buffer> {
        if let Some(staging) = &self.staging {
            return Ok(staging.clone());
        }
        let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let staging = gpu.empty("hiz.pyramid.atlas_staging", staging_bytes(layout.size), usage)?;
        Ok(self.staging.insert(staging).clone())
    }

    /// Records the copy of one level from `buffer` to column x and row y of the atlas.
    fn record_rows(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffer: &wgpu::Buffer,
        [x, y]: [u32; 2],
        Rows { offset, pitch, width, height }: Rows,
    ) {
        encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo { buffer, layout: copy_layout(offset, pitch) },
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x, y, z: 0 },
                ..self.texture.as_image_copy()
            },
            wgpu::Extent3d { width: width.div_ceil(PIXELS), height, depth_or_array_layers: 1 },
        );
    }
}

/// Bytes per row of an image in the staging buffer, at 4 bytes per pixel.
///
/// The image fits the device's textures, so this cannot overflow.
fn staging_pitch(size: ImageSize) -> u32 {
    (4 * size.width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

fn staging_bytes(size: ImageSize) -> u64 {
    u64::from(staging_pitch(size)) * u64::from(size.height)
}

/// Rows in a buffer: `offset` and `pitch` in bytes, `width` in words.
#[derive(Clone, Copy)]
struct Rows {
    offset: u64,
    pitch: u32,
    width: u32,
    height: u32,
}

fn copy_layout(offset: u64, pitch: u32) -> wgpu::TexelCopyBufferLayout {
    wgpu::TexelCopyBufferLayout {
        offset,
        bytes_per_row: (pitch > 0).then_some(pitch),
        rows_per_image: None,
    }
}

#[cfg(test)]
mod tests {
    use crate::input::image::ImageSize;
    use crate::pyramid::ends::Depths;
    use crate::pyramid::layout::PyramidLayout;
    use crate::pyramid::levels::StoredLevels;

    #[test]
    fn levels_lie_beside_each_other() {
        for (w, h) in [(1, 1), (5, 3), (1, 9000), (9000, 1), (1920, 1080), (640, 481), (8191, 8001)]
        {
            let choices =
                [StoredLevels::ALL, StoredLevels::only(3), StoredLevels { first: 2, last: 4 }];
            let ends = [(Depths::Farthest, 1), (Depths::Both, 2)];
            for (levels, (depths, words)) in
                choices.into_iter().flat_map(|levels| ends.map(|ends| (levels, ends)))
            {
                let layout = PyramidLayout::new(ImageSize::new(w, h), levels, depths, 25).unwrap();
                let atlas = &layout.atlas;
                // Column, row, width and height of each area; the headers have the last columns.
                let mut areas = vec![
                    [0, 0, w.div_ceil(4), h],
                    [atlas.width - 1, 0, 1, 1],
                    [atlas.width - 2, 0, 1, 1],
                ];
                for (k, level) in layout.stored_levels() {
                    let [x, y, ..] = atlas.origins[k];
                    areas.push([x, y, (words * level.width).div_ceil(4), level.height]);
                }
                for (i, [x, y, width, height]) in areas.iter().enumerate() {
                    assert!(
                        x + width <= atlas.width && y + height <= atlas.height,
                        "{w}x{h} {levels:?} {depths:?}"
                    );
                    for [u, v, across, down] in &areas[..i] {
                        assert!(
                            x + width <= *u
                                || u + across <= *x
                                || y + height <= *v
                                || v + down <= *y,
                            "{w}x{h}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn the_largest_image_of_any_device_fits() {
        let layout =
            PyramidLayout::new(ImageSize::new(8192, 8192), StoredLevels::ALL, Depths::Farthest, 25)
                .unwrap();
        assert!(layout.atlas.fits(&wgpu::Limits::default()));
    }
}
