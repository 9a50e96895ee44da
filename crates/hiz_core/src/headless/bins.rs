//! What can be read of a cull that emitted bins.

use crate::cull::options::Order;
use crate::error::{Error, Result};
use crate::headless::culling::Culling;
use crate::headless::readback::{BufferRange, to_u32};
use crate::host::memory;
use crate::output::bins::{Arrangement, BinRecord, Bins, TotalRecord};
use crate::output::draw::{DrawIndexedIndirect, DrawIndirect};

/// The LOD of an instance that was not kept.
pub const NO_LOD: u8 = u8::MAX;

impl Culling {
    /// The bins of the cull.
    pub(super) fn bins(&self) -> Result<&Bins> {
        let is_missing = self.visible.bins.is_none() && !self.visible.outputs().emit.is_one_list();
        self.require("draws or indices", !is_missing)?;
        self.visible.bins.as_ref().ok_or_else(|| {
            Error::mismatch(
                "outputs",
                "expected a cull with meshes, by Emit::Binned or Emit::Instances",
            )
        })
    }

    /// All draw records of the pieces, `max_draws` for each piece, as bytes.
    fn draw_bytes(&self, bins: &Bins) -> Result<Vec<u8>> {
        let bytes = self.read(&[BufferRange::first(&bins.draws, bins.draws.size())])?;
        let of_piece = u64::from(bins.records) * bins.record_bytes();
        let pieces = bytes[0].chunks_exact(bins.piece_bytes() as usize);
        Ok(pieces.flat_map(|piece| &piece[..of_piece as usize]).copied().collect())
    }

    /// The records of bins with an index buffer.
    pub(super) fn indexed_draws(&self, bins: &Bins) -> Result<Vec<DrawIndexedIndirect>> {
        if !bins.meshes.is_indexed() {
            return Err(Error::mismatch(
                "meshes",
                "expected meshes with an index buffer, got others: read `vertex_draws`",
            ));
        }
        Ok(bytemuck::pod_collect_to_vec(&self.draw_bytes(bins)?))
    }

    /// The draw arguments of meshes without an index buffer,
    /// [`max_draws`](crate::Visible::max_draws) records per piece.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without bins, and for meshes with an index buffer.
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn vertex_draws(&self) -> Result<Vec<DrawIndirect>> {
        let bins = self.bins()?;
        if bins.meshes.is_indexed() {
            return Err(Error::mismatch(
                "meshes",
                "expected meshes without an index buffer, got others: read `draws`",
            ));
        }
        Ok(bytemuck::pod_collect_to_vec(&self.draw_bytes(bins)?))
    }

    /// How many of each piece's draw records draw something.
    /// They are the first ones, unless each bin has its record in a fixed place.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without draws, indices and mask.
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn draw_counts(&self) -> Result<Vec<u32>> {
        if let Some(counts) = self.visible.draw_count() {
            let bytes = self.read(&[BufferRange::first(counts, counts.size())])?;
            return Ok(to_u32(&bytes[0]).collect());
        }
        let instances: Vec<u32> = match &self.visible.bins {
            Some(bins) if !bins.meshes.is_indexed() => {
                self.vertex_draws()?.iter().map(|draw| draw.instance_count).collect()
            }
            _ => self.draws()?.iter().map(|draw| draw.instance_count).collect(),
        };
        let pieces = instances.chunks_exact(self.visible.max_draws() as usize);
        Ok(pieces.map(|piece| piece.iter().filter(|n| **n > 0).count() as u32).collect())
    }

