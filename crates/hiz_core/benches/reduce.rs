//! The depth reduction against its yardsticks.
//!
//! A table of medians comes first, then criterion's own figures.
//! All ways are run in turns, so that a busy moment hits all of them.
//! Run it with `cargo bench --workspace --bench reduce`.
//!
//! - `-- --test` runs everything once.
//! - `-- nothing` prints only the table.
//! - `HIZVK_BENCH_SIZES` chooses among 1080p and 4K.

mod common;

use std::sync::Arc;
use std::time::Instant;

use common::{Way, measure, table};
use hiz_core::headless::{DepthImage, Engine};
use hiz_core::yardstick::{
    PerLevelReduction, ReductionShape, empty_submit_ms, memcpy_ms, reduce, submitted_ms,
};
use hiz_core::{
    Camera, DepthConvention, Floats, ImageSize, MeshData, OccluderOptions, Pose, Projection,
    Pyramid, PyramidOptions, StoredLevels, wgpu,
};

fn camera(size: ImageSize, convention: DepthConvention) -> Camera {
    let pose = Pose { eye: [0.0, 0.0, 0.0], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    let projection =
        Projection::Perspective { fov_y: 1.0, near: 0.1, far: Some(1000.0), convention };
    Camera::look_at(&pose, &projection, size).expect("a plain camera")
}

/// A depth image of a few hundred random triangles in front of the camera.
fn depth_texture(engine: &Engine, camera: &Camera) -> DepthImage {
    let mut state = 1_u64;
    let mut unit = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    let mut vertices = Vec::new();
    for _ in 0..300 {
        let (x, y, z) = (unit() * 40.0 - 20.0, unit() * 24.0 - 12.0, -5.0 - 40.0 * unit());
        for _ in 0..3 {
            vertices.extend([x + 4.0 * unit(), y + 4.0 * unit(), z + unit()]);
        }
    }
    let triangles: Vec<u32> = (0..900).collect();
    let mesh =
        MeshData { vertices: Floats::F64(&vertices), triangles: &triangles, transforms: None };
    let occluders = engine.occluders(&[mesh], &OccluderOptions::default()).expect("occluders");
    engine.render_depth(&occluders, camera).expect("a depth texture")
}

fn ways<'a>(engine: &'a Engine, depth: &'a DepthImage) -> Vec<Way<'a>> {
    let numbers = depth.read().expect("the depth image");
    let mut copy = vec![0.0; numbers.len()];
    let mut ways: Vec<Way<'a>> = vec![
        ("memcpy".to_owned(), Box::new(move || memcpy_ms(&numbers, &mut copy))),
        ("empty submit".to_owned(), Box::new(|| empty_submit_ms(engine).expect("a submit"))),
    ];
    for (name, levels) in [
        ("ours, all levels", StoredLevels::ALL),
        ("ours, levels >= 2", StoredLevels::from(2)),
        ("ours, levels >= 3", StoredLevels::from(3)),
        ("ours, level 3 alone", StoredLevels::only(3)),
        ("ours, level 5 alone", StoredLevels::only(5)),
        ("ours, level 7 alone", StoredLevels::only(7)),
    ] {
        let options = PyramidOptions { levels, ..PyramidOptions::default() };
        let pyramid: Arc<Pyramid> = engine.pyramid_with(depth, &options).expect("a pyramid");
        let run = move || {
            submitted_ms(engine, |e| reduce(engine, e, depth, &pyramid)).expect("a reduction")
        };
        ways.push((name.to_owned(), Box::new(run)));
    }
    for (name, shape) in [
        ("a dispatch a level, buffer", ReductionShape::Buffer),
        ("a dispatch a level, textures", ReductionShape::Textures),
    ] {
        let reduction = PerLevelReduction::new(engine, depth, shape).expect("a yardstick");
        let run = move || {
            submitted_ms(engine, |e| {
                reduction.record(e);
                Ok(())
            })
            .expect("a yardstick")
        };
        ways.push((name.to_owned(), Box::new(run)));
    }
    ways
}

/// Ways to bring an image from the host into a texture.
/// Each makes a texture of its own, as an upload does.
fn uploads<'a>(engine: &'a Engine, numbers: &'a [f32], camera: &'a Camera) -> Vec<Way<'a>> {
    let mut copy = vec![0.0; numbers.len()];
    let ours = move || {
        let start = Instant::now();
        engine.upload_depth(numbers, camera).expect("an upload");
        engine.queue().submit([]);
        engine.wait().expect("a wait");
        start.elapsed().as_secs_f64() * 1e3
    };
    let write = move || {
        let start = Instant::now();
        let size = camera.size();
        let texture = engine.device().create_texture(&wgpu::TextureDescriptor {
            label: Some("bench.depth"),
            size: wgpu::Extent3d {
                width: size.width / 4,
                height: size.height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        engine.queue().write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(numbers),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * size.width),
                rows_per_image: None,
            },
            texture.size(),
        );
        engine.queue().submit([]);
        engine.wait().expect("a wait");
        start.elapsed().as_secs_f64() * 1e3
    };
    vec![
        ("memcpy".to_owned(), Box::new(move || memcpy_ms(numbers, &mut copy))),
        ("ours, upload".to_owned(), Box::new(ours)),
        ("upload by write_texture".to_owned(), Box::new(write)),
    ]
}

fn main() {
    let engine = common::engine();
    let mut criterion = common::criterion();
    let sizes = std::env::var("HIZVK_BENCH_SIZES").unwrap_or_default();
    for (label, size) in [("1080p", ImageSize::new(1920, 1080)), ("4K", ImageSize::new(3840, 2160))]
    {
        if !sizes.is_empty() && !sizes.contains(label) {
            continue;
        }
        for convention in [DepthConvention::Reversed, DepthConvention::Standard] {
            let camera = camera(size, convention);
            let texture = depth_texture(&engine, &camera);
            let numbers = texture.read().expect("depth");
            table(
                &format!("{label} to the device"),
                "memcpies",
                &mut uploads(&engine, &numbers, &camera),
            );
            let uploaded = engine.upload_depth(&numbers, &camera).expect("an upload");
            for (source, depth) in [("depth texture", &texture), ("upload", &uploaded)] {
                let mut ways = ways(&engine, depth);
                let name = format!("{label} {source} {convention:?}");
                table(&name, "memcpies", &mut ways);
                measure(&mut criterion, &name, &mut ways);
            }
        }
    }
    criterion.final_summary();
}
