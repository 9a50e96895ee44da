//! Depth images that cannot be reduced, and targets that cannot be drawn into.

use hiz_core::wgpu::{TextureFormat as Format, TextureUsages as Usages};
use hiz_core::{DrawOptions, HizContext, PyramidOptions, wgpu};

use crate::common::camera_along_z;
use crate::{SAMPLED, SIDE, STANDARD, World, plain, run};

#[test]
fn depth_images_that_cannot_be_reduced_are_refused_by_name() {
    let [world, other] = World::two();
    let other_context = HizContext::new(&world.device).unwrap();
    let of_another =
        other_context.create_pyramid(world.camera.size(), &PyramidOptions::default()).unwrap();
    let smaller = camera_along_z(SIDE, 8, STANDARD);
    let destroyed = |world: &World, format, usage| {
        let texture = world.texture(format, usage);
        let view = plain(&texture);
        texture.destroy();
        view
    };
    let combined = Format::Depth24PlusStencil8;
    let gone = "depth: expected a texture of this device and context that has not been destroyed";
    let view_of = |texture: wgpu::Texture, descriptor: wgpu::TextureViewDescriptor<'static>| {
        texture.create_view(&descriptor)
    };
    let with = |view: wgpu::TextureView| {
        let world = &world;
        Box::new(move |encoder: &mut wgpu::CommandEncoder| world.reduce(encoder, &view)) as Box<_>
    };
    let but = |format, usage, change: &dyn Fn(&mut wgpu::TextureDescriptor<'_>)| {
        with(plain(&world.texture_but(format, usage, change)))
    };
    let aspect = |aspect| wgpu::TextureViewDescriptor { aspect, ..Default::default() };
    let both = SAMPLED | Usages::RENDER_ATTACHMENT;
    run(
        &world,
        &[
            (
                "the default view of depth and stencil",
                "",
                with(plain(&world.texture(combined, SAMPLED))),
            ),
            (
                "its depth",
                "",
                with(view_of(
                    world.texture(combined, SAMPLED),
                    aspect(wgpu::TextureAspect::DepthOnly),
                )),
            ),
            (
                "its stencil",
                "",
                with(view_of(
                    world.texture(combined, SAMPLED),
                    aspect(wgpu::TextureAspect::StencilOnly),
                )),
            ),
            (
                "a view to draw into alone",
                "",
                with(view_of(
                    world.texture(Format::Depth32Float, both),
                    wgpu::TextureViewDescriptor {
                        usage: Some(Usages::RENDER_ATTACHMENT),
                        ..Default::default()
                    },
                )),
            ),
            (
                "a view of layers",
                "",
                with(view_of(
                    world.texture(Format::R32Float, SAMPLED),
                    wgpu::TextureViewDescriptor {
                        dimension: Some(wgpu::TextureViewDimension::D2Array),
                        ..Default::default()
                    },
                )),
            ),
            ("16 bits", "", with(plain(&world.texture(Format::Depth16Unorm, SAMPLED)))),
            ("half floats", "", with(plain(&world.texture(Format::R16Float, SAMPLED)))),
            (
                "another device's depth",
                gone,
                with(plain(&other.texture(Format::Depth32Float, SAMPLED))),
            ),
            (
                "another device's floats",
                gone,
                with(plain(&other.texture(Format::R32Float, SAMPLED))),
            ),
            ("another device's stencil", gone, with(plain(&other.texture(combined, SAMPLED)))),
            ("destroyed depth", gone, with(destroyed(&world, Format::Depth32Float, SAMPLED))),
            ("destroyed floats", gone, with(destroyed(&world, Format::R32Float, SAMPLED))),
            ("destroyed stencil", gone, with(destroyed(&world, combined, SAMPLED))),
            (
                "another device's destroyed depth",
                gone,
                with(destroyed(&other, Format::Depth32Float, SAMPLED)),
            ),
            (
                "another device's destroyed stencil",
                gone,
                with(destroyed(&other, combined, SAMPLED)),
            ),
            (
                "colors",
                "depth: expected a depth format, R32Float",
                with(plain(&world.texture(Format::Rgba8Unorm, SAMPLED))),
            ),
            (
                "a stencil alone",
                "depth: expected a depth format",
                with(plain(&world.texture(Format::Stencil8, SAMPLED))),
            ),
            (
                "no usage",
                "depth: expected the usage TEXTURE_BINDING",
                with(plain(&world.texture(Format::Depth32Float, Usages::RENDER_ATTACHMENT))),
            ),
            (
                "no storage",
                "depth: expected the usage STORAGE_BINDING",
                but(Format::Rgba32Uint, SAMPLED, &|d| d.size.width = SIDE / 4),
            ),
            (
                "another size",
                "depth: expected the pyramid's size",
                but(Format::R32Float, SAMPLED, &|d| d.size.width = 8),
            ),
            (
                "mips",
                "depth: expected which of 2 mip levels, got none",
                but(Format::R32Float, SAMPLED, &|d| d.mip_level_count = 2),
            ),
            (
                "layers",
                "depth: expected which of 3 layers, got none",
                but(Format::R32Float, SAMPLED, &|d| d.size.depth_or_array_layers = 3),
            ),
            (
                "samples",
                "depth: expected one sample per pixel, got 4; record_resolve",
                but(Format::Depth32Float, both, &|d| d.sample_count = 4),
            ),
            (
                "a volume",
                "depth: expected a 2D texture",
                but(Format::R32Float, SAMPLED, &|d| d.dimension = wgpu::TextureDimension::D3),
            ),
            (
                "another context's pyramid",
                "pyramid: expected an object of this device and context",
                Box::new(|encoder| {
                    let view = plain(&world.texture(Format::R32Float, SAMPLED));
                    world.context.record_reduce(encoder, &view, &world.camera, &of_another)
                }),
            ),
            (
                "another camera",
                "camera: expected the depth image's size",
                Box::new(|encoder| {
                    let view = plain(&world.texture(Format::R32Float, SAMPLED));
                    world.context.record_reduce(encoder, &view, &smaller, &world.pyramid)
                }),
            ),
        ],
    );
}

