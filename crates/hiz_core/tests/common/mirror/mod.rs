//! The cull shader once more, on the host: the same input words and the same steps.
//! The arithmetic is an argument.
//! So it shows how the certificates would do on devices that round, fuse, reassociate and flush
//! differently from the ones at hand.
#![allow(dead_code, unused_imports, reason = "each test binary uses its own part")]

mod arithmetic;
mod extent;
mod front;
mod guesses;
mod lod;
mod loss;
mod planes;
mod shadow;
mod volume;

use hiz_core::{BoundsKind, CullOptions, ERROR_ULPS, Fit, Footprint};

use crate::campaign::{Arrays, Round};

pub(crate) use arithmetic::{
    Arithmetic, MARGIN_FIRST, STYLES, Style, WILDEST, WITHOUT_BARS, WITHOUT_SLOPE_BARS,
};
use extent::Extent;
pub(crate) use lod::{LodMirror, NEED_FACTOR, Need};
pub(crate) use loss::{Losses, texel_loss};
use planes::Projected;
pub(crate) use shadow::ShadowMirror;
use volume::Volume;

const EPS: f32 = 1.0 / 8_388_608.0;
const LEAST_NORMAL: f32 = f32::MIN_POSITIVE;
/// `LEAST_W`: 2^-66.
const LEAST_W: f32 = f32::from_bits((127 - 66) << 23);

/// `2^n`.
fn two_to(n: i32) -> f32 {
    2.0_f32.powi(n)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// How many eps a certificate keeps back, and how many a texel's comparison with a plane does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Margins {
    pub(crate) certificate: f32,
    pub(crate) texel: f32,
    /// `FLATTEST`.
    pub(crate) flattest: f32,
    /// Whether `below` and `above` of an extent are clamped to 0.
    pub(crate) clamped: bool,
    /// The share of a volume's own size that counts in its margins.
    pub(crate) own: f32,
}

impl Margins {
    /// The shader's.
    pub(crate) const FULL: Self = Self {
        certificate: ERROR_ULPS as f32,
        texel: 8.0,
        flattest: f32::from_bits((127 - 100) << 23),
        clamped: true,
        own: 1.0,
    };
}

impl From<f32> for Margins {
    fn from(certificate: f32) -> Self {
        Self { certificate, ..Self::FULL }
    }
}

/// A linear function, and the terms of its margin.
/// They are `magnitudes` and `constant_magnitudes` of `view.wgsl`.
#[derive(Debug, Clone, Copy)]
struct Row {
    m: [f32; 4],
    magnitude: f32,
    constant_magnitude: f32,
}

/// `View` of `view.wgsl`, read from the words that the shader reads.
#[derive(Debug)]
struct View {
    x: Row,
    y: Row,
    z: Row,
    w: Row,
    eye_hi: [f32; 3],
    z_slope: f32,
    eye_lo: [f32; 3],
    halves_size: f32,
    half_size: [f32; 2],
    reach: f32,
    depth_factor: f32,
    size: [i32; 2],
    descent_budget: u32,
    depth_offset: f32,
    coordinate_limit: f32,
    near_factor: f32,
    near_offset: f32,
}

impl View {
    fn new(words: &[u32]) -> Self {
        let one = |i: usize| f32::from_bits(words[i]);
        let three = |i: usize| [0, 1, 2].map(|k| one(i + k));
        let row = |k: usize| Row {
            m: [0, 1, 2, 3].map(|j| one(4 * k + j)),
            magnitude: one(16 + k),
            constant_magnitude: one(20 + k),
        };
        Self {
            x: row(0),
            y: row(1),
            z: row(2),
            w: row(3),
            eye_hi: three(24),
            z_slope: one(27),
            eye_lo: three(28),
            halves_size: one(31),
            half_size: [one(32), one(33)],
            reach: one(34),
            depth_factor: one(35),
            size: [words[36] as i32, words[37] as i32],
            descent_budget: words[40],
            depth_offset: one(41),
            coordinate_limit: one(42),
            near_factor: one(53),
            near_offset: one(54),
        }
    }
}

