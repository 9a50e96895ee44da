//! Devices with the least limits, and with less.

use hiz_core::wgpu::{TextureFormat as Format, TextureUsages as Usages};
use hiz_core::{
    AtlasUse, Bounds, BoundsKind, CullOptions, Error, Floats, Footprint, Hierarchy, HizContext,
    ImageSize, InstanceOptions, MeshData, OccluderOptions, Order, Outputs, PyramidOptions,
    StoredOrder, wgpu,
};

use crate::{SAMPLED, SIDE, World, adapter, open, plain};

/// The least of each limit that the shaders need.
/// They are counted by hand from `gpu/layouts.rs` and `shaders/`.
fn least() -> wgpu::Limits {
    wgpu::Limits {
        max_texture_dimension_2d: 4096,
        max_bind_groups: 4,
        max_bind_groups_plus_vertex_buffers: 4,
        max_bindings_per_bind_group: 7,
        max_sampled_textures_per_shader_stage: 4,
        max_samplers_per_shader_stage: 1,
        max_storage_buffers_per_shader_stage: 8,
        max_storage_textures_per_shader_stage: 4,
        max_uniform_buffers_per_shader_stage: 4,
        max_uniform_buffer_binding_size: 528,
        max_storage_buffer_binding_size: 8192,
        max_buffer_size: 65_536,
        max_vertex_buffers: 2,
        max_vertex_attributes: 8,
        max_vertex_buffer_array_stride: 88,
        max_inter_stage_shader_variables: 1,
        max_compute_workgroup_storage_size: 1024,
        max_compute_invocations_per_workgroup: 256,
        max_compute_workgroup_size_x: 256,
        max_compute_workgroup_size_y: 1,
        max_compute_workgroup_size_z: 1,
        max_compute_workgroups_per_dimension: 65_535,
        // Limits that nothing here needs.
        max_texture_dimension_1d: 1,
        max_texture_dimension_3d: 1,
        max_texture_array_layers: 1,
        max_dynamic_uniform_buffers_per_pipeline_layout: 0,
        max_dynamic_storage_buffers_per_pipeline_layout: 0,
        max_color_attachments: 0,
        max_color_attachment_bytes_per_sample: 0,
        ..wgpu::Limits::default()
    }
}

type Lower = (&'static str, fn(&mut wgpu::Limits));

#[test]
fn devices_with_less_than_the_shaders_need_are_refused() {
    macro_rules! one_less {
        ($($name:ident),* $(,)?) => {
            [$((stringify!($name), |limits: &mut wgpu::Limits| limits.$name -= 1)),*]
        };
    }
    let all: [Lower; 22] = one_less![
        max_texture_dimension_2d,
        max_bind_groups,
        max_bind_groups_plus_vertex_buffers,
        max_bindings_per_bind_group,
        max_sampled_textures_per_shader_stage,
        max_samplers_per_shader_stage,
        max_storage_buffers_per_shader_stage,
        max_storage_textures_per_shader_stage,
        max_uniform_buffers_per_shader_stage,
        max_uniform_buffer_binding_size,
        max_storage_buffer_binding_size,
        max_buffer_size,
        max_vertex_buffers,
        max_vertex_attributes,
        max_vertex_buffer_array_stride,
        max_inter_stage_shader_variables,
        max_compute_workgroup_storage_size,
        max_compute_invocations_per_workgroup,
        max_compute_workgroup_size_x,
        max_compute_workgroup_size_y,
        max_compute_workgroup_size_z,
        max_compute_workgroups_per_dimension,
    ];
    let adapter = adapter();
    for (name, lower) in all {
        let mut limits = least();
        lower(&mut limits);
        let (device, _queue) = open(&adapter, wgpu::Features::empty(), &limits);
        let error = HizContext::new(&device).unwrap_err();
        assert!(
            matches!(&error, Error::Limit { name: limit, .. } if limit == name),
            "{name}: {error}"
        );
    }
}

/// Everything runs on a device with only the required limits.
#[test]
fn the_least_limits_are_enough_for_everything() {
    let world = World::on(open(&adapter(), wgpu::Features::empty(), &least()));
    world.works(world.encoder(), "a plain cull");
    let context = &world.context;
    // Each source once, and each kind of bounds.
    let sources = [
        (Format::Depth32Float, SAMPLED, SIDE, BoundsKind::Sphere),
        (Format::R32Float, SAMPLED, SIDE, BoundsKind::Box),
        (Format::Rgba32Uint, Usages::STORAGE_BINDING, SIDE / 4, BoundsKind::OrientedBox),
        (Format::R32Float, SAMPLED, SIDE, BoundsKind::Point),
    ];
    for (format, usage, width, kind) in sources {
        let image = world.texture_but(format, usage | Usages::COPY_SRC, |d| d.size.width = width);
        // Several pieces: more than a row of records.
        let n = 3000;
        let (centers, sizes) = (vec![8.0_f32; 3 * n], vec![1.0_f32; 3 * n]);
        let bounds = match kind {
            BoundsKind::Sphere => {
                Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&sizes[..n]) }
            }
            BoundsKind::Box => {
                Bounds::Boxes { min: Floats::F32(&sizes), max: Floats::F32(&centers) }
            }
            BoundsKind::OrientedBox => Bounds::OrientedBoxes {
                centers: Floats::F32(&centers),
                half_sizes: Floats::F32(&sizes),
                rotations: Floats::F32(&vec![0.5; 9 * n]),
            },
            BoundsKind::Point | BoundsKind::WidePoint => {
                Bounds::Points { positions: Floats::F32(&centers) }
            }
        };
        let mut encoder = world.encoder();
        let instances =
            context.record_instances(&mut encoder, &bounds, &InstanceOptions::default()).unwrap();
        context.record_update(&mut encoder, &instances, 0, &bounds, false).unwrap();
        if kind != BoundsKind::OrientedBox {
            let buffer = world.bounds_buffer(8192);
            let count = 8192 / 24;
            context.record_instances_from(&mut encoder, &buffer, kind, count).unwrap();
        }
        let visible = context.create_visible(&instances, &Outputs::default()).unwrap();
        for atlas in [AtlasUse::Never, AtlasUse::Always] {
            let options = PyramidOptions { atlas, ..PyramidOptions::default() };
            let pyramid = context.create_pyramid(world.camera.size(), &options).unwrap();
            context.record_reduce(&mut encoder, &plain(&image), &world.camera, &pyramid).unwrap();
            for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
                for order in [Order::Stable, Order::Any] {
                    let footprint = Footprint::Four;
                    let options = CullOptions {
                        hierarchy,
                        order,
                        footprint,
                        statistics: true,
                        ..CullOptions::default()
                    };
                    context
                        .record_cull(
                            &mut encoder,
                            &instances,
                            &world.camera,
                            &pyramid,
                            &visible,
                            &options,
                        )
                        .unwrap();
                }
            }
        }
        world.works(encoder, &format!("{format:?} {kind:?}"));
    }
    // Beyond these limits there are named errors.
    let many = vec![0.0_f32; 3 * 3000];
    let mesh = MeshData { vertices: Floats::F32(&many), triangles: &[0, 1, 2], transforms: None };
    let error = context.create_occluders(&[mesh], &OccluderOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "max_buffer_size: requested 72000, the device allows 65536");
    let error =
        context.create_pyramid(ImageSize::new(4096, 4096), &PyramidOptions::default()).unwrap_err();
    assert!(error.to_string().starts_with("pyramid texels: requested"), "{error}");
}

