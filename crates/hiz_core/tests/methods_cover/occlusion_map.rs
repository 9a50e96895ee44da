//! Hierarchical occlusion maps against loops over all pixels, exact fractions and rays.
//! Planted faults show that these tests can fail.

use std::collections::BTreeSet;

use hiz_core::methods::occlusion_map::fault::MapFault;
use hiz_core::methods::occlusion_map::{MapCull, MapOptions, OcclusionMap};
use hiz_core::{
    Bounds, Camera, Floats, ImageSize, MeshData, OccluderOptions, OccluderSurface, Pose,
    Projection, Verdict,
};

use crate::common::{CONVENTIONS, Random};

type Vec3 = [f64; 3];

/// A box that is turned about the vertical axis.
#[derive(Debug, Clone, Copy)]
struct Turned {
    center: Vec3,
    half: Vec3,
    cosine: f64,
    sine: f64,
}

impl Turned {
    fn rotation(&self) -> [f64; 9] {
        let Self { cosine: c, sine: s, .. } = *self;
        [c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c]
    }

    fn turn(&self, v: Vec3) -> Vec3 {
        let m = self.rotation();
        std::array::from_fn(|k| (0..3).map(|j| m[3 * k + j] * v[j]).sum())
    }

    fn turn_back(&self, v: Vec3) -> Vec3 {
        let m = self.rotation();
        std::array::from_fn(|k| (0..3).map(|j| m[3 * j + k] * v[j]).sum())
    }

    fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let u =
                std::array::from_fn(|k| self.half[k] * if i >> k & 1 == 1 { 1.0 } else { -1.0 });
            let turned = self.turn(u);
            std::array::from_fn(|k| self.center[k] + turned[k])
        })
    }

    /// Where a ray enters it, in multiples of its direction.
    fn entry(&self, from: Vec3, along: Vec3) -> Option<f64> {
        let start = self.turn_back(std::array::from_fn(|k| from[k] - self.center[k]));
        let along = self.turn_back(along);
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            let ends = [-self.half[k], self.half[k]].map(|h| (h - start[k]) / along[k]);
            enter = enter.max(ends[0].min(ends[1]));
            leave = leave.min(ends[0].max(ends[1]));
        }
        (enter < leave).then_some(enter)
    }
}

/// Occluders, what they may hide, and a view.
struct Scene {
    camera: Camera,
    eye: Vec3,
    /// To the right, up and into the view.
    axes: [Vec3; 3],
    tangent: [f64; 2],
    occluders: Vec<Turned>,
    things: Vec<Turned>,
    options: MapOptions,
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|k| a[k] - b[k])
}

const NEAR: f64 = 0.5;

fn scene(seed: u64) -> Scene {
    let mut random = Random(seed);
    let eye = [0; 3].map(|_| random.range(-1.0, 1.0) * random.pick(&[0.0, 10.0, 1e4]));
    let angle = random.range(-3.0, 3.0);
    let forward = [angle.sin(), 0.0, -angle.cos()];
    let axes = [[angle.cos(), 0.0, angle.sin()], [0.0, 1.0, 0.0], forward];
    let size = random.pick(&[(64_u32, 64_u32), (128, 64), (64, 128)]);
    let projection = Projection::Perspective {
        fov_y: 1.2,
        near: NEAR,
        far: random.pick(&[None, Some(100.0)]),
        convention: random.pick(&CONVENTIONS),
    };
    let target = std::array::from_fn(|k| eye[k] + forward[k]);
    let pose = Pose { eye, target, up: [0.0, 1.0, 0.0] };
    let camera = Camera::look_at(&pose, &projection, ImageSize::new(size.0, size.1)).unwrap();
    let tangent = 0.6_f64.tan();
    let mut turned = |near: f64, far: f64, small: f64, large: f64| {
        let z = random.range(near, far);
        let place = [random.range(-0.8, 0.8) * z, random.range(-0.7, 0.7) * z, z];
        let turn = random.range(0.0, 6.3);
        let center = |k: usize| eye[k] + (0..3).map(|a| axes[a][k] * place[a]).sum::<f64>();
        Turned {
            center: std::array::from_fn(center),
            half: [0; 3].map(|_| random.range(small, large)),
            cosine: turn.cos(),
            sine: turn.sin(),
        }
    };
    let occluders = (0..60).map(|_| turned(4.0, 20.0, 0.1, 1.2)).collect();
    let things = (0..300).map(|_| turned(-1.0, 60.0, 0.05, 1.5)).collect();
    let options = MapOptions { regions: 16, ..MapOptions::default() };
    let tangent = [tangent * f64::from(size.0) / f64::from(size.1), tangent];
    Scene { camera, eye, axes, tangent, occluders, things, options }
}

