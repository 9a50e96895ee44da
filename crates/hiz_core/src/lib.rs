//! Certified hierarchical-Z occlusion culling on wgpu.
//!
//! The data flows one way.
//! Steps 1 to 6 are folders; each uses those before it, and `occluders` uses `pyramid`, too:
//!
//! 1. **Input** (`input`).
//!    A [`Camera`] describes in float64 what is seen.
//!    A [`DepthKind`] says what the numbers of a depth image mean, and [`Bounds`] say where the
//!    instances are.
//! 2. **Occluders** (`occluders`).
//!    [`Occluders`] are drawn into a depth texture, or the caller brings a depth texture.
//!    A host that draws makes the pyramid's levels as well ([`HostLevels`]).
//!    Their [`OccluderSurface`] makes a small depth image that also holds for larger images.
//! 3. **Pyramid** (`pyramid`).
//!    [`HizContext::record_reduce`] builds the [`Pyramid`]: for each level, the farthest depth of
//!    every block of pixels.
//! 4. **Instances** (`instances`).
//!    [`HizContext::record_instances`] uploads the bounds as [`Instances`], in groups of 64
//!    neighbours.
//! 5. **Output** (`output`).
//!    [`HizContext::create_visible`] makes the buffers of a [`Visible`], which the next step fills.
//! 6. **Cull** (`cull`).
//!    [`HizContext::record_cull`] tests the instances against the pyramid; if there are many, it
//!    tests whole groups first.
//!    The list of kept instances goes to [`Visible`].
//!    Its length is the `instance_count` of a [`DrawIndexedIndirect`] record on the device.
//! 7. **Draw**.
//!    The caller draws with [`Visible::draw_arguments`], and no number visits the CPU.
//!
//! [`HizContext`] in `context` is the face of these steps, and a Rust renderer starts there.
//! It only records into the caller's encoder on the caller's device: it never submits, polls or
//! maps.
//! [`headless`] is for programs without a renderer: it owns a device, submits, waits and reads
//! back.
//!
//! Two folders serve the others: `host` has arithmetic, memory and threads, and `gpu` makes objects
//! on the device.
//!
//! # The promise
//!
//! An instance is culled only if every pixel that its bounds can touch holds a depth nearer than
//! all of the bounds.
//! This holds for the exact real numbers that the inputs denote.
//! The cull proves it with *certificates*: float32 comparisons whose margins cover every rounding
//! (`shaders/cull/certificate.wgsl`).
//! Whatever they cannot prove stays visible.
//!
//! # Examples
//!
//! In a renderer, on its own device:
//!
//! ```
//! # use hiz_core::headless::Engine;
//! # use hiz_core::{Camera, DepthConvention, DrawIndexedIndirect, DrawTemplate, Floats, ImageSize};
//! # use hiz_core::{Bounds, Pose, Projection};
//! use hiz_core::{
//!     CullOptions, HizContext, InstanceOptions, Outputs, PyramidOptions, wgpu,
//! };
//! # let engine = Engine::new(None)?;
//! # let (device, queue) = (engine.device(), engine.queue());
//! # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
//! # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
//! # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
//! # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
//! # let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
//! # let depth = device.create_texture(&wgpu::TextureDescriptor {
//! #     label: None,
//! #     size: wgpu::Extent3d { width: 64, height: 64, depth_or_array_layers: 1 },
//! #     mip_level_count: 1,
//! #     sample_count: 1,
//! #     dimension: wgpu::TextureDimension::D2,
//! #     format: wgpu::TextureFormat::Depth32Float,
//! #     usage,
//! #     view_formats: &[],
//! # });
//! # let depth_view = depth.create_view(&wgpu::TextureViewDescriptor::default());
//! # let (centers, radii) = ([0.0, 0.0, -5.0, 0.0, 0.0, 5.0], [0.5, 0.5]);
//! # let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
//! # let draw = DrawTemplate { index_count: 36, ..DrawTemplate::default() };
//! # let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
//!
//! // Once:
//! let hiz = HizContext::new(device)?;
//! let pyramid = hiz.create_pyramid(camera.size(), &PyramidOptions::default())?;
//! let instances = hiz.record_instances(&mut encoder, &bounds, &InstanceOptions::default())?;
//! let visible = hiz.create_visible(&instances, &Outputs { draw, ..Outputs::default() })?;
//!
//! // Each frame, after the depth buffer was drawn:
//! hiz.record_reduce(&mut encoder, &depth_view, &camera, &pyramid)?;
//! let options = CullOptions::default();
//! hiz.record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)?;
//! // Now the renderer's own pass calls draw_indexed_indirect, and submits.
//! # queue.submit([encoder.finish()]);
//! # let (told, answer) = std::sync::mpsc::channel();
//! # let draws = visible.draw_arguments().unwrap().slice(..);
//! # wgpu::util::DownloadBuffer::read_buffer(device, queue, &draws, move |bytes| {
//! #     told.send(bytes.unwrap().to_vec()).unwrap();
//! # });
//! # engine.wait()?;
//! # // The depth buffer is empty: the sphere in front of the eye is kept, not the one behind it.
//! # let drawn = u32::from_ne_bytes(answer.recv().unwrap()[4..8].try_into().unwrap());
//! # assert_eq!(drawn, 1);
//! # Ok::<(), hiz_core::Error>(())
//! ```
//!
//! Without a renderer, on a device that the crate opens:
//!
//! ```
//! use hiz_core::headless::Engine;
//! use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
//! use hiz_core::{InstanceOptions, Outputs, Pose, Projection};
//!
//! let engine = Engine::new(None)?; // the best adapter, GPUs first
//! let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
//! let convention = DepthConvention::Reversed;
//! let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention };
//! let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 48))?;
//!
//! // A wall at view depth 10: with reversed Z and no far plane, NDC depth is near / view depth.
//! let pyramid = engine.pyramid(&engine.upload_depth(&[0.01; 64 * 48], &camera)?)?;
//!
//! // One sphere in front of the wall, one behind it.
//! let (centers, radii) = ([0.0, 0.0, -5.0, 0.0, 0.0, -20.0], [0.5, 0.5]);
//! let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
//! let instances = engine.instances(&bounds, &InstanceOptions::default())?;
//! let (options, outputs) = (CullOptions::default(), Outputs::default());
//! let culling = engine.cull(&instances, &camera, &pyramid, &options, &outputs)?;
//! assert_eq!(culling.mask()?, [true, false]);
//! # Ok::<(), hiz_core::Error>(())
//! ```
//!
//! The folder `examples` of the repository has two renderers, `simple` and `renderer`.

