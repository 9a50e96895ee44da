//! The explanation of one verdict, made from what the shader wrote down.

use crate::cull::explain::{BEHIND, CLEAR, ExplanationRecord, LEVEL_MASK, Reading, Stage};
use crate::cull::options::{CullOptions, Fit};
use crate::input::camera::Camera;
use crate::input::view_depth::ViewDepth;
use crate::output::verdict::Verdict;

/// Why an instance got its verdict: the cull's own steps, run for it once more.
///
/// A member of a group that was culled as a whole was never tested by itself.
/// Its verdict is then that of the group, which `group` explains, or outside if its own test says
/// so.
/// Everything else here is its own test, which may have kept it.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The verdict.
    pub verdict: Verdict,
    /// First and last pixel column and row that the projection may touch, inclusive: x0, y0, x1,
    /// y1.
    pub rectangle: Option<[i32; 4]>,
    /// The level of the footprint.
    pub level: Option<u32>,
    /// The texels (x, y) that were read, in order: those of the footprint, then those of a descent.
    /// At most the first 4,096.
    pub texels: Vec<[u32; 2]>,
    /// The level of each of these texels.
    pub texel_levels: Vec<u32>,
    /// The NDC depth of each of these texels.
    pub texel_depths: Vec<f32>,
    /// How many texels were read, including those that are not listed.
    pub texels_read: u32,
    /// Which of the listed texels decided: the farthest one that hides the instance, or the one
    /// that does not.
    /// `None` if no single texel decided, or if it is not listed.
    pub decisive: Option<usize>,
    /// The farthest NDC depth of those that hide the instance, or the depth that does not.
    pub farthest: Option<f32>,
    /// The NDC depth of the bounds' nearest point, an estimate.
    pub nearest: Option<f64>,
    /// `farthest` as view depth in world units; infinite for far.
    /// `None` if view depth does not follow from the camera's NDC depth alone.
    /// That is so for an orthographic camera from a bare matrix, and for an oblique near plane.
    pub farthest_z: Option<f64>,
    /// The view depth of the bounds' nearest point in world units, an estimate.
    /// `None` for an orthographic camera from a bare matrix.
    pub nearest_z: Option<f64>,
    /// The nearest NDC depth of the texels, which all of an unoccluded instance is nearer than.
    /// Of another instance, the depth that it is not surely nearer than, or not surely inside of
    /// the frustum besides.
    /// `None` if the pyramid has one end alone, and if the texels reach the near plane.
    pub in_front_of: Option<f32>,
    /// `in_front_of` as view depth in world units; see `farthest_z`.
    pub in_front_of_z: Option<f64>,
    /// Whether the instance was updated since the cull.
    /// If so, everything here is about its new bounds, and the cull's verdict may be another.
    pub stale: bool,
    /// For a member of a group that was decided as a whole: the test of the box around the group.
    pub group: Option<Box<Self>>,
    /// The reason in words.
    pub reason: String,
}

/// What the shader wrote down about one test, and what the test was given.
pub(super) struct Told<'a> {
    pub(super) record: ExplanationRecord,
    pub(super) readings: &'a [Reading],
    pub(super) camera: &'a Camera,
    /// For the test of a group: the options of that test.
    pub(super) options: &'a CullOptions,
}

/// How a test ended, and which texel decided.
struct End {
    reason: &'static str,
    decisive: Option<usize>,
    farthest: Option<f32>,
}

impl End {
    fn new(reason: &'static str) -> Self {
        Self { reason, decisive: None, farthest: None }
    }
}

