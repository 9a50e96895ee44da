//! Intel's castle: 1,999 meshes of a million triangles, and walls that hide them.
//!
//! Its data is Intel's (Apache-2.0), and not part of this repository.
//! `scripts/view.sh` unpacks it to the folder that `$HIZVK_CASTLE` names.

use std::collections::BTreeMap;
use std::path::PathBuf;

use hiz_core::{LodRule, Vec3};

use crate::Failure;
use crate::mesh::{Mesh, cross, sub, unit};
use crate::scene::npy;
use crate::scene::{Body, Kind, Leg, Scene, boxes};

/// The side of a cell that walls are cut into, in metres.
const CELL: f64 = 10.0;

/// The folder with the castle's arrays.
pub(crate) const FOLDER: &str = "HIZVK_CASTLE_FOLDER";

/// The scene.
///
/// # Errors
/// If the data is not there; the text says how it comes there.
pub(crate) fn scene() -> Result<Scene, Failure> {
    let folder = PathBuf::from(std::env::var_os(FOLDER).ok_or_else(|| {
        format!(
            "the castle is not there: {FOLDER} names no folder with castle.npz unpacked in it; \
             HIZVK_CASTLE=castle.npz make view ARGS='--scene castle' unpacks it first"
        )
    })?);
    let array = |name: &str| npy::read(&folder.join(format!("{name}.npy")));
    let points = |name: &str| -> Result<Vec<Vec3>, Failure> {
        Ok(array(name)?.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
    };
    let vertices = points("instance_vertices")?;
    let triangles = points("instance_triangles")?;
    let first = array("instance_first_triangle")?;
    let (mut kinds, mut bodies) = (Vec::new(), Vec::new());
    for (number, range) in first.windows(2).enumerate() {
        let triangles = &triangles[range[0] as usize..range[1] as usize];
        kinds.push(Kind::of(one_mesh(&vertices, triangles, shade(number))));
        bodies.push(Body::at(number as u32, [0.0; 3], false));
    }
    let owners = array("occluder_instance")?;
    let triangles = points("occluder_triangles")?;
    // Those of an instance lie inside of it, and the others are walls that are seen.
    let walls = triangles.iter().zip(&owners).filter(|(_, owner)| **owner < 0.0);
    for part in in_cells(&points("occluder_vertices")?, walls.map(|(t, _)| *t)) {
        bodies.push(Body::at(kinds.len() as u32, [0.0; 3], true));
        kinds.push(Kind::of(part));
    }
    let volumes = boxes(&kinds, &bodies);
    let [eyes, targets] = [points("camera_eye")?, points("camera_target")?];
    let fov_y = array("camera_fov_y")?;
    // The cameras of the commonest angle stand for all, because a scene has one.
    let legs: Vec<_> = eyes
        .iter()
        .zip(&targets)
        .zip(&fov_y)
        .filter(|(_, fov)| **fov == fov_y[0])
        .map(|((eye, target), _)| Leg {
            eyes: [*eye, [0, 1, 2].map(|k| eye[k] + 0.05 * (target[k] - eye[k]))],
            targets: [*target; 2],
        })
        .take(8)
        .collect();
    Ok(Scene {
        name: "castle",
        kinds,
        bodies,
        volumes,
        rule: LodRule::Error { pixels: 1.0 },
        legs,
        fov_y: fov_y[0],
        near: 0.1,
        far: None,
        speed: 8.0,
    })
}

/// Triangles with flat normals as one mesh.
fn one_mesh(vertices: &[Vec3], triangles: &[Vec3], colour: [f32; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    for triangle in triangles {
        let corners = triangle.map(|index| vertices[index as usize]);
        let [a, b, c] = corners;
        let normal = unit(cross(sub(b, a), sub(c, a)));
        for corner in corners {
            let index = mesh.push(corner, normal, colour);
            mesh.indices.push(index);
        }
    }
    mesh
}

/// Triangles as one mesh per cell of a grid, so that walls hide walls.
fn in_cells(vertices: &[Vec3], triangles: impl Iterator<Item = Vec3>) -> Vec<Mesh> {
    let mut cells: BTreeMap<[i64; 3], Vec<Vec3>> = BTreeMap::new();
    for triangle in triangles {
        let corner = vertices[triangle[0] as usize];
        cells.entry(corner.map(|v| (v / CELL).floor() as i64)).or_default().push(triangle);
    }
    cells.values().map(|part| one_mesh(vertices, part, [0.62, 0.58, 0.5])).collect()
}

/// A colour of stone that differs between neighbours.
fn shade(number: usize) -> [f32; 3] {
    let spread = |k: usize| ((number * 7919 + k * 104_729) % 97) as f32 / 97.0;
    let light = 0.55 + 0.3 * spread(0);
    [light, light * (0.86 + 0.1 * spread(1)), light * (0.72 + 0.16 * spread(2))]
}