#[test]
fn targets_that_cannot_be_drawn_into_are_refused_by_name() {
    let [world, other] = World::two();
    let depth = Format::Depth32Float;
    let usage = Usages::RENDER_ATTACHMENT;
    let into = |view: wgpu::TextureView| {
        let World { context, occluders, camera, .. } = &world;
        Box::new(move |encoder: &mut wgpu::CommandEncoder| {
            context
                .record_occluders(encoder, occluders, camera, &view, &DrawOptions::default())
                .map(drop)
        }) as Box<_>
    };
    let but = |usage, change: &dyn Fn(&mut wgpu::TextureDescriptor<'_>)| {
        into(plain(&world.texture_but(depth, usage, change)))
    };
    let layers = || world.texture_but(depth, usage, |d| d.size.depth_or_array_layers = 3);
    let destroyed = world.texture(depth, usage);
    let of_destroyed = plain(&destroyed);
    destroyed.destroy();
    let gone = "target: expected a view of one layer of a texture of this device \
                that has not been destroyed";
    run(
        &world,
        &[
            ("a target", "", into(plain(&world.texture(depth, usage)))),
            (
                "one layer of three",
                "",
                into(layers().create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(wgpu::TextureViewDimension::D2),
                    base_array_layer: 2,
                    array_layer_count: Some(1),
                    ..Default::default()
                })),
            ),
            ("three layers", gone, into(plain(&layers()))),
            ("another device's", gone, into(plain(&other.texture(depth, usage)))),
            ("destroyed", gone, into(of_destroyed)),
            (
                "a view without the usage",
                gone,
                into(world.texture(depth, usage | SAMPLED).create_view(
                    &wgpu::TextureViewDescriptor { usage: Some(SAMPLED), ..Default::default() },
                )),
            ),
            ("no usage", "target: expected the usage RENDER_ATTACHMENT", but(SAMPLED, &|_| ())),
            (
                "another format",
                "target: expected a Depth32Float texture",
                into(plain(&world.texture(Format::Depth16Unorm, usage))),
            ),
            (
                "another size",
                "target: expected a Depth32Float texture of the camera's size",
                but(usage, &|d| d.size.width = 8),
            ),
            (
                "samples",
                "target: expected a 2D texture of one mip level and one sample",
                but(usage, &|d| d.sample_count = 4),
            ),
            (
                "mips",
                "target: expected a 2D texture of one mip level",
                but(usage | SAMPLED, &|d| d.mip_level_count = 2),
            ),
            (
                "another context's occluders",
                "occluders: expected an object of this device and context",
                Box::new(|encoder| {
                    let view = plain(&world.texture(depth, usage));
                    world
                        .context
                        .record_occluders(
                            encoder,
                            &other.occluders,
                            &world.camera,
                            &view,
                            &DrawOptions::default(),
                        )
                        .map(drop)
                }),
            ),
        ],
    );
}
