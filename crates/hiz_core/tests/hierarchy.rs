//! Hierarchical visibility against the rasteriser without skipping, and against loops of this file.
//! Planted faults show that these tests can fail.
//! No device is needed.

mod common;

use common::{CONVENTIONS, Random};
use hiz_core::methods::hierarchy::{
    HierarchicalVisibility, HierarchyFault, HierarchyFrame, HierarchyOptions, NodeState,
};
use hiz_core::yardstick::HostRaster;
use hiz_core::{
    Camera, DepthConvention, FaceCull, Floats, ImageSize, MeshData, OccluderOptions,
    OccluderSurface, Pose, Projection,
};

/// A mesh with its places.
#[derive(Debug, Clone, Default)]
struct Model {
    vertices: Vec<f64>,
    triangles: Vec<u32>,
    transforms: Option<Vec<f64>>,
}

/// A bumpy sheet of `n` x `n` squares over -1..1, so of 2 n^2 triangles.
fn sheet(random: &mut Random, n: u32, rough: f64) -> Model {
    let at = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
    let mut model = Model::default();
    for row in 0..=n {
        for column in 0..=n {
            model.vertices.extend([at(column), at(row), random.range(-rough, rough)]);
        }
    }
    for row in 0..n {
        for column in 0..n {
            let a = row * (n + 1) + column;
            model.triangles.extend([a, a + 1, a + n + 1, a + n + 1, a + 1, a + n + 2]);
        }
    }
    model
}

/// A place before a camera that looks along -z: turned, scaled, sometimes mirrored or sheared.
fn place(random: &mut Random, offset: f64) -> [f64; 16] {
    let depth = random.range(3.0, 40.0);
    let [x, y] = [0; 2].map(|_| random.range(-0.9, 0.9) * depth);
    let (sin, cos) = random.range(0.0, 6.0).sin_cos();
    let scale = random.pick(&[0.3, 1.0, 2.0, 9.0]);
    let mirror = random.pick(&[1.0, 1.0, -1.0]);
    let shear = random.pick(&[0.0, 0.0, 3.0]);
    let s = scale * mirror;
    [
        scale * cos,
        -scale * sin,
        shear,
        x + offset,
        s * sin,
        s * cos,
        0.0,
        y,
        0.0,
        0.0,
        scale,
        -depth,
        0.0,
        0.0,
        0.0,
        1.0,
    ]
}

#[derive(Debug)]
struct Case {
    models: Vec<Model>,
    camera: Camera,
    drawing: OccluderOptions,
    options: HierarchyOptions,
}

const SIZES: [(u32, u32); 9] =
    [(1, 1), (7, 3), (8, 8), (65, 63), (200, 120), (130, 97), (33, 200), (321, 17), (5, 300)];

fn case(random: &mut Random) -> Case {
    let offset = random.pick(&[0.0, 0.0, 1e6]);
    let mut models = Vec::new();
    for _ in 0..1 + random.below(3) {
        let (n, rough) = (random.pick(&[1, 9, 20]), random.pick(&[0.0, 0.1, 1.0]));
        let mut model = sheet(random, n, rough);
        let copies = 1 + random.below(20);
        model.transforms = Some((0..copies).flat_map(|_| place(random, offset)).collect());
        models.push(model);
    }
    // A wall in world coordinates, which hides much.
    let mut wall = sheet(random, 12, 0.0);
    for p in wall.vertices.as_chunks_mut::<3>().0 {
        *p = [6.0 * p[0] + offset - 2.0, 6.0 * p[1], p[2] - 9.0];
    }
    models.push(wall);
    let eye = [offset, 0.0, random.pick(&[0.0, 0.0, -12.0])];
    let pose = Pose { eye, target: [offset, 0.0, eye[2] - 1.0], up: [0.0, 1.0, 0.0] };
    let (width, height) = random.pick(&SIZES);
    let convention = random.pick(&CONVENTIONS);
    let projection = match random.below(4) {
        0 => Projection::Orthographic {
            left: -8.0,
            right: 8.0,
            bottom: -8.0,
            top: 8.0,
            near: 0.5,
            far: 60.0,
            convention,
        },
        _ => {
            let far = random.pick(&[None, Some(25.0)]);
            Projection::Perspective { fov_y: 1.3, near: 0.1, far, convention }
        }
    };
    let camera = Camera::look_at(&pose, &projection, ImageSize::new(width, height)).unwrap();
    let cull_mode = random.pick(&[FaceCull::None, FaceCull::None, FaceCull::Back, FaceCull::Front]);
    let options = HierarchyOptions {
        threshold: random.pick(&[1, 1, 4, 30]),
        deepest: random.pick(&[0, 2, 16, 30]),
    };
    Case { models, camera, drawing: OccluderOptions { cull_mode }, options }
}

