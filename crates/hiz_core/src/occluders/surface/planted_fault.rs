//! Faults that tests plant into conservative depth: nothing of them is there without the feature
//! `testing`.

/// The fault that is planted, if any.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Planted(#[cfg(feature = "testing")] pub(crate) Option<PlantedFault>);

/// Whether this fault is planted.
#[cfg(feature = "testing")]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {
        $planted.0 == Some($crate::occluders::surface::planted_fault::PlantedFault::$fault)
    };
}

/// None is planted in a product.
#[cfg(not(feature = "testing"))]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {{
        let _: $crate::occluders::surface::planted_fault::Planted = $planted;
        false
    }};
}
pub(super) use is_planted;

/// A way to make [`OccluderSurface::conservative_depth`](crate::OccluderSurface::conservative_depth) wrong.
/// A suite is trusted once a planted fault turns it red.
#[cfg(feature = "testing")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlantedFault {
    /// Borders within a pixel do not spoil a sheet.
    ContoursIgnored,
    /// A triangle's depth at the pixel's centre counts for the whole pixel.
    DepthAtCentre,
    /// Projected vertices count as exact.
    NoWidening,
    /// Triangles on the same side of their edge count as neighbours on different ones.
    FoldsIgnored,
    /// Depths become the nearest float32.
    RoundedToNearest,
    /// What lies a little before the near plane counts, too.
    BeforeNear,
    /// A point is behind the near plane if float64 says so.
    NearPointsUnproved,
    /// Projected depths count as exact.
    DepthsExact,
    /// A triangle's corners have no error of their depth; its plane has.
    CornerDepthsExact,
    /// Points where edges are cut at the near plane count as exact.
    CutPointsExact,
    /// The side along the near plane counts as the edge that it was cut from.
    CutSidesJoined,
    /// A triangle faces as float64 says.
    FacingUnproved,
}
