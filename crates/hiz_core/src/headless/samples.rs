//! Multisampled depth from the host: the farthest of each pixel's samples is uploaded.

use crate::error::{Error, Result};
use crate::headless::depth_image::DepthImage;
use crate::headless::engine::Engine;
use crate::input::camera::Camera;
use crate::input::depth::{Conversion, DepthInput, sanitized};
use crate::input::image::DepthConvention;
use crate::input::tolerance::DepthTolerance;

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
        self.check_process()?;
        let samples = Samples::new(samples, camera, 0)?;
        let image = DepthImage::for_upload(self, camera)?;
        let first = &samples.conversions[0];
        let (rows, threads) = (first.band_rows(), first.threads());
        self.scoped(|| image.write_bands(rows, threads, |row, band| samples.rows(row, band)))?;
        Ok(DepthImage { samples: samples.count(), tolerance: samples.tolerance(), ..image })
    }
}

/// How the samples of an image, or of some rows of it, become one depth per pixel.
pub(super) struct Samples<'a> {
    conversions: Vec<Conversion<'a>>,
    convention: DepthConvention,
}

impl<'a> Samples<'a> {
    /// Images of whole rows of the camera's image, from row `first` on: one for each sample.
    pub(super) fn new(samples: &[DepthInput<'a>], camera: &Camera, first: u32) -> Result<Self> {
        if samples.is_empty() {
            return Err(Error::invalid("samples", "expected an image for each sample, got none"));
        }
        let convert = |sample| Conversion::of_rows(sample, camera, first);
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

    /// Converts whole rows, the first of which is row `first` of the image.
    pub(super) fn rows(&self, first: u32, out: &mut [f32]) {
        let [only_or_first, others @ ..] = self.conversions.as_slice() else { return };
        only_or_first.rows(first, out);
        if others.is_empty() {
            return;
        }
        let depth = |d: f32| sanitized(d.to_bits(), self.convention);
        out.iter_mut().for_each(|d| *d = depth(*d));
        let mut row = vec![0.0; out.len()];
        for other in others {
            other.rows(first, &mut row);
            for (farthest, sample) in out.iter_mut().zip(&row) {
                let sample = depth(*sample);
                *farthest = if self.convention.is_reversed() {
                    farthest.min(sample)
                } else {
                    farthest.max(sample)
                };
            }
        }
    }
}