impl Case {
    fn meshes(&self) -> Vec<MeshData<'_>> {
        self.models.iter().map(mesh_data).collect()
    }

    fn hierarchy(&self, fault: Option<HierarchyFault>) -> HierarchicalVisibility {
        HierarchicalVisibility::with_fault(&self.meshes(), &self.drawing, &self.options, fault)
            .unwrap()
    }

    /// The image of the rasteriser without skipping.
    fn plain(&self) -> Vec<f32> {
        let surface = OccluderSurface::from_meshes(&self.meshes(), &self.drawing).unwrap();
        let size = self.camera.size();
        let mut raster = HostRaster::new(size, [1, 1]);
        raster.draw(&surface, &self.camera, 1, false).unwrap();
        let mut depth = vec![f32::NAN; size.pixels() as usize];
        raster.write(&mut depth, &self.camera, 1);
        depth
    }
}

fn mesh_data(model: &Model) -> MeshData<'_> {
    MeshData {
        vertices: Floats::F64(&model.vertices),
        triangles: &model.triangles,
        transforms: model.transforms.as_deref().map(Floats::F64),
    }
}

/// Level k by its definition: the farthest depth of each block of 2^k x 2^k pixels.
fn level(depth: &[f32], size: ImageSize, k: u32, convention: DepthConvention) -> Vec<f32> {
    let (width, height) = (size.width.div_ceil(1 << k), size.height.div_ceil(1 << k));
    let far = |a: f32, b: f32| if convention.is_reversed() { a.min(b) } else { a.max(b) };
    let mut texels = vec![f32::NAN; (width * height) as usize];
    for y in 0..size.height {
        for x in 0..size.width {
            let texel = &mut texels[((y >> k) * width + (x >> k)) as usize];
            *texel = far(*texel, depth[(y * size.width + x) as usize]);
        }
    }
    texels
}

fn bits(v: &[f32]) -> Vec<u32> {
    v.iter().map(|v| v.to_bits()).collect()
}

/// What is wrong with a frame, if anything is.
fn wrong(case: &Case, scene: &HierarchicalVisibility, frame: &HierarchyFrame) -> Option<String> {
    let (size, convention) = (case.camera.size(), case.camera.convention());
    let plain = case.plain();
    if bits(&plain) != bits(&frame.depth) {
        return Some("the image".to_owned());
    }
    let mut side = size.width.max(size.height);
    for (k, (level_size, texels)) in (1..).zip(&frame.levels) {
        side = side.div_ceil(2);
        let expected = (size.width.div_ceil(1 << k), size.height.div_ceil(1 << k));
        if (level_size.width, level_size.height) != expected {
            return Some(format!("the size of level {k}"));
        }
        if bits(&level(&plain, size, k, convention)) != bits(texels) {
            return Some(format!("level {k}"));
        }
    }
    if side != 1 {
        return Some("the number of levels".to_owned());
    }
    let counts = &frame.counts;
    let sum = counts.triangles_outside
        + counts.triangles_in_hidden_nodes
        + counts.triangles_in_hidden_meshlets
        + counts.triangles_drawn;
    if sum != scene.num_triangles() {
        return Some(format!("{sum} triangles of {}", scene.num_triangles()));
    }
    let nodes: Vec<_> = scene.nodes().collect();
    for (node, state) in nodes.iter().zip(&frame.states) {
        let above = node.parent.map(|parent| frame.states[parent as usize]);
        let is_visited = above.is_none_or(|above| above == NodeState::Visible);
        if is_visited == (*state == NodeState::NotVisited) {
            return Some(format!("{state:?} below {above:?}"));
        }
    }
    let is_leaf = |leaf: &u32| {
        let node = *leaf as usize;
        frame.states[node] == NodeState::Visible && nodes[node].meshlets > 0
    };
    (!frame.visible_leaves.iter().all(is_leaf)).then(|| "visible leaves".to_owned())
}

