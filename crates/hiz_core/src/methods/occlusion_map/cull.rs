//! The cull: is the rectangle of an instance covered, and does it lie behind?
//!
//! Source: Zhang, Manocha, Hudson and Hoff (1997), section 3: the overlap test and the depth test.
//! The overlap test begins at the level where a pixel is about as large as the rectangle.
//! It ends early where a pixel is opaque, and at the first pixel that shows something.

use crate::error::{Error, Result};
use crate::host::linear::Vec3;
use crate::host::threads::{on_threads, worth_it};
use crate::input::bounds::Bounds;
use crate::methods::occlusion_map::fault::is_planted;
use crate::methods::occlusion_map::map::OcclusionMap;
use crate::methods::seen::{Seen, touched};
use crate::output::verdict::Verdict;

/// How a cull by maps decides.
#[derive(Debug, Clone, Copy, Default)]
pub struct MapCull<'a> {
    /// A hole of so many pixels of the finest map is negligible.
    pub negligible_px: u32,
    /// Instances that are kept without a test, such as the occluders that were drawn; one flag for
    /// each instance.
    pub never: Option<&'a [bool]>,
}

/// What a cull by maps has found.
#[derive(Debug, Clone, Default)]
pub struct MapSeen {
    /// By instance; nothing of it is certified.
    pub verdicts: Vec<Verdict>,
    /// By instance that was culled as occluded: the pixels that no occluder covers within the
    /// pixels of maps that it was culled by; 0 for others.
    pub holes: Vec<u32>,
    /// Pixels of maps that were read.
    pub lookups: u64,
}

/// What one thread writes: its instances from `first` on.
struct Part<'a> {
    first: usize,
    verdicts: &'a mut [Verdict],
    holes: &'a mut [u32],
    lookups: &'a mut u64,
}

/// What the test of one instance adds up.
#[derive(Default)]
struct Tally {
    holes: u32,
    lookups: u64,
}

/// Instances that a thread takes at once.
const BATCH: usize = 1024;