/// A row on a volume (`certificate.wgsl`, `Value`).
#[derive(Debug, Clone, Copy)]
struct Value {
    center: f32,
    error: f32,
    half: [f32; 3],
}

impl Value {
    /// `sign` times the value, which is exact.
    fn signed(&self, sign: f32) -> Self {
        Self { center: sign * self.center, error: self.error, half: self.half.map(|h| sign * h) }
    }
}

/// A round's camera and depth image, prepared.
#[derive(Debug)]
pub(crate) struct Mirror {
    view: View,
    reversed: bool,
    sample_coverage: bool,
    footprint_log2: u32,
    descent: bool,
    fit_volume: bool,
    levels: Vec<hiz_ref::Level>,
    words: Vec<(BoundsKind, Vec<u32>)>,
}

impl Mirror {
    /// `None` for a camera that is refused.
    pub(crate) fn new(round: &Round) -> Option<Self> {
        let CullOptions { footprint, coverage, descent, fit, .. } = round.options;
        let view = View::new(&hiz_core::testing::words::view(&round.camera, &round.options).ok()?);
        let words = round
            .volumes
            .iter()
            .map(|(kind, volumes)| {
                let arrays = Arrays::new(volumes);
                (
                    *kind,
                    hiz_core::testing::words::instances(&arrays.bounds(*kind))
                        .expect("arrays that agree"),
                )
            })
            .collect();
        Some(Self {
            view,
            reversed: round.view.reversed,
            sample_coverage: coverage == hiz_core::Coverage::Sample,
            footprint_log2: match footprint {
                Footprint::One => 0,
                Footprint::Two => 1,
                Footprint::Four => 2,
                Footprint::Eight => 3,
            },
            descent: descent > 0,
            fit_volume: fit == Fit::Volume,
            levels: hiz_ref::pyramid(
                &round.depth,
                round.view.width,
                round.view.height,
                round.view.reversed,
            ),
            words,
        })
    }

    /// The same without the host's share in the magnitudes.
    /// They then bound the coefficients, but not what float64 lost in them.
    pub(crate) fn without_error_share(mut self) -> Self {
        let view = &mut self.view;
        for row in [&mut view.x, &mut view.y, &mut view.z, &mut view.w] {
            let [x, y, z, constant] = row.m.map(f32::abs);
            (row.magnitude, row.constant_magnitude) = (x.max(y).max(z), constant);
        }
        self
    }

    /// The masks of kept volumes, for each kind.
    pub(crate) fn masks(
        &self,
        margins: impl Into<Margins>,
        arithmetic: &mut Arithmetic,
    ) -> Vec<Vec<bool>> {
        let margins = margins.into();
        self.words
            .iter()
            .map(|(kind, words)| {
                let stride = kind.record_bytes() as usize / 4;
                words
                    .chunks_exact(stride)
                    .map(|record| !self.culls(*kind, record, margins, arithmetic))
                    .collect()
            })
            .collect()
    }

    /// Whether a volume is culled.
    pub(crate) fn culls_volume(
        &self,
        volume: &hiz_ref::Volume,
        margins: impl Into<Margins>,
        arithmetic: &mut Arithmetic,
    ) -> bool {
        let kind = match volume {
            hiz_ref::Volume::Sphere { .. } => BoundsKind::Sphere,
            hiz_ref::Volume::Box { .. } => BoundsKind::Box,
            hiz_ref::Volume::OrientedBox { .. } => BoundsKind::OrientedBox,
        };
        let arrays = Arrays::new(std::slice::from_ref(volume));
        let record =
            hiz_core::testing::words::instances(&arrays.bounds(kind)).expect("arrays that agree");
        self.culls(kind, &record, margins.into(), arithmetic)
    }

