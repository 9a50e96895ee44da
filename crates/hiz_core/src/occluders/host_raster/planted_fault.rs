//! Faults that tests plant into the rasteriser on the host.
//!
//! Without the feature `testing` nothing of them is compiled.

/// The fault that is planted, if any.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Planted(#[cfg(feature = "testing")] pub(crate) Option<RasterFault>);

/// Whether this fault is planted.
#[cfg(feature = "testing")]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {
        $planted.0 == Some($crate::occluders::host_raster::planted_fault::RasterFault::$fault)
    };
}

/// False: without the feature no fault can be planted.
#[cfg(not(feature = "testing"))]
macro_rules! is_planted {
    ($planted:expr, $fault:ident) => {{
        let _: $crate::occluders::host_raster::planted_fault::Planted = $planted;
        false
    }};
}
pub(super) use is_planted;

/// A way to make the rasteriser on the host wrong.
///
/// A test suite is trusted once a planted fault makes it fail.
#[cfg(feature = "testing")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RasterFault {
    /// A centre on an edge belongs to the triangles on both sides.
    EdgesOfBothSides,
    /// A centre on an edge belongs to neither side.
    EdgesOfNoSide,
    /// Depth is that of the plane through the rounded corners.
    PlaneOfRoundedCorners,
    /// The rounded corners say which way a face is turned.
    FacingOfRoundedCorners,
    /// Pixels may be nearer than the nearest corner.
    NoCap,
    /// Nearness below 0, beyond the far plane, is written.
    BeyondFar,
    /// A tile's farthest depth is taken at its middle.
    FarthestInTheMiddle,
    /// A box counts as hidden where its farthest point is hidden.
    BoxesByTheirFarthest,
    /// The farthest depth of a tile with pixels is that of its nearest pixel.
    RenewedTooNear,
    /// Quotients are carried from row to row without their remainders.
    RemaindersDropped,
    /// A cell keeps the farthest depth of one tile.
    CellOfOneTile,
    /// Vertices before the near plane count as if they were on it.
    NearUnclipped,
    /// Vertices far outside of the image are moved to the guard band's border.
    GuardClamped,
    /// Triangles are clipped with coordinates that float32 has rounded.
    ClippedInFloat32,
    /// Masks are one row too low.
    MasksShifted,
    /// Two planes are in order over all of a tile as they are at its first pixel.
    OrderOfOnePixel,
    /// A layer that is partly hidden keeps its whole mask.
    LayersOverlap,
    /// The way in which a triangle is drawn is chosen by its columns in a pane.
    WayByPane,
    /// Panes are written one tile too far to the left.
    PanesShifted,
    /// Mirrored copies keep their winding.
    MirrorsIgnored,
    /// Of closed parts the faces that are entered by are left out.
    EnteringLeftOut,
    /// All triangles count as those of closed parts.
    OpenCountsAsClosed,
    /// Closed parts are taken to be beyond the near plane, wherever they are.
    ClosedBeforeTheEye,
    /// Closed parts of mirrored copies keep their sense.
    ClosedIgnoreMirrors,
    /// Corners before they are rounded say whether a face leaves a closed part.
    SidesOfUnroundedCorners,
}
