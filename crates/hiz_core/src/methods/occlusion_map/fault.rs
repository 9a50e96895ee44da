//! Faults that tests plant into occlusion maps.
//!
//! Without the feature `testing` nothing of them is compiled.

/// The fault that is planted, if any.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Planted(#[cfg(feature = "testing")] pub(super) Option<MapFault>);

/// Whether this fault is planted.
#[cfg(feature = "testing")]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {
        $planted.0 == Some($crate::methods::occlusion_map::fault::MapFault::$fault)
    };
}

/// False: without the feature no fault can be planted.
#[cfg(not(feature = "testing"))]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {{
        let _: $crate::methods::occlusion_map::fault::Planted = $planted;
        false
    }};
}
pub(super) use is_planted;

/// A way to make occlusion maps wrong.
///
/// A test suite is trusted once a planted fault makes it fail.
#[cfg(feature = "testing")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapFault {
    /// A pixel of a coarser map counts three of the four below it, and one of them twice.
    AChildTwice,
    /// Averages are rounded to bytes, as a texture of 8 bits would.
    Bytes,
    /// The hole of each level is four times that of the finer one, so that opacity stays.
    ShareKept,
    /// Levels below the first threshold take the hole as well.
    HoleInAnyLevel,
    /// A region holds the nearest vertex of the boxes.
    NearestVertex,
    /// A region holds the box that came last.
    LastBox,
    /// Regions are those of the middle of a box alone.
    MiddleRegion,
    /// The last column of the pixels of an instance is dropped.
    ColumnDropped,
    /// The test ends at the first opaque pixel.
    FirstPixel,
    /// The farthest corner of an instance is compared.
    FarthestCorner,
}
