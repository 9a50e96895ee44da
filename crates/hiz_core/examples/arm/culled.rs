//! The culls, each beside what the rays see.

use std::sync::Arc;

use hiz_core::headless::Engine;
use hiz_core::{
    Bounds, BoundsKind, Camera, ConservativeDepthOptions, CullOptions, FaceCull, Floats, Hierarchy,
    ImageSize, InstanceOptions, Instances, MeshData, OccluderOptions, Outputs, Pyramid, Result,
};

use crate::moving::Mover;
use crate::scene::{self, OCCLUDER_SIZE};
use crate::truth::Rays;

/// Degrees by which the camera is turned; from most of these a plain image hides some that show.
pub(crate) const SIDES: [f64; 5] = [0.0, 32.5, 168.5, 212.5, 228.5];

/// How the occluders' depth image is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Depth {
    /// It holds for every larger picture.
    Conservative,
    /// It holds at the centres of its own pixels.
    Plain,
}

/// Culls beside the truth, added up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    pub(crate) tested: usize,
    pub(crate) kept: usize,
    /// Spheres with valid bounds that a ray meets before any prism.
    pub(crate) seen: usize,
    /// Those of them that were culled.
    pub(crate) false_culls: usize,
    /// Spheres with invalid bounds, and those of them that were culled.
    pub(crate) invalid: usize,
    pub(crate) invalid_culls: usize,
}

impl Tally {
    fn add(&mut self, spheres: &[[f32; 4]], kept: &[bool], rays: &Rays) {
        for (sphere, kept) in spheres.iter().zip(kept) {
            let is_valid = sphere.iter().all(|v| v.is_finite());
            let is_seen = is_valid && rays.see(*sphere);
            self.tested += 1;
            self.kept += usize::from(*kept);
            self.seen += usize::from(is_seen);
            self.false_culls += usize::from(is_seen && !kept);
            self.invalid += usize::from(!is_valid);
            self.invalid_culls += usize::from(!is_valid && !kept);
        }
    }
}

/// The pyramid of the prisms, as the camera sees them in 256x256 pixels.
fn pyramid(
    engine: &Engine,
    azimuth_deg: f64,
    picture: ImageSize,
    kind: Depth,
) -> Result<(Camera, Arc<Pyramid>)> {
    let (vertices, triangles) = scene::mesh(&scene::prisms());
    let vertices = Floats::F64(&vertices);
    let mesh = MeshData { vertices, triangles: &triangles, transforms: None };
    let options = OccluderOptions { cull_mode: FaceCull::Back };
    let occluders = engine.occluders(&[mesh], &options)?;
    let camera = scene::camera(azimuth_deg, picture, OCCLUDER_SIZE)?;
    let depth = match kind {
        Depth::Conservative => {
            let options = ConservativeDepthOptions::default();
            engine.render_depth_conservative(&occluders, &camera, &options)?
        }
        Depth::Plain => engine.render_depth(&occluders, &camera)?,
    };
    Ok((camera, engine.pyramid(&depth)?))
}

fn options() -> CullOptions {
    CullOptions { hierarchy: Hierarchy::Always, ..CullOptions::default() }
}

fn uploaded(engine: &Engine, spheres: &[[f32; 4]]) -> Result<Arc<Instances>> {
    let centers: Vec<f32> = spheres.iter().flat_map(|s| s[..3].to_vec()).collect();
    let radii: Vec<f32> = spheres.iter().map(|s| s[3]).collect();
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    engine.instances(&bounds, &InstanceOptions::default())
}

/// One cull of the spheres at rest.
pub(crate) fn at_rest(
    engine: &Engine,
    azimuth_deg: f64,
    picture: ImageSize,
    kind: Depth,
) -> Result<Tally> {
    let spheres = scene::spheres();
    let instances = uploaded(engine, &spheres)?;
    let (camera, pyramid) = pyramid(engine, azimuth_deg, picture, kind)?;
    let culling = engine.cull(&instances, &camera, &pyramid, &options(), &Outputs::default())?;
    let mut tally = Tally::default();
    let rays = Rays::new(azimuth_deg, picture, &scene::prisms());
    tally.add(&spheres, &culling.mask()?, &rays);
    Ok(tally)
}

/// Where the instances come from.
#[allow(dead_code, reason = "the example takes one way, its test both")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum From {
    /// The buffer: they are stored as the shader writes them.
    Buffer,
    /// The spheres at rest, on the host: they are stored along a curve through space.
    Host,
}

/// Frames in which a shader moves all spheres, seen from one side after the other.
pub(crate) fn moving(
    engine: &Engine,
    from: From,
    frames: u32,
    picture: ImageSize,
) -> Result<Tally> {
    let (device, queue) = (engine.device(), engine.queue());
    let spheres = scene::spheres();
    let mover = Mover::new(device, &spheres);
    let views = SIDES
        .map(|azimuth| pyramid(engine, azimuth, picture, Depth::Conservative))
        .into_iter()
        .collect::<Result<Vec<_>>>()?;
    let rays = SIDES.map(|azimuth| Rays::new(azimuth, picture, &scene::prisms()));
    let moved = |frame: u32| {
        let mut encoder = device.create_command_encoder(&Default::default());
        mover.record(device, &mut encoder, frame);
        queue.submit([encoder.finish()]);
    };
    moved(0);
    let count = spheres.len() as u32;
    let instances = match from {
        From::Buffer => engine.instances_from(&mover.bounds, BoundsKind::Sphere, count)?,
        From::Host => uploaded(engine, &spheres)?,
    };
    let mut tally = Tally::default();
    for frame in 1..=frames {
        moved(frame);
        engine.update_from(&instances, &mover.bounds)?;
        let side = frame as usize % SIDES.len();
        let (camera, pyramid) = &views[side];
        let culling = engine.cull(&instances, camera, pyramid, &options(), &Outputs::default())?;
        tally.add(&mover.read(device, queue), &culling.mask()?, &rays[side]);
    }
    Ok(tally)
}
