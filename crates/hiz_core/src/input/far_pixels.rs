//! What an upload tells of pixels whose depth is far: for the nearest end of a pyramid.
//!
//! For the farthest end all of them are far, and nothing has to be told.
//! The nearest end counts what is no depth as near, and background as far.
//! Receivers leave out background.

use crate::input::image::DepthConvention;
use crate::input::tolerance::DepthTolerance;

/// What an upload tells of pixels that are far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum FarPixels {
    /// Nothing: what is no depth is far, too.
    Alike,
    /// What is no depth is NaN, and far is background: a measured depth is never exactly far.
    ///
    /// Background of the kinds `Z` and `Distance` is infinity, and what is surely beyond the far
    /// plane.
    ///
    /// With reversed Z it stops at 2^-126 instead.
    /// With standard Z it counts as no depth, so that the farthest end is what it was.
    NoDepthApart,
    /// The same, but a measured depth stops one float short of far with standard Z, too.
    ///
    /// Background of the kinds `Z` and `Distance` is NaN: it may be a receiver of shadows.
    BackgroundApart,
}

impl FarPixels {
    /// By how much a measured depth may be nearer than it was, since it stops short of far.
    ///
    /// With reversed Z that is 2^-126, which no comparison tells (`docs/accuracy.md`).
    pub(crate) fn tolerance(self, convention: DepthConvention) -> DepthTolerance {
        if self < Self::BackgroundApart || convention.is_reversed() {
            return DepthTolerance::NONE;
        }
        DepthTolerance { relative: 0.0, absolute: f64::from(1.0 - 1.0_f32.next_down()) }
    }
}
