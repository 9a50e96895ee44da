//! Pyramids of uploaded depth images, and their levels as arrays.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use crate::error::{Error, Result};
use crate::headless::depth_image::DepthImage;
use crate::headless::engine::Engine;
use crate::headless::readback::{self, BufferRange, to_u32};
use crate::host::memory;
use crate::input::depth::{is_background, sanitized, sanitized_near};
use crate::pyramid::atlas;
use crate::pyramid::built::Owner;
use crate::pyramid::ends::DepthEnd;
use crate::pyramid::levels::StoredLevels;
use crate::pyramid::reduce::record_reduce;
use crate::pyramid::{Pyramid, PyramidOptions};

impl Engine {
    /// Builds the depth pyramid of an image, with default options.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for an image of another device.
    /// - [`Error::OutOfMemory`].
    pub fn pyramid(&self, depth: &DepthImage) -> Result<Arc<Pyramid>> {
        self.pyramid_with(depth, &PyramidOptions::default())
    }

    /// [`Engine::pyramid`] with options.
    ///
    /// # Errors
    /// Those of [`Engine::pyramid`] and of
    /// [`HizContext::create_pyramid`](crate::HizContext::create_pyramid).
    pub fn pyramid_with(
        &self,
        depth: &DepthImage,
        options: &PyramidOptions,
    ) -> Result<Arc<Pyramid>> {
        self.context().gpu.check_context("depth", depth.engine.context().gpu.id())?;
        self.scoped(|| {
            let pyramid = self.context().create_pyramid(depth.size(), options)?;
            self.submit_reduce(depth, &pyramid)?;
            Ok(Arc::new(pyramid))
        })
    }

    /// Builds a pyramid anew from an image of its size.
    pub(super) fn reduce(&self, depth: &DepthImage, pyramid: &Pyramid) -> Result<()> {
        self.scoped(|| self.submit_reduce(depth, pyramid))
    }

    fn submit_reduce(&self, depth: &DepthImage, pyramid: &Pyramid) -> Result<()> {
        depth.check_depths(pyramid.depths())?;
        let _in_order = pyramid.submitting.lock();
        let drawn = depth.drawn.as_ref();
        let _drawn_in_order = drawn.map(|drawn| drawn.submitting.lock());
        let levels = drawn.and_then(|drawn| drawn.levels());
        let mut encoder = self.encoder("hiz.reduce.encoder");
        let gpu = &self.context().gpu;
        self.timed(&mut encoder, |encoder| {
            record_reduce(gpu, encoder, &depth.source_with(levels), &depth.camera, pyramid)
        })?;
        pyramid.no_data_is_far.store(depth.no_data_is_far, Ordering::Relaxed);
        if let Some(drawn) = drawn {
            pyramid.keep_with_it(Arc::clone(drawn) as Arc<dyn Owner>);
        }
        self.queue().submit([encoder.finish()]);
        if pyramid.built().is_some_and(|built| built.in_place.is_none()) {
            levels.inspect(|levels| levels.image_has_come());
        }
        Ok(())
    }

    /// Reads a level of a pyramid: one float32 per texel, sanitised NDC depth, row 0 on top.
    ///
    /// It has the farthest depths, or the nearest where the pyramid has these alone.
    /// The array has as many rows and columns as the level.
    ///
    /// # Errors
    /// - [`Error::Invalid`] past the last level, for a level that is not stored, and for level 0 of
    ///   a format that is not read as float32.
    /// - [`Error::Mismatch`] for a pyramid that was never built.
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read_level(&self, pyramid: &Pyramid, level: u32) -> Result<Vec<f32>> {
        let end =
            if pyramid.depths().has_farthest() { DepthEnd::Farthest } else { DepthEnd::Nearest };
        self.read_level_of(pyramid, level, end)
    }

