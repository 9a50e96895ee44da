//! The search through the image for a pixel that proves a volume visible.

use crate::dyadic::Dyadic;
use crate::feasibility::{Constraint, Shape, feasible, feasible_in_float, is_consistent};
use crate::pyramid::{ONE, sanitized_depth};
use crate::scalar::{Ball, Scalar};
use crate::view::{Block, Clip, Coverage, View};
use crate::volume::{Frame, Volume};
use crate::{Arithmetic, Options, OwnDepth};
use std::cell::OnceCell;

/// A volume as a view sees it, with the two questions about it.
/// Does it meet a block of pixels, and does a depth hide it?
pub(crate) struct Projected<'a> {
    pub(crate) view: &'a View,
    volume: &'a Volume,
    pub(crate) options: Options,
    pub(crate) shape: Shape,
    pub(crate) float: Clip<Ball>,
    /// Made when float64 first leaves a sign open, which is rare.
    exact: OnceCell<Clip<Dyadic>>,
}

impl<'a> Projected<'a> {
    pub(crate) fn new(view: &'a View, volume: &'a Volume, options: Options) -> Self {
        Projected {
            view,
            volume,
            options,
            shape: volume.shape(),
            float: Clip::new(view, &Frame::new(volume, view.origin)),
            exact: OnceCell::new(),
        }
    }

    pub(crate) fn exact(&self) -> &Clip<Dyadic> {
        self.exact.get_or_init(|| Clip::new(self.view, &Frame::new(self.volume, self.view.origin)))
    }

    /// Runs a decision in the arithmetic that the options name.
    pub(crate) fn decide(
        &self,
        float: impl FnOnce() -> Option<bool>,
        exact: impl FnOnce() -> Option<bool>,
    ) -> Option<bool> {
        match self.options.arithmetic {
            Arithmetic::Float => float(),
            Arithmetic::Escalate => float().or_else(exact),
            Arithmetic::Exact => exact(),
        }
    }

    /// Whether a point of the volume is inside the frustum and inside the block.
    pub(crate) fn meets(&self, block: Block) -> Option<bool> {
        self.decide(
            || self.meets_in_float(block),
            || {
                let coverage = self.options.coverage;
                let consistent = is_consistent(&self.float.inside(self.view, block, coverage));
                let inside = self.exact().inside(self.view, block, coverage);
                feasible(&inside, self.shape, consistent)
            },
        )
    }

    /// Whether a point of the volume is inside the frustum and the block, and not farther than
    /// `depth`, which is in 0..=1.
    pub(crate) fn meets_before(&self, block: Block, depth: f32) -> Option<bool> {
        let coverage = self.options.coverage;
        let before = self.float.inside_and_before(self.view, block, coverage, depth);
        self.decide(
            || feasible_in_float(&before, self.shape),
            || {
                let exact = self.exact().inside_and_before(self.view, block, coverage, depth);
                feasible(&exact, self.shape, is_consistent(&before))
            },
        )
    }

    /// The conditions for a point inside the frustum and the block that is not nearer than `depth`.
    pub(crate) fn float_behind(&self, block: Block, depth: f32) -> Vec<Constraint<Ball>> {
        self.float.inside_and_behind(self.view, block, self.options.coverage, depth)
    }

    /// The same, exactly.
    pub(crate) fn exact_behind(&self, block: Block, depth: f32) -> Vec<Constraint<Dyadic>> {
        self.exact().inside_and_behind(self.view, block, self.options.coverage, depth)
    }

    pub(crate) fn shape(&self) -> Shape {
        self.shape
    }

    /// The nearest depth at which a pixel shows something of the volume.
    ///
    /// Bisection over the float32 numbers from near to far works because a depth shows whatever a
    /// nearer depth shows.
    pub(crate) fn own_depth(&self, [x, y]: [u32; 2]) -> Option<f32> {
        let pixel = Block { x: [x, x + 1], y: [y, y + 1] };
        let depth =
            |steps: u32| f32::from_bits(if self.view.reversed { ONE - steps } else { steps });
        let shows = |steps: u32| self.meets_before(pixel, depth(steps)) == Some(true);
        let (mut hidden, mut shown) = (0, ONE);
        if !shows(shown) {
            return None;
        }
        if shows(hidden) {
            return Some(depth(hidden));
        }
        while shown - hidden > 1 {
            let middle = hidden.midpoint(shown);
            if shows(middle) { shown = middle } else { hidden = middle }
        }
        Some(depth(shown))
    }

    fn meets_in_float(&self, block: Block) -> Option<bool> {
        let inside = self.float.inside(self.view, block, self.options.coverage);
        feasible_in_float(&inside, self.shape)
    }

    /// Whether all of the volume lies strictly farther than `depth`, which is in 0..=1.
    pub(crate) fn is_beyond(&self, depth: f32) -> Option<bool> {
        fn beyond<S: Scalar>(clip: &Clip<S>, depth: f32, p: &Projected) -> Option<bool> {
            clip.beyond(depth, p.view.reversed).is_positive_on(p.shape)
        }
        self.decide(|| beyond(&self.float, depth, self), || beyond(self.exact(), depth, self))
    }