/// The triangles of a box from -1 to 1; which way they are turned does not matter.
fn cube() -> (Vec<f64>, Vec<u32>) {
    let corner = |i: usize, k: usize| if i >> k & 1 == 1 { 1.0 } else { -1.0 };
    let vertices = (0..8).flat_map(|i| (0..3).map(move |k| corner(i, k))).collect();
    let sides =
        [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 3, 6, 7], [0, 2, 4, 6], [1, 3, 5, 7]];
    (vertices, sides.iter().flat_map(|[a, b, c, d]| [*a, *b, *c, *b, *d, *c]).collect())
}

impl Scene {
    fn surface(&self) -> OccluderSurface {
        let (vertices, triangles) = cube();
        let transforms: Vec<f64> = self
            .occluders
            .iter()
            .flat_map(|one| {
                let m = one.rotation();
                let row = |k: usize| {
                    let scaled = |j: usize| m[3 * k + j] * one.half[j];
                    [scaled(0), scaled(1), scaled(2), one.center[k]]
                };
                [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]].concat()
            })
            .collect();
        let mesh = MeshData {
            vertices: Floats::F64(&vertices),
            triangles: &triangles,
            transforms: Some(Floats::F64(&transforms)),
        };
        OccluderSurface::from_meshes(&[mesh], &OccluderOptions::default()).unwrap()
    }

    fn map(&self, fault: Option<MapFault>) -> OcclusionMap {
        OcclusionMap::with_fault(&self.surface(), &self.camera, &self.options, fault).unwrap()
    }

    fn depth(&self, p: Vec3) -> f64 {
        dot(sub(p, self.eye), self.axes[2])
    }

    /// The rectangle of a box as parts of the image's sides; `None` if it crosses the near plane.
    fn rectangle(&self, one: &Turned) -> Option<[f64; 4]> {
        let mut found = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for p in one.corners() {
            let d = sub(p, self.eye);
            let z = self.depth(p);
            if z < NEAR {
                return None;
            }
            let x = 0.5 + 0.5 * dot(d, self.axes[0]) / z / self.tangent[0];
            let y = 0.5 - 0.5 * dot(d, self.axes[1]) / z / self.tangent[1];
            found = [found[0].min(x), found[1].min(y), found[2].max(x), found[3].max(y)];
        }
        Some(found)
    }

    fn cull(
        &self,
        map: &OcclusionMap,
        negligible_px: u32,
    ) -> hiz_core::methods::occlusion_map::MapSeen {
        let centers: Vec<f64> = self.things.iter().flat_map(|one| one.center).collect();
        let half_sizes: Vec<f64> = self.things.iter().flat_map(|one| one.half).collect();
        let rotations: Vec<f64> = self.things.iter().flat_map(Turned::rotation).collect();
        let bounds = Bounds::OrientedBoxes {
            centers: Floats::F64(&centers),
            half_sizes: Floats::F64(&half_sizes),
            rotations: Floats::F64(&rotations),
        };
        map.cull(&bounds, &MapCull { negligible_px, never: None }).unwrap()
    }
}

/// Each count is the sum over all pixels below it.
fn counts(seeds: std::ops::Range<u64>, fault: Option<MapFault>) -> Result<(), String> {
    for seed in seeds {
        let scene = scene(seed);
        let map = scene.map(fault);
        let depth = scene.surface().depth(&scene.camera).unwrap();
        let far = scene.camera.convention().far();
        let ImageSize { width, height } = scene.camera.size();
        for level in 0..map.num_levels() {
            let (size, found) = map.level(level);
            assert_eq!(size, ImageSize::new(width >> level, height >> level));
            let mut expected = vec![0; found.len()];
            for y in 0..height {
                for x in 0..width {
                    let covered = depth[(y * width + x) as usize] != far;
                    let pixel = (y >> level) * size.width + (x >> level);
                    expected[pixel as usize] += u32::from(covered);
                }
            }
            if found != expected {
                return Err(format!("seed {seed}: level {level} differs"));
            }
        }
        assert_eq!(
            map.level(map.num_levels() - 1).0.width.min(map.level(map.num_levels() - 1).0.height),
            4
        );
    }
    Ok(())
}

