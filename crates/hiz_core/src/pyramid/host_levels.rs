//! Levels that the host makes with an image that it draws, and that reductions copy.
//!
//! The rasteriser on the host writes its image in rows of 8x8 pixels.
//! While such a row is in the caches, its three levels cost a fraction of what a software driver
//! takes for them, and the levels above are small (`docs/performance_log.md`).
//!
//! A reduction copies them from the buffer that the host has written.
//!
//! Where shaders may read that buffer ([`Gpu::reads_mapped`]), it may have the image, too.
//! Culls read all of it in place then, and nobody waits for the image to come to its texture.
//! **Whoever reads the texture records that copy first** ([`HostLevels::record_image`]).
//!
//! **In whichever order recordings are submitted, a pyramid has the levels of its image, or culls
//! keep everything.**
//! Each drawing has a number, which the commands that bring its image to the device put beside it.
//! A reduction copies the number from there into the pyramid's header.
//! A cull expects that of the drawing whose levels were copied, so it finds another one where the
//! image came from another drawing, or from none.
//! A drawing that makes no levels clears the number.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use crate::error::{Error, Result};
use crate::gpu::buffers::{Mapped, made};
use crate::gpu::device::Gpu;
use crate::gpu::kept::{Lent, RingShare};
use crate::host::memory;
use crate::host::threads::Locked;
use crate::input::image::{DepthConvention, ImageSize};
use crate::pyramid::ends::Depths;
use crate::pyramid::host_reduce::{BLOCK_ROWS, halve_rows, padded};
use crate::pyramid::layout::{BLOCK_LOG2, HEADER_WORDS, PyramidLayout, chunk_shift};
use crate::pyramid::levels::{Level, StoredLevels};
use crate::pyramid::numbering::next_number;

const LABEL: &str = "hiz.host_levels";
const STAGING: &str = "hiz.host_levels.staging";
const WITH_IMAGE: &str = "hiz.host_levels.with_image";

/// Staging buffers that are kept for an image: two frames may be on their way.
const STAGING_KEPT: usize = 2;

/// Bytes of a texel: a word.
const WORD: u64 = 4;

const HEADER_BYTES: u64 = HEADER_WORDS * WORD;

/// The levels of an [`OccluderDepth`](crate::OccluderDepth), which the host makes with the image.
///
/// [`DepthSource::levels`](crate::DepthSource::levels) hands them to a reduction, which copies them.
/// They are made while reductions ask for them: if none has since the last drawing, the next one
/// makes none.
#[derive(Debug)]
pub struct HostLevels {
    /// Of the image that they belong to.
    texture: wgpu::Texture,
    /// All levels of farthest depths, in one chunk.
    layout: PyramidLayout,
    /// Where the image lies behind them, if it stays in their buffer.
    image: Option<Level>,
    /// The number of the drawing that is in the texture; made by the first one.
    drawn: OnceLock<wgpu::Buffer>,
    free: RingShare,
    /// What the last drawing has made; `None` if it made none.
    made: Locked<Option<Made>>,
    /// Whether a reduction has asked for them since the last drawing.
    are_wanted: AtomicBool,
    /// Whether they are made no more.
    are_off: AtomicBool,
}

/// The levels of one drawing.
#[derive(Debug, Clone)]
struct Made {
    number: u32,
    /// The depths that are farthest depend on it.
    convention: DepthConvention,
    /// The number, the levels behind it, and the image if it stays there.
    staging: Arc<Lent>,
    /// Whether the copy of the image to its texture was submitted.
    is_in_texture: Arc<AtomicBool>,
}

impl Made {
    fn is_in_texture(&self) -> bool {
        self.is_in_texture.load(Ordering::Acquire)
    }
}

/// All levels and the image in one buffer, in which the host has made them.
#[derive(Debug, Clone)]
pub(crate) struct InPlace {
    pub(crate) buffer: Arc<Lent>,
    /// Whether a copy of the image to its texture was submitted, too.
    pub(crate) is_in_texture: Arc<AtomicBool>,
}

/// A copy from one buffer to another, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct LevelCopy {
    from: u64,
    to: u64,
    bytes: u64,
}

