//! A texture with real mip levels of depth, for shaders of the caller's own.

use crate::error::{Error, Result};
use crate::gpu::device::{ContextId, Gpu};
use crate::input::image::ImageSize;
use crate::pyramid::mips_bindings::MipBindings;
use crate::pyramid::mips_plan::{self, MipPlan};
use crate::pyramid::sources::Sources;

/// WGSL functions that find texels of a mip texture: sizes, texels, levels.
///
/// Append this text to a shader of your own.
/// [`MipTexture`] has an example.
pub const MIP_LOOKUP: &str =
    include_str!(concat!(env!("HIZ_SHADERS"), "/snippets/mip_lookup.wgsl"));

/// A WGSL function that culls by a mip texture, for shaders of the caller's own.
///
/// It needs [`MIP_LOOKUP`] in the same shader, and a texture with [`MipLayout::Atlas`].
/// Nothing certifies its answer: see `docs/rust.md`.
pub const MIP_CULL: &str = include_str!(concat!(env!("HIZ_SHADERS"), "/snippets/mip_cull.wgsl"));

/// Which depths of its pixels a texel of a mip texture holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum MipDepths {
    /// The farthest, in a texture of the format `R32Float`.
    #[default]
    Farthest,
    /// The nearest, in a texture of the format `R32Float`.
    Nearest,
    /// The farthest in x and the nearest in y, in a texture of the format `Rg32Float`.
    Both,
}

/// How shaders find the texel that covers a pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum MipLookup {
    /// By normalised coordinates `u`: texel `floor(u n)` of a level with `n` texels along an axis.
    ///
    /// That is what a sampler with nearest filtering takes.
    /// A texel covers every pixel that its part of the image touches.
    /// So at odd sizes neighbouring texels share pixels.
    #[default]
    Normalized,
    /// By the pixel's number `p`: texel `min(p >> k, n - 1)` of level `k`.
    ///
    /// Texels share no pixels, and the last one of a row or column covers what is left.
    EdgeTexel,
}

/// Where the levels lie in the texture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum MipLayout {
    /// Each is a mip level.
    #[default]
    Levels,
    /// All of them, level 0 included, are parts of one mip level.
    /// `mip_origin` in [`MIP_LOOKUP`] says where each begins.
    ///
    /// `textureGather` reads one mip level alone, so it needs this layout.
    Atlas,
}

/// What a [`MipTexture`] holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MipOptions {
    /// Which depths.
    pub depths: MipDepths,
    /// How its texels are looked up.
    pub lookup: MipLookup,
    /// Whether the image itself, level 0, becomes the texture's mip level 0.
    ///
    /// Otherwise mip level 0 is level 1, which costs less.
    /// An image of one pixel has level 0 alone, and a [`MipLayout::Atlas`] has it, too.
    pub level_0: bool,
    /// Where the levels lie.
    pub layout: MipLayout,
}

/// A texture with the levels of a depth image, for shaders of the caller's own; made by
/// [`HizContext::create_mip_texture`](crate::HizContext::create_mip_texture).
///
/// Level k has `max(1, size >> k)` texels along each side.
/// Pixels without a depth (NaN, outside of 0..=1) count as far for the farthest depths, and as near
/// for the nearest ones.
/// Subnormals and -0 become 0.
///
/// The formats are `R32Float` and `Rg32Float`.
/// WebGPU filters neither of them by default, so read them by `textureLoad` or by a sampler with
/// nearest filtering.
///
/// # Examples
/// A shader that reads the nearest depth around each pixel, at level 3:
///
/// ```
/// # use hiz_core::headless::Engine;
/// use hiz_core::{DepthConvention, ImageSize, MIP_LOOKUP, MipDepths, MipLookup, MipOptions, wgpu};
/// # let engine = Engine::new(None)?;
/// # let (device, hiz) = (engine.device(), engine.context());
/// # let size = ImageSize::new(100, 60);
/// # let depth = device.create_texture(&wgpu::TextureDescriptor {
/// #     label: None,
/// #     size: wgpu::Extent3d { width: 100, height: 60, depth_or_array_layers: 1 },
/// #     mip_level_count: 1,
/// #     sample_count: 1,
/// #     dimension: wgpu::TextureDimension::D2,
/// #     format: wgpu::TextureFormat::Depth32Float,
/// #     usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
/// #     view_formats: &[],
/// # });
/// # let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
///
/// // Once, for a depth texture of 100 x 60 pixels:
/// let options = MipOptions {
///     depths: MipDepths::Nearest,
///     lookup: MipLookup::EdgeTexel,
///     level_0: true,
///     ..MipOptions::default()
/// };
/// let mips = hiz.create_mip_texture(size, &options)?;
/// assert_eq!((mips.num_levels(), mips.level_size(3)), (7, Some(ImageSize::new(12, 7))));
/// let shader = format!(
///     "{MIP_LOOKUP}
///     @group(0) @binding(0) var mips: texture_2d<f32>;
///     fn nearest_around(pixel: vec2<u32>, size: vec2<u32>) -> f32 {{
///         return textureLoad(mips, mip_edge_texel(pixel, 3u, size), 3).x;
///     }}"
/// );
/// # device.create_shader_module(wgpu::ShaderModuleDescriptor {
/// #     label: None,
/// #     source: wgpu::ShaderSource::Wgsl(shader.into()),
/// # });
///
/// // Each frame, after the depth texture was drawn:
/// hiz.record_mips(&mut encoder, &depth, DepthConvention::Reversed, &mips)?;
/// let bound = mips.view();
/// # let _ = bound;
/// # engine.queue().submit([encoder.finish()]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct MipTexture {
    pub(super) context: ContextId,
    pub(super) size: ImageSize,
    pub(super) options: MipOptions,
    pub(super) plan: MipPlan,
    pub(super) texture: wgpu::Texture,
    view: wgpu::TextureView,
    pub(super) bindings: MipBindings,
    pub(super) sources: Sources,
}