    /// `classify` of `classify.wgsl`; the numbers are its steps.
    fn culls(
        &self,
        kind: BoundsKind,
        record: &[u32],
        margins: Margins,
        arithmetic: &mut Arithmetic,
    ) -> bool {
        let view = &self.view;
        let Some(volume) = Volume::load(kind, record, view, &margins, arithmetic) else {
            return false;
        };
        let mut c = Certificates { kind, margins, arithmetic };
        let [x, y, z, w] = [&view.x, &view.y, &view.z, &view.w].map(|row| c.value_of(row, &volume));
        let a = view.z_slope;

        // 1. Outside one of the six planes of the frustum.
        let border = view.half_size.map(|h| h + view.reach);
        let far_plane = c.arithmetic.sub(1.0, a);
        if c.surely_beyond(&x, border[0], &w)
            || c.surely_beyond(&y, border[1], &w)
            || c.surely_below(&z, -a, &w)
            || c.surely_above(&z, far_plane, &w)
        {
            return true;
        }

        // 2. Crossing w = 0.
        let w_min = c.least_w(&w);
        if w_min.is_nan() || w_min <= LEAST_W {
            return false;
        }

        // 3. The pixels that the projection may touch.
        let extents = [0, 1].map(|k| c.extent_of([&x, &y][k], &w, view.half_size[k]));
        let mut first = [0; 2];
        let mut last = [0; 2];
        for k in 0..2 {
            [first[k], last[k]] = pixel_interval(&extents[k], 1.25 / w_min, view, k);
            if c.arithmetic.style.wild && view.size[k] > 0 {
                let wild = [0; 2].map(|_| c.arithmetic.below(view.size[k] as u32) as i32);
                if c.arithmetic.below(4) == 0 {
                    [first[k], last[k]] = [wild[0].min(wild[1]), wild[0].max(wild[1])];
                } else if first[k] < last[k] {
                    // Near misses: one pixel too few on one side.
                    if c.arithmetic.below(2) == 0 { first[k] += 1 } else { last[k] -= 1 }
                }
            }
        }
        let empty = [0, 1].map(|k| first[k] > last[k]);
        if empty[0] || empty[1] {
            return self.sample_coverage
                && ((empty[0] && c.between_samples(&x, &w, first[0], view, 0))
                    || (empty[1] && c.between_samples(&y, &w, first[1], view, 1)));
        }

        // 4. The finest level at which the rectangle spans no more texels than the footprint.
        let (first, last) = (first.map(|v| v as u32), last.map(|v| v as u32));
        let n = self.footprint_log2;
        let spans = |level: u32| (0..2).map(move |k| (last[k] >> level) - (first[k] >> level));
        let level = (0..32).find(|level| spans(*level).all(|more| more < 1 << n)).expect("one");
        let (from, to) = (first.map(|v| v >> level), last.map(|v| v >> level));

        // 5. All of the volume is farther than the farthest depth in the footprint.
        //    Or 5a. than the depths in finer levels, texel by texel.
        let farthest = self.farthest(level as usize, from, to);
        let block = if self.surely_behind(farthest, &z, &w, &mut c) {
            (from, to, level)
        } else if (self.descent && level > 0) || self.fit_volume {
            if !self.descends(
                level,
                [from, to],
                [first, last],
                &Projected { x, y, z, w, w_min },
                &mut c,
            ) {
                return false;
            }
            (first, last, 0)
        } else {
            return false;
        };

        // 6. The texels were those of all pixels that matter.
        let (from, to, level) = block;
        let mut inside = |r: &Value, axis: usize| {
            let begin = (from[axis] << level) as f32 + view.reach - view.half_size[axis];
            let end = ((to[axis] + 1) << level) as f32 - view.reach - view.half_size[axis];
            let reaches_end = (to[axis] + 1) << level >= view.size[axis] as u32;
            (from[axis] == 0 || c.surely_after(r, &w, &extents[axis], begin, w_min))
                && (reaches_end || c.surely_before(r, &w, &extents[axis], end, w_min))
        };
        inside(&x, 0) && inside(&y, 1)
    }