/// Levels that a reduction can copy.
#[derive(Debug)]
pub(super) struct Copied<'a> {
    drawn: &'a wgpu::Buffer,
    levels: Arc<Lent>,
    copies: Vec<LevelCopy>,
    /// Where culls may read in place of pyramid and image.
    pub(super) in_place: Option<InPlace>,
    /// The number that the pyramid then begins with.
    pub(super) number: u32,
}

impl Copied<'_> {
    /// Records the copies into the only chunk of a pyramid.
    pub(super) fn record(&self, encoder: &mut wgpu::CommandEncoder, chunk: &wgpu::Buffer) {
        encoder.copy_buffer_to_buffer(self.drawn, 0, chunk, 0, HEADER_BYTES);
        let levels = self.levels.read_by(encoder);
        for LevelCopy { from, to, bytes } in &self.copies {
            encoder.copy_buffer_to_buffer(levels, *from, chunk, *to, *bytes);
        }
    }
}

impl HostLevels {
    /// Those of an image of `size` in `texture`; `None` for one that has no levels, or more than
    /// one storage binding holds.
    ///
    /// `keeps_image`: the image stays in their buffer, if shaders may read that.
    pub(crate) fn new(
        gpu: &Gpu,
        texture: &wgpu::Texture,
        size: ImageSize,
        keeps_image: bool,
    ) -> Option<Self> {
        let shift = chunk_shift(gpu.limits());
        let layout = PyramidLayout::new(size, StoredLevels::ALL, Depths::Farthest, shift).ok()?;
        let fits = layout.num_levels() > 1 && layout.chunk_sizes().len() == 1;
        let image = layout.image().filter(|_| keeps_image && gpu.reads_mapped());
        let key = (label(image), staging_bytes(&layout, image));
        fits.then(|| Self {
            texture: texture.clone(),
            layout,
            image,
            drawn: OnceLock::new(),
            free: gpu.rings.share(key, STAGING_KEPT),
            made: Locked::default(),
            // Images are drawn to be reduced.
            are_wanted: AtomicBool::new(true),
            are_off: AtomicBool::new(false),
        })
    }

    /// Makes none from now on, because the image may hold what was not drawn.
    pub(crate) fn turn_off(&self) {
        self.are_off.store(true, Ordering::Relaxed);
        self.let_go();
    }

    /// Lets go of what the last drawing has made, unless its image is nowhere else.
    fn let_go(&self) {
        self.made.lock().take_if(|made| made.is_in_texture());
    }

