//! Occluders: triangle meshes that hide other things.
//!
//! The data goes through these files:
//!
//! 1. `shapes` checks meshes and cuts them into `meshlets`, each mesh in its own space.
//!    `closed` finds the parts of a mesh that bound solids.
//!    `placement` says where the copies of a mesh stand.
//! 2. `drawing` says which copies are drawn, and `view` is a camera in the space of a copy.
//! 3. `host_raster` draws the meshes on the host, for devices that are processors.
//! 4. `surface` holds them on the host, and computes conservative depth from them in float64.
//! 5. `device_meshes` holds them on the device, and `uploaded` both.
//! 6. `device_raster` draws them on the device.
//! 7. `depth` is the image that the one rasteriser or the other draws into.
//!
//! The drawing is recorded into the caller's encoder; nothing here submits or reads back.

pub(crate) mod closed;
#[cfg(feature = "methods")]
pub(crate) mod copies;
pub(crate) mod depth;
mod device_meshes;
pub(crate) mod device_raster;
pub(crate) mod drawing;
pub(crate) mod host_raster;
pub(crate) mod meshlets;
pub(crate) mod placement;
pub(crate) mod shapes;
pub(crate) mod surface;
pub(crate) mod uploaded;
mod view;