impl Told<'_> {
    pub(super) fn explanation(&self) -> Explanation {
        let record = &self.record;
        let reached_depth = record.stage() >= Stage::Depth;
        let End { reason, decisive, farthest } = self.end();
        let [least, greatest, w_least, _] = record.depths.map(f64::from);
        let nearest = if self.camera.convention().is_reversed() { greatest } else { least };
        let is_before_eye = record.stage() >= Stage::Rectangle;
        let view_depth = ViewDepth::new(self.camera);
        let z_of = |ndc: f64| view_depth.as_ref().and_then(|view| view.of_ndc(ndc));
        let nearest_z = match view_depth.as_ref().and_then(|view| view.of_w(w_least)) {
            Some(z) => Some(z),
            None => z_of(nearest),
        };
        let near = f32::to_bits(if self.camera.convention().is_reversed() { 1.0 } else { 0.0 });
        let in_front_of = (reached_depth && record.nearest_bits != near)
            .then(|| f32::from_bits(record.nearest_bits));
        Explanation {
            verdict: Verdict::of_word(record.verdict),
            rectangle: reached_depth.then_some(record.pixels),
            level: reached_depth.then_some(record.level),
            texels: self.readings.iter().map(|[_, x, y, _]| [*x, *y]).collect(),
            texel_levels: self.readings.iter().map(|[word, ..]| word & LEVEL_MASK).collect(),
            texel_depths: self.readings.iter().map(depth).collect(),
            texels_read: record.texels_read,
            decisive: decisive.filter(|i| *i < self.readings.len()),
            farthest,
            nearest: is_before_eye.then_some(nearest),
            farthest_z: farthest.and_then(|ndc| z_of(f64::from(ndc))),
            nearest_z: nearest_z.filter(|_| is_before_eye),
            in_front_of,
            in_front_of_z: in_front_of.and_then(|ndc| z_of(f64::from(ndc))),
            stale: false,
            group: None,
            reason: reason.to_owned(),
        }
    }

    /// How the test ended.
    fn end(&self) -> End {
        let record = &self.record;
        let verdict = Verdict::of_word(record.verdict);
        let is_hidden = verdict == Verdict::Occluded;
        match record.stage() {
            Stage::Validity if verdict == Verdict::Outside => {
                End::new("absent: its mesh id says that there is no such instance")
            }
            Stage::Validity => {
                End::new("the bounds are not finite, negative, or too large for this camera: kept")
            }
            Stage::Frustum => End::new("outside one plane of the frustum"),
            Stage::EyePlane => End::new("crosses the plane of the eye: kept"),
            Stage::Rectangle if verdict == Verdict::Outside => {
                End::new("between the pixel centres")
            }
            Stage::Rectangle => End::new(
                "touches no pixel for sure, but no plane of the frustum separates it: kept",
            ),
            Stage::Depth if record.texels_read == 0 => {
                End::new("the pyramid's reduction has not run: kept")
            }
            _ if record.texels_read == 0 => End::new(
                "spans more texels of the coarsest stored level than the footprint has: kept",
            ),
            Stage::Depth => {
                self.footprint("not surely behind the farthest depth of the texels: kept")
            }
            Stage::Block if is_hidden => {
                self.footprint("behind the farthest depth of all texels that it can touch")
            }
            Stage::Block => End::new("behind the texels, but not surely inside their block: kept"),
            Stage::Front if verdict == Verdict::Unoccluded => End::new(
                "inside the frustum, and before the nearest depth of all texels that it can touch",
            ),
            Stage::Front => End::new("before the texels, but not surely inside their block: kept"),
            Stage::Descent if verdict == Verdict::Unoccluded => {
                End::new("inside the frustum, and before every pixel that it can touch")
            }
            Stage::Descent | Stage::Level if is_hidden => {
                let farthest = (record.any_before != 0).then_some(record.farthest_before);
                let is_it = |r: &Reading| r[0] & BEHIND != 0 && Some(r[3]) == farthest;
                End {
                    reason: "behind the farthest depth of every pixel that it can touch",
                    decisive: self.readings.iter().position(is_it),
                    farthest: farthest.map(f32::from_bits),
                }
            }
            Stage::Descent | Stage::Level => self.failed_descent(),
        }
    }

    fn footprint(&self, reason: &'static str) -> End {
        let bits = self.record.farthest_bits;
        let of_footprint =
            &self.readings[..self.readings.len().min(self.record.of_footprint as usize)];
        End {
            reason,
            decisive: of_footprint.iter().position(|r| r[3] == bits),
            farthest: Some(f32::from_bits(bits)),
        }
    }

    /// Why a descent did not hide the volume.
    /// It ended at a texel that does not hide it, at the end of its budget, or at the last
    /// certificate.
    fn failed_descent(&self) -> End {
        let [word, x, y, bits] = self.record.last;
        let level = word & LEVEL_MASK;
        let [x0, y0, x1, y1] = self.record.pixels.map(i64::from);
        let size = self.camera.size();
        let (begin_x, begin_y) = (i64::from(x) << level, i64::from(y) << level);
        let end_x = ((i64::from(x) + 1) << level).min(i64::from(size.width));
        let end_y = ((i64::from(y) + 1) << level).min(i64::from(size.height));
        if word & (BEHIND | CLEAR) != 0 {
            // The descent ends at the rectangle's last pixel.
            let is_last = (begin_x..end_x).contains(&x1) && (begin_y..end_y).contains(&y1);
            return End::new(if is_last {
                "behind every pixel that it can touch, but those are not surely all: kept"
            } else {
                "hidden as far as the descent's budget reached: kept"
            });
        }
        let is_within = begin_x >= x0 && begin_y >= y0 && end_x <= x1 + 1 && end_y <= y1 + 1;
        let has_children = self.options.descent > 0 && level > 0;
        if has_children && (self.options.fit == Fit::Volume || !is_within) {
            return End::new("the descent's budget ended before a finer level could tell: kept");
        }
        End {
            reason: "not surely behind a pixel that it can touch: kept",
            decisive: Some(self.record.texels_read as usize - 1),
            farthest: Some(f32::from_bits(bits)),
        }
    }
}

fn depth([.., bits]: &Reading) -> f32 {
    f32::from_bits(*bits)
}