    /// Begins those of a drawing of the whole image; `None` if nobody wants them.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device).
    /// Where there is no memory for them, there are none.
    pub(crate) fn begin(
        &self,
        gpu: &Gpu,
        convention: DepthConvention,
    ) -> Result<Option<LevelRows<'_>>> {
        // An image stays as it was if the next drawing fails.
        self.let_go();
        if self.are_off.load(Ordering::Relaxed) || !self.are_wanted.swap(false, Ordering::Relaxed) {
            return Ok(None);
        }
        match self.rows(gpu, convention) {
            Ok(rows) => Ok(Some(rows)),
            Err(Error::OutOfMemory(_)) => {
                self.turn_off();
                Ok(None)
            }
            Err(other) => Err(other),
        }
    }

    fn rows(&self, gpu: &Gpu, convention: DepthConvention) -> Result<LevelRows<'_>> {
        let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let drawn = made(&self.drawn, || gpu.empty(LABEL, HEADER_BYTES, usage))?;
        let bytes = staging_bytes(&self.layout, self.image);
        let usage = match self.image {
            Some(_) => wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::STORAGE,
            None => wgpu::BufferUsages::COPY_SRC,
        };
        let staging = gpu.staging_for(Some(self.free.ring()), label(self.image), bytes, usage)?;
        let last = BLOCK_LOG2.min(self.layout.num_levels() - 1);
        let Level { width, height, .. } = self.layout.levels[last as usize];
        let coarse = memory::filled(padded(width) * height as usize, 0, "texels")?;
        Ok(LevelRows {
            levels: self,
            drawn,
            staging,
            convention,
            last,
            coarse: Locked::new(coarse),
        })
    }

    /// Records that the image changes and its levels do not.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for an encoder with an open pass.
    pub(crate) fn retract(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) -> Result<()> {
        // As in `begin`.
        self.let_go();
        if let Some(drawn) = self.drawn.get() {
            gpu.recorded(|| {
                encoder.clear_buffer(drawn, 0, None);
                Ok(())
            })?;
        }
        *self.made.lock() = None;
        Ok(())
    }

    /// Whether the last drawing is not in the texture yet.
    pub(crate) fn holds_image(&self) -> bool {
        self.made.lock().as_ref().is_some_and(|made| !made.is_in_texture())
    }

    /// Records the copy of the image to its texture, if the last drawing has not made it.
    ///
    /// The commands that read the texture come behind it, and no drawing is submitted in between.
    /// So whoever keeps the order of drawings keeps that of this copy, too.
    pub(crate) fn record_image(&self, encoder: &mut wgpu::CommandEncoder) {
        let made = self.made.lock().clone().filter(|made| !made.is_in_texture());
        let Some((Made { staging, .. }, image)) = made.zip(self.image) else { return };
        let buffer = staging.read_by(encoder);
        encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo {
                buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: u64::from(image.offset) * WORD,
                    bytes_per_row: Some(image.stride * WORD as u32),
                    rows_per_image: None,
                },
            },
            self.texture.as_image_copy(),
            self.texture.size(),
        );
    }

    /// Notes that the copy of the image was submitted, and no drawing since it was recorded.
    pub(crate) fn image_has_come(&self) {
        if let Some(made) = &*self.made.lock() {
            made.is_in_texture.store(true, Ordering::Release);
        }
    }

    /// What a reduction of the image in `texture` into a pyramid of `layout` can copy.
    /// The next drawing makes levels, if they fit this pyramid.
    pub(super) fn for_pyramid(
        &self,
        texture: &wgpu::Texture,
        convention: DepthConvention,
        layout: &PyramidLayout,
    ) -> Option<Copied<'_>> {
        if self.texture != *texture || self.are_off.load(Ordering::Relaxed) {
            return None;
        }
        let copies = copies(&self.layout, layout)?;
        self.are_wanted.store(true, Ordering::Relaxed);
        let made = self.made.lock().clone().filter(|made| made.convention == convention)?;
        let Made { number, staging: levels, is_in_texture, .. } = made;
        // Culls look where the pyramid's own layout has the levels and the image.
        let is_there = self.layout.levels == layout.levels && self.image == layout.image();
        let in_place = (is_there && self.image.is_some())
            .then(|| InPlace { buffer: Arc::clone(&levels), is_in_texture });
        Some(Copied { drawn: self.drawn.get()?, levels, copies, in_place, number })
    }
}

fn label(image: Option<Level>) -> &'static str {
    if image.is_some() { WITH_IMAGE } else { STAGING }
}

/// Bytes of the levels, and of an image behind them.
fn staging_bytes(levels: &PyramidLayout, image: Option<Level>) -> u64 {
    let of_image = |image: Level| {
        (u64::from(image.offset) + u64::from(image.stride) * u64::from(image.height)) * WORD
    };
    image.map_or(levels.texels * WORD, of_image)
}

/// The copies of levels; `None` where the pyramid of the second layout has others, or has them in
/// other rows.
fn copies(from: &PyramidLayout, to: &PyramidLayout) -> Option<Vec<LevelCopy>> {
    if from.size != to.size || from.depths != to.depths || to.chunk_sizes().len() != 1 {
        return None;
    }
    if from.levels == to.levels {
        let bytes = from.texels * WORD - HEADER_BYTES;
        return Some(vec![LevelCopy { from: HEADER_BYTES, to: HEADER_BYTES, bytes }]);
    }
    let of_level = |(k, level): (usize, &Level)| {
        let ours = &from.levels[k];
        let [from, to] = [ours, level].map(|level| u64::from(level.offset) * WORD);
        let bytes = u64::from(level.stride) * u64::from(level.height) * WORD;
        (ours.stride == level.stride).then_some(LevelCopy { from, to, bytes })
    };
    to.stored_levels().map(of_level).collect()
}