/// The least counts are the least whole numbers at or above the text's thresholds, as fractions.
fn thresholds(fault: Option<MapFault>) -> Result<(), String> {
    let map = scene(1).map(fault);
    for hole in [0_u128, 1, 4, 5, 16, 64, 1000] {
        let found = map.least_counts(hole as u32);
        // Opacity as a fraction: `none` until the hole is a sixteenth of a pixel at most.
        let mut opacity: Option<(u128, u128)> = None;
        for (level, least) in found.iter().enumerate() {
            let whole = 4_u128.pow(level as u32);
            opacity = match opacity {
                Some((n, d)) => Some((3 * d + n, 4 * d)),
                None if 16 * hole <= whole => Some((whole - hole, whole)),
                None => None,
            };
            let (n, d) = opacity.unwrap_or((1, 1));
            let expected = (whole * n).div_ceil(d);
            if u128::from(*least) != expected {
                return Err(format!("hole {hole}, level {level}: {least}, not {expected}"));
            }
        }
    }
    // The text's numbers: 2x2 of 8x8 pixels, and the level above.
    let found = map.least_counts(4);
    if [f64::from(found[3]) / 64.0, f64::from(found[4]) / 256.0] != [0.9375, 0.984_375] {
        return Err(format!("{found:?}"));
    }
    Ok(())
}

/// Each region holds the farthest corner of the boxes that meet it, and is infinite without one.
fn regions(seeds: std::ops::Range<u64>, fault: Option<MapFault>) -> Result<(), String> {
    for seed in seeds {
        let scene = scene(seed);
        let map = scene.map(fault);
        let (size, found) = map.estimate();
        let side = f64::from(size.width);
        for (number, found) in found.iter().enumerate() {
            let (row, column) = (number as u32 / size.width, number as u32 % size.width);
            // What surely meets the region, and what may.
            let (mut least, mut most) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
            for one in map.chosen().iter().map(|copy| &scene.occluders[*copy as usize]) {
                let depths = one.corners().map(|p| scene.depth(p));
                let farthest = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
                let rectangle = scene.rectangle(one).unwrap_or([0.0, 0.0, 1.0, 1.0]);
                let [x0, y0, x1, y1] = rectangle.map(|v| v * side);
                let meets = |spare: f64| {
                    x1 + spare > f64::from(column)
                        && x0 - spare < f64::from(column + 1)
                        && y1 + spare > f64::from(row)
                        && y0 - spare < f64::from(row + 1)
                };
                if meets(-1e-9) {
                    least = least.max(farthest);
                }
                if meets(1e-9) {
                    most = most.max(farthest);
                }
            }
            let close = 1e-6 * (1.0 + most.abs());
            let is_right = if *found == f64::INFINITY {
                least == f64::NEG_INFINITY
            } else {
                (least - close..=most + close).contains(found)
            };
            if !is_right {
                return Err(format!("seed {seed}, region {number}: {found}, not {least}..={most}"));
            }
        }
    }
    Ok(())
}

