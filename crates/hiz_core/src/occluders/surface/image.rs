//! The conservative depths of an image: thresholds, proof, search.

use crate::host::threads::{cores, on_threads};
use crate::input::camera::Camera;
use crate::occluders::surface::cells::Cells;
use crate::occluders::surface::facets::{Facet, Rounder};
use crate::occluders::surface::hulls::Hulls;
use crate::occluders::surface::links::Standing;
use crate::occluders::surface::looks::{Looks, Placed, Sought, Tiles, Wanted};
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::planted_fault::Planted;
use crate::occluders::surface::proof::{band_rows, bands, proved};
use crate::occluders::surface::search::search;
use crate::occluders::surface::sheets;
use crate::occluders::surface::thresholds::{Centres, Slabs};
use crate::occluders::surface::walk::Walk;

/// As [`image`], by a search of all pixels: slow, and what tests compare with.
pub(super) fn searched(
    placed: Placed<'_>,
    links: &Standing<'_>,
    rounder: &Rounder,
    camera: &Camera,
    refinement: u32,
) -> Vec<f32> {
    let size = camera.size();
    let looks = Looks::new(
        &placed,
        camera,
        rounder,
        &Sought { tiles: &Tiles::open(size), open: None, left_out: None },
    );
    let open = OpenPixels::new(size, vec![true; size.pixels() as usize]);
    let beyond = if camera.convention().is_reversed() { 0.0 } else { 1.0 };
    let mut far = vec![beyond; size.pixels() as usize];
    let search = Search { placed, links, rounder, looks: &looks, refinement };
    search.lower(&open, &Tiles::open(size), &mut far);
    rounded(&far, placed.fault)
}

/// Values of `far` as float32, rounded towards far.
fn rounded(far: &[f64], fault: Planted) -> Vec<f32> {
    far.iter().map(|far| Facet::rounded(*far, fault)).collect()
}

/// What is searched.
#[derive(Debug, Clone, Copy)]
struct Search<'a> {
    placed: Placed<'a>,
    links: &'a Standing<'a>,
    rounder: &'a Rounder,
    looks: &'a Looks,
    refinement: u32,
}

impl Search<'_> {
    /// Lowers the values of `far` of the open pixels where a search finds nearer ones.
    ///
    /// What `tiles` hide is not searched for.
    fn lower(&self, open: &OpenPixels, tiles: &Tiles, far: &mut [f64]) {
        let (size, fault) = (open.size(), self.placed.fault);
        let part = (band_rows(size) * size.width) as usize;
        on_threads(cores(), far.chunks_mut(part).zip(bands(size)), |(far, rows)| {
            if !open.of_rows(rows).is_empty() {
                let wanted = Wanted { open, tiles, rows };
                let projector = &self.rounder.projector;
                let cells = Cells::new(&self.placed, projector, self.looks, self.links, &wanted);
                sheets::search(&cells, open, rows, self.refinement, fault, far);
            }
        });
    }
}

/// For every pixel, rows from top to bottom: every ray through its closed square is blocked at this
/// value of `far` or before.
///
/// At least the value at the far plane where that cannot be shown.
/// `centres` are NDC depths at the pixels' centres, for choices alone.
pub(super) fn image(
    placed: Placed<'_>,
    links: &Standing<'_>,
    rounder: &Rounder,
    camera: &Camera,
    refinement: u32,
    centres: &[f32],
) -> Vec<f32> {
    let (size, convention) = (camera.size(), camera.convention());
    let beyond: f32 = if convention.is_reversed() { 0.0 } else { 1.0 };
    let centres = Centres { depths: centres, size, convention };
    let (mut slabs, tried) = centres.slabs();
    let mut hulls = Hulls::new(placed, links, refinement);
    let sought = Sought { tiles: &tried, open: None, left_out: None };
    if let Some(hulls) = &mut hulls {
        hulls.add(camera, rounder, &sought);
    }
    let sought = Sought { left_out: hulls.as_ref().map(Hulls::left_out), ..sought };
    let mut looks = Looks::new(&placed, camera, rounder, &sought);
    let has_uncertain = looks.has_uncertain;
    let walk = Walk { placed, rounder, looks: &looks, links };
    let mut far = proved(&walk, hulls.as_ref(), &mut slabs, &tried, size);
    let open = OpenPixels::new(size, slabs.iter().map(Slabs::is_any).collect());
    if !open.is_empty() {
        let pixels = open.of_rows([0, size.height.cast_signed() - 1]);
        let bound = |pixel: &u32| {
            let (known, slabs) = (far[*pixel as usize], &slabs[*pixel as usize]);
            centres.bound(*pixel, slabs).min(known)
        };
        let bounds: Vec<f32> = pixels.iter().map(bound).collect();
        let tiles = Tiles::of(pixels.iter().copied().zip(bounds.iter().copied()), size);
        let sought = Sought { tiles: &tiles, open: Some(&open), left_out: None };
        if let Some(hulls) = &mut hulls {
            hulls.add(camera, rounder, &sought);
        }
        looks.add(
            &placed,
            camera,
            rounder,
            &Sought { left_out: hulls.as_ref().map(Hulls::left_out), ..sought },
        );
        let walk = Walk { placed, rounder, looks: &looks, links };
        search(&walk, hulls.as_ref(), &open, &bounds, (beyond, refinement), &mut far);
    }
    if has_uncertain {
        // What is too uncertain for integers is missing everywhere so far.
        let mut all: Vec<f64> = far.iter().map(|far| f64::from(far.min(beyond))).collect();
        let is_open = |far: &f64| *far >= f64::from(beyond);
        let open = OpenPixels::new(size, all.iter().map(is_open).collect());
        let tiles = Tiles::open(size);
        let sought = Sought { tiles: &tiles, open: None, left_out: None };
        let looks = &Looks::new(&placed, camera, rounder, &sought);
        Search { placed, links, rounder, looks, refinement }.lower(&open, &tiles, &mut all);
        far = rounded(&all, placed.fault);
    }
    far
}
