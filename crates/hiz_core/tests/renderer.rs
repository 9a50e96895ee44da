//! The example renderer: with culling and without, pixel for pixel; and how much slack a driver's depth needs for that.

mod common;
#[path = "../examples/renderer/renderer.rs"]
mod renderer;
#[path = "../examples/renderer/scene.rs"]
mod scene;

use common::{CONVENTIONS, Random};
use hiz_core::{Camera, ImageSize, Pose, Projection};
use renderer::{Culled, Picture, Renderer, Town, depth_slack};
use scene::{Block, ORIGINS, Scene, Shot, shots};

/// A row of 321 pixels is padded where it is copied.
const SIZES: [(u32, u32); 2] = [(640, 360), (321, 203)];

fn open(faults: &[(&str, &str)]) -> Renderer {
    let renderer = Renderer::open(faults).expect("the device tests need a Vulkan driver");
    let adapter = format!("{} ({} {})", renderer.adapter.name, renderer.adapter.driver, renderer.adapter.driver_info);
    eprintln!("adapter: {adapter}");
    if let Ok(expected) = std::env::var("HIZVK_EXPECT_ADAPTER") {
        assert!(
            adapter.to_lowercase().contains(&expected.to_lowercase()),
            "expected the adapter {expected}, got {adapter}"
        );
    }
    renderer
}

/// Draws every shot with culling and without.
fn draw_each(renderer: &Renderer, shots: &[Shot], mut look: impl FnMut(&Shot, &Scene, &Picture, &Culled)) {
    let scenes = ORIGINS.map(Scene::new);
    let towns: Vec<Town> = scenes.iter().map(|scene| renderer.build(scene).unwrap()).collect();
    for shot in shots {
        let town = &towns[shot.town];
        look(shot, &scenes[shot.town], &renderer.draw_all(town, shot), &renderer.draw_culled(town, shot).unwrap());
    }
}

/// The example's cameras.
fn example_shots() -> Vec<Shot> {
    SIZES.iter().flat_map(|(width, height)| shots(ImageSize::new(*width, *height)).unwrap()).collect()
}

