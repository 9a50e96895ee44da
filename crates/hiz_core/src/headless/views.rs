//! Culls for several views: one submission and one readback.

use std::sync::Arc;
use std::time::Instant;

use crate::cull::among::{Among, AmongMask, record_among};
use crate::cull::options::CullOptions;
use crate::cull::views::{View, ViewsInputs, record_cull_views};
use crate::error::{Error, Result};
use crate::gpu::copies::{BufferRange, Copies};
use crate::gpu::pipelines::PipelinesMade;
use crate::headless::cull::{CullExtras, Question, Reading, Submission, tell_when_done};
use crate::headless::culling::{Culling, spread_bits};
use crate::headless::engine::Engine;
use crate::headless::ranges::mask_bytes;
use crate::headless::readback::{self, to_u32};
use crate::host::memory;
use crate::input::camera::Camera;
use crate::instances::{Instances, InstancesId};
use crate::output::draw::DrawIndexedIndirect;
use crate::output::views::{Joined, ViewsOutputs};
use crate::output::visible::Visible;
use crate::pyramid::Pyramid;

/// How many masks of culls are kept for later ones.
const AMONGS_KEPT: usize = 4;

/// Which instances a cull is restricted to; see [`Engine::among`].
#[derive(Debug, Clone, Copy)]
pub enum AmongSource<'a> {
    /// One flag per instance.
    Mask(&'a [bool]),
    /// What a cull of the same instances has kept; it must have been asked for a mask.
    Kept(&'a Culling),
    /// What any view of an earlier call has kept.
    KeptByAny(&'a ViewsCulling),
}

impl<'a> AmongSource<'a> {
    /// The mask as a recording takes it, such as [`CullExtras::mask`].
    /// `words` holds the bits of flags; it comes empty.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a mask of another length.
    /// - [`Error::Mismatch`] for a cull without a mask.
    pub fn mask<'b>(&self, instances: &Instances, words: &'b mut Vec<u32>) -> Result<AmongMask<'b>>
    where
        'a: 'b,
    {
        match *self {
            Self::Kept(culling) if !culling.visible.outputs().mask => {
                let outputs = culling.visible.outputs();
                Err(Error::mismatch(
                    "among",
                    format!("expected a cull that was asked for mask, got one with {outputs}"),
                ))
            }
            Self::Mask(mask) if mask.len() != instances.len() as usize => Err(Error::invalid(
                "among",
                format!("expected {} flags, got {}", instances.len(), mask.len()),
            )),
            Self::Mask(mask) => {
                let word = |flags: &[bool]| {
                    flags.iter().rev().fold(0_u32, |word, flag| word << 1 | u32::from(*flag))
                };
                words.extend(mask.chunks(32).map(word));
                Ok(AmongMask::Bits(words))
            }
            Self::Kept(culling) => Ok(AmongMask::Kept(&culling.visible)),
            Self::KeptByAny(views) => Ok(AmongMask::Kept(&views.joined.any)),
        }
    }
}

/// A cull for several views that was submitted.
///
/// # Examples
/// Two cameras, one on each side of a wall, and a sphere on each side:
///
/// ```
/// # use hiz_core::headless::{CullExtras, Engine};
/// # use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
/// # use hiz_core::{InstanceOptions, Pose, Projection, ViewsOutputs};
/// # let engine = Engine::new(None)?;
/// # let looking = |z: f64| {
/// #     let pose = Pose { eye: [0.0, 0.0, z], target: [0.0; 3], up: [0.0, 1.0, 0.0] };
/// #     let (fov_y, convention) = (1.0, DepthConvention::Reversed);
/// #     let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// #     Camera::look_at(&pose, &projection, ImageSize::new(64, 64))
/// # };
/// # let pyramid = |camera| engine.pyramid(&engine.upload_depth(&[0.01; 64 * 64], camera)?);
/// let (front, back) = (looking(10.0)?, looking(-10.0)?);
/// let views = [(&front, &pyramid(&front)?), (&back, &pyramid(&back)?)];
/// # let (centers, radii) = ([0.0, 0.0, 5.0, 0.0, 0.0, -5.0], [0.5, 0.5]);
/// # let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
/// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
/// let (options, outputs) = (CullOptions::default(), ViewsOutputs::default());
/// let extras = CullExtras::default();
/// let culling = engine.cull_views(&instances, &views, &options, &outputs, &extras)?;
/// assert_eq!(culling.masks()?, [[true, false], [false, true]].concat());
/// assert_eq!(culling.any()?, [true, true]);
/// assert_eq!(culling.view(1).indices()?, [1]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct ViewsCulling {
    engine: Engine,
    instances: Arc<Instances>,
    each: Vec<Arc<Culling>>,
    joined: Arc<Joined>,
    copies: Copies,
    /// Held for its drop, which frees the slot.
    slot: Arc<()>,
}