    /// Whether all of the volume surely has w > 0.
    /// An open answer counts as no, because the answer only saves work.
    fn is_in_front(&self) -> bool {
        self.float.w.is_positive_on(self.shape) == Some(true)
    }

    /// A block that holds every pixel that the volume can touch.
    /// It is usually much smaller than the image.
    ///
    /// The projection of eight corners gives a first guess.
    /// Each part of the image outside of the guess is left out only if it is proved empty.
    pub(crate) fn bounding_block(&self) -> Block {
        let image = self.view.image();
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for corner in 0..8u8 {
            let s = [1, 2, 4].map(|bit| if corner & bit == 0 { -1.0 } else { 1.0 });
            let [x, y, w] =
                [&self.float.width_x, &self.float.height_y, &self.float.w].map(|form| {
                    form.middle.mid + (0..3).map(|k| form.along[k].mid * s[k]).sum::<f64>()
                });
            if w <= 0.0 || w.is_nan() {
                return image;
            }
            let pixel = [
                0.5 * (f64::from(self.view.width) + x / w),
                0.5 * (f64::from(self.view.height) - y / w),
            ];
            for axis in 0..2 {
                low[axis] = low[axis].min(pixel[axis]);
                high[axis] = high[axis].max(pixel[axis]);
            }
        }
        let mut guess = [image.x, image.y];
        for (axis, [from, to]) in guess.iter_mut().enumerate() {
            // A little wider than the guess, because a volume that touches the border of an outer
            // strip keeps the strip.
            // Casts saturate.
            let first = (low[axis] - 0.01).floor().max(0.0) as u32;
            let last = (high[axis] + 0.01).floor().max(0.0) as u32;
            *from = first.min(*to - 1);
            *to = last.saturating_add(1).clamp(*from + 1, *to);
        }
        let empty = |block: Block| self.meets_in_float(block) == Some(false);
        let mut kept = image;
        let [x, y] = guess;
        if x[0] > 0 && empty(Block { x: [0, x[0]], ..kept }) {
            kept.x[0] = x[0];
        }
        let right = [x[1], image.x[1]];
        if x[1] < image.x[1] && empty(Block { x: right, ..kept }) {
            kept.x[1] = x[1];
        }
        if y[0] > 0 && empty(Block { y: [0, y[0]], ..kept }) {
            kept.y[0] = y[0];
        }
        let bottom = [y[1], image.y[1]];
        if y[1] < image.y[1] && empty(Block { y: bottom, ..kept }) {
            kept.y[1] = y[1];
        }
        kept
    }

    /// Every pixel that the volume touches, in row order, and whether every decision was made.
    pub(crate) fn touched(&self) -> (Vec<[u32; 2]>, bool) {
        let mut pixels = Vec::new();
        let mut decided = true;
        let mut blocks = vec![self.bounding_block()];
        while let Some(block) = blocks.pop() {
            match self.meets(block) {
                Some(false) => {}
                Some(true) if block.is_pixel() => pixels.push([block.x[0], block.y[0]]),
                None if block.is_pixel() => decided = false,
                _ => blocks.extend(block.halves()),
            }
        }
        pixels.sort_unstable_by_key(|&[x, y]| [y, x]);
        (pixels, decided)
    }

    /// The NDC depth of the volume's nearest point in plain float64.
    /// `None` unless all of the volume surely has w > 0.
    pub(crate) fn nearest_depth(&self) -> Option<f64> {
        if !self.is_in_front() {
            return None;
        }
        let (z, w) = (&self.float.z, &self.float.w);
        let (z0, w0) = (z.middle.mid, w.middle.mid);
        let (zv, wv) = (z.along.map(|x| x.mid), w.along.map(|x| x.mid));
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let sign = if self.view.reversed { -1.0 } else { 1.0 };
        Some(match self.shape {
            Shape::Cube => {
                let depths = (0..8u8).map(|corner| {
                    let s = [1, 2, 4].map(|bit| if corner & bit == 0 { -1.0 } else { 1.0 });
                    (z0 + dot(zv, s)) / (w0 + dot(wv, s))
                });
                let nearer = |a: f64, b: f64| if sign * a < sign * b { a } else { b };
                depths.reduce(nearer)?
            }
            // At the nearest depth t, the plane z - t w = 0 is tangent to the ball.
            // That gives (z0 - t w0)^2 = |zv - t wv|^2, written as a t^2 - 2 b t + c = 0.
            Shape::Ball => {
                let a = w0 * w0 - dot(wv, wv);
                let b = z0 * w0 - dot(zv, wv);
                let c = z0 * z0 - dot(zv, zv);
                let root = (b * b - a * c).max(0.0).sqrt();
                // This form of the smaller root has no cancellation if b > 0.
                match (self.view.reversed, b > 0.0) {
                    (true, _) => (b + root) / a,
                    (false, true) => c / (b + root),
                    (false, false) => (b - root) / a,
                }
            }
        })
    }
}

