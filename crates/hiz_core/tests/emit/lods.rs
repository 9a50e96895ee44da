//! Levels of detail by their rules, and faults in the choice.

use hiz_core::{Bounds, CullOptions, Floats, Hierarchy, InstanceOptions, LodRule, Outputs};

use crate::common::{Random, ndc};
use crate::expected::emits;
use crate::{CONVENTION, World};

/// A device without planted faults but these, and an image in which nothing hides anything.
fn open_world(faults: &[(&str, &str)]) -> World {
    let world = World::new(faults);
    let far = world.engine.upload_depth(&[ndc(f32::INFINITY, CONVENTION); 64 * 64], &world.camera);
    let pyramid = world.engine.pyramid(&far.unwrap()).unwrap();
    World { pyramid, ..world }
}

/// The LODs of balls along the axis, by distance and by error, from their definitions.
/// With `camera_along_z`, w is view depth, so its least value on a ball is z - r.
/// The rows X' and Y' are 32 x and 32 y: the norm of the error's matrix is greatest in the corners,
/// `|[32 0 -32; 0 32 -32]| = sqrt(3072)`.
fn lods_by_rule(world: &World) -> Result<(), String> {
    const N: usize = 4000;
    let mut random = Random(7);
    let (pixels, stretch) = (4.0, 3072.0_f64.sqrt());
    let lods = [8, 3, 1, 5];
    let meshes = world.table(&lods, true);
    let mut instances = Vec::new();
    for _ in 0..N {
        let radius = 0.5 * random.unit();
        // A scale that leads to all LODs: their errors are 0, 1, 2 and so on.
        let scale = 0.05 + random.unit();
        let mesh = (random.unit() * lods.len() as f64) as usize;
        instances.push((1.0 + radius + 60.0 * random.unit(), radius, scale, mesh as u32));
    }
    let centers: Vec<f64> = instances.iter().flat_map(|i| [0.0, 0.0, i.0]).collect();
    let radii: Vec<f64> = instances.iter().map(|i| i.1).collect();
    let scales: Vec<f64> = instances.iter().map(|i| i.2).collect();
    let ids: Vec<u32> = instances.iter().map(|i| i.3).collect();
    let bounds = Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
    let options = InstanceOptions {
        mesh_ids: Some(&ids),
        scales: Some(Floats::F64(&scales)),
        ..InstanceOptions::default()
    };
    let uploaded = world.engine.instances(&bounds, &options).unwrap();
    let thresholds = vec![5.0, 10.0, 20.0, 30.0];
    let by_distance = LodRule::Distance { thresholds: thresholds.clone() };
    let mut used = std::collections::BTreeSet::new();
    for (rule, hierarchy) in [
        (by_distance.clone(), Hierarchy::Never),
        (by_distance, Hierarchy::Always),
        (LodRule::Error { pixels }, Hierarchy::Always),
    ] {
        for emit in emits(&meshes) {
            let options = CullOptions { lod: rule.clone(), hierarchy, ..CullOptions::default() };
            let outputs = Outputs { indices: true, emit, ..Outputs::NONE };
            let World { engine, camera, pyramid, .. } = world;
            let culling = engine.cull(&uploaded, camera, pyramid, &options, &outputs).unwrap();
            for (i, got) in culling.lods().unwrap().into_iter().enumerate() {
                let (z, radius, scale, mesh) = instances[i];
                // The rounding of the certificate may only choose a finer one, near a threshold.
                let lod_at = |w: f64| {
                    let is_allowed = |l: &usize| match &rule {
                        LodRule::Error { .. } => {
                            let error = (l * (mesh as usize + 1)) as f64;
                            w > error * scale * stretch / pixels
                        }
                        _ => thresholds.get(l - 1).is_some_and(|threshold| w > *threshold),
                    };
                    (1..lods[mesh as usize]).take_while(is_allowed).count() as u8
                };
                let w = z - radius;
                let (least, most) = (lod_at(w * (1.0 - 1e-4)), lod_at(w));
                if !(least..=most).contains(&got) {
                    return Err(format!("{rule:?}: {i} has LOD {got}, not {least}..={most}"));
                }
                used.insert(got);
            }
        }
    }
    assert_eq!(used, (0..8).collect(), "all levels occur");
    Ok(())
}

#[test]
fn lods_follow_the_rule() {
    lods_by_rule(&open_world(&[])).unwrap();
}

#[test]
fn faults_in_the_choice_of_lods_are_seen() {
    for (name, fault) in [
        ("the scale dropped", ("scale = bitcast<f32>(texel.z);", "")),
        (
            "the group's first member",
            ("lod_of(load_volume(place)", "lod_of(load_volume(place & ~63u)"),
        ),
        ("the errors of mesh 0", ("mesh, scale, lods_of(mesh)", "0u, scale, lods_of(mesh)")),
        ("the number of LODs", ("scale, lods_of(mesh)", "scale, 8u")),
        ("the second four errors", ("let k = 1u + (l >> ERRORS_LOG2);", "let k = 1u;")),
    ] {
        let seen = std::panic::catch_unwind(|| lods_by_rule(&open_world(&[fault])));
        assert!(!matches!(seen, Ok(Ok(()))), "{name}: nothing shows it");
    }
}