impl MipTexture {
    pub(crate) fn new(gpu: &Gpu, size: ImageSize, options: &MipOptions) -> Result<Self> {
        let limits = gpu.limits();
        let (side, allowed) = (size.width.max(size.height), limits.max_texture_dimension_2d);
        if side > allowed {
            return Err(Error::limit("max_texture_dimension_2d", side.into(), allowed.into()));
        }
        if size.pixels() == 0 {
            return Err(Error::invalid(
                "size",
                format!("expected at least one pixel a side, got {size}"),
            ));
        }
        let is_atlas = options.layout == MipLayout::Atlas;
        let is_pixel = size.pixels() == 1;
        let options = MipOptions { level_0: options.level_0 || is_atlas || is_pixel, ..*options };
        let format = options.format();
        let texel_bytes = format.block_copy_size(None).unwrap_or(4);
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let plan = MipPlan::new(size, texel_bytes, options.level_0, most)?;
        let usage = wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::COPY_SRC;
        let (extent, levels) = if is_atlas {
            (plan.atlas_size(), 1)
        } else {
            let first = u32::from(!options.level_0);
            (mips_plan::level_size(size, first), plan.levels.len() as u32 - first)
        };
        let extent = (extent.width, extent.height);
        let texture = gpu.texture_of_levels("hiz.mips.texture", extent, format, usage, levels)?;
        Ok(Self {
            context: gpu.id(),
            size,
            options,
            view: gpu.view(&texture)?,
            texture,
            bindings: MipBindings::new(gpu, &plan)?,
            plan,
            sources: Sources::new(),
        })
    }

    /// The depth image's size in pixels.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// The options, where [`MipOptions::level_0`] says whether level 0 is there.
    pub fn options(&self) -> MipOptions {
        self.options
    }

    /// The number of levels, counted from the image, which is level 0.
    pub fn num_levels(&self) -> u32 {
        self.plan.levels.len() as u32
    }

    /// The size of a level, counted from the image; `None` past the last one.
    pub fn level_size(&self, level: u32) -> Option<ImageSize> {
        (level < self.num_levels()).then(|| mips_plan::level_size(self.size, level))
    }

    /// The level that is the texture's mip level 0: 0 with [`MipOptions::level_0`], otherwise 1.
    pub fn first_level(&self) -> u32 {
        u32::from(!self.options.level_0)
    }

    /// The texture, with the usages `TEXTURE_BINDING` and `COPY_SRC`.
    pub fn texture(&self) -> &wgpu::Texture {
        &self.texture
    }

    /// The view of all levels.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        let texel = u64::from(self.texture.format().block_copy_size(None).unwrap_or(4));
        let level = |k: u32| {
            let side = |side: u32| u64::from((side >> k).max(1));
            side(self.texture.width()) * side(self.texture.height())
        };
        let texels: u64 = (0..self.texture.mip_level_count()).map(level).sum();
        self.plan.bytes + texel * texels
    }

    pub(crate) fn context(&self) -> ContextId {
        self.context
    }

    /// Where a level lies in the texture; `None` for one that is not there.
    pub(crate) fn place_of(&self, level: u32) -> Option<wgpu::TexelCopyTextureInfo<'_>> {
        if level < self.first_level() || level >= self.num_levels() {
            return None;
        }
        let whole = self.texture.as_image_copy();
        Some(match self.options.layout {
            MipLayout::Levels => {
                wgpu::TexelCopyTextureInfo { mip_level: level - self.first_level(), ..whole }
            }
            MipLayout::Atlas => {
                let [x, y] = self.plan.atlas_origin(level);
                wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x, y, z: 0 }, ..whole }
            }
        })
    }
}

impl MipOptions {
    /// The texture's format.
    pub fn format(&self) -> wgpu::TextureFormat {
        match self.depths {
            MipDepths::Farthest | MipDepths::Nearest => wgpu::TextureFormat::R32Float,
            MipDepths::Both => wgpu::TextureFormat::Rg32Float,
        }
    }
}