    /// `descend`.
    fn descends(
        &self,
        level: u32,
        [from, to]: [[u32; 2]; 2],
        [first, last]: [[u32; 2]; 2],
        p: &Projected,
        c: &mut Certificates<'_>,
    ) -> bool {
        let planes = self.fit_volume.then(|| c.supporting_planes(p, self.reversed));
        let mut left = self.view.descent_budget + (to[0] - from[0] + 1) * (to[1] - from[1] + 1);
        let mut waiting = vec![];
        let mut next = (level, from, to);
        loop {
            let (level, from, to) = next;
            for y in from[1]..=to[1] {
                for x in from[0]..=to[0] {
                    if left == 0 {
                        return false;
                    }
                    left -= 1;
                    let texels = &self.levels[level as usize];
                    let stored = texels.texels[(y * texels.width + x) as usize];
                    if self.surely_behind(stored, &p.z, &p.w, c) {
                        continue;
                    }
                    if let Some(planes) = &planes {
                        let begin = [0, 1].map(|k| ([x, y][k] << level).max(first[k]));
                        let end = [0, 1].map(|k| (([x, y][k] + 1) << level).min(last[k] + 1));
                        c.arithmetic.part();
                        let depth = self.occluding_depth(stored, c);
                        if c.surely_clear(planes, begin, end, depth, &self.view) {
                            continue;
                        }
                    }
                    if level == 0 || !self.descent {
                        return false;
                    }
                    waiting.push((level, [x, y]));
                }
            }
            let Some((level, parent)) = waiting.pop() else { return true };
            let corner = parent.map(|v| 2 * v);
            let level = level - 1;
            next = (
                level,
                [0, 1].map(|k| corner[k].max(first[k] >> level)),
                [0, 1].map(|k| (corner[k] + 1).min(last[k] >> level)),
            );
        }
    }

    /// `occluding_depth`.
    fn occluding_depth(&self, stored: f32, c: &mut Certificates<'_>) -> f32 {
        let stored = if self.reversed { stored.min(1.0) } else { stored.max(LEAST_NORMAL) };
        c.arithmetic.mul_add(stored, self.view.depth_factor, self.view.depth_offset)
    }

    fn farthest(&self, level: usize, from: [u32; 2], to: [u32; 2]) -> f32 {
        let texels = &self.levels[level];
        let mut depth = 1.0 - self.far();
        for y in from[1]..=to[1] {
            for x in from[0]..=to[0] {
                let d = texels.texels[(y * texels.width + x) as usize];
                depth = if self.reversed { depth.min(d) } else { depth.max(d) };
            }
        }
        depth
    }

    fn far(&self) -> f32 {
        if self.reversed { 0.0 } else { 1.0 }
    }

    fn surely_behind(&self, stored: f32, z: &Value, w: &Value, c: &mut Certificates<'_>) -> bool {
        let view = &self.view;
        c.arithmetic.part();
        let d = self.occluding_depth(stored, c);
        if self.reversed {
            return d >= LEAST_NORMAL && c.surely_deeper(-1.0, z, d, view.z_slope, w);
        }
        d < 1.0 && c.surely_deeper(1.0, z, d, view.z_slope, w)
    }
}

/// `pixel_interval`.
fn pixel_interval(extent: &Extent, per_w: f32, view: &View, axis: usize) -> [i32; 2] {
    let (half_size, edge) = (view.half_size[axis], view.size[axis] as f32);
    let rounding = 4.0 * EPS * half_size + view.reach;
    let low = extent.low - (extent.below * per_w + rounding) + half_size;
    let high = extent.high + (extent.above * per_w + rounding) + half_size;
    [low.floor().clamp(0.0, edge) as i32, high.floor().clamp(-1.0, edge - 1.0) as i32]
}

/// `certificate.wgsl`, for one kind of volume in one arithmetic.
struct Certificates<'a> {
    kind: BoundsKind,
    margins: Margins,
    arithmetic: &'a mut Arithmetic,
}

