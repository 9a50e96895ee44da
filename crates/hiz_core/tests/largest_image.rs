//! The largest depth image that the device's textures allow.
//! On lavapipe it is 16384 x 16384: 1 GiB, and the pyramid's first level alone needs two bindings.
//! On SwiftShader it is 8192 x 8192.

mod common;

use common::{camera_along_z, engine};
use hiz_core::{Bounds, CullOptions, DepthConvention, Floats, InstanceOptions, Outputs};

#[test]
fn the_largest_image_is_reduced_and_culled_against() {
    let side = engine().max_image_side().min(16_384);
    let camera = camera_along_z(side, side, DepthConvention::Reversed);
    // A wall at depth 4 with one far pixel in every block of 2048.
    // Most are beside their block's last corner, so that errors in split levels show.
    let block = 2048;
    let mut depth = vec![0.25_f32; side as usize * side as usize];
    let blocks = side / block;
    for (y, x) in (0..blocks).flat_map(|y| (0..blocks).map(move |x| (y, x))) {
        let (row, column) = ((y + 1) * block - 1 - x, (x + 1) * block - 1 - y);
        depth[(row * side + column) as usize] = 1.0 / f32::from(8 + (y * blocks + x) as u16);
    }
    let image = engine().upload_depth(&depth, &camera).unwrap();
    drop(depth);
    let pyramid = engine().pyramid(&image).unwrap();
    let level = block.ilog2();
    let expected: Vec<f32> = (0..blocks * blocks).map(|i| 1.0 / f32::from(8 + i as u16)).collect();
    assert_eq!(engine().read_level(&pyramid, level).unwrap(), expected);
    // Level 1 in full, across its chunks, shows the far pixels and nothing else.
    let first = engine().read_level(&pyramid, 1).unwrap();
    assert_eq!(first.iter().filter(|d| **d != 0.25).count(), (blocks * blocks) as usize);
    drop(first);
    // Specks in the middle of a pixel.
    // Those behind a far pixel are visible; those 40 pixels to the left of one are hidden.
    let mut centers = Vec::new();
    for (y, x) in (0..blocks).flat_map(|y| (0..blocks).map(move |x| (y, x))) {
        let (row, column) = ((y + 1) * block - 1 - x, (x + 1) * block - 1 - y);
        for column in [column, column - 40] {
            let ndc_x = (f64::from(column) + 0.5) / f64::from(side) * 2.0 - 1.0;
            let ndc_y = 1.0 - (f64::from(row) + 0.5) / f64::from(side) * 2.0;
            centers.extend([6.0 * ndc_x, 6.0 * ndc_y, 6.0]);
        }
    }
    let radii = vec![1e-6; centers.len() / 3];
    let bounds = Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
    let instances = engine().instances(&bounds, &InstanceOptions::default()).unwrap();
    let culling = engine()
        .cull(&instances, &camera, &pyramid, &CullOptions::default(), &Outputs::default())
        .unwrap();
    let expected: Vec<bool> = (0..radii.len()).map(|i| i % 2 == 0).collect();
    assert_eq!(culling.mask().unwrap(), expected);
}