/// What is wrong with a tree, by its boxes and numbers.
fn wrong_tree(case: &Case, scene: &HierarchicalVisibility) -> Option<String> {
    let nodes: Vec<_> = scene.nodes().collect();
    let mut below: Vec<u64> = vec![0; nodes.len()];
    for (number, node) in nodes.iter().enumerate().rev() {
        let below_it = below[number];
        if node.level > case.options.deepest || node.triangles < below_it {
            return Some(format!("node {number}: level or triangles"));
        }
        let is_leaf = below_it == 0;
        let is_full = node.meshlets > case.options.threshold;
        if is_leaf && is_full && node.level < case.options.deepest {
            // Only what is larger than half of a cell may stay together.
            let side = |n: &hiz_core::methods::hierarchy::HierarchyNode| {
                (0..3).map(|k| n.max[k] - n.min[k]).fold(0.0, f64::max)
            };
            if side(node) < 0.5 * side(&nodes[0]) * 0.5_f64.powi(node.level as i32) {
                return Some(format!("node {number}: not split"));
            }
        }
        let Some(parent) = node.parent else { continue };
        let above = &nodes[parent as usize];
        below[parent as usize] += node.triangles;
        let fits = (0..3).all(|k| above.min[k] <= node.min[k] && node.max[k] <= above.max[k]);
        if parent as usize >= number || above.level >= node.level || !fits {
            return Some(format!("node {number} in node {parent}"));
        }
    }
    let meshlets: usize = nodes.iter().map(|node| node.meshlets as usize).sum();
    (meshlets != scene.num_meshlets() || nodes[0].triangles != scene.num_triangles())
        .then(|| "what the tree holds".to_owned())
}

#[test]
fn images_and_levels_are_those_without_skipping() {
    let mut random = Random(1993);
    let (mut hidden, mut skipped, mut settled) = (0, 0, 0);
    for round in 0..120 {
        let case = case(&mut random);
        let scene = case.hierarchy(None);
        assert_eq!(wrong_tree(&case, &scene), None, "round {round}: {:?}", case.options);
        let frame = scene.render(&case.camera, &[], false).unwrap();
        assert_eq!(wrong(&case, &scene, &frame), None, "round {round}: {case:?}");
        hidden += frame.counts.triangles_in_hidden_nodes;
        skipped += frame.counts.triangles_in_hidden_meshlets;
        settled += frame.counts.settled_by_one;
        // Again, in the order of the last frame, and in one that is useless.
        let leaves = &frame.visible_leaves;
        let any: Vec<u32> = (0..5).map(|_| random.below(scene.nodes().len() as u32)).collect();
        for previous in [leaves, &any] {
            let again = scene.render(&case.camera, previous, false).unwrap();
            assert_eq!(wrong(&case, &scene, &again), None, "round {round}: after {previous:?}");
            assert_eq!(again.visible_leaves, *leaves, "round {round}: after {previous:?}");
        }
    }
    // The scenes do hide something, in each of the ways.
    assert!(hidden > 50_000 && skipped > 500 && settled > 50, "{hidden} {skipped} {settled}");
}

#[test]
fn planted_faults_are_found() {
    for (fault, expected) in [
        (HierarchyFault::PropagationStopsEarly, "level"),
        (HierarchyFault::ParentMissesChild, "the image"),
        (HierarchyFault::TileTooNear, "the image"),
    ] {
        let mut random = Random(1993);
        let found = (0..60).find_map(|_| {
            let case = case(&mut random);
            let scene = case.hierarchy(Some(fault));
            let frame = scene.render(&case.camera, &[], false).unwrap();
            wrong(&case, &scene, &frame).filter(|what| what.starts_with(expected))
        });
        assert!(found.is_some(), "{fault:?}");
    }
    // The box of a parent is compared, too.
    let mut random = Random(1993);
    let found = (0..60).find_map(|_| {
        let case = case(&mut random);
        wrong_tree(&case, &case.hierarchy(Some(HierarchyFault::ParentMissesChild)))
    });
    assert!(found.is_some_and(|what| what.contains(" in node ")));
}

