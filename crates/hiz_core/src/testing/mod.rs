//! What tests of this library need and its users do not: planted faults, the words on the device,
//! and the shaders.

pub mod lod;
pub mod shaders;
#[cfg(test)]
mod twins;
pub mod words;

pub use crate::gpu::made::Made;
pub use crate::occluders::host_raster::planted_fault::RasterFault;
pub use crate::occluders::surface::planted_fault::PlantedFault;
pub use crate::output::lists::CANARY_WORDS;
