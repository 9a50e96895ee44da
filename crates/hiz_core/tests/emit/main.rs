//! Bins by mesh and level of detail: lists, draw arguments and their number.
//! Expectations come from loops over what each instance was made to be.

mod bins;
#[path = "../common/mod.rs"]
mod common;
mod engine;
mod expected;
mod faults;
mod lods;
mod refusals;
mod renderers;

use std::sync::Arc;

use hiz_core::headless::Engine;
use hiz_core::{
    ABSENT, Bounds, Camera, CullOptions, DepthConvention, DrawTemplate, Error, Floats,
    InstanceOptions, Instances, Lod, MeshLods, MeshTable, Pyramid, VertexDraw, Visible, wgpu,
};

use crate::common::{Random, camera_along_z, ndc, words_of};

const CONVENTION: DepthConvention = DepthConvention::Reversed;

/// The instances choose their own LOD: the whole part of their scale, at most the last one.
const LOD_OF_SCALE: (&str, &str) = (
    "scale: f32, count: u32) -> u32 {\n    return 0u;",
    "scale: f32, count: u32) -> u32 {\n    return min(u32(scale), count - 1u);",
);

/// A device, a camera and the pyramid of a wall at depth 4.
struct World {
    engine: Engine,
    camera: Camera,
    pyramid: Arc<Pyramid>,
}

impl World {
    fn new(faults: &[(&str, &str)]) -> Self {
        let faults = [&[LOD_OF_SCALE], faults].concat();
        let engine = Engine::with_planted_faults(None, &faults).expect("a Vulkan driver");
        let adapter = engine.adapter().to_string();
        eprintln!("adapter: {adapter}");
        if let Ok(expected) = std::env::var("HIZVK_EXPECT_ADAPTER") {
            assert!(adapter.to_lowercase().contains(&expected.to_lowercase()), "{adapter}");
        }
        let camera = camera_along_z(64, 64, CONVENTION);
        let wall = engine.upload_depth(&[ndc(4.0, CONVENTION); 64 * 64], &camera).unwrap();
        let pyramid = engine.pyramid(&wall).unwrap();
        Self { engine, camera, pyramid }
    }

    fn table(&self, lods: &[usize], indexed: bool) -> MeshTable {
        let draw = |m: usize, l: usize| {
            let (count, first) = ((100 * m + l + 1) as u32, (7 * m + l) as u32);
            let error = (l * (m + 1)) as f64;
            if indexed {
                let base_vertex = -(m as i32) - 1;
                let draw = DrawTemplate {
                    index_count: count,
                    first_index: first,
                    base_vertex,
                    ..Default::default()
                };
                Lod::new(draw, error)
            } else {
                Lod::new(VertexDraw { vertex_count: count, first_vertex: first }, error)
            }
        };
        let all: Vec<Vec<Lod>> =
            lods.iter().enumerate().map(|(m, n)| (0..*n).map(|l| draw(m, l)).collect()).collect();
        let meshes: Vec<_> = all.iter().map(|lods| MeshLods::new(lods)).collect();
        self.engine.context().create_mesh_table(&meshes).unwrap()
    }

    fn words(&self, buffer: &wgpu::Buffer) -> Vec<u32> {
        words_of(&self.engine, buffer)
    }

    fn cull(&self, crowd: &Crowd, visible: &Visible, options: &CullOptions) -> Result<(), Error> {
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = self.engine.device().create_command_encoder(&descriptor);
        let (hiz, instances) = (self.engine.context(), &crowd.instances);
        hiz.record_cull(&mut encoder, instances, &self.camera, &self.pyramid, visible, options)?;
        self.engine.queue().submit([encoder.finish()]);
        Ok(())
    }
}

/// What an instance is made to be.
#[derive(Debug, Clone, Copy)]
struct Made {
    mesh: u32,
    lod: u32,
    /// Before the wall; behind it otherwise.
    shows: bool,
}

impl Made {
    fn is_kept(&self) -> bool {
        self.shows && self.mesh != ABSENT
    }
}

struct Crowd {
    made: Vec<Made>,
    instances: Arc<Instances>,
    piece: usize,
}

impl Crowd {
    /// Without `with_ids`, all must have mesh 0 and LOD 0.
    fn new(world: &World, made: Vec<Made>, piece: Option<u32>, with_ids: bool) -> Self {
        let centers: Vec<f32> =
            made.iter().flat_map(|m| [0.0, 0.0, if m.shows { 2.0 } else { 8.0 }]).collect();
        let radii = vec![0.125_f32; made.len()];
        let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
        let ids: Vec<u32> = made.iter().map(|m| m.mesh).collect();
        let scales: Vec<f32> = made.iter().map(|m| m.lod as f32 + 0.5).collect();
        let options = InstanceOptions {
            piece_capacity: piece,
            mesh_ids: with_ids.then_some(&ids),
            scales: with_ids.then_some(Floats::F32(&scales)),
            ..InstanceOptions::default()
        };
        let instances = world.engine.instances(&bounds, &options).unwrap();
        let piece = piece.map_or(made.len().max(1), |piece| piece as usize);
        Self { made, instances, piece }
    }

    fn random(n: usize, lods: &[usize], share: f64, absent: f64, random: &mut Random) -> Vec<Made> {
        let make = |_| {
            let mesh = (random.unit() * lods.len() as f64) as usize;
            let lod = (random.unit() * lods[mesh] as f64) as u32;
            let mesh = if random.unit() < absent { ABSENT } else { mesh as u32 };
            Made { mesh, lod, shows: random.unit() < share }
        };
        (0..n).map(make).collect()
    }

    /// The indices of each piece.
    fn pieces(&self) -> Vec<std::ops::Range<usize>> {
        let n = self.made.len();
        (0..n.max(1)).step_by(self.piece).map(|first| first..n.min(first + self.piece)).collect()
    }

    /// What a piece keeps of one bin, ascending.
    fn bin(&self, piece: &std::ops::Range<usize>, mesh: u32, lod: u32) -> Vec<u32> {
        let is_in = |i: &usize| {
            let made = self.made[*i];
            made.is_kept() && made.mesh == mesh && made.lod == lod
        };
        piece.clone().filter(is_in).map(|i| i as u32).collect()
    }
}