/// An update of more records than a storage binding holds is split into bands.
/// The device has the results of all of them.
#[test]
fn an_update_larger_than_a_binding_reaches_every_instance() {
    // 256 spheres of 32 bytes per band.
    let world = World::on(open(&adapter(), wgpu::Features::empty(), &least()));
    let context = &world.context;
    let count = 1000;
    let random: Vec<[f32; 2]> = {
        let mut random = crate::common::Random(11);
        (0..count)
            .map(|_| [random.range(-0.5, 0.5) as f32, random.range(-0.5, 0.5) as f32])
            .collect()
    };
    let at = |z: f32| -> Vec<f32> { random.iter().flat_map(|[x, y]| [x * z, y * z, z]).collect() };
    let radii = vec![0.01_f32; count];
    let (near, far) = (at(2.0), at(8.0));
    for order in [StoredOrder::Morton, StoredOrder::Given] {
        let mut encoder = world.encoder();
        let before = Bounds::Spheres { centers: Floats::F32(&far), radii: Floats::F32(&radii) };
        let options = InstanceOptions { order, ..InstanceOptions::default() };
        let instances = context.record_instances(&mut encoder, &before, &options).unwrap();
        // All but the first 40 and the last 40 move in front of the wall.
        let range = 40..count - 40;
        let after = Bounds::Spheres {
            centers: Floats::F32(&near[3 * range.start..3 * range.end]),
            radii: Floats::F32(&radii[range.clone()]),
        };
        context.record_update(&mut encoder, &instances, 40, &after, true).unwrap();
        let wall = world.wall(&mut encoder);
        world.reduce(&mut encoder, &plain(&wall)).unwrap();
        for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
            let visible = context.create_visible(&instances, &Outputs::default()).unwrap();
            let mut encoder = std::mem::replace(&mut encoder, world.encoder());
            let options = CullOptions { hierarchy, ..CullOptions::default() };
            context
                .record_cull(
                    &mut encoder,
                    &instances,
                    &world.camera,
                    &world.pyramid,
                    &visible,
                    &options,
                )
                .unwrap();
            let staging = world.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("test.mask"),
                size: 128,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            encoder.copy_buffer_to_buffer(visible.mask(0).expect("a mask"), 0, &staging, 0, 128);
            world.queue.submit([encoder.finish()]);
            staging.map_async(wgpu::MapMode::Read, .., |_| {});
            world.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
            let bytes = staging.get_mapped_range(..).unwrap();
            let kept: Vec<bool> = (0..count).map(|i| bytes[i / 8] >> (i % 8) & 1 == 1).collect();
            let expected: Vec<bool> = (0..count).map(|i| range.contains(&i)).collect();
            assert_eq!(kept, expected, "{order:?} {hierarchy:?}");
        }
    }
}