// Some items serve only a readback, so a build without `headless` never uses them.
#![cfg_attr(not(feature = "headless"), allow(dead_code))]

// The rooms, in the order of the data, but for `occluders`, which makes levels of pyramids.
// Each imports only from itself and from rooms declared before it; `tests/rooms.rs` checks that.
// Empty lines keep rustfmt from sorting them.
mod error;

mod host;

mod input;

mod gpu;

mod pyramid;

mod occluders;

mod instances;

mod output;

mod cull;

mod context;

#[cfg(feature = "headless")]
pub mod headless;

#[cfg(feature = "yardstick")]
pub mod yardstick;

#[cfg(feature = "methods")]
pub mod methods;

#[cfg(feature = "testing")]
pub mod testing;

pub use wgpu;

pub use context::HizContext;
pub use cull::among::{Among, AmongMask};
pub use cull::approximate::Approximate;
pub use cull::history::{EarlySet, Temporal};
pub use cull::lod::LodRule;
pub use cull::options::{Coverage, CullOptions, Fit, Footprint, Hierarchy, Order};
pub use cull::views::View;
pub use cull::warm_up::{WarmUp, WarmUpMore};
pub use error::{Error, Result};
pub use gpu::stage_times::{StageTime, StageTimer, StageTimesInFlight};
pub use host::linear::{Mat3, Mat4, Vec3};
pub use input::bounds::{Bounds, BoundsKind, Floats};
pub use input::camera::Camera;
pub use input::depth::{DepthInput, ndc_from_kind, ndc_from_kind_within, ndc_of};
pub use input::depth_kind::DepthKind;
pub use input::depth_numbers::DepthNumbers;
pub use input::image::{DepthConvention, ImageSize, MAX_IMAGE_SIDE};
pub use input::light::DirectionalLight;
pub use input::mesh::{FaceCull, MeshData};
pub use input::near_slack::NearSlack;
pub use input::projection::{Pose, Projection};
pub use input::seen_points::{ColourSums, ColourWeight, Colours, add_colours, depth_of_points};
pub use input::tolerance::DepthTolerance;
pub use input::view::ERROR_ULPS;
pub use input::world_tolerance::WorldTolerance;
pub use instances::from_buffer::BoundsBuffer;
pub use instances::order::StoredOrder;
pub use instances::slots::ABSENT;
pub use instances::{InstanceOptions, Instances};
pub use occluders::depth::OccluderDepth;
pub use occluders::device_raster::OCCLUDER_DEPTH_FORMAT;
pub use occluders::drawing::OccluderOptions;
pub use occluders::drawing::{DepthLoad, DrawOptions, Only, Rasteriser, Touched};
pub use occluders::surface::{ConservativeDepthOptions, OccluderSurface};
pub use occluders::uploaded::Occluders;
pub use output::draw::{DrawIndexedIndirect, DrawIndirect, DrawTemplate, VertexDraw};
pub use output::emit::{Emit, Placement};
pub use output::mesh_table::{Lod, LodDraw, MAX_LODS, MeshLods, MeshTable};
pub use output::outputs::Outputs;
pub use output::pixels::PixelCounts;
pub use output::readback::{Answer, AnswerInFlight, ReadbackRing};
pub use output::verdict::Verdict;
pub use output::views::{MAX_VIEWS, ViewsOutputs, VisibleViews};
pub use output::visible::Visible;
pub use pyramid::atlas::AtlasUse;
pub use pyramid::ends::{DepthEnd, Depths};
pub use pyramid::host_levels::HostLevels;
pub use pyramid::level_texels::LevelTexels;
pub use pyramid::levels::{MAX_LEVELS, StoredLevels};
pub use pyramid::mips::{MIP_CULL, MIP_LOOKUP};
pub use pyramid::mips::{MipDepths, MipLayout, MipLookup, MipOptions, MipTexture};
pub use pyramid::receiver_mask::{ReceiverMask, ReceiverMaskOptions};
pub use pyramid::resolve::{DepthResolve, ResolveOptions, ResolvedDepths};
pub use pyramid::source::DepthSource;
pub use pyramid::{Pyramid, PyramidOptions};

/// Compiles and runs the program in the README with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
mod readme {}

/// Compiles and runs the programs in the page for Rust with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/rust.md")]
mod rust_page {}