impl OcclusionMap {
    /// Tests the bounds of instances against the maps, on all cores.
    ///
    /// A sphere is tested as the box around it, and a point as a box of size 0.
    ///
    /// # Errors
    /// [`Error::Invalid`] if arrays have the wrong length.
    pub fn cull(&self, bounds: &Bounds<'_>, options: &MapCull<'_>) -> Result<MapSeen> {
        let count = bounds.len()?;
        if let Some(never) = options.never.filter(|never| never.len() != count) {
            let message = format!("expected {count} flags, got {}", never.len());
            return Err(Error::invalid("never", message));
        }
        let least = self.least_counts(options.negligible_px);
        let mut seen =
            MapSeen { verdicts: vec![Verdict::Visible; count], holes: vec![0; count], lookups: 0 };
        let mut lookups = vec![0; count.div_ceil(BATCH)];
        let parts = seen
            .verdicts
            .chunks_mut(BATCH)
            .zip(seen.holes.chunks_mut(BATCH))
            .zip(&mut lookups)
            .enumerate()
            .map(|(number, ((verdicts, holes), lookups))| Part {
                first: number * BATCH,
                verdicts,
                holes,
                lookups,
            });
        on_threads(worth_it(300 * count as u64), parts, |part: Part<'_>| {
            for (i, (verdict, holes)) in part.verdicts.iter_mut().zip(part.holes).enumerate() {
                let number = part.first + i;
                if options.never.is_some_and(|never| never[number]) {
                    continue;
                }
                let mut tally = Tally::default();
                *verdict = self.verdict(corners(bounds, number), &least, &mut tally);
                if *verdict == Verdict::Occluded {
                    *holes = tally.holes;
                }
                *part.lookups += tally.lookups;
            }
        });
        seen.lookups = lookups.iter().sum();
        Ok(seen)
    }

    fn verdict(&self, corners: Option<[Vec3; 8]>, least: &[u32], tally: &mut Tally) -> Verdict {
        let Some(corners) = corners else { return Verdict::Invalid };
        let ([x0, y0, x1, y1], depths) = match self.eye.look(&corners) {
            Seen::Outside => return Verdict::Outside,
            Seen::Crossing(_) => return Verdict::Visible,
            Seen::Inside(rectangle, depths) => (rectangle, depths),
        };
        let size = self.camera().size();
        let (columns, rows) = (touched(x0, x1, size.width), touched(y0, y1, size.height));
        let mut pixels = [columns.0, rows.0, columns.1, rows.1];
        if is_planted!(self.fault, ColumnDropped) && pixels[2] > pixels[0] {
            pixels[2] -= 1;
        }
        let nearest =
            if is_planted!(self.fault, FarthestCorner) { depths.farthest } else { depths.nearest };
        let per_region =
            [size.width, size.height].map(|side| (side / self.estimate.regions).trailing_zeros());
        let is_hidden = self.covers(pixels, least, tally)
            && self.estimate.is_before(nearest, pixels, per_region);
        if is_hidden { Verdict::Occluded } else { Verdict::Visible }
    }

    /// The overlap test: from the level whose pixel is about as large as the rectangle down.
    fn covers(&self, pixels: [u32; 4], least: &[u32], tally: &mut Tally) -> bool {
        let [x0, y0, x1, y1] = pixels;
        let longer = (x1 - x0 + 1).max(y1 - y0 + 1);
        let level = longer.next_power_of_two().trailing_zeros().min(self.num_levels() - 1);
        for y in y0 >> level..=y1 >> level {
            for x in x0 >> level..=x1 >> level {
                let is_covered = self.is_opaque((level, x, y), pixels, least, tally);
                if is_planted!(self.fault, FirstPixel) && is_covered {
                    return true;
                }
                if !is_covered {
                    return false;
                }
            }
        }
        true
    }

    /// Whether a pixel of a level covers its part of the rectangle, or those below it do.
    fn is_opaque(
        &self,
        (level, x, y): (u32, u32, u32),
        pixels: [u32; 4],
        least: &[u32],
        tally: &mut Tally,
    ) -> bool {
        tally.lookups += 1;
        let count = self.levels.at(level, x, y);
        if count >= least[level as usize] {
            tally.holes += (1 << (2 * level)) - count;
            return true;
        }
        if level == 0 || count == 0 {
            return false;
        }
        let below = level - 1;
        let [x0, y0, x1, y1] = pixels.map(|v| v >> below);
        for y in (2 * y).max(y0)..=(2 * y + 1).min(y1) {
            for x in (2 * x).max(x0)..=(2 * x + 1).min(x1) {
                if !self.is_opaque((below, x, y), pixels, least, tally) {
                    return false;
                }
            }
        }
        true
    }
}

/// The corners of the box of instance `i`; `None` for invalid bounds.
fn corners(bounds: &Bounds<'_>, i: usize) -> Option<[Vec3; 8]> {
    let ends = |low: Vec3, high: Vec3| -> [Vec3; 8] {
        std::array::from_fn(|corner| {
            std::array::from_fn(|k| if corner >> k & 1 == 0 { low[k] } else { high[k] })
        })
    };
    let corners = match bounds {
        Bounds::Spheres { centers, radii } => {
            let (center, radius): (Vec3, _) = (centers.array(i), radii.get(i));
            (radius >= 0.0).then(|| ends(center.map(|v| v - radius), center.map(|v| v + radius)))?
        }
        Bounds::Boxes { min, max } => {
            let (low, high): (Vec3, Vec3) = (min.array(i), max.array(i));
            (0..3).all(|k| low[k] <= high[k]).then(|| ends(low, high))?
        }
        Bounds::OrientedBoxes { centers, half_sizes, rotations } => {
            let (center, half): (Vec3, Vec3) = (centers.array(i), half_sizes.array(i));
            let m: [f64; 9] = rotations.array(i);
            half.iter().all(|v| *v >= 0.0).then(|| {
                ends(half.map(|v| -v), half).map(|u| {
                    std::array::from_fn(|k| {
                        center[k] + m[3 * k] * u[0] + m[3 * k + 1] * u[1] + m[3 * k + 2] * u[2]
                    })
                })
            })?
        }
        Bounds::Points { positions } => [positions.array(i); 8],
    };
    corners.iter().flatten().all(|v| v.is_finite()).then_some(corners)
}
