//! What cannot be made, encoders that cannot be used, and a device that is lost.

use hiz_core::{
    AtlasUse, CullOptions, DrawOptions, DrawTemplate, Error, Floats, HizContext, ImageSize,
    InstanceOptions, MeshData, OccluderOptions, Outputs, PyramidOptions, Result, StoredLevels,
    wgpu,
};

use crate::culls::culled;
use crate::{TWO_BOXES, WALL, World, adapter, open, plain, run};

#[test]
fn what_cannot_be_made_is_refused_by_name() {
    let [world, other] = World::two();
    let context = &world.context;
    let pyramid = |width, height, options: PyramidOptions| {
        Box::new(move |_: &mut wgpu::CommandEncoder| {
            context.create_pyramid(ImageSize::new(width, height), &options).map(drop)
        }) as Box<_>
    };
    let visible = |instances, draw| {
        Box::new(move |_: &mut wgpu::CommandEncoder| {
            context.create_visible(instances, &Outputs { draw, ..Outputs::default() }).map(drop)
        }) as Box<_>
    };
    let occluders = |mesh: MeshData<'static>| {
        Box::new(move |_: &mut wgpu::CommandEncoder| {
            context.create_occluders(&[mesh], &OccluderOptions::default()).map(drop)
        }) as Box<_>
    };
    let first = DrawTemplate { first_instance: 7, ..DrawTemplate::default() };
    run(
        &world,
        &[
            (
                "no pixels",
                "size: expected at least one pixel a side",
                pyramid(0, 4, PyramidOptions::default()),
            ),
            (
                "too many",
                "max_texture_dimension_2d: requested 8193",
                pyramid(8193, 1, PyramidOptions::default()),
            ),
            (
                "chunks",
                "chunk_shift: expected 2 to",
                pyramid(
                    4,
                    4,
                    PyramidOptions { chunk_shift: Some(40), ..PyramidOptions::default() },
                ),
            ),
            (
                "levels",
                "levels: expected",
                pyramid(
                    4,
                    4,
                    PyramidOptions {
                        levels: StoredLevels { first: 0, last: 3 },
                        ..PyramidOptions::default()
                    },
                ),
            ),
            (
                "too many chunks",
                "pyramid texels: requested",
                pyramid(
                    64,
                    64,
                    PyramidOptions { chunk_shift: Some(2), ..PyramidOptions::default() },
                ),
            ),
            (
                "a first instance",
                "first_instance: expected 0 on a device without the feature \
                 INDIRECT_FIRST_INSTANCE, got 7",
                visible(&world.instances, first),
            ),
            (
                "outputs of another device",
                "instances: expected an object of this device",
                visible(&other.instances, DrawTemplate::default()),
            ),
            (
                "an index",
                "triangles: expected indices below the 4",
                occluders(MeshData { triangles: &[0, 1, 4], ..WALL }),
            ),
            (
                "two indices",
                "triangles: expected 3 indices",
                occluders(MeshData { triangles: &[0, 1], ..WALL }),
            ),
            (
                "transforms",
                "transforms: expected 16 numbers",
                occluders(MeshData { transforms: Some(Floats::F32(&[1.0])), ..WALL }),
            ),
            (
                "vertices",
                "vertices: expected finite positions",
                occluders(MeshData { vertices: Floats::F32(&[f32::NAN; 12]), ..WALL }),
            ),
            ("no triangle", "", occluders(MeshData { triangles: &[], ..WALL })),
            (
                "no vertex",
                "",
                occluders(MeshData { vertices: Floats::F32(&[]), triangles: &[], ..WALL }),
            ),
        ],
    );
    // With the feature it is accepted.
    let features = wgpu::Features::INDIRECT_FIRST_INSTANCE;
    let world = World::on(open(&adapter(), features, &HizContext::required_limits()));
    world
        .context
        .create_visible(&world.instances, &Outputs { draw: first, ..Outputs::default() })
        .unwrap();
}

