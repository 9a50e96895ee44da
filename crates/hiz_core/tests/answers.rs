//! The buffers of answers: one that is alive keeps its own, and one that was dropped lends its own.

mod common;

use std::sync::Arc;

use common::{Random, camera_along_z, engine, ndc};
use hiz_core::headless::{Culling, Engine};
use hiz_core::{
    Bounds, CullOptions, DepthConvention, Floats, Hierarchy, InstanceOptions, Instances, Outputs,
    Pyramid, Verdict,
};

const CONVENTION: DepthConvention = DepthConvention::Reversed;
const ASKED: Outputs = Outputs { mask: true, verdicts: true, ..Outputs::NONE };

/// Spheres of all sizes, in front of and behind walls at distances 4 to 16.
fn spheres(count: usize) -> (Vec<f32>, Vec<f32>) {
    let mut random = Random(3);
    let (mut centers, mut radii) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let z = random.range(2.0, 30.0);
        centers.extend([random.range(-z, z) as f32, random.range(-z, z) as f32, z as f32]);
        radii.push((z * random.unit().powi(3) * 0.3) as f32);
    }
    (centers, radii)
}

/// One engine with its instances, and pyramids of different walls.
struct World {
    engine: Engine,
    instances: Arc<Instances>,
    pyramids: Vec<Arc<Pyramid>>,
}

impl World {
    fn new(engine: &Engine, count: usize) -> Self {
        let (centers, radii) = spheres(count);
        let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
        let camera = camera_along_z(40, 30, CONVENTION);
        let pyramid = |wall: f32| {
            let image = vec![ndc(wall, CONVENTION); 40 * 30];
            engine.pyramid(&engine.upload_depth(&image, &camera).unwrap()).unwrap()
        };
        Self {
            engine: engine.clone(),
            instances: engine.instances(&bounds, &InstanceOptions::default()).unwrap(),
            pyramids: [4.0, 7.0, 11.0, 16.0].map(pyramid).into(),
        }
    }

    fn cull(&self, wall: usize, hierarchy: Hierarchy) -> Culling {
        let options = CullOptions { hierarchy, ..CullOptions::default() };
        let camera = camera_along_z(40, 30, CONVENTION);
        let Self { engine, instances, pyramids } = self;
        engine.cull(instances, &camera, &pyramids[wall], &options, &ASKED).unwrap()
    }
}

/// What a cull answers in a world of its own, without another one before it.
fn alone(wall: usize, count: usize, hierarchy: Hierarchy) -> (Vec<bool>, Vec<Verdict>) {
    let world = World::new(&engine(), count);
    let culling = world.cull(wall, hierarchy);
    (culling.mask().unwrap(), culling.verdicts().unwrap())
}

#[test]
fn answers_that_are_alive_stay_right() {
    for (count, hierarchy) in [(300, Hierarchy::Never), (300, Hierarchy::Always)] {
        let expected: Vec<_> = (0..4).map(|wall| alone(wall, count, hierarchy)).collect();
        assert!(expected.windows(2).all(|pair| pair[0].0 != pair[1].0), "the walls differ");
        let world = World::new(&engine(), count);
        let mut random = Random(7);
        let mut alive: Vec<(usize, Culling)> = Vec::new();
        for round in 0..60 {
            let wall = random.below(4) as usize;
            alive.push((wall, world.cull(wall, hierarchy)));
            // Some are read more than once, some in part, some never.
            if random.below(2) == 0 {
                let (wall, culling) = &alive[random.below(alive.len() as u32) as usize];
                let what = format!("{hierarchy:?} round {round} wall {wall}");
                match random.below(4) {
                    0 => assert!(culling.mask().unwrap() == expected[*wall].0, "{what}"),
                    1 => assert!(culling.verdicts().unwrap() == expected[*wall].1, "{what}"),
                    2 => {
                        let kept = expected[*wall].0.iter().filter(|kept| **kept).count();
                        assert_eq!(culling.indices().unwrap().len(), kept, "{what}");
                    }
                    _ => culling.wait().unwrap(),
                }
            }
            while alive.len() > 3 {
                alive.swap_remove(random.below(alive.len() as u32) as usize);
            }
        }
        for (wall, culling) in alive {
            assert!(culling.verdicts().unwrap() == expected[wall].1, "{hierarchy:?} wall {wall}");
            assert!(culling.mask().unwrap() == expected[wall].0, "{hierarchy:?} wall {wall}");
        }
    }
}

/// Handles that the caller took from an answer hold what that answer left there, also after it was
/// dropped.
#[test]
fn buffers_that_were_seen_are_not_lent_again() {
    let world = World::new(&engine(), 300);
    let culling = world.cull(0, Hierarchy::Never);
    let mask = culling.visible().mask(0).expect("asked for").clone();
    drop(culling);
    let later = world.cull(3, Hierarchy::Never);
    later.wait().unwrap();
    assert!(later.visible().mask(0).expect("asked for") != &mask);
}

/// Culls of the same instances and outputs make nothing, once the buffers are there.
#[test]
fn culls_in_a_loop_make_nothing() {
    let engine = Engine::new(None).unwrap();
    for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
        let world = World::new(&engine, 300);
        // More often in a row than a view needs to get a uniform of its own.
        (0..20).for_each(|_| drop(world.cull(0, hierarchy).mask().unwrap()));
        let before = engine.context().made();
        (0..50).for_each(|_| drop(world.cull(0, hierarchy).mask().unwrap()));
        assert_eq!(engine.context().made(), before, "{hierarchy:?}");
    }
}
