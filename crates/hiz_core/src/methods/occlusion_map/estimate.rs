//! The depth-estimation buffer, which takes the place of a Z-buffer.
//!
//! Source: Zhang, Manocha, Hudson and Hoff (1997), section 6.
//! A region of the image holds the view depth of the farthest vertex of the boxes of all occluders
//! that it meets.
//! What lies behind that plane lies behind these occluders, whichever of them covers a pixel.

use crate::methods::occlusion_map::fault::{Planted, is_planted};
use crate::methods::occlusion_map::options::MapOptions;
use crate::methods::seen::{Eye, Seen, touched};
use crate::occluders::copies::CopyBox;

/// One depth for each region.
#[derive(Debug)]
pub(super) struct Estimate {
    /// Along each side.
    pub(super) regions: u32,
    /// View depth in world units, row by row; infinite where no occluder is.
    pub(super) farthest: Vec<f64>,
}

impl Estimate {
    /// The depths of the occluders whose boxes these are.
    pub(super) fn new(
        eye: &Eye,
        options: &MapOptions,
        boxes: impl Iterator<Item = CopyBox>,
        fault: Planted,
    ) -> Self {
        let side = options.regions;
        let mut farthest = vec![f64::NEG_INFINITY; (side * side) as usize];
        for one in boxes {
            let (mut rectangle, depths) = match eye.look(&one.corners) {
                Seen::Outside => continue,
                Seen::Crossing(depths) => ([0.0, 0.0, 1.0, 1.0], depths),
                Seen::Inside(rectangle, depths) => (rectangle, depths),
            };
            if is_planted!(fault, MiddleRegion) {
                let [x0, y0, x1, y1] = rectangle;
                rectangle = [(x0 + x1) / 2.0, (y0 + y1) / 2.0, (x0 + x1) / 2.0, (y0 + y1) / 2.0];
            }
            let depth =
                if is_planted!(fault, NearestVertex) { depths.nearest } else { depths.farthest };
            let (columns, rows) = (
                touched(rectangle[0], rectangle[2], side),
                touched(rectangle[1], rectangle[3], side),
            );
            for row in rows.0..=rows.1 {
                let row = &mut farthest[(row * side) as usize..][..side as usize];
                for region in &mut row[columns.0 as usize..=columns.1 as usize] {
                    *region = if is_planted!(fault, LastBox) { depth } else { region.max(depth) };
                }
            }
        }
        for region in &mut farthest {
            if *region == f64::NEG_INFINITY {
                *region = f64::INFINITY;
            }
        }
        Self { regions: side, farthest }
    }

    /// Whether `nearest` is behind all occluders in the regions that these pixels meet.
    ///
    /// `shifts` says how many pixels a region has along each side, as powers of two.
    pub(super) fn is_before(
        &self,
        nearest: f64,
        [x0, y0, x1, y1]: [u32; 4],
        shifts: [u32; 2],
    ) -> bool {
        let side = self.regions as usize;
        let (columns, rows) = (
            (x0 >> shifts[0]) as usize..=(x1 >> shifts[0]) as usize,
            (y0 >> shifts[1]) as usize..=(y1 >> shifts[1]) as usize,
        );
        self.farthest
            .chunks_exact(side)
            .take(rows.end() + 1)
            .skip(*rows.start())
            .all(|row| row[columns.clone()].iter().all(|farthest| nearest > *farthest))
    }
}