    /// The list of one bin, all pieces joined: what was kept of a mesh and drawn at one LOD.
    ///
    /// It ascends, unless the cull was asked for any order.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without the bins of
    ///   [`Emit::Binned`](crate::Emit::Binned) or without indices.
    /// - [`Error::Invalid`] for a mesh or LOD that does not exist.
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn bin(&self, mesh: u32, lod: u32) -> Result<Vec<u32>> {
        let bins = self.bins()?;
        if bins.arrangement == Arrangement::Instances {
            return Err(Error::mismatch("outputs", "expected Emit::Binned, got Emit::Instances"));
        }
        if mesh >= bins.meshes.len() {
            let message = format!("expected a mesh below {}, got {mesh}", bins.meshes.len());
            return Err(Error::invalid("mesh", message));
        }
        let lods = bins.meshes.lods(mesh);
        if lod >= lods {
            let message = format!("expected a level below {lods} for mesh {mesh}, got {lod}");
            return Err(Error::invalid("lod", message));
        }
        let number = u64::from(mesh * bins.meshes.most_lods() + lod);
        let ranges: Vec<BufferRange<'_>> = if self.options.order == Order::Any {
            let offset = number * bins.record_bytes() + 4;
            (0..bins.pieces.len() as u64)
                .map(|p| BufferRange {
                    buffer: &bins.draws,
                    offset: p * bins.piece_bytes() + offset,
                    size: 4,
                })
                .collect()
        } else {
            let size = size_of::<BinRecord>() as u64;
            let range = |buffer| BufferRange { buffer, offset: number * size, size };
            bins.pieces.iter().map(|piece| range(&piece.bins)).collect()
        };
        let records = self.read(&ranges)?;
        let mut lists = memory::list(bins.pieces.len(), "bin")?;
        for (p, words) in records.iter().enumerate() {
            let words: Vec<u32> = to_u32(words).collect();
            let (begin, count) = match bins.reserved(p, mesh, lod) {
                Some((begin, _)) => (begin, if words.len() > 1 { words[1] } else { words[0] }),
                None => (words[0], words[1]),
            };
            lists.push(part_of_list(bins, p, begin, count)?);
        }
        let parts = self.read(&lists)?;
        let mut indices = memory::list(parts.iter().map(|bytes| bytes.len() / 4).sum(), "bin")?;
        indices.extend(parts.iter().flat_map(|bytes| to_u32(bytes)));
        Ok(indices)
    }

    /// What the lists of all bins hold, ascending.
    /// A capacity cuts the coarsest LODs, so the mask does not tell it.
    pub(super) fn indices_of_bins(&self, bins: &Bins) -> Result<Vec<u32>> {
        let lists = match bins.arrangement {
            Arrangement::Reserved => self.reserved_lists(bins)?,
            Arrangement::Packed | Arrangement::Instances => {
                let totals = self.read(&[BufferRange::first(&bins.totals, bins.totals.size())])?;
                let totals: Vec<TotalRecord> = bytemuck::pod_collect_to_vec(&totals[0]);
                let written = totals.iter().enumerate().map(|(p, total)| (p, 0, total.written));
                written
                    .map(|(p, begin, count)| part_of_list(bins, p, begin, count))
                    .collect::<Result<_>>()?
            }
        };
        let parts = self.read(&lists)?;
        let mut is_listed = memory::list(self.instances.len() as usize, "indices")?;
        is_listed.resize(self.instances.len() as usize, false);
        for index in parts.iter().flat_map(|bytes| to_u32(bytes)) {
            is_listed[index as usize] = true;
        }
        let count = parts.iter().map(|bytes| bytes.len() / 4).sum();
        let mut indices = memory::list(count, "indices")?;
        indices.extend((0..).zip(&is_listed).filter_map(|(i, listed)| listed.then_some(i)));
        Ok(indices)
    }

    /// The lists of bins that have places of their own, without those of empty bins.
    fn reserved_lists<'a>(&self, bins: &'a Bins) -> Result<Vec<BufferRange<'a>>> {
        let counts: Vec<Vec<u32>> = if self.options.order == Order::Any {
            let words: Vec<u32> = to_u32(&self.draw_bytes(bins)?).collect();
            let record = (bins.record_bytes() / 4) as usize;
            let pieces = words.chunks_exact(bins.records as usize * record);
            pieces.map(|piece| piece.chunks_exact(record).map(|draw| draw[1]).collect()).collect()
        } else {
            let whole = |buffer: &'a wgpu::Buffer| BufferRange::first(buffer, buffer.size());
            let records: Vec<_> = bins.pieces.iter().map(|piece| whole(&piece.bins)).collect();
            let bytes = self.read(&records)?;
            let records = bytes.iter().map(|b| bytemuck::pod_collect_to_vec::<u8, BinRecord>(b));
            records.map(|of_piece| of_piece.iter().map(|bin| bin.count).collect()).collect()
        };
        let mut lists = Vec::new();
        for (p, counts) in counts.iter().enumerate() {
            let lods = bins.meshes.most_lods();
            for (number, count) in (0..).zip(counts).filter(|(_, count)| **count > 0) {
                let place = bins.reserved(p, number / lods, number % lods);
                if let Some((begin, _)) = place {
                    lists.push(part_of_list(bins, p, begin, *count)?);
                }
            }
        }
        Ok(lists)
    }

    /// The level of detail of each instance, by its index, and [`NO_LOD`] for those that were not
    /// kept.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a cull without bins, and for one in any order.
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn lods(&self) -> Result<Vec<u8>> {
        let bins = self.bins()?;
        if self.options.order == Order::Any {
            return Err(Error::mismatch(
                "order",
                "expected a cull in a stable order, got Order::Any, which keeps no LODs",
            ));
        }
        let mut lods = memory::list(self.instances.len() as usize, "lods")?;
        lods.resize(self.instances.len() as usize, NO_LOD);
        let by_index = bins.arrangement == Arrangement::Instances;
        for (piece, output) in self.instances.pieces.iter().zip(&bins.pieces) {
            let mut ranges = vec![BufferRange::first(&output.planes, output.planes.size())];
            let slots = piece.slots.as_ref().filter(|_| !by_index);
            ranges.extend(slots.map(|s| BufferRange::first(&s.index_of, s.index_of.size())));
            let bytes = self.read(&ranges)?;
            let index_of: Option<Vec<u32>> = bytes.get(1).map(|bytes| to_u32(bytes).collect());
            let planes: Vec<u32> = to_u32(&bytes[0]).collect();
            if output.words == 0 {
                continue;
            }
            let (set, words) = (bins.plane_set(), output.words as usize);
            for lod in 0..bins.meshes.most_lods() as usize {
                for w in 0..words {
                    let word = planes[set.word_at(words, lod, w)];
                    let bits = (0..32).filter(|bit| word >> bit & 1 == 1);
                    for slot in bits.map(|bit| 32 * w + bit) {
                        let index = index_of.as_ref().map_or(slot, |of| of[slot] as usize);
                        lods[piece.range.start as usize + index] = lod as u8;
                    }
                }
            }
        }
        Ok(lods)
    }

    /// How many instances are kept, and how many of them the lists of bins hold.
    pub(super) fn demand_and_written_of_bins(&self, bins: &Bins) -> Result<(Option<u64>, u64)> {
        if self.options.order == Order::Any {
            let written = self.draw_bytes(bins)?;
            let words: Vec<u32> = to_u32(&written).collect();
            let records = words.chunks_exact((bins.record_bytes() / 4) as usize);
            let written: u64 = records.map(|record| u64::from(record[1])).sum();
            let has_room =
                written < u64::from(self.visible.capacity()) || !self.visible.is_capped();
            return Ok((has_room.then_some(written), written));
        }
        let bytes = self.read(&[BufferRange::first(&bins.totals, bins.totals.size())])?;
        let totals: Vec<TotalRecord> = bytemuck::pod_collect_to_vec(&bytes[0]);
        let sum = |of: fn(&TotalRecord) -> u32| totals.iter().map(|t| u64::from(of(t))).sum();
        Ok((Some(sum(|t| t.demand)), sum(|t| t.written)))
    }
}

/// So many words of a piece's list, from word `begin` on.
fn part_of_list(bins: &Bins, piece: usize, begin: u32, count: u32) -> Result<BufferRange<'_>> {
    let buffer = bins.pieces[piece]
        .list
        .as_ref()
        .ok_or_else(|| Error::mismatch("outputs", "expected a cull that was asked for indices"))?;
    Ok(BufferRange { buffer, offset: 4 * u64::from(begin), size: 4 * u64::from(count) })
}
