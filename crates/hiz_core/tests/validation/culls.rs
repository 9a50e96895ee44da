//! Culls of what was destroyed, of what does not belong together, and of nothing.

use hiz_core::wgpu::{TextureFormat as Format, TextureUsages as Usages};
use hiz_core::{
    AtlasUse, Bounds, CullOptions, DepthConvention, DrawOptions, Floats, Hierarchy,
    InstanceOptions, OccluderOptions, Order, Outputs, PyramidOptions, wgpu,
};

use crate::common::camera_along_z;
use crate::{SAMPLED, SIDE, STANDARD, TWO_BOXES, World, plain, run};

/// A world whose wall is reduced, with or without an atlas, and culled once.
/// So its pyramid keeps bindings.
pub(crate) fn culled(mut world: World, atlas: AtlasUse) -> (World, wgpu::Texture) {
    let options = PyramidOptions { atlas, ..PyramidOptions::default() };
    world.pyramid = world.context.create_pyramid(world.camera.size(), &options).unwrap();
    let mut encoder = world.encoder();
    let wall = world.wall(&mut encoder);
    world.reduce(&mut encoder, &plain(&wall)).unwrap();
    world.cull(&mut encoder, &CullOptions::default()).unwrap();
    assert_eq!(world.mask(encoder, &world.visible), 0b01);
    (world, wall)
}

#[test]
fn a_cull_of_what_was_destroyed_is_refused_by_name() {
    for atlas in [AtlasUse::Never, AtlasUse::Always] {
        for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
            let (world, wall) = culled(World::new(), atlas);
            let options = CullOptions { hierarchy, ..CullOptions::default() };
            wall.destroy();
            let gone = "pyramid: expected one whose depth image has not been destroyed";
            run(
                &world,
                &[("the depth image", gone, Box::new(|encoder| world.cull(encoder, &options)))],
            );
        }
    }
    let (world, _) = culled(World::new(), AtlasUse::Never);
    let gone = "visible: expected buffers that have not been destroyed";
    for order in [Order::Stable, Order::Any] {
        let options = CullOptions { order, ..CullOptions::default() };
        for part in 0..3 {
            let visible =
                world.context.create_visible(&world.instances, &Outputs::default()).unwrap();
            let buffers = [visible.draw_arguments(), visible.list(0), visible.mask(0)];
            buffers[part].expect("all outputs").destroy();
            let World { context, instances, camera, pyramid, .. } = &world;
            let cull = |encoder: &mut wgpu::CommandEncoder| {
                context.record_cull(encoder, instances, camera, pyramid, &visible, &options)
            };
            run(&world, &[("a buffer", gone, Box::new(cull))]);
        }
    }
}

