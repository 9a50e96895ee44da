//! The blocks that a step of the reduction reads: all, or those that a changed rectangle touches.
//!
//! A block is 8x8 texels, and makes texels of its own.
//! So the blocks that hold a changed texel are all that has to be read again.
//! The blocks' texels on the level that the step writes last are what the next step reads.
//!
//! Levels are padded to whole vectors, and the padding repeats the edge.
//! Where the block with a row's last texel is touched, the padding behind it is renewed as well.

use crate::pyramid::layout::{BLOCK_LOG2, PyramidLayout, Step};

/// The blocks that a step reads: columns and rows from `begin` to before `end`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Blocks {
    pub(crate) begin: [u32; 2],
    pub(crate) end: [u32; 2],
}

impl Blocks {
    /// All blocks of a step.
    pub(crate) fn all(step: &Step) -> Self {
        Self { begin: [0, 0], end: step.blocks }
    }

    /// How many there are, in columns and rows.
    pub(crate) fn size(&self) -> [u32; 2] {
        [0, 1].map(|axis| self.end[axis] - self.begin[axis])
    }
}

/// The blocks of every step that a changed rectangle of level 0 touches, padding included.
///
/// `rectangle` has both ends: columns `x0..=x1` and rows `y0..=y1` as `[x0, y0, x1, y1]`.
pub(crate) fn touched_blocks(layout: &PyramidLayout, [x0, y0, x1, y1]: [u32; 4]) -> Vec<Blocks> {
    let (mut first, mut last) = ([x0, y0], [x1, y1]);
    let touched = |step: &Step| {
        let level = &layout.levels[step.source as usize];
        let shift = if step.is_coarse() { step.first } else { BLOCK_LOG2 };
        let (begin, of_last) = (first.map(|v| v >> shift), last.map(|v| v >> shift));
        let mut end = of_last.map(|v| v + 1);
        if end[0] > (level.width - 1) >> shift {
            end[0] = step.blocks[0];
        }
        // What the next step reads.
        (first, last) = (begin, of_last);
        if step.blocks == [0, 0] {
            // The header alone: nothing is stored.
            return Blocks::all(step);
        }
        Blocks { begin, end }
    };
    layout.steps.iter().map(touched).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::image::ImageSize;
    use crate::pyramid::ends::Depths;
    use crate::pyramid::levels::StoredLevels;

    /// Worked out by hand for 1920 x 1080: 240 columns of blocks, of which 30 make a block again.
    #[test]
    fn a_rectangle_is_shifted_by_three_levels_a_step() {
        let layout =
            PyramidLayout::new(ImageSize::new(1920, 1080), StoredLevels::ALL, Depths::Farthest, 25)
                .unwrap();
        let blocks = |begin, end| Blocks { begin, end };
        assert_eq!(
            touched_blocks(&layout, [700, 400, 999, 699]),
            [blocks([87, 50], [125, 88]), blocks([10, 6], [16, 11])]
        );
        // The last column touches the padding: 240 columns need none, and 30 become 32.
        assert_eq!(
            touched_blocks(&layout, [1919, 0, 1919, 0]),
            [blocks([239, 0], [240, 1]), blocks([29, 0], [32, 1])]
        );
    }

    /// An image of 9 columns has two blocks, and two of padding.
    #[test]
    fn the_padding_follows_the_block_of_the_last_column() {
        let layout =
            PyramidLayout::new(ImageSize::new(9, 9), StoredLevels::ALL, Depths::Farthest, 25)
                .unwrap();
        let ends = |rectangle| touched_blocks(&layout, rectangle)[0].end;
        assert_eq!(ends([0, 0, 7, 7]), [1, 1]);
        assert_eq!(ends([8, 0, 8, 8]), [4, 2]);
        let coarse =
            PyramidLayout::new(ImageSize::new(99, 40), StoredLevels::only(4), Depths::Farthest, 25)
                .unwrap();
        assert_eq!(
            touched_blocks(&coarse, [16, 0, 98, 16]),
            [Blocks { begin: [1, 0], end: [8, 2] }]
        );
    }
}