impl Certificates<'_> {
    fn value_of(&mut self, row: &Row, volume: &Volume) -> Value {
        let three = |v: [f32; 4]| [v[0], v[1], v[2]];
        self.arithmetic.part();
        let center = self.arithmetic.sum_of_products(three(row.m), volume.center, Some(row.m[3]));
        self.arithmetic.part();
        let half = volume.on_half_axes(three(row.m), self.arithmetic);
        self.arithmetic.part();
        let sizes = self.arithmetic.mul_add(volume.size, row.magnitude, row.constant_magnitude);
        let error = self.arithmetic.mul_add(self.margins.certificate * EPS, sizes, two_to(-70));
        Value { center, error, half }
    }

    fn error_bound(&mut self, r: &Value, t: f32, w: &Value) -> f32 {
        self.arithmetic.mul_add(t.abs(), w.error, r.error)
    }

    fn support(&mut self, half: [f32; 3]) -> f32 {
        match self.kind {
            BoundsKind::Sphere => self.arithmetic.sum_of_products(half, half, None).sqrt(),
            _ => self.arithmetic.sum(half.map(f32::abs)),
        }
    }

    fn exceeds_support(&mut self, center: f32, half: [f32; 3]) -> bool {
        self.arithmetic.part();
        match self.kind {
            BoundsKind::Sphere => {
                let squares = self.arithmetic.sum_of_products(half, half, None);
                let most = self.arithmetic.mul_add(squares, 1.000_001, two_to(-100));
                self.arithmetic.part();
                center > 0.0 && self.arithmetic.mul(center, center) > most
            }
            _ => center > self.support(half),
        }
    }

    /// `sign (r - t w) > 0` on the whole volume.
    fn surely(&mut self, sign: f32, r: &Value, t: f32, w: &Value) -> bool {
        self.arithmetic.part();
        let center = if self.arithmetic.takes_any_order() {
            let terms = [
                (sign * r.center, 1.0),
                (-sign * t, w.center),
                (-r.error, 1.0),
                (-t.abs(), w.error),
            ];
            self.arithmetic.sum_in_any_order(terms)
        } else {
            let difference = self.arithmetic.mul_add(-t, w.center, r.center);
            self.arithmetic.part();
            let error = self.error_bound(r, t, w);
            self.arithmetic.sub(sign * difference, error)
        };
        self.arithmetic.part();
        let half = [0, 1, 2].map(|k| self.arithmetic.mul_add(-t, w.half[k], r.half[k]));
        self.exceeds_support(center, half)
    }

    fn surely_beyond(&mut self, r: &Value, t: f32, w: &Value) -> bool {
        let r = r.signed(if r.center < 0.0 { -1.0 } else { 1.0 });
        if !self.arithmetic.style.margin_first {
            return self.surely_above(&r, t, w);
        }
        let error = self.error_bound(&r, t, w);
        let less = self.arithmetic.sub(r.center, error);
        let center = self.arithmetic.mul_add(-t, w.center, less);
        let half = [0, 1, 2].map(|k| self.arithmetic.mul_add(-t, w.half[k], r.half[k]));
        self.exceeds_support(center, half)
    }

    fn surely_above(&mut self, r: &Value, t: f32, w: &Value) -> bool {
        self.surely(1.0, r, t, w)
    }

    fn surely_below(&mut self, r: &Value, t: f32, w: &Value) -> bool {
        self.surely(-1.0, r, t, w)
    }

    /// `sign (z - (d - z_slope) w) > 0`; the difference is behind a bar, or folded.
    fn surely_deeper(&mut self, sign: f32, z: &Value, d: f32, z_slope: f32, w: &Value) -> bool {
        let t = self.arithmetic.sub(d, z_slope);
        if self.arithmetic.style.bars {
            return self.surely(sign, z, t, w);
        }
        let folded = self.arithmetic.mul_add(z_slope, w.center, z.center);
        let half = [0, 1, 2].map(|k| self.arithmetic.mul_add(z_slope, w.half[k], z.half[k]));
        let error = self.error_bound(z, t, w);
        let difference = self.arithmetic.mul_add(-d, w.center, folded);
        let center = self.arithmetic.sub(sign * difference, error);
        let half = [0, 1, 2].map(|k| self.arithmetic.mul_add(-d, w.half[k], half[k]));
        self.exceeds_support(center, half)
    }

    /// Pixel edges are multiples of 2^-8 below 2^16, so sums of them are exact in any arithmetic.
    fn between_samples(
        &mut self,
        r: &Value,
        w: &Value,
        first: i32,
        view: &View,
        axis: usize,
    ) -> bool {
        let left = first as f32 - view.half_size[axis];
        self.surely_above(r, left + view.reach, w) && self.surely_below(r, left - view.reach, w)
    }
}