impl Engine {
    /// Brings a mask to the device, for culls of the instances that it names.
    /// The mask of an earlier cull stays on the device.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a mask of another length.
    /// - [`Error::Mismatch`] for a cull of other instances or without a mask.
    /// - [`Error::OutOfMemory`] and [`Error::DeviceLost`].
    pub fn among(
        &self,
        instances: &Arc<Instances>,
        source: &AmongSource<'_>,
    ) -> Result<Arc<Among>> {
        let mut words = Vec::new();
        let mask = source.mask(instances, &mut words)?;
        let gpu = &self.context().gpu;
        self.scoped(|| {
            let among = Among::new(gpu, instances)?;
            let mut encoder = self.encoder("hiz.among.encoder");
            self.timed(&mut encoder, |encoder| {
                record_among(gpu, encoder, instances, &mask, &among)
            })?;
            self.queue().submit([encoder.finish()]);
            Ok(Arc::new(among))
        })
    }

    /// Records what brings the mask of a cull to the device, if it has one of its own.
    pub(super) fn record_mask(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Arc<Instances>,
        extras: &CullExtras<'_>,
    ) -> Result<Option<Arc<Among>>> {
        let Some(mask) = &extras.mask else { return Ok(extras.among.cloned()) };
        if extras.among.is_some() {
            return Err(Error::invalid("mask", "expected no among beside it, got both"));
        }
        let among = self.lend_among(instances)?;
        record_among(&self.context().gpu, encoder, instances, mask, &among)?;
        Ok(Some(among))
    }

    /// An [`Among`] that no cull uses any more, or a new one.
    /// Its recording writes all of it again.
    fn lend_among(&self, instances: &Arc<Instances>) -> Result<Arc<Among>> {
        let mut kept = self.amongs().lock();
        let is_free = |(id, among): &&(InstancesId, Arc<Among>)| {
            *id == instances.id && Arc::strong_count(among) == 1
        };
        if let Some((_, free)) = kept.iter().find(is_free) {
            return Ok(Arc::clone(free));
        }
        let among = Arc::new(Among::new(&self.context().gpu, instances)?);
        kept.insert(0, (instances.id, Arc::clone(&among)));
        kept.truncate(AMONGS_KEPT);
        Ok(among)
    }

    /// Culls for several views, each a camera and its pyramid: one submission and one readback.
    ///
    /// The submission copies the masks of all views, and what was asked of their union, in any
    /// case; with [`CullExtras::ahead`] also what was asked of each view.
    ///
    /// # Errors
    /// Those of [`Engine::cull`], and [`Error::Invalid`] for no views or more than
    /// [`MAX_VIEWS`](crate::MAX_VIEWS).
    pub fn cull_views(
        &self,
        instances: &Arc<Instances>,
        views: &[(&Camera, &Arc<Pyramid>)],
        options: &CullOptions,
        outputs: &ViewsOutputs,
        extras: &CullExtras<'_>,
    ) -> Result<ViewsCulling> {
        let submit = || {
            let culled =
                self.scoped(|| self.submit_views(instances, views, options, outputs, extras));
            if culled.is_err() {
                self.answers().forget();
                self.joined().forget();
                for (_, pyramid) in views {
                    pyramid.forget();
                }
            }
            culled
        };
        if !extras.ahead {
            self.check_process()?;
            return submit();
        }
        self.in_a_slot(submit, |culling| culling.each.first().map(|one| one.taken(&culling.slot)))
    }

