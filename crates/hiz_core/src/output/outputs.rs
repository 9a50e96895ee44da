//! Outputs: what a cull is asked to leave behind.

use crate::output::draw::DrawTemplate;
use crate::output::emit::Emit;

/// What a cull leaves behind.
/// Anything that is not asked for is neither computed nor stored.
///
/// # Examples
/// Room for one of two visible instances: the list ends there, and the mask is complete.
///
/// ```
/// # use hiz_core::headless::Engine;
/// # use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
/// # use hiz_core::{InstanceOptions, Pose, Projection};
/// use hiz_core::{DrawIndexedIndirect, DrawTemplate, Outputs};
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let pyramid = engine.pyramid(&engine.upload_depth(&[0.0; 64 * 64], &camera)?)?;
/// # let (centers, radii) = ([0.0, 0.0, -5.0, 1.0, 0.0, -5.0], [0.5, 0.5]);
/// # let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
/// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
/// # let options = CullOptions::default();
///
/// let outputs = Outputs {
///     mask: true,
///     indices: true,
///     draws: true,
///     capacity: Some(1),
///     draw: DrawTemplate { index_count: 36, ..DrawTemplate::default() },
///     ..Outputs::NONE
/// };
/// let culling = engine.cull(&instances, &camera, &pyramid, &options, &outputs)?;
/// assert_eq!(culling.mask()?, [true, true]);
/// assert_eq!(culling.indices()?, [0]);
/// let draw = DrawIndexedIndirect { index_count: 36, instance_count: 1, ..Default::default() };
/// assert_eq!(culling.draws()?, [draw]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Outputs {
    /// One bit per instance: kept or not.
    pub mask: bool,
    /// The verdict of each instance.
    /// [`Counts`](crate::headless::Counts) come from it, and
    /// [`verdicts`](crate::headless::Culling::verdicts) says what each verdict means.
    pub verdicts: bool,
    /// The packed list of the indices of the kept instances.
    pub indices: bool,
    /// The draw arguments.
    /// Their instance count is the length of the list, whether or not there is a list.
    pub draws: bool,
    /// The [`PixelCounts`](crate::PixelCounts) of each instance, by a pass of its own.
    pub pixels: bool,
    /// How many rows of four texels that pass may read of an instance.
    /// The pixels that are left then count as undecided.
    /// `None`: as many as it takes.
    pub pixel_budget: Option<u32>,
    /// How many indices are written at most, in all pieces together.
    /// `None`: as many as there are instances.
    pub capacity: Option<u32>,
    /// The constant part of the draw arguments of [`Emit::List`].
    pub draw: DrawTemplate,
    /// How indices and draw arguments are arranged.
    pub emit: Emit,
}

impl Outputs {
    /// Nothing.
    pub const NONE: Self = Self {
        mask: false,
        verdicts: false,
        indices: false,
        draws: false,
        pixels: false,
        pixel_budget: None,
        capacity: None,
        draw: DrawTemplate { index_count: 0, first_index: 0, base_vertex: 0, first_instance: 0 },
        emit: Emit::List,
    };
    /// Everything but counts of pixels, for all instances.
    pub const ALL: Self = Self {
        mask: true,
        verdicts: true,
        indices: true,
        draws: true,
        pixels: false,
        pixel_budget: None,
        capacity: None,
        draw: DrawTemplate { index_count: 0, first_index: 0, base_vertex: 0, first_instance: 0 },
        emit: Emit::List,
    };
}

impl std::fmt::Display for Outputs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let all = [
            (self.mask, "mask"),
            (self.verdicts, "verdicts"),
            (self.indices, "indices"),
            (self.draws, "draws"),
            (self.pixels, "pixels"),
        ];
        let names: Vec<_> =
            all.into_iter().filter_map(|(asked, name)| asked.then_some(name)).collect();
        if names.is_empty() { f.write_str("nothing") } else { f.write_str(&names.join(", ")) }
    }
}

impl Default for Outputs {
    fn default() -> Self {
        Self::ALL
    }
}
