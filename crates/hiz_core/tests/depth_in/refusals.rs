//! What is refused is refused by name, and says the way out.

use hiz_core::{
    DepthConvention, DepthSource, DepthTolerance, Error, ImageSize, PyramidOptions, ResolveOptions,
    ResolvedDepths, wgpu,
};
use wgpu::TextureFormat as Format;

use crate::common::{camera_along_z, depth_descriptor, engine};
use crate::{SAMPLED, encoder};

/// How the error of a call must begin; the case's name comes first.
fn check(what: &str, expected: &str, found: Result<(), Error>) {
    let text = found.expect_err(what).to_string();
    assert!(text.starts_with(expected), "{what}: {text}");
}

#[test]
fn parts_that_are_not_there_are_refused_by_name() {
    let engine = engine();
    let (device, context) = (engine.device(), engine.context());
    let camera = camera_along_z(16, 16, DepthConvention::Standard);
    let pyramid = context.create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
    let mut descriptor = depth_descriptor((32, 32), Format::R32Float, SAMPLED);
    descriptor.mip_level_count = 2;
    descriptor.size.depth_or_array_layers = 3;
    let texture = device.create_texture(&descriptor);
    let packed = Format::Rgba32Uint;
    let usage = wgpu::TextureUsages::STORAGE_BINDING;
    let packed = device.create_texture(&depth_descriptor((8, 16), packed, usage));
    let of = |texture| DepthSource::from(texture);
    let part = DepthSource {
        mip_level: Some(0),
        array_layer: Some(1),
        size: Some(camera.size()),
        ..of(&texture)
    };
    let mut commands = encoder(device);
    let mut reduce =
        |depth: DepthSource<'_>| context.record_reduce(&mut commands, depth, &camera, &pyramid);
    // These work: a mip level of the pyramid's size, and a corner of the level above.
    reduce(DepthSource { mip_level: Some(1), size: None, ..part }).unwrap();
    reduce(DepthSource { origin: [16, 16], ..part }).unwrap();
    for (what, expected, depth) in [
        (
            "no mip level",
            "depth: expected which of 2 mip levels, got none: a texture or a view does not say it; \
             set DepthSource::mip_level",
            DepthSource { mip_level: None, ..part },
        ),
        (
            "no layer",
            "depth: expected which of 3 layers, got none: a texture or a view does not say it; set \
             DepthSource::array_layer",
            DepthSource { array_layer: None, ..part },
        ),
        (
            "past the mip levels",
            "depth: expected a mip level below 2, got 2",
            DepthSource { mip_level: Some(2), ..part },
        ),
        (
            "past the layers",
            "depth: expected a layer below 3, got 3",
            DepthSource { array_layer: Some(3), ..part },
        ),
        (
            "the stencil",
            "depth: expected the aspect All or DepthOnly, got StencilOnly",
            DepthSource { aspect: wgpu::TextureAspect::StencilOnly, ..part },
        ),
        (
            "another size",
            "depth: expected the pyramid's size (height 16, width 16), got DepthSource::size \
             (height 16, width 8)",
            DepthSource { size: Some(ImageSize::new(8, 16)), ..part },
        ),
        (
            "a larger level without a size",
            "depth: expected the pyramid's size (height 16, width 16), got (height 32, width 32); \
             set DepthSource::size",
            DepthSource { size: None, ..part },
        ),
        (
            "past the right edge",
            "depth: expected the pyramid's size (height 16, width 16), got (height 32, width 15) \
             from (17, 0) on, of a level of (height 32, width 32)",
            DepthSource { origin: [17, 0], ..part },
        ),
        (
            "past the lower edge",
            "depth: expected the pyramid's size (height 16, width 16), got (height 0, width 32) \
             from (0, 99) on",
            DepthSource { origin: [0, 99], ..part },
        ),
        (
            "a part of packed pixels",
            "depth: expected the origin (0, 0) for Rgba32Uint",
            DepthSource { origin: [4, 0], ..of(&packed) },
        ),
        (
            "packed pixels of a larger image",
            "depth: expected the pyramid's size (height 16, width 16) as (height 16, width 4) \
             texels of four pixels, got (height 16, width 8)",
            DepthSource { size: Some(camera.size()), ..of(&packed) },
        ),
        (
            "no sample",
            "depth: expected at least one sample per pixel, got samples 0",
            DepthSource { samples: 0, ..part },
        ),
        (
            "a tolerance",
            "tolerance.relative: expected a number in 0..=0.5, got 0.75",
            DepthSource { tolerance: DepthTolerance { relative: 0.75, absolute: 0.0 }, ..part },
        ),
    ] {
        check(what, expected, reduce(depth));
    }
    engine.queue().submit([commands.finish()]);
}