/// When a device is lost nothing panics, whatever is returned.
#[test]
fn a_lost_device_ends_nothing() {
    let (world, wall) = culled(World::new(), AtlasUse::Never);
    let (view, mut encoder) = (plain(&wall), world.encoder());
    let buffer = world.bounds_buffer(48);
    world.device.destroy();
    let World { context, instances, occluders, camera, .. } = &world;
    let outcomes = [
        world.reduce(&mut encoder, &view),
        world.cull(&mut encoder, &CullOptions::default()),
        context
            .record_occluders(&mut encoder, occluders, camera, &view, &DrawOptions::default())
            .map(drop),
        context.record_update(&mut encoder, instances, 0, &TWO_BOXES, true),
        context.record_update_from(&mut encoder, instances, &buffer),
        context.record_instances(&mut encoder, &TWO_BOXES, &InstanceOptions::default()).map(drop),
        context.create_occluders(&[WALL], &OccluderOptions::default()).map(drop),
        context.create_pyramid(camera.size(), &PyramidOptions::default()).map(drop),
        context.create_visible(instances, &Outputs::default()).map(drop),
        HizContext::new(&world.device).map(drop),
    ];
    for (i, outcome) in outcomes.into_iter().enumerate() {
        // Some calls cannot notice the loss; those that need mapped memory do.
        assert!(outcome.is_ok() || matches!(outcome, Err(Error::Device(_))), "{i}: {outcome:?}");
    }
    drop(encoder.finish());
}

/// wgpu reports an encoder of another device when it is finished.
/// An encoder with an open pass is reported at once or when it is finished.
/// Nothing panics here, and the devices can still be used.
#[test]
fn encoders_that_cannot_be_used_are_told_of() {
    let [world, other] = World::two();
    let (world, wall) = culled(world, AtlasUse::Never);
    let mut encoder = other.encoder();
    world.reduce(&mut encoder, &plain(&wall)).unwrap();
    world.cull(&mut encoder, &CullOptions::default()).unwrap();
    let fails = |world: &World, encoder: wgpu::CommandEncoder| {
        let scope = world.device.push_error_scope(wgpu::ErrorFilter::Validation);
        drop(encoder.finish());
        pollster::block_on(scope.pop()).is_some()
    };
    assert!(fails(&other, encoder));
    let World { context, instances, occluders, camera, .. } = &world;
    let view = plain(&wall);
    type Act<'a> = &'a dyn Fn(&mut wgpu::CommandEncoder) -> Result<()>;
    let buffer = world.bounds_buffer(48);
    let acts: [Act<'_>; 6] = [
        &|encoder| world.reduce(encoder, &view),
        &|encoder| world.cull(encoder, &CullOptions::default()),
        &|encoder| {
            context
                .record_occluders(encoder, occluders, camera, &view, &DrawOptions::default())
                .map(drop)
        },
        &|encoder| context.record_update(encoder, instances, 0, &TWO_BOXES, true),
        &|encoder| {
            context.record_instances(encoder, &TWO_BOXES, &InstanceOptions::default()).map(drop)
        },
        &|encoder| context.record_update_from(encoder, instances, &buffer),
    ];
    for (i, act) in acts.iter().enumerate() {
        let mut encoder = world.encoder();
        let pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default()).forget_lifetime();
        let outcome = act(&mut encoder);
        // Where copies are recorded first, wgpu reports it later.
        if [2, 3, 5].contains(&i) {
            let text = outcome.unwrap_err().to_string();
            assert!(
                text.starts_with("encoder: expected one of this device without an open pass, but"),
                "{i}: {text}"
            );
        }
        let scope = world.device.push_error_scope(wgpu::ErrorFilter::Validation);
        drop(pass);
        drop(pollster::block_on(scope.pop()));
        assert!(fails(&world, encoder));
    }
    world.works(world.encoder(), "this device");
    other.works(other.encoder(), "the other one");
}