/// Verdicts and holes by loops over all pixels, for holes of several sizes.
fn verdicts(seeds: std::ops::Range<u64>, fault: Option<MapFault>) -> Result<(), String> {
    let mut hidden = [0; 4];
    for seed in seeds {
        let scene = scene(seed);
        let map = scene.map(fault);
        let ImageSize { width, height } = scene.camera.size();
        let (regions, estimate) = map.estimate();
        for (hidden, hole) in hidden.iter_mut().zip([0, 1, 4, 16]) {
            let least = map.least_counts(hole);
            let seen = scene.cull(&map, hole);
            for (number, one) in scene.things.iter().enumerate() {
                let Some(rectangle) = scene.rectangle(one) else {
                    if seen.verdicts[number] == Verdict::Occluded {
                        return Err(format!("seed {seed}: {number} crosses the near plane"));
                    }
                    continue;
                };
                let sides = [width, height, width, height].map(f64::from);
                let edges: [f64; 4] = std::array::from_fn(|k| rectangle[k] * sides[k]);
                let is_clear = edges.iter().all(|v| (v - v.round()).abs() > 1e-6);
                if !is_clear || seen.verdicts[number] == Verdict::Outside {
                    continue;
                }
                let pixel = |k: usize| edges[k].floor().clamp(0.0, sides[k] - 1.0) as u32;
                let [x0, y0, x1, y1] = [0, 1, 2, 3].map(pixel);
                let longer = (x1 - x0 + 1).max(y1 - y0 + 1);
                let first = (0..map.num_levels() - 1).find(|k| 1 << k >= longer);
                let first = first.unwrap_or(map.num_levels() - 1);
                let nearest =
                    one.corners().map(|p| scene.depth(p)).into_iter().fold(f64::INFINITY, f64::min);
                let (mut is_hidden, mut ended) = (true, BTreeSet::new());
                for y in y0..=y1 {
                    for x in x0..=x1 {
                        let opaque = (0..=first).rev().find(|k| {
                            let (size, counts) = map.level(*k);
                            let at = (y >> k) * size.width + (x >> k);
                            counts[at as usize] >= least[*k as usize]
                        });
                        match opaque {
                            Some(k) => drop(ended.insert((k, x >> k, y >> k))),
                            None => is_hidden = false,
                        }
                        let column = x * regions.width / width;
                        let row = y * regions.height / height;
                        is_hidden &= nearest > estimate[(row * regions.width + column) as usize];
                    }
                }
                let expected = if is_hidden { Verdict::Occluded } else { Verdict::Visible };
                if seen.verdicts[number] != expected {
                    return Err(format!("seed {seed}, hole {hole}: {number} is {expected:?}"));
                }
                let holes: u32 = ended
                    .into_iter()
                    .map(|(k, x, y)| {
                        let (size, counts) = map.level(k);
                        (1 << (2 * k)) - counts[(y * size.width + x) as usize]
                    })
                    .sum();
                if seen.holes[number] != if is_hidden { holes } else { 0 } {
                    return Err(format!("seed {seed}, hole {hole}: {number} has {holes} holes"));
                }
                *hidden += u32::from(is_hidden);
            }
        }
    }
    if fault.is_none() {
        assert!(hidden[0] > 20 && hidden[3] > hidden[0], "{hidden:?}");
    }
    Ok(())
}

/// With exact thresholds, no pixel's centre shows what was culled.
fn rays(seeds: std::ops::Range<u64>, fault: Option<MapFault>) -> Result<(), String> {
    let mut hidden = 0;
    for seed in seeds {
        let scene = scene(seed);
        let map = scene.map(fault);
        let seen = scene.cull(&map, 0);
        let culled: Vec<_> = (scene.things.iter().zip(&seen.verdicts))
            .filter(|(_, verdict)| **verdict == Verdict::Occluded)
            .collect();
        hidden += culled.len();
        let ImageSize { width, height } = scene.camera.size();
        for y in 0..height {
            for x in 0..width {
                let right =
                    ((f64::from(x) + 0.5) / f64::from(width) * 2.0 - 1.0) * scene.tangent[0];
                let up = (1.0 - (f64::from(y) + 0.5) / f64::from(height) * 2.0) * scene.tangent[1];
                let along: Vec3 = std::array::from_fn(|k| {
                    right * scene.axes[0][k] + up * scene.axes[1][k] + scene.axes[2][k]
                });
                // The rasteriser rounds corners to 1/256 pixel, so borders may move a little.
                let shift = 2.0 / 256.0 * 2.0 * scene.tangent[0] / f64::from(width);
                let nearest = [-shift, 0.0, shift]
                    .into_iter()
                    .flat_map(|dx| [-shift, 0.0, shift].map(|dy| (dx, dy)))
                    .flat_map(|(dx, dy)| {
                        let along: Vec3 = std::array::from_fn(|k| {
                            along[k] + dx * scene.axes[0][k] + dy * scene.axes[1][k]
                        });
                        let entry = move |one: &Turned| one.entry(scene.eye, along);
                        scene.occluders.iter().filter_map(entry)
                    })
                    .fold(f64::INFINITY, f64::min);
                for (thing, _) in &culled {
                    if thing.entry(scene.eye, along).is_some_and(|at| at >= NEAR && at < nearest) {
                        return Err(format!("seed {seed}: pixel {x}, {y} shows what was culled"));
                    }
                }
            }
        }
    }
    if fault.is_none() {
        assert!(hidden > 20, "{hidden}");
    }
    Ok(())
}

#[test]
fn counts_are_sums_over_all_pixels() {
    counts(0..8, None).unwrap();
}

#[test]
fn thresholds_are_those_of_exact_fractions() {
    thresholds(None).unwrap();
}

#[test]
fn regions_hold_the_farthest_corner() {
    regions(0..20, None).unwrap();
}

#[test]
fn verdicts_are_those_of_loops_over_all_pixels() {
    verdicts(0..20, None).unwrap();
}

