//! Explanations of single verdicts: the cull's own steps, run again for one instance.

use crate::cull::explain::{ExplanationRecord, Reading, TEXELS_NOTED, record_explain};
use crate::cull::groups::group_options;
use crate::cull::inputs::CullInputs;
use crate::error::Result;
use crate::gpu::buffers::STORAGE;
use crate::headless::culling::{Culling, is_hidden};
use crate::headless::explanation::{Explanation, Told};
use crate::headless::readback::{self, BufferRange};
use crate::instances::batch::GROUP;
use crate::output::verdict::Verdict;

impl Culling {
    /// Why instance `index` got its verdict: the cull's own steps, run for it once more.
    ///
    /// The test reads the bounds as they are now.
    /// If the instance was updated since the cull, the explanation is
    /// [`stale`](Explanation::stale).
    ///
    /// # Errors
    /// - [`Error::Invalid`](crate::Error::Invalid) for an index past the end.
    /// - [`Error::DeviceLost`](crate::Error::DeviceLost).
    /// - [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn explain(&self, index: u64) -> Result<Explanation> {
        let index = u32::try_from(index).unwrap_or(u32::MAX);
        let mut told = self.test(index, false)?;
        if !self.is_among(index)? {
            told.verdict = Verdict::Outside;
            told.reason =
                format!("not among the instances that were asked for; by itself: {}", told.reason);
            return Ok(told);
        }
        told.stale = self.watch.is_updated(&(index..index.saturating_add(1)));
        if told.stale {
            told.reason =
                format!("updated since the cull, so this is of its new bounds: {}", told.reason);
            return Ok(told);
        }
        let Some((of_group, is_updated)) = self.hidden_group(index)? else { return Ok(told) };
        let mut group = self.test(index, true)?;
        group.stale = is_updated;
        if told.verdict != Verdict::Outside {
            told.verdict = of_group;
        }
        told.reason = format!(
            "its group of 64 is hidden as a whole ({}); by itself: {}",
            group.reason, told.reason
        );
        told.group = Some(Box::new(group));
        Ok(told)
    }

    /// Whether an instance that exists was asked for.
    fn is_among(&self, index: u32) -> Result<bool> {
        let Some(among) = &self.among else { return Ok(true) };
        let mut pieces = self.instances.pieces.iter().enumerate();
        let Some((p, piece)) = pieces.find(|(_, piece)| piece.range.contains(&index)) else {
            return Ok(true);
        };
        let place = piece.order.place((index - piece.range.start) as usize);
        let (engine, bits) = (&self.engine, among.bits(p));
        let row = 4 * u64::from(bits.width());
        let bytes =
            engine.scoped(|| readback::read_texture(engine.device(), engine.queue(), bits, row))?;
        Ok(bytes[place / 8] >> (place % 8) & 1 == 1)
    }

    /// Repeats the test of an instance, or of the box around its group.
    fn test(&self, index: u32, whole_group: bool) -> Result<Explanation> {
        let engine = &self.engine;
        let bytes = engine.scoped(|| {
            let gpu = &engine.context().gpu;
            let target =
                gpu.empty("hiz.explain.target", size_of::<ExplanationRecord>() as u64, STORAGE)?;
            let readings = gpu.empty(
                "hiz.explain.readings",
                (TEXELS_NOTED * size_of::<Reading>()) as u64,
                STORAGE,
            )?;
            let mut encoder = engine.encoder("hiz.explain.encoder");
            let inputs =
                CullInputs::new(&self.instances, &self.camera, &self.pyramid, &self.options);
            record_explain(gpu, &mut encoder, &inputs, (index, whole_group), [&target, &readings])?;
            engine.queue().submit([encoder.finish()]);
            let ranges =
                [&target, &readings].map(|buffer| BufferRange::first(buffer, buffer.size()));
            readback::read_buffers(engine.device(), engine.queue(), &ranges)
        })?;
        let record: ExplanationRecord = bytemuck::pod_read_unaligned(&bytes[0]);
        let readings: Vec<Reading> = bytemuck::pod_collect_to_vec(&bytes[1]);
        let readings = &readings[..readings.len().min(record.texels_read as usize)];
        let of_group = group_options(&self.options);
        let options = if whole_group { &of_group } else { &self.options };
        Ok(Told { record, readings, camera: &self.camera, options }.explanation())
    }

    /// If this cull hid the group of an instance: the group's verdict, and whether any member was
    /// updated since.
    fn hidden_group(&self, index: u32) -> Result<Option<(Verdict, bool)>> {
        let pieces = self.instances.pieces.iter().zip(&self.visible.pieces);
        let Some((piece, output)) =
            pieces.into_iter().find(|(piece, _)| piece.range.contains(&index))
        else {
            return Ok(None);
        };
        let Some(groups) = self.groups(piece, output) else { return Ok(None) };
        let group = piece.order.place((index - piece.range.start) as usize) / GROUP;
        let word = self.read(&[BufferRange {
            buffer: &groups.verdicts,
            offset: 4 * group as u64,
            size: 4,
        }])?;
        let Some(word) = word[0].first().copied().filter(|word| is_hidden(*word)) else {
            return Ok(None);
        };
        let members = group * GROUP..((group + 1) * GROUP).min(piece.count() as usize);
        let is_updated = |place| {
            let index = piece.range.start + piece.order.index(place) as u32;
            self.watch.is_updated(&(index..index + 1))
        };
        Ok(Some((Verdict::of_word(word.into()), members.into_iter().any(is_updated))))
    }
}