#[test]
fn culls_of_what_does_not_belong_are_refused_by_name() {
    let [world, other] = World::two();
    let (world, _) = culled(world, AtlasUse::Auto);
    let never_built =
        world.context.create_pyramid(world.camera.size(), &PyramidOptions::default()).unwrap();
    let reversed = camera_along_z(SIDE, SIDE, DepthConvention::Reversed);
    let mut encoder = world.encoder();
    let single =
        Bounds::Spheres { centers: Floats::F32(&[0.0, 0.0, 8.0]), radii: Floats::F32(&[1.0]) };
    let single =
        world.context.record_instances(&mut encoder, &single, &InstanceOptions::default()).unwrap();
    world.works(encoder, "an upload");
    let of_single = world.context.create_visible(&single, &Outputs::default()).unwrap();
    let cull = |instances, camera, pyramid, visible| {
        let context = &world.context;
        Box::new(move |encoder: &mut wgpu::CommandEncoder| {
            context.record_cull(
                encoder,
                instances,
                camera,
                pyramid,
                visible,
                &CullOptions::default(),
            )
        }) as Box<_>
    };
    let World { context, instances, camera, pyramid, visible, .. } = &world;
    let options = |options: CullOptions| {
        let world = &world;
        Box::new(move |encoder: &mut wgpu::CommandEncoder| world.cull(encoder, &options)) as Box<_>
    };
    let plain = CullOptions::default;
    let theirs = Bounds::Spheres { centers: Floats::F32(&[0.0; 3]), radii: Floats::F32(&[1.0]) };
    let update = |instances, first, bounds| {
        Box::new(move |encoder: &mut wgpu::CommandEncoder| {
            context.record_update(encoder, instances, first, bounds, false)
        }) as Box<_>
    };
    let boxes =
        |centers: Floats<'static>, radii: Floats<'static>, options: InstanceOptions<'static>| {
            Box::new(move |encoder: &mut wgpu::CommandEncoder| {
                context
                    .record_instances(encoder, &Bounds::Spheres { centers, radii }, &options)
                    .map(drop)
            }) as Box<_>
        };
    let stranger = other.bounds_buffer(48);
    run(
        &world,
        &[
            (
                "instances of another device",
                "instances: expected an object of this device",
                cull(&other.instances, camera, pyramid, visible),
            ),
            (
                "a pyramid of another device",
                "pyramid: expected an object of this device",
                cull(instances, camera, &other.pyramid, visible),
            ),
            (
                "outputs of another device",
                "visible: expected an object of this device",
                cull(instances, camera, pyramid, &other.visible),
            ),
            (
                "outputs of other instances",
                "visible: expected buffers that were created for these",
                cull(instances, camera, pyramid, &of_single),
            ),
            (
                "no reduction",
                "pyramid: expected one that was built",
                cull(instances, camera, &never_built, visible),
            ),
            (
                "another camera",
                "camera: expected the camera of the pyramid's depth image",
                cull(instances, &reversed, pyramid, visible),
            ),
            (
                "slack",
                "depth_slack: expected a number in 0..=0.5",
                options(CullOptions { depth_slack: -1.0, ..plain() }),
            ),
            (
                "guard",
                "guard_px: expected",
                options(CullOptions { guard_px: Some(0.3), ..plain() }),
            ),
            (
                "descent",
                "descent: expected a number in 0..=65536",
                options(CullOptions { descent: 65_537, ..plain() }),
            ),
            (
                "an update of another device's",
                "instances: expected an object",
                update(&other.instances, 0, &TWO_BOXES),
            ),
            (
                "an update of another kind",
                "bounds: expected the instances' kind",
                update(instances, 0, &theirs),
            ),
            (
                "another device's buffer",
                "buffer: expected a buffer of this device that has not been destroyed",
                Box::new(|encoder| context.record_update_from(encoder, instances, &stranger)),
            ),
            (
                "an update past the end",
                "bounds: expected at most 1 from instance 1 on",
                update(instances, 1, &TWO_BOXES),
            ),
            (
                "an update beyond the end",
                "first: expected a number in 0..=2",
                update(instances, 3, &TWO_BOXES),
            ),
            (
                "centers and radii",
                "radii: ",
                boxes(Floats::F32(&[0.0; 6]), Floats::F32(&[1.0]), InstanceOptions::default()),
            ),
            (
                "a piece's capacity",
                "piece_capacity: expected a multiple",
                boxes(
                    Floats::F32(&[0.0; 3]),
                    Floats::F32(&[1.0]),
                    InstanceOptions { piece_capacity: Some(1), ..InstanceOptions::default() },
                ),
            ),
            (
                "strict",
                "bounds: expected finite numbers",
                boxes(
                    Floats::F32(&[f32::NAN; 3]),
                    Floats::F32(&[1.0]),
                    InstanceOptions { strict: true, ..InstanceOptions::default() },
                ),
            ),
        ],
    );
}

/// No instances, no triangles, one pixel; with every output, order and way.
#[test]
fn nothing_at_all_is_drawn_reduced_and_culled() {
    let mut world = World::new();
    world.camera = camera_along_z(1, 1, STANDARD);
    world.pyramid =
        world.context.create_pyramid(world.camera.size(), &PyramidOptions::default()).unwrap();
    let mut encoder = world.encoder();
    let nothing = Bounds::Boxes { min: Floats::F32(&[]), max: Floats::F32(&[]) };
    world.instances = world
        .context
        .record_instances(&mut encoder, &nothing, &InstanceOptions::default())
        .unwrap();
    world.visible = world.context.create_visible(&world.instances, &Outputs::default()).unwrap();
    world.context.record_update(&mut encoder, &world.instances, 0, &nothing, true).unwrap();
    let no_mesh = world.context.create_occluders(&[], &OccluderOptions::default()).unwrap();
    let target =
        world.texture_but(Format::Depth32Float, Usages::RENDER_ATTACHMENT | SAMPLED, |d| {
            (d.size.width, d.size.height) = (1, 1);
        });
    world
        .context
        .record_occluders(
            &mut encoder,
            &no_mesh,
            &world.camera,
            &plain(&target),
            &DrawOptions::default(),
        )
        .unwrap();
    world.reduce(&mut encoder, &plain(&target)).unwrap();
    for order in [Order::Stable, Order::Any] {
        for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
            let options =
                CullOptions { order, hierarchy, statistics: true, ..CullOptions::default() };
            world.cull(&mut encoder, &options).unwrap();
        }
    }
    assert_eq!(world.mask(encoder, &world.visible), 0);
}