    fn submit_views(
        &self,
        instances: &Arc<Instances>,
        views: &[(&Camera, &Arc<Pyramid>)],
        options: &CullOptions,
        outputs: &ViewsOutputs,
        extras: &CullExtras<'_>,
    ) -> Result<ViewsCulling> {
        let gpu = &self.context().gpu;
        let (start, made_before) = (Instant::now(), PipelinesMade::so_far());
        let ViewsOutputs { each: outputs, any } = outputs.completed();
        let joined = self.joined().lend(gpu, instances, views.len(), &any)?;
        let lend = |_| self.answers().lend(self.context(), instances, &outputs);
        let buffers = views.iter().map(lend).collect::<Result<Vec<_>>>()?;
        let visible: Vec<_> = buffers.iter().map(|buffers| Arc::clone(&buffers.visible)).collect();
        let visible: Vec<&Visible> = visible.iter().map(Arc::as_ref).collect();
        let of_views: Vec<_> =
            views.iter().map(|(camera, pyramid)| View { camera, pyramid }).collect();
        if outputs.pixels {
            views.iter().for_each(|(_, pyramid)| self.bring_image_of(pyramid));
        }
        let mut encoder = self.encoder("hiz.views.encoder");
        let inputs = ViewsInputs {
            instances,
            views: &of_views,
            among: None,
            options,
            idle: false,
            built: None,
        };
        let (among, times) = self.timed(&mut encoder, |encoder| {
            let among = self.record_mask(encoder, instances, extras)?;
            let inputs = ViewsInputs { among: among.as_deref(), ..inputs };
            record_cull_views(gpu, encoder, &inputs, &visible, &joined)?;
            Ok(among)
        })?;
        let questions: Vec<_> = views
            .iter()
            .map(|(camera, pyramid)| Question {
                instances,
                camera,
                pyramid,
                options,
                among: among.as_ref(),
            })
            .collect();
        let reading = if extras.ahead { Reading::Ahead } else { Reading::Later };
        let recorded = questions
            .iter()
            .zip(buffers)
            .map(|(question, buffers)| {
                question.record_reading(self, &mut encoder, buffers, reading)
            })
            .collect::<Result<Vec<_>>>()?;
        let ranges = ranges(instances, &joined);
        let copies = Copies::record(gpu, &mut encoder, self.staging(), &ranges)?;
        let done = tell_when_done(&encoder);
        let timings = self.compiled((start, made_before), |encoder| {
            let inputs = ViewsInputs { among: among.as_deref(), idle: true, ..inputs };
            record_cull_views(gpu, encoder, &inputs, &visible, &joined)
        })?;
        let watches = &mut instances.watches();
        let at = Instant::now();
        let index = self.queue().submit([encoder.finish()]);
        let submission = Submission { index, at, done, timings, times };
        let each = questions.iter().zip(recorded).map(|(question, recorded)| {
            watches.add(&recorded.watch);
            Arc::new(question.submitted(self, recorded, &submission))
        });
        Ok(ViewsCulling {
            each: each.collect(),
            engine: self.clone(),
            instances: Arc::clone(instances),
            joined,
            copies,
            slot: Arc::new(()),
        })
    }
}

/// The masks of all views, and mask, lists and draw arguments of their union.
fn ranges<'a>(instances: &Instances, joined: &'a Joined) -> Vec<BufferRange<'a>> {
    let mut ranges = vec![BufferRange::first(&joined.masks, joined.masks.size())];
    for (piece, output) in instances.pieces.iter().zip(&joined.any.pieces) {
        ranges.push(BufferRange::first(&output.mask, mask_bytes(piece)));
    }
    if let Some(lists) = &joined.any.lists {
        ranges.push(BufferRange::first(&lists.draws, lists.draws.size()));
        let filled = lists.pieces.iter().filter(|list| list.indices.is_some());
        ranges.extend(
            filled.map(|list| BufferRange::first(list.bound(), 4 * u64::from(list.capacity))),
        );
    }
    ranges
}

impl ViewsCulling {
    /// The number of views.
    pub fn num_views(&self) -> usize {
        self.each.len()
    }