/// Random cameras that look along an axis: faces come out edge-on, where a rasteriser errs the most, or parallel to the
/// image, where depths tie.
fn straight_shots() -> Vec<Shot> {
    let mut random = Random(3);
    let shot = |_| {
        let forward = random.pick(&[[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]);
        let at = [random.range(-75.0, 75.0), random.range(0.1, 30.0), random.range(-75.0, 75.0)];
        let town = random.below(2) as usize;
        let eye = [0, 1, 2].map(|k| at[k] + ORIGINS[town][k]);
        let pose = Pose { eye, target: [0, 1, 2].map(|k| eye[k] + 7.0 * forward[k]), up: [0.0, 1.0, 0.0] };
        let projection = Projection::Perspective {
            fov_y: random.range(0.3, 2.0),
            near: 10.0_f64.powf(random.range(-3.0, 0.0)),
            far: None,
            convention: random.pick(&CONVENTIONS),
        };
        let camera = Camera::look_at(&pose, &projection, ImageSize::new(SIZES[1].0, SIZES[1].1)).unwrap();
        Shot { name: "straight", camera, town, crowd_occludes: random.below(3) == 0 }
    };
    (0..60).map(shot).collect()
}

#[test]
fn pictures_with_culling_equal_those_without() {
    draw_each(&open(&[]), &example_shots(), |shot, scene, all, culled| {
        let (name, size, counts) = (shot.name, shot.camera.size(), culled.counts);
        assert_eq!(all.differing_pixels(&culled.picture), 0, "{name} {size}");
        assert_eq!(counts.drawn, counts.kept, "{name} {size}");
        assert_eq!(counts.kept + counts.occluded + counts.outside, scene.crowd);
        // Equal pictures prove nothing where nothing is hidden or nobody is seen.
        assert!(counts.kept < scene.crowd / 2 && counts.occluded > scene.crowd / 8, "{name} {size}: {counts:?}");
        assert!(all.ids.iter().any(|id| (1..=scene.crowd).contains(id)), "{name} {size}: an empty street");
    });
}

#[test]
fn so_do_those_of_random_straight_cameras() {
    draw_each(&open(&[]), &straight_shots(), |shot, _, all, culled| {
        assert_eq!(all.differing_pixels(&culled.picture), 0, "{:?}", shot.camera);
    });
}

/// Cameras whose pictures differ, with the pixels that do.
fn with_fault(what: &str, by: &str) -> Vec<(&'static str, usize)> {
    let mut differing = Vec::new();
    let shots = shots(ImageSize::new(SIZES[1].0, SIZES[1].1)).unwrap();
    draw_each(&open(&[(what, by)]), &shots, |shot, _, all, culled| {
        differing.push((shot.name, all.differing_pixels(&culled.picture)));
    });
    differing.retain(|(_, pixels)| *pixels > 0);
    eprintln!("{by}: {differing:?}");
    differing
}

/// The comparison would see a false cull: the pyramid holds the nearest depth instead of the farthest.
#[test]
fn a_pyramid_upside_down_is_seen() {
    let swapped = with_fault("select(max(a, b), min(a, b), REVERSED)", "select(min(a, b), max(a, b), REVERSED)");
    assert!(swapped.len() >= 6, "{swapped:?}");
}

/// And a single box that the draw forgets: the last of each list.
#[test]
fn a_forgotten_box_is_seen() {
    let forgotten = with_fault(
        "instance_count = min(sums[lane], room());",
        "instance_count = max(1u, min(sums[lane], room())) - 1u;",
    );
    assert!(!forgotten.is_empty());
}

/// A box's least and greatest depth in float64; nothing if it crosses the near plane.
fn depth_range(block: &Block, camera: &Camera) -> Option<[f64; 2]> {
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for corner in 0..8 {
        let d: [f64; 3] =
            [0, 1, 2].map(|k| if corner >> k & 1 == 0 { block.min[k] } else { block.max[k] } - camera.origin()[k]);
        let [_, _, z, w] = camera.rows().map(|r| r[0] * d[0] + r[1] * d[1] + r[2] * d[2] + r[3]);
        if w <= 0.0 || z < 0.0 || z > w {
            return None;
        }
        range = [range[0].min(z / w), range[1].max(z / w)];
    }
    Some(range)
}

/// What [`depth_slack`] has to cover. A culled box lies behind the prepass exactly; it stays unseen only if its own rasterised
/// depth comes out no nearer than its bounds, and the walls' no farther than in the prepass, both up to the slack together.
/// The same keeps a box from being hidden by itself.
#[test]
fn the_slack_covers_the_driver() {
    let renderer = open(&[]);
    // For standard and reversed depth.
    let mut worst = [[0.0_f64; 2]; 2];
    let all_shots: Vec<_> = example_shots().into_iter().chain(straight_shots()).collect();
    draw_each(&renderer, &all_shots, |shot, scene, all, culled| {
        let reversed = shot.camera.convention().is_reversed();
        let ranges: Vec<_> = scene.blocks.iter().map(|block| depth_range(block, &shot.camera)).collect();
        // How much nearer `b` is than `a`, relative.
        let nearer = |a: f64, b: f64| if reversed { 1.0 - a / b } else { a / b - 1.0 };
        let [boxes, walls] = &mut worst[usize::from(reversed)];
        for ((id, depth), prepass) in all.ids.iter().zip(&all.depth).zip(&culled.prepass) {
            let (depth, prepass) = (f64::from(*depth), f64::from(*prepass));
            if *id > scene.crowd || (*id > 0 && shot.crowd_occludes) {
                *walls = walls.max(nearer(depth, prepass));
            }
            if (1..=scene.crowd).contains(id)
                && let Some([least, greatest]) = ranges[*id as usize - 1]
            {
                *boxes = boxes.max(nearer(if reversed { greatest } else { least }, depth));
            }
        }
    });
    for (convention, [boxes, walls]) in CONVENTIONS.into_iter().zip(worst) {
        let slack = depth_slack(&renderer.adapter, convention);
        eprintln!(
            "{convention:?}: boxes {boxes:.2e} nearer than their bounds, walls {walls:.2e} farther than in the prepass"
        );
        assert!((1.0 + boxes) * (1.0 + walls) <= 1.0 + slack, "{convention:?}: slack {slack:e}");
    }
}