#[test]
fn what_cannot_be_resolved_is_refused_by_name() {
    let engine = engine();
    let (device, context) = (engine.device(), engine.context());
    let camera = camera_along_z(16, 16, DepthConvention::Standard);
    let size = camera.size();
    let resolve = context.create_depth_resolve(size, &ResolveOptions::default()).unwrap();
    let texture = |format, usage, samples, side| {
        let mut descriptor = depth_descriptor((side, side), format, usage);
        descriptor.sample_count = samples;
        device.create_texture(&descriptor)
    };
    let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
    let fits = texture(Format::Depth32Float, SAMPLED | drawn, 4, 16);
    let destroyed = texture(Format::Depth32Float, SAMPLED | drawn, 4, 16);
    destroyed.destroy();
    let mut commands = encoder(device);
    for (what, expected, texture) in [
        (
            "one sample",
            "depth: expected several samples per pixel, got 1; record_reduce takes",
            texture(Format::Depth32Float, SAMPLED, 1, 16),
        ),
        (
            "a color",
            "depth: expected a depth format, R32Float or R16Float, got Rgba8Unorm",
            texture(Format::Rgba8Unorm, SAMPLED | drawn, 4, 16),
        ),
        (
            "packed pixels",
            "depth: expected a depth format, R32Float or R16Float, got Rgba32Uint",
            texture(Format::Rgba32Uint, SAMPLED, 1, 16),
        ),
        (
            "no usage",
            "depth: expected the usage TEXTURE_BINDING, got",
            texture(Format::Depth32Float, drawn, 4, 16),
        ),
        (
            "another size",
            "depth: expected the resolve's size (height 16, width 16), got (height 8, width 8)",
            texture(Format::Depth32Float, SAMPLED | drawn, 4, 8),
        ),
        ("a destroyed texture", "depth: expected a texture of this device and context", destroyed),
    ] {
        check(what, expected, context.record_resolve(&mut commands, &texture, &camera, &resolve));
    }
    let smaller = camera_along_z(8, 16, DepthConvention::Standard);
    let other = context.record_resolve(&mut commands, &fits, &smaller, &resolve);
    let expected = "camera: expected the depth image's size (height 16, width 16), got";
    check("another camera", expected, other);
    let elsewhere = hiz_core::HizContext::new(device).unwrap();
    let other = elsewhere.record_resolve(&mut commands, &fits, &camera, &resolve);
    check("another context", "resolve: expected an object of this device and context", other);
    let none = resolve.farthest().map(drop);
    check("nothing yet", "resolve: expected one that depth was resolved into", none);
    context.record_resolve(&mut commands, &fits, &camera, &resolve).unwrap();
    let none = resolve.nearest().map(drop);
    check("no such end", "resolve: expected ResolveOptions::depths Nearest or Both, got", none);
    let options = ResolveOptions { depths: ResolvedDepths::Nearest };
    let nearest = context.create_depth_resolve(size, &options).unwrap();
    context.record_resolve(&mut commands, &fits, &camera, &nearest).unwrap();
    let none = nearest.farthest().map(drop);
    check("no such end", "resolve: expected ResolveOptions::depths Farthest or Both, got", none);
    let none = context.create_depth_resolve(ImageSize::new(0, 4), &options).map(drop);
    check("no pixels", "size: expected at least one pixel a side, got (height 4,", none);
    let none = context.create_depth_resolve(ImageSize::new(1 << 20, 4), &options).map(drop);
    check("too large", "max_texture_dimension_2d: requested 1048576", none);
    engine.queue().submit([commands.finish()]);
}

#[test]
fn regions_that_cannot_be_reduced_are_refused_by_name() {
    let engine = engine();
    let (device, context) = (engine.device(), engine.context());
    let camera = camera_along_z(16, 12, DepthConvention::Standard);
    let create = || context.create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
    let texture = || device.create_texture(&depth_descriptor((16, 12), Format::R32Float, SAMPLED));
    let (pyramid, depth, other) = (create(), texture(), texture());
    let mut commands = encoder(device);
    context.record_reduce(&mut commands, &depth, &camera, &pyramid).unwrap();
    let mut region = |depth: &wgpu::Texture, rectangle, pyramid| {
        context.record_reduce_region(&mut commands, depth, rectangle, pyramid)
    };
    region(&depth, [15, 11, 15, 11], &pyramid).unwrap();
    region(&depth, [0, 0, 15, 11], &pyramid).unwrap();
    for rectangle in [[3, 0, 2, 4], [0, 5, 4, 4], [0, 0, 16, 4], [0, 0, 4, 12]] {
        let expected = "rectangle: expected [x0, y0, x1, y1] with x0 <= x1 < 16 and y0 <= y1 < 12";
        check("a rectangle", expected, region(&depth, rectangle, &pyramid));
    }
    let all = [0, 0, 15, 11];
    let expected = "depth: expected the depth image that the pyramid was built from";
    check("another image", expected, region(&other, all, &pyramid));
    let expected = "pyramid: expected one that was built from a depth image";
    check("never built", expected, region(&depth, all, &create()));
    let elsewhere = hiz_core::HizContext::new(device).unwrap();
    let other = elsewhere.record_reduce_region(&mut commands, &depth, all, &pyramid);
    check("another context", "pyramid: expected an object of this device and context", other);
    engine.queue().submit([commands.finish()]);
}