/// Squares across the whole view, one behind the other: every count can be worked out by hand.
#[test]
fn counts_by_hand() {
    let size = ImageSize::new(64, 32);
    let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    let convention = DepthConvention::Reversed;
    let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention };
    let camera = Camera::look_at(&pose, &projection, size).unwrap();
    let corners = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, -1.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let at = |x: f64, z: f64| {
        let s = 2.0 * z.abs();
        [s, 0.0, 0.0, x, 0.0, s, 0.0, 0.0, 0.0, 0.0, s, z, 0.0, 0.0, 0.0, 1.0]
    };
    // Seven walls that fill the view, and one behind the eye.
    let transforms: Vec<f64> =
        (1..8).map(|k| f64::from(k) * -10.0).chain([50.0]).flat_map(|z| at(0.0, z)).collect();
    let wall = MeshData {
        vertices: Floats::F64(&corners),
        triangles: &[0, 1, 2, 2, 1, 3],
        transforms: Some(Floats::F64(&transforms)),
    };
    let options = HierarchyOptions { threshold: 1, deepest: 16 };
    let drawing = OccluderOptions::default();
    let scene = HierarchicalVisibility::new(&[wall], &drawing, &options).unwrap();
    let frame = scene.render(&camera, &[], true).unwrap();
    let counts = frame.counts;
    assert_eq!((counts.triangles_drawn, counts.triangles_outside), (2, 2));
    assert_eq!(counts.triangles_in_hidden_nodes + counts.triangles_in_hidden_meshlets, 12);
    // Each square covers each centre once.
    let centres = frame.centres.unwrap();
    assert_eq!((centres.in_view, centres.drawn), (7 * size.pixels(), size.pixels()));
    // Nothing that lies wholly behind the nearest wall is a visible leaf.
    let nodes: Vec<_> = scene.nodes().collect();
    let leaves = &frame.visible_leaves;
    assert!(!leaves.is_empty() && leaves.iter().all(|leaf| nodes[*leaf as usize].max[2] >= -10.0));
    let [ones, hidden] = [NodeState::Visible, NodeState::Hidden]
        .map(|state| frame.states.iter().filter(|s| **s == state).count());
    assert!(ones >= 1 && hidden >= 1);
    assert!(
        counts.settled_by_one as usize >= hidden && counts.comparisons >= counts.settled_by_one
    );
    let flat = scene.render_flat(&camera).unwrap();
    assert_eq!((flat.depth, flat.meshlets_drawn, flat.triangles_drawn), (frame.depth, 1, 2));
    // An image of one pixel is its own pyramid.
    let tiny = Camera::look_at(&pose, &projection, ImageSize::new(1, 1)).unwrap();
    assert_eq!(scene.render(&tiny, &[], false).unwrap().levels, []);
}

#[test]
fn what_is_refused() {
    let drawing = OccluderOptions::default();
    let made = |threshold, deepest| {
        let options = HierarchyOptions { threshold, deepest };
        HierarchicalVisibility::new(&[], &drawing, &options).map(|scene| scene.nodes().len())
    };
    assert_eq!(made(1, 30), Ok(0));
    let text = |result: hiz_core::Result<usize>| result.unwrap_err().to_string();
    assert!(text(made(0, 3)).contains("threshold: expected at least 1 meshlet, got 0"));
    assert!(text(made(1, 31)).contains("deepest: expected a level of at most 30, got 31"));
    let case = case(&mut Random(1));
    let scene = case.hierarchy(None);
    let error = scene.render(&case.camera, &[9999], false).unwrap_err().to_string();
    assert!(error.contains("previous: expected numbers of the") && error.contains("got 9999"));
    // Nothing to draw is far everywhere.
    let nothing = HierarchicalVisibility::new(&[], &drawing, &HierarchyOptions::default()).unwrap();
    let frame = nothing.render(&case.camera, &[], true).unwrap();
    assert!(frame.depth.iter().all(|depth| *depth == case.camera.convention().far()));
}