/// What is known so far about which depths hide a volume.
///
/// If w > 0 on the volume and a depth hides it, every nearer depth hides it too.
/// Then two bounds that close in on the threshold keep all answers.
/// So an image needs a few evaluations instead of one per pixel.
struct Hiding<'a> {
    projected: &'a Projected<'a>,
    monotone: bool,
    /// In float32 steps from the nearest depth.
    /// All depths up to `hides_to` hide the volume, and all from `open_from` on do not.
    hides_to: i64,
    open_from: i64,
}

impl<'a> Hiding<'a> {
    fn new(projected: &'a Projected<'a>) -> Self {
        Hiding { projected, monotone: projected.is_in_front(), hides_to: -1, open_from: i64::MAX }
    }

    /// Whether a pixel with this depth hides the volume.
    fn hides(&mut self, pixel: f32) -> Option<bool> {
        let reversed = self.projected.view.reversed;
        let depth = sanitized_depth(pixel, reversed);
        let bits = i64::from(depth.to_bits());
        let far = i64::from(ONE);
        let steps = if reversed { far - bits } else { bits };
        // The far plane hides nothing.
        if steps == far || steps >= self.open_from {
            return Some(false);
        }
        if steps <= self.hides_to {
            return Some(true);
        }
        let answer = self.projected.is_beyond(depth);
        match answer {
            Some(true) if self.monotone => self.hides_to = steps,
            Some(false) if self.monotone => self.open_from = steps,
            _ => {}
        }
        answer
    }
}

/// What the search found.
pub(crate) enum Found {
    /// A touched pixel that does not hide the volume.
    /// Its position is unknown if float64 alone could not locate it.
    Open(Option<[u32; 2]>),
    /// There is no such pixel.
    Nothing,
    /// There may be such a pixel.
    Unknown,
}

/// How many pixels of a block hide the volume.
#[derive(PartialEq)]
enum Pixels {
    AllHide,
    NoneHides,
    Mixed,
}

/// Looks for a touched pixel that does not hide the volume.
///
/// Blocks are halved, and dropped if all of their pixels hide the volume or none is touched.
/// With [`OwnDepth::PerPixel`], every block is asked anew, against the farthest of its depths.
pub(crate) fn find_open_pixel(projected: &Projected, depth: &[f32]) -> Found {
    let mut hiding = Hiding::new(projected);
    let width = projected.view.width as usize;
    let mut classify = |block: Block| {
        // An undecided pixel belongs to neither side.
        let (mut all, mut none) = (true, true);
        for y in block.y[0]..block.y[1] {
            let row = &depth[y as usize * width..][block.x[0] as usize..block.x[1] as usize];
            for &pixel in row {
                let hides = hiding.hides(pixel);
                all &= hides == Some(true);
                none &= hides == Some(false);
                if !all && !none {
                    return Pixels::Mixed;
                }
            }
        }
        if all { Pixels::AllHide } else { Pixels::NoneHides }
    };

    let mut unknown = false;
    let mut blocks = vec![projected.bounding_block()];
    while let Some(block) = blocks.pop() {
        let pixels = classify(block);
        if pixels == Pixels::AllHide {
            continue;
        }
        let meets = match projected.options.own_depth {
            OwnDepth::Nearest => projected.meets(block),
            OwnDepth::PerPixel => {
                projected.meets_before(block, farthest(projected.view, depth, block))
            }
        };
        if meets == Some(false) {
            continue;
        }
        // The squares of its pixels cover a block, but its samples do not.
        // Nor does the farthest depth stand for all pixels.
        // So with samples or own depths, only single pixels count.
        let Options { coverage, own_depth, .. } = projected.options;
        let counts =
            (coverage == Coverage::Area && own_depth == OwnDepth::Nearest) || block.is_pixel();
        if meets == Some(true) && pixels == Pixels::NoneHides && counts {
            return Found::Open(follow(projected, block));
        }
        if block.is_pixel() {
            unknown = true;
        } else {
            blocks.extend(block.halves());
        }
    }
    if unknown { Found::Unknown } else { Found::Nothing }
}

/// The farthest depth of a block after [`sanitized_depth`].
fn farthest(view: &View, depth: &[f32], block: Block) -> f32 {
    let rows = block.y[0]..block.y[1];
    let columns = block.x[0] as usize..block.x[1] as usize;
    rows.flat_map(|y| &depth[y as usize * view.width as usize..][columns.clone()])
        .map(|&pixel| sanitized_depth(pixel, view.reversed))
        .reduce(if view.reversed { f32::min } else { f32::max })
        .expect("a block is never empty")
}

/// A touched pixel of a block that the volume meets.
fn follow(projected: &Projected, mut block: Block) -> Option<[u32; 2]> {
    while !block.is_pixel() {
        block = *block.halves().iter().find(|&&half| projected.meets(half) == Some(true))?;
    }
    Some([block.x[0], block.y[0]])
}
