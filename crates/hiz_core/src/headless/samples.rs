//! Multisampled depth from the host: the farthest of each pixel's samples is uploaded.

use crate::error::{Error, Result};
use crate::headless::depth_image::{DepthImage, far_pixels};
use crate::headless::engine::Engine;
use crate::input::camera::Camera;
use crate::input::depth::{Conversion, DepthInput, sanitized, sanitized_near};
use crate::input::far_pixels::FarPixels;
use crate::input::image::DepthConvention;
use crate::input::near_slack::NearSlack;
use crate::input::tolerance::DepthTolerance;
use crate::pyramid::ends::{DepthEnd, Depths};

impl Engine {
    /// Uploads the farthest depth of several samples per pixel.
    ///
    /// `samples` has an image for each sample, all of the camera's size.
    /// A sample without a depth makes its pixel far.
    /// A pyramid of the image holds for everything that is drawn with these samples.
    /// Culls by it take [`Coverage::Area`](crate::Coverage::Area), the default.
    ///
    /// # Errors
    /// Those of [`Engine::upload_depth_of_kind`], and [`Error::Invalid`] without an image.
    pub fn upload_depth_of_samples(
        &self,
        samples: &[DepthInput<'_>],
        camera: &Camera,
    ) -> Result<DepthImage> {
        self.upload_samples_for(samples, camera, Depths::Farthest)
    }

    /// [`Engine::upload_depth_of_samples`] for a pyramid of `depths`, or of the farthest depths alone.
    ///
    /// The nearest depth of the samples is uploaded, too, where `depths` has it.
    /// A sample without a depth then makes its pixel near in the nearest end.
    ///
    /// # Errors
    /// Those of [`Engine::upload_depth_of_samples`].
    pub fn upload_samples_for(
        &self,
        samples: &[DepthInput<'_>],
        camera: &Camera,
        depths: Depths,
    ) -> Result<DepthImage> {
        self.check_process()?;
        let samples = Samples::new(samples, camera, (0, far_pixels(depths)))?;
        let upload = |end| {
            let image = DepthImage::for_upload(self, camera)?;
            let threads = samples.conversions[0].threads();
            self.scoped(|| {
                image.write_converted(threads, |first, rows| samples.rows(first, rows, end))
            })?;
            Ok(image)
        };
        let image = upload(DepthEnd::Farthest)?;
        let has_nearest = depths.has_nearest() && samples.count() > 1;
        let nearest = if has_nearest { Some(upload(DepthEnd::Nearest)?.texture) } else { None };
        Ok(DepthImage {
            samples: samples.count(),
            tolerance: samples.tolerance(),
            near_slack: samples.near_slack(),
            far_pixels: far_pixels(depths),
            no_data_is_far: samples.have_lost_no_data(),
            nearest,
            ..image
        })
    }
}

/// How the samples of an image, or of some rows of it, become one depth per pixel.
pub(super) struct Samples<'a> {
    conversions: Vec<Conversion<'a>>,
    convention: DepthConvention,
}

impl<'a> Samples<'a> {
    /// Images of whole rows of the camera's image, from row `first` on: one for each sample.
    pub(super) fn new(
        samples: &[DepthInput<'a>],
        camera: &Camera,
        (first, far_pixels): (u32, FarPixels),
    ) -> Result<Self> {
        if samples.is_empty() {
            return Err(Error::invalid("samples", "expected an image for each sample, got none"));
        }
        let convert =
            |sample| Conversion::of_rows(sample, camera, first).map(|of| of.telling(far_pixels));
        let conversions = samples.iter().map(convert).collect::<Result<_>>()?;
        Ok(Self { conversions, convention: camera.convention() })
    }

    /// How many samples a pixel has.
    pub(super) fn count(&self) -> u32 {
        self.conversions.len() as u32
    }

    /// What the depths may still be off by: the most that any sample's may.
    pub(super) fn tolerance(&self) -> DepthTolerance {
        let all = self.conversions.iter().map(Conversion::left);
        all.fold(DepthTolerance::NONE, |a, b| DepthTolerance {
            relative: a.relative.max(b.relative),
            absolute: a.absolute.max(b.absolute),
        })
    }

    /// Whether a sample's conversion has lost which pixels have no depth.
    pub(super) fn have_lost_no_data(&self) -> bool {
        self.conversions.iter().any(Conversion::has_lost_no_data)
    }

    /// How near the surfaces may be: the most that any sample's may.
    pub(super) fn near_slack(&self) -> NearSlack {
        let all = self.conversions.iter().map(Conversion::near_slack);
        all.reduce(|a, b| a.or(b, self.convention)).unwrap_or(NearSlack::NONE)
    }

    /// Converts whole rows to an end of the samples; the first is row `first` of the image.
    pub(super) fn rows(&self, first: u32, out: &mut [f32], end: DepthEnd) {
        let [only_or_first, others @ ..] = self.conversions.as_slice() else { return };
        only_or_first.rows(first, out);
        if others.is_empty() {
            return;
        }
        let takes_nearest = end == DepthEnd::Nearest;
        let depth = |d: f32| {
            let sanitized = if takes_nearest { sanitized_near } else { sanitized };
            sanitized(d.to_bits(), self.convention)
        };
        out.iter_mut().for_each(|d| *d = depth(*d));
        let mut row = vec![0.0; out.len()];
        for other in others {
            other.rows(first, &mut row);
            for (found, sample) in out.iter_mut().zip(&row) {
                let sample = depth(*sample);
                *found = if self.convention.is_reversed() == takes_nearest {
                    found.max(sample)
                } else {
                    found.min(sample)
                };
            }
        }
    }
}
