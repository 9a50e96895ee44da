//! The classes of cases: what each of them fixes, while everything else stays random.

use hiz_core::{DepthConvention, ImageSize};

use crate::common::Random;

use super::scene::{DepthStyle, Settings};

/// One class of adversarial cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Class {
    /// Nothing is fixed: a little of everything.
    Random,
    /// Rectangles that end on pixel and texel borders, beside a column or row of holes.
    PixelBorders,
    /// Volumes from 1e-9 to 1e-2 pixels.
    Tiny,
    /// Volumes from ten to 1e5 images wide; the camera is inside some of them.
    Huge,
    /// Plates seen edge-on.
    Grazing,
    /// Volumes that touch the near plane, from either side.
    NearPlane,
    /// Images up to three times their width off the optical axis.
    OffCentre,
    /// Parallel rays.
    Orthographic,
    /// Reversed Z without a far plane.
    InfiniteReversed,
    /// far / near - 1 from 1e-4 to 1e-2.
    ThinRange,
    /// far / near from 1e4 to 1e8.
    DeepRange,
    /// The camera is 1e3 to 1e9 away from the world's origin.
    FarAway,
    /// Volumes outside the frustum that are nearly tangent to one of its planes.
    FrustumPlanes,
    /// Volumes whose nearest point has the stored depth, to within an ulp or far less.
    EqualDepth,
    /// Single pixels with nothing in them.
    Holes,
    /// Images of one row or column; pixels and volumes up to 1e4 times as wide as high.
    AspectRatios,
    /// Worlds from 1e-24 to 1e12 times the usual size, camera included.
    Scale,
    /// A matrix about the world's origin, whose camera is far away.
    /// Constants cancel at the eye, and the rows' error bounds have to include that.
    BareMatrix,
}

impl Class {
    /// All classes.
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

    /// Fixes what the class needs in settings that are random so far.
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
                // A near plane so close that float64's loss in the constants is large beside it.
                // The volumes are far behind it.
                // There no other part of a depth's margin covers that loss.
                // Without a far plane z and w lose the same amount.
                s.near = distance * 10.0_f64.powf(random.range(-13.0, -10.0));
                s.far = s.near * 10.0_f64.powf(random.range(4.0, 8.0));
                s.style = random.pick(&[DepthStyle::Equal, s.style]);
            }
        }
    }

    /// How many pixels a volume is wide, or high, in an image of `side` pixels.
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
