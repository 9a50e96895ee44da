//! Explanations of single verdicts: the cull's own steps, run again for one instance.

use crate::cull::explain::{ExplanationRecord, Reading, TEXELS_NOTED, record_explain};
use crate::cull::groups::{group_options, tiers_of};
use crate::cull::inputs::CullInputs;
use crate::error::Result;
use crate::gpu::buffers::STORAGE;
use crate::headless::culling::Culling;
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
        let mut told = self.test(index, None)?;
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
        let Some(of_group) = self.whole_group(index)? else { return Ok(told) };
        let (group, size) = self.deciding_box(index, of_group)?;
        if told.verdict != Verdict::Outside {
            told.verdict = of_group;
        }
        let how = match of_group {
            Verdict::Outside => "is outside",
            kept if kept.is_kept() => "shows",
            _ => "is hidden",
        };
        told.reason = format!(
            "its group of {size} {how} as a whole ({}); by itself: {}",
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

    /// Repeats the test of an instance, or of the box around it in a tier.
    fn test(&self, index: u32, tier: Option<usize>) -> Result<Explanation> {
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
            record_explain(gpu, &mut encoder, &inputs, (index, tier), [&target, &readings])?;
            engine.queue().submit([encoder.finish()]);
            let ranges =
                [&target, &readings].map(|buffer| BufferRange::first(buffer, buffer.size()));
            readback::read_buffers(engine.device(), engine.queue(), &ranges)
        })?;
        let record: ExplanationRecord = bytemuck::pod_read_unaligned(&bytes[0]);
        let readings: Vec<Reading> = bytemuck::pod_collect_to_vec(&bytes[1]);
        let readings = &readings[..readings.len().min(record.texels_read as usize)];
        let of_group = group_options(&self.options);
        let options = if tier.is_some() { &of_group } else { &self.options };
        Ok(Told { record, readings, camera: &self.camera, options }.explanation())
    }

    /// The verdict on the group of an instance, if this cull gave all its members one verdict.
    fn whole_group(&self, index: u32) -> Result<Option<Verdict>> {
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
        Ok(word[0].first().map(|word| Verdict::of_word((*word).into())).filter(is_of_all))
    }

    /// The test of the box that decided for a whole group, and how many instances it holds.
    fn deciding_box(&self, index: u32, verdict: Verdict) -> Result<(Explanation, usize)> {
        let mut pieces = self.instances.pieces.iter();
        let piece = pieces.find(|piece| piece.range.contains(&index)).expect("checked before");
        let place = piece.order.place((index - piece.range.start) as usize);
        let mut first = None;
        // The box of the group itself comes first: what hides a larger one mostly hides it, too.
        for tier in 0..tiers_of(piece, &self.options) {
            let size = GROUP.pow(tier as u32 + 1);
            let mut told = self.test(index, Some(tier))?;
            let members =
                place / size * size..(place / size * size + size).min(piece.count() as usize);
            told.stale = members.into_iter().any(|place| {
                let index = piece.range.start + piece.order.index(place) as u32;
                self.watch.is_updated(&(index..index + 1))
            });
            if told.verdict == verdict {
                return Ok((told, size));
            }
            first.get_or_insert((told, size));
        }
        Ok(first.expect("groups were tested"))
    }
}

/// Whether a group with this verdict has it for all its members.
fn is_of_all(verdict: &Verdict) -> bool {
    !verdict.is_kept() || *verdict == Verdict::Unoccluded
}
