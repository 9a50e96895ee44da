//! The classes of cases: what each of them insists on, while everything else stays random.

use hiz_core::{DepthConvention, ImageSize};

use crate::common::Random;

use super::scene::{DepthStyle, Settings};

/// One class of adversarial cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Class {
    /// Nothing in particular: a little of everything.
    Random,
    /// Rectangles that end on pixel and texel borders, beside a column or row of holes.
    PixelBorders,
    /// Volumes from 1e-9 to 1e-2 pixels.
    Tiny,
    /// Volumes from ten to 1e5 images wide, the camera inside of some.
    Huge,
    /// Plates seen edge-on.
    Grazing,
    /// Volumes that touch the near plane, from either side.
    NearPlane,
    /// Images up to three times their width beside the optical axis.
    OffCentre,
    /// Parallel rays.
    Orthographic,
    /// Reversed Z without a far plane.
    InfiniteReversed,
    /// far / near - 1 from 1e-4 to 1e-2.
    ThinRange,
    /// far / near from 1e4 to 1e8.
    DeepRange,
    /// The camera 1e3 to 1e9 from the world's origin.
    FarAway,
    /// Volumes nearly tangent to a plane of the frustum, from outside.
    FrustumPlanes,
    /// Volumes whose nearest point has the stored depth, to within an ulp and much less.
    EqualDepth,
    /// Single pixels that are seen through.
    Holes,
    /// Images of one row or column, pixels and volumes up to 1e4 times as wide as high.
    AspectRatios,
    /// Worlds from 1e-24 to 1e12 units across, the unit of the camera being 1.
    Scale,
    /// A matrix about the world's origin, its camera far away: constants cancel at the eye, and the
    /// rows have to own up to it.
    BareMatrix,
}

impl Class {
    /// All of them.
    pub(crate) const ALL: [Self; 18] = [
        Self::Random,
        Self::PixelBorders,
        Self::Tiny,
        Self::Huge,
        Self::Grazing,
        Self::NearPlane,
        Self::OffCentre,
        Self::Orthographic,
        Self::InfiniteReversed,
        Self::ThinRange,
        Self::DeepRange,
        Self::FarAway,
        Self::FrustumPlanes,
        Self::EqualDepth,
        Self::Holes,
        Self::AspectRatios,
        Self::Scale,
        Self::BareMatrix,
    ];

    /// What the class insists on, said to settings that are random so far.
    pub(super) fn insist(self, s: &mut Settings, random: &mut Random) {
        match self {
            Self::Random | Self::Tiny | Self::Huge => {}
            Self::PixelBorders => s.style = random.pick(&[DepthStyle::Column, DepthStyle::Row]),
            Self::Grazing => {
                s.style = random.pick(&[DepthStyle::Column, DepthStyle::Row, DepthStyle::Far]);
            }
            Self::NearPlane => s.style = random.pick(&[DepthStyle::Far, DepthStyle::Near]),
            Self::OffCentre => {
                s.middle = [0, 1]
                    .map(|k| random.pick(&[-3.0, -1.0, 1.0, 3.0]) * random.unit() * s.half[k]);
            }
            Self::Orthographic => s.orthographic = true,
            Self::InfiniteReversed => {
                s.orthographic = false;
                s.far = f64::INFINITY;
                s.convention = DepthConvention::Reversed;
            }
            Self::ThinRange => s.far = s.near * (1.0 + 10.0_f64.powf(random.range(-4.0, -2.0))),
            Self::DeepRange => s.far = s.near * 10.0_f64.powf(random.range(4.0, 8.0)),
            Self::FarAway => s.stand_away(10.0_f64.powf(random.range(3.0, 9.0)), random),
            Self::FrustumPlanes => s.style = DepthStyle::Far,
            Self::EqualDepth => s.style = DepthStyle::Equal,
            Self::Holes => s.style = DepthStyle::Pixel,
            Self::AspectRatios => {
                let side = 1 + random.below(600);
                s.size = random.pick(&[ImageSize::new(1, side), ImageSize::new(side, 1), s.size]);
                let stretch = 10.0_f64.powf(random.range(-2.0, 2.0));
                s.half = [s.half[0] * stretch, s.half[1] / stretch];
            }
            Self::Scale => {
                s.stand_away(0.0, random);
                let scale = 10.0_f64.powf(random.range(-24.0, 12.0));
                (s.near, s.far) = (s.near * scale, s.far * scale);
                if s.orthographic {
                    (s.half, s.middle) = (s.half.map(|v| v * scale), s.middle.map(|v| v * scale));
                }
            }
            Self::BareMatrix => {
                s.bare_matrix = true;
                let distance = 10.0_f64.powf(random.range(0.0, 9.0));
                s.stand_away(distance, random);
                // A near plane so close that what float64 lost in the constants is large beside it,
                // and volumes far behind it: there nothing else in the margin of a depth covers
                // that.
                // (Without a far plane z and w lose the same.)
                s.near = distance * 10.0_f64.powf(random.range(-13.0, -10.0));
                s.far = s.near * 10.0_f64.powf(random.range(4.0, 8.0));
                s.style = random.pick(&[DepthStyle::Equal, s.style]);
            }
        }
    }

    /// How many pixels a volume is wide, or high, in an image of `side`.
    pub(super) fn extent(self, side: u32, random: &mut Random) -> f64 {
        match self {
            Self::Tiny => 10.0_f64.powf(random.range(-9.0, -2.0)),
            Self::Huge => f64::from(side) * 10.0_f64.powf(random.range(1.0, 5.0)),
            Self::AspectRatios => 10.0_f64.powf(random.range(-4.0, 2.0)),
            _ => {
                random.pick(&[0.0, 0.01, 0.5, 1.0, 2.0, 4.0])
                    + f64::from(random.below(side + 1)) * random.unit()
            }
        }
    }
}