    /// The cull for one view, with everything that can be read from it.
    ///
    /// # Panics
    /// If `view` is not below [`ViewsCulling::num_views`].
    pub fn view(&self, view: usize) -> &Arc<Culling> {
        &self.each[view]
    }

    /// The instances that were culled.
    pub fn instances(&self) -> &Instances {
        &self.instances
    }

    /// Whether the masks of all views have arrived; this asks the device and never waits.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn is_ready(&self) -> Result<bool> {
        if !self.copies.is_ready() {
            self.engine.scoped(|| readback::look(self.engine.device()))?;
        }
        Ok(self.copies.is_ready() && self.each[0].is_ready()?)
    }

    /// Waits until the device is done and the masks have arrived.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn wait(&self) -> Result<()> {
        self.each[0].wait()?;
        self.engine.await_copies(&self.copies)
    }

    fn read(&self, range: &BufferRange<'_>) -> Result<Vec<u8>> {
        self.wait()?;
        let bytes = self.engine.scoped(|| self.copies.read(range))?;
        bytes.ok_or_else(|| Error::Device("a range that was not copied".to_owned()))
    }

    /// Whether each view keeps each instance: the flags of all instances for the first view, then
    /// those for the second, and so on.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] and [`Error::OutOfMemory`].
    pub fn masks(&self) -> Result<Vec<bool>> {
        let count = self.instances.len() as usize;
        let bytes = self.read(&BufferRange::first(&self.joined.masks, self.joined.masks.size()))?;
        let mut masks = memory::list(count * self.num_views(), "masks")?;
        masks.resize(count * self.num_views(), false);
        if count > 0 {
            let rows = bytes.chunks_exact(self.joined.stride as usize);
            for (row, mask) in rows.zip(masks.chunks_exact_mut(count)) {
                spread_bits(row, mask);
            }
        }
        Ok(masks)
    }

    /// Whether any view keeps each instance.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] and [`Error::OutOfMemory`].
    pub fn any(&self) -> Result<Vec<bool>> {
        let count = self.instances.len() as usize;
        let mut any = memory::list(count, "any")?;
        any.resize(count, false);
        let mut rest = &mut any[..];
        for (piece, output) in self.instances.pieces.iter().zip(&self.joined.any.pieces) {
            let (part, behind) = rest.split_at_mut(piece.count() as usize);
            spread_bits(&self.read(&BufferRange::first(&output.mask, mask_bytes(piece)))?, part);
            rest = behind;
        }
        Ok(any)
    }

    /// The draw arguments of what any view keeps, one record per piece.
    ///
    /// # Errors
    /// [`Error::Mismatch`] if [`ViewsOutputs::any`] asked for neither indices nor draws;
    /// [`Error::DeviceLost`] and [`Error::OutOfMemory`].
    pub fn any_draws(&self) -> Result<Vec<DrawIndexedIndirect>> {
        let Some(lists) = &self.joined.any.lists else { return Err(self.not_asked("draws")) };
        let bytes = self.read(&BufferRange::first(&lists.draws, lists.draws.size()))?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// The list of what any view keeps, ascending.
    ///
    /// # Errors
    /// [`Error::Mismatch`] if [`ViewsOutputs::any`] did not ask for indices;
    /// [`Error::DeviceLost`] and [`Error::OutOfMemory`].
    pub fn any_indices(&self) -> Result<Vec<u32>> {
        let lists = self.joined.any.lists.as_ref().filter(|_| self.joined.any.outputs().indices);
        let Some(lists) = lists else { return Err(self.not_asked("indices")) };
        let mut indices = Vec::new();
        for (list, draw) in lists.pieces.iter().zip(self.any_draws()?) {
            let size = 4 * u64::from(draw.instance_count.min(list.capacity));
            let bytes = self.read(&BufferRange::first(list.bound(), size))?;
            indices.extend(to_u32(&bytes));
        }
        Ok(indices)
    }

    fn not_asked(&self, output: &str) -> Error {
        let got = self.joined.any.outputs();
        Error::mismatch(
            "outputs",
            format!(
                "expected a cull that was asked for {output} of any view, got one with {got}; \
                 name {output} among the cull's outputs"
            ),
        )
    }
}
