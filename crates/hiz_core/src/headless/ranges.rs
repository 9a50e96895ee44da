//! Where the answers of a cull lie on the device: which ranges a read copies.

use crate::cull::groups::{is_grouped, tiers_of};
use crate::cull::options::CullOptions;
use crate::gpu::copies::BufferRange;
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::bins::Arrangement;
use crate::output::pixels::PixelCounts;
use crate::output::survivors::GroupOutput;
use crate::output::visible::{PieceOutput, Visible, verdicts_offset};

/// What a cull with these options left of a piece's groups, if it tested them.
pub(super) fn groups_of<'a>(
    piece: &Piece,
    output: &'a PieceOutput,
    options: &CullOptions,
) -> Option<&'a GroupOutput> {
    output.groups().filter(|_| is_grouped(piece, options))
}

fn of_pieces<'a>(
    instances: &Instances,
    visible: &'a Visible,
    of: impl Fn(&Piece, &'a PieceOutput) -> BufferRange<'a>,
) -> Vec<BufferRange<'a>> {
    let pieces = instances.pieces.iter().zip(&visible.pieces);
    pieces.map(|(piece, output)| of(piece, output)).collect()
}

/// The verdicts of all pieces.
pub(super) fn verdict_ranges<'a>(
    instances: &Instances,
    visible: &'a Visible,
) -> Vec<BufferRange<'a>> {
    of_pieces(instances, visible, |piece, output| BufferRange {
        buffer: &output.mask,
        offset: verdicts_offset(piece),
        size: 4 * u64::from(piece.count()),
    })
}

/// What the counts are made from: the counters, the survivors of each tier of each piece, and the
/// statistics if there are any.
pub(super) fn count_ranges<'a>(
    instances: &Instances,
    visible: &'a Visible,
    options: &CullOptions,
    counters: &'a wgpu::Buffer,
) -> Vec<BufferRange<'a>> {
    let mut ranges = vec![BufferRange::first(counters, counters.size())];
    for (piece, output) in instances.pieces.iter().zip(&visible.pieces) {
        let Some(groups) = groups_of(piece, output, options) else { continue };
        let tiers = groups.tiers.iter().take(tiers_of(piece, options));
        ranges.extend(tiers.map(|t| BufferRange::first(&t.survivors, t.survivors.size())));
    }
    let statistics = visible.statistics().filter(|_| options.statistics);
    ranges.extend(statistics.map(|buffer| BufferRange::first(buffer, buffer.size())));
    ranges
}

/// Bytes of the mask of a piece.
pub(super) fn mask_bytes(piece: &Piece) -> u64 {
    4 * u64::from(piece.words())
}

/// The masks of all pieces.
pub(super) fn mask_ranges<'a>(instances: &Instances, visible: &'a Visible) -> Vec<BufferRange<'a>> {
    let sizes = instances.pieces.iter().map(mask_bytes);
    visible
        .pieces
        .iter()
        .zip(sizes)
        .map(|(output, size)| BufferRange::first(&output.mask, size))
        .collect()
}

/// All that can be read of bins.
pub(super) fn bin_ranges<'a>(
    instances: &'a Instances,
    visible: &'a Visible,
) -> Vec<BufferRange<'a>> {
    let Some(bins) = &visible.bins else { return Vec::new() };
    let mut buffers = vec![&bins.draws, &bins.draw_counts, &bins.totals];
    for (piece, output) in instances.pieces.iter().zip(&bins.pieces) {
        buffers.extend([&output.bins, &output.planes]);
        buffers.extend(&output.list);
        let by_slot = bins.arrangement != Arrangement::Instances;
        buffers.extend(piece.slots.as_ref().filter(|_| by_slot).map(|slots| &slots.index_of));
    }
    buffers.into_iter().map(|buffer| BufferRange::first(buffer, buffer.size())).collect()
}

/// The counts of pixels of all pieces; none if they were not asked for.
pub(super) fn pixel_ranges<'a>(
    instances: &Instances,
    visible: &'a Visible,
) -> Vec<BufferRange<'a>> {
    let pieces = instances.pieces.iter().zip(&visible.pieces);
    let counts = pieces.filter_map(|(piece, output)| Some((piece, output.pixels.as_ref()?)));
    let range = |(piece, counts): (&Piece, &'a wgpu::Buffer)| {
        BufferRange::first(counts, u64::from(piece.count()) * size_of::<PixelCounts>() as u64)
    };
    counts.map(range).collect()
}