/// The levels of one drawing while its rows are written.
#[derive(Debug)]
pub(crate) struct LevelRows<'a> {
    levels: &'a HostLevels,
    drawn: &'a wgpu::Buffer,
    staging: wgpu::Buffer,
    convention: DepthConvention,
    /// The coarsest level that is made row by row.
    last: u32,
    /// That level, in padded rows.
    coarse: Locked<Vec<u32>>,
}

/// The levels of some rows, which one thread makes.
#[derive(Debug)]
pub(crate) struct LevelPart<'a> {
    all: &'a LevelRows<'a>,
    /// The rows of each level, from level 1 on, and the first of them.
    views: Vec<(u32, wgpu::BufferViewMut)>,
    /// The rows of two levels that are made at once.
    finer: Vec<u32>,
    coarser: Vec<u32>,
}

impl LevelRows<'_> {
    fn level(&self, k: u32) -> &Level {
        &self.levels.layout.levels[k as usize]
    }

    fn mapped(&self) -> Mapped<'_> {
        Mapped::of(label(self.levels.image), &self.staging)
    }

    /// Opens some rows of a level.
    fn open(&self, k: u32, rows: Range<u32>) -> Result<wgpu::BufferViewMut> {
        let Level { offset, stride, .. } = *self.level(k);
        let byte = |row: u32| (u64::from(offset) + u64::from(row) * u64::from(stride)) * WORD;
        self.mapped().range(byte(rows.start)..byte(rows.end))
    }

    /// Bytes from row to row of the image, if it stays with its levels.
    pub(crate) fn image_pitch(&self) -> Option<usize> {
        self.levels.image.map(|image| image.stride as usize * WORD as usize)
    }

    /// Opens some bytes of such an image.
    pub(crate) fn open_image(&self, bytes: Range<u64>) -> Result<wgpu::BufferViewMut> {
        let first = self.levels.image.map_or(0, |image| u64::from(image.offset) * WORD);
        self.mapped().range(first + bytes.start..first + bytes.end)
    }

    /// Begins the levels of some rows of the image, the first of which begins a block.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device).
    pub(crate) fn part(&self, rows: Range<u32>) -> Result<LevelPart<'_>> {
        debug_assert!(rows.start.is_multiple_of(1 << BLOCK_LOG2), "{rows:?}");
        let views = (1..=self.last).map(|k| {
            let (first, end) = (rows.start >> k, rows.end.div_ceil(1 << k));
            Ok((first, self.open(k, first..end)?))
        });
        let views = views.collect::<Result<Vec<_>>>()?;
        let room = padded(self.level(1).width) * BLOCK_ROWS / 2;
        Ok(LevelPart { all: self, views, finer: vec![0; room], coarser: vec![0; room] })
    }

    /// Makes the levels that are left, and records the number beside the image.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device), and [`Error::Invalid`](crate::Error::Invalid) for
    /// an encoder with an open pass.
    pub(crate) fn record(self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) -> Result<()> {
        self.make_coarser()?;
        let number = next_number();
        let mut header = self.mapped().range(0..HEADER_BYTES)?;
        header.slice(..).copy_from_slice(bytemuck::bytes_of(&[number, 0, 0, 0]));
        drop(header);
        let Self { levels, drawn, staging, convention, .. } = self;
        staging.unmap();
        let staging = Lent::new(staging, levels.free.ring());
        gpu.recorded(|| {
            encoder.copy_buffer_to_buffer(staging.read_by(encoder), 0, drawn, 0, HEADER_BYTES);
            Ok(())
        })?;
        let is_in_texture = Arc::new(AtomicBool::new(levels.image.is_none()));
        *levels.made.lock() = Some(Made { number, convention, staging, is_in_texture });
        Ok(())
    }

    /// Makes the levels after the last one that is made row by row.
    fn make_coarser(&self) -> Result<()> {
        let mut finer = std::mem::take(&mut *self.coarse.lock());
        for k in self.last + 1..self.levels.layout.num_levels() {
            let (source, level) = (self.level(k - 1), self.level(k));
            let (wide, across) = (padded(source.width), padded(level.width));
            let mut rows = memory::filled(across * level.height as usize, 0, "texels")?;
            let mut view = self.open(k, 0..level.height)?;
            for (y, row) in rows.chunks_exact_mut(across).enumerate() {
                let of = |y: usize| &finer[y.min(source.height as usize - 1) * wide..];
                let pair = [of(2 * y), of(2 * y + 1)];
                halve_rows(self.convention, source.width, pair, row);
                store(&mut view, y, level, row);
            }
            finer = rows;
        }
        Ok(())
    }
}