#[test]
fn no_centre_shows_what_exact_thresholds_cull() {
    rays(0..6, None).unwrap();
}

#[test]
fn planted_faults_are_seen() {
    let seen_by = |fault| {
        let fault = Some(fault);
        counts(0..4, fault)
            .and_then(|()| thresholds(fault))
            .and_then(|()| regions(0..10, fault))
            .and_then(|()| verdicts(0..10, fault))
            .err()
    };
    for fault in [
        MapFault::AChildTwice,
        MapFault::Bytes,
        MapFault::ShareKept,
        MapFault::HoleInAnyLevel,
        MapFault::NearestVertex,
        MapFault::LastBox,
        MapFault::MiddleRegion,
        MapFault::ColumnDropped,
        MapFault::FirstPixel,
        MapFault::FarthestCorner,
    ] {
        let seen = seen_by(fault);
        eprintln!("{fault:?}: {seen:?}");
        assert!(seen.is_some(), "{fault:?}");
    }
    // Rays alone see that a cull is wrong.
    assert!(rays(0..6, Some(MapFault::FirstPixel)).is_err());
}

/// The largest and nearest are taken, those outside are not, and what does not fit is passed over.
#[test]
fn occluders_are_taken_by_size_and_distance() {
    let mut scene = scene(3);
    let at = |right: f64, z: f64, half: f64| Turned {
        center: std::array::from_fn(|k| {
            scene.eye[k] + right * scene.axes[0][k] + z * scene.axes[2][k]
        }),
        half: [half; 3],
        cosine: 1.0,
        sine: 0.0,
    };
    // Sizes by distance: 1/20, 1/5, 1/10, and one that is outside.
    scene.occluders =
        vec![at(0.0, 20.0, 1.0), at(0.0, 5.0, 1.0), at(0.0, 20.0, 2.0), at(900.0, 3.0, 1.0)];
    let chosen = |options: MapOptions| {
        let options = MapOptions { regions: 16, ..options };
        let map = OcclusionMap::new(&scene.surface(), &scene.camera, &options).unwrap();
        (map.chosen().to_vec(), map.num_triangles())
    };
    let all = MapOptions::default();
    assert_eq!(chosen(all), (vec![1, 2, 0], 36));
    assert_eq!(chosen(MapOptions { max_copies: Some(2), ..all }), (vec![1, 2], 24));
    assert_eq!(chosen(MapOptions { max_triangles: Some(35), ..all }), (vec![1, 2], 24));
    assert_eq!(chosen(MapOptions { max_triangles: Some(11), ..all }), (vec![], 0));
}

/// What is invalid is kept, what was drawn is never culled, and lengths are checked.
#[test]
fn named_outcomes() {
    let scene = scene(5);
    let map = scene.map(None);
    let bad = [f64::NAN, f64::INFINITY, 0.0];
    let centers: Vec<f64> = bad.iter().flat_map(|x| [*x, 0.0, 0.0]).collect();
    let spheres =
        Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&[1.0, 1.0, -1.0]) };
    let seen = map.cull(&spheres, &MapCull::default()).unwrap();
    assert_eq!(seen.verdicts, [Verdict::Invalid; 3]);
    let count = scene.things.len();
    let before = scene.cull(&map, 0);
    assert!(before.verdicts.contains(&Verdict::Occluded));
    let positions: Vec<f64> = scene.things.iter().flat_map(|one| one.center).collect();
    let points = Bounds::Points { positions: Floats::F64(&positions) };
    let never = vec![true; count];
    let options = MapCull { negligible_px: 0, never: Some(&never) };
    let kept = map.cull(&points, &options).unwrap();
    assert!(kept.verdicts.iter().all(|verdict| verdict.is_kept()));
    let short = MapCull { never: Some(&never[1..]), ..options };
    assert!(map.cull(&points, &short).unwrap_err().to_string().starts_with("never: expected 300"));
    for (size, options, text) in [
        ((60, 64), MapOptions::default(), "size: expected powers of two, got (height 64"),
        ((64, 64), MapOptions { least: 3, ..MapOptions::default() }, "least: expected a power"),
        ((32, 64), MapOptions::default(), "regions: expected a power of two up to 32, got 64"),
    ] {
        let camera = scene.camera.with_size(ImageSize::new(size.0, size.1)).unwrap();
        let error = OcclusionMap::new(&scene.surface(), &camera, &options).unwrap_err();
        assert!(error.to_string().starts_with(text), "{error}");
    }
}