    /// [`Engine::read_level`] of one of the ends that the pyramid has ([`Depths`](crate::Depths)).
    ///
    /// Level 0 has the pixels as that end counts them.
    ///
    /// # Errors
    /// Those of [`Engine::read_level`], and [`Error::Invalid`] for an end that is not stored.
    pub fn read_level_of(&self, pyramid: &Pyramid, level: u32, end: DepthEnd) -> Result<Vec<f32>> {
        self.check_process()?;
        self.context().gpu.check_context("pyramid", pyramid.context)?;
        let layout = pyramid.layout.levels.get(level as usize).ok_or_else(|| {
            Error::invalid(
                "level",
                format!("expected a level below {}, got {level}", pyramid.num_levels()),
            )
        })?;
        pyramid.depths().check_end(end)?;
        if !pyramid.layout.is_there(level) {
            let StoredLevels { first, last } = pyramid.layout.stored;
            return Err(Error::invalid(
                "level",
                format!("expected 0 or a stored level, {first}..={last}, got {level}"),
            ));
        }
        let built = pyramid.built().ok_or_else(|| {
            Error::mismatch(
                "pyramid",
                "expected one that was built from a depth image, got one that never was",
            )
        })?;
        if level == 0 {
            let part = &built.part;
            let format = part.subresource.texture.format();
            if !atlas::travels(format) {
                return Err(Error::invalid(
                    "level",
                    format!(
                        "expected a level above 0 of a pyramid of {format:?}, which is not read as \
                         float32, got 0"
                    ),
                ));
            }
            self.scoped(|| {
                self.bring_image_of(pyramid);
                Ok(())
            })?;
            let [x, y] = part.origin.map(u64::from);
            let crop = readback::Crop {
                skip: 4 * x,
                row: 4 * u64::from(layout.width),
                first: y,
                rows: u64::from(layout.height),
            };
            let (of, convention) = (&part.subresource, built.camera.convention());
            let read = |copied| {
                let texels = (copied, of.texels());
                self.scoped(|| readback::read_texels(self.device(), self.queue(), texels, &crop))
            };
            let nearest = match &part.nearest {
                Some(nearest) => Some(read(nearest.as_image_copy())?),
                None => None,
            };
            if let (DepthEnd::Nearest, Some(nearest)) = (end, &nearest) {
                let depth = |bits| sanitized_near(bits, convention);
                return memory::collected(to_u32(nearest).map(depth), "level");
            }
            let bytes = read(of.as_image_copy())?;
            // Where a pixel has several samples, the nearest tells whether all are background.
            let told = to_u32(nearest.as_ref().unwrap_or(&bytes));
            let depth = |(bits, told)| match end {
                DepthEnd::Farthest
                    if pyramid.depths().of_receivers() && is_background(told, convention) =>
                {
                    convention.near()
                }
                DepthEnd::Farthest => sanitized(bits, convention),
                DepthEnd::Nearest => sanitized_near(bits, convention),
            };
            return memory::collected(to_u32(&bytes).zip(told).map(depth), "level");
        }
        let (width, stride) = (layout.width as usize, layout.stride as usize);
        // Of both ends, the nearest depth of a texel follows its farthest.
        let of_end = if end == DepthEnd::Nearest { pyramid.layout.nearest as usize } else { 0 };
        let ends = pyramid.depths().count() as usize;
        let first = u64::from(layout.offset);
        let count = u64::from(layout.stride) * u64::from(layout.height);
        let chunk = 1_u64 << pyramid.layout.chunk_shift;
        let ranges: Vec<_> = (first / chunk..=(first + count - 1) / chunk)
            .map(|c| {
                let begin = first.max(c * chunk);
                let end = (first + count).min((c + 1) * chunk);
                BufferRange {
                    buffer: &pyramid.chunks[c as usize],
                    offset: 4 * (begin - c * chunk),
                    size: 4 * (end - begin),
                }
            })
            .collect();
        let bytes =
            self.scoped(|| readback::read_buffers(self.device(), self.queue(), &ranges))?.concat();
        let mut texels = memory::list(width * layout.height as usize, "level")?;
        for row in bytes.chunks_exact(4 * stride) {
            let words = to_u32(&row[..4 * ends * width]);
            texels.extend(words.skip(of_end).step_by(ends).map(f32::from_bits));
        }
        Ok(texels)
    }
}