/// Stores row `y` of those that are open.
fn store(view: &mut wgpu::BufferViewMut, y: usize, level: &Level, row: &[u32]) {
    let (at, bytes) = (y * level.stride as usize * WORD as usize, bytemuck::cast_slice(row));
    view.slice(at..at + bytes.len()).copy_from_slice(bytes);
}

impl LevelPart<'_> {
    /// Makes the levels of a row of blocks: of the rows of the image from `top` on.
    ///
    /// The bits of their depths are `wide` apart, and what is past the width repeats the edge.
    pub(crate) fn add(&mut self, top: u32, lines: &[u32], wide: usize) {
        let Self { all, views, finer, coarser } = self;
        let mut source = &all.levels.layout.levels[0];
        for (k, (first, view)) in (1..).zip(views) {
            let level = all.level(k);
            let (above, across) =
                (if k == 1 { wide } else { padded(source.width) }, padded(level.width));
            let above_rows = if k == 1 { lines } else { &finer[..] };
            let row = top >> k;
            let rows = (BLOCK_ROWS >> k).min((level.height - row) as usize);
            let last = (source.height - 2 * row) as usize - 1;
            for (y, out) in coarser.chunks_exact_mut(across).take(rows).enumerate() {
                let of = |y: usize| &above_rows[y.min(last) * above..];
                halve_rows(all.convention, source.width, [of(2 * y), of(2 * y + 1)], out);
                store(view, (row - *first) as usize + y, level, out);
            }
            std::mem::swap(finer, coarser);
            source = level;
        }
        let Level { width, height, .. } = *source;
        let (across, row) = (padded(width), (top >> all.last) as usize);
        let rows = (BLOCK_ROWS >> all.last).min(height as usize - row);
        all.coarse.lock()[row * across..][..rows * across].copy_from_slice(&finer[..rows * across]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(size: ImageSize, stored: StoredLevels, depths: Depths) -> PyramidLayout {
        PyramidLayout::new(size, stored, depths, 25).unwrap()
    }

    #[test]
    fn copies_have_all_rows_of_each_stored_level() {
        let (size, all) = (ImageSize::new(1921, 1079), StoredLevels::ALL);
        let from = layout(size, all, Depths::Farthest);
        let whole = LevelCopy { from: 16, to: 16, bytes: from.texels * 4 - 16 };
        assert_eq!(copies(&from, &from), Some(vec![whole]));
        for stored in [StoredLevels::from(2), StoredLevels { first: 1, last: 4 }] {
            let to = layout(size, stored, Depths::Farthest);
            let found = copies(&from, &to).unwrap();
            assert_eq!(found.len(), to.stored_levels().count());
            for (copy, (k, level)) in found.iter().zip(to.stored_levels()) {
                assert_eq!(copy.from, 4 * u64::from(from.levels[k].offset));
                assert_eq!(copy.to, 4 * u64::from(level.offset));
                assert!(
                    copy.bytes >= 4 * u64::from(level.stride * (level.height - 1) + level.width)
                );
                assert!(copy.to + copy.bytes <= 4 * to.texels);
                assert!(copy.from + copy.bytes <= 4 * from.texels);
            }
        }
        for other in [
            layout(size, all, Depths::Both),
            layout(size, all, Depths::Nearest),
            layout(ImageSize::new(1920, 1079), all, Depths::Farthest),
            PyramidLayout::new(size, all, Depths::Farthest, 19).unwrap(),
        ] {
            assert_eq!(copies(&from, &other), None);
        }
    }
}
