//! Depth that is converted on its way into an image's texture.
//!
//! Each thread makes a few rows at a time, and copies them into a mapped buffer while they are in
//! its cache.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::gpu::buffers::Mapped;
use crate::gpu::row_staging::row_pitch;
use crate::headless::depth_image::DepthImage;
use crate::headless::readback;
use crate::host::threads::{Locked, on_threads};

/// Bytes of a buffer at most, or one row; larger images come in several parts.
const MOST_BYTES: u32 = 1 << 26;

/// Pixels of a band of rows, which one thread makes at a time.
const BAND_PIXELS: u32 = 1 << 16;

/// Pixels that are made before they are copied: they fit the fastest cache.
const PIXELS_AT_ONCE: usize = 1 << 12;

impl DepthImage {
    /// Writes the rows that `make` makes, which gets the first row of some and room for them.
    pub(super) fn write_converted(
        &self,
        threads: usize,
        make: impl Fn(u32, &mut [f32]) + Sync,
    ) -> Result<()> {
        let (height, engine) = (self.size().height, &self.engine);
        let room = (MOST_BYTES / row_pitch(&self.texture)).clamp(1, height);
        for first in (0..height).step_by(room as usize) {
            let rows = first..height.min(first + room);
            let is_last = rows.end == height;
            let mut encoder = engine.encoder("hiz.depth.encoder");
            let part = (&self.texture, rows.clone(), room);
            let gpu = &engine.context().gpu;
            engine.depth_staging().record(gpu, &mut encoder, part, |mapped, pitch| {
                self.fill(mapped, pitch, &rows, threads, &make)
            })?;
            let submission = engine.queue().submit([encoder.finish()]);
            if !is_last {
                // Only one part has a buffer at a time.
                readback::wait(engine.device(), Some(submission))?;
            }
        }
        Ok(())
    }

    /// Fills a mapping with rows of the image; they are `pitch` bytes apart.
    fn fill(
        &self,
        mapped: &Mapped<'_>,
        pitch: usize,
        rows: &Range<u32>,
        threads: usize,
        make: &(impl Fn(u32, &mut [f32]) + Sync),
    ) -> Result<()> {
        let width = self.size().width as usize;
        let band_rows = (BAND_PIXELS / self.size().width).max(1);
        let rows_at_once = (PIXELS_AT_ONCE / width).max(1);
        // The last texel of a row repeats the row's last pixel.
        let repeated = 4 * self.texture.width() as usize - width;
        let failed: Locked<Option<Error>> = Locked::default();
        on_threads(threads, rows.clone().step_by(band_rows as usize), |first| {
            let band = first..rows.end.min(first + band_rows);
            let byte = |row: u32| u64::from(row - rows.start) * pitch as u64;
            let mut view = match mapped.range(byte(band.start)..byte(band.end)) {
                Ok(view) => view,
                Err(error) => {
                    failed.lock().get_or_insert(error);
                    return;
                }
            };
            let mut made = vec![0.0; width * rows_at_once.min(band.len())];
            for some in band.clone().step_by(rows_at_once) {
                let count = rows_at_once.min((band.end - some) as usize);
                let made = &mut made[..width * count];
                make(some, made);
                let begin = (some - first) as usize * pitch;
                for (at, row) in (begin..).step_by(pitch).zip(made.chunks_exact(width)) {
                    let end = at + size_of_val(row);
                    view.slice(at..end).copy_from_slice(bytemuck::cast_slice(row));
                    let last = [row[width - 1]; 3];
                    let last: &[u8] = bytemuck::cast_slice(&last[..repeated]);
                    view.slice(end..end + last.len()).copy_from_slice(last);
                }
            }
        });
        failed.lock().take().map_or(Ok(()), Err)
    }
}
