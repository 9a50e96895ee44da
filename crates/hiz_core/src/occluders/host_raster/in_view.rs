//! The meshlets whose boxes may show in a view.
//!
//! A box takes 17 nanoseconds where it is outside, and a mesh of 3 million triangles has 23,000.
//! So threads share them.

use std::ops::Range;

use crate::error::Result;
use crate::host::memory;
use crate::host::threads::{on_threads, worth_it};
use crate::host::vectors::{Plain, with_eight};
use crate::input::camera::Camera;
use crate::input::mesh::FaceCull;
use crate::occluders::host_raster::lens::{Extent, Image, Lens, extent};
use crate::occluders::placement::Placement;
use crate::occluders::shapes::Shapes;
use crate::occluders::view::View;

/// What is drawn, and how it is seen.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub(crate) shapes: &'a Shapes,
    /// The copies, with their numbers.
    pub(crate) copies: &'a [(u32, &'a Placement)],
    /// Of the image's size.
    pub(crate) camera: &'a Camera,
    /// Which faces do not occlude.
    pub(crate) cull_mode: FaceCull,
}

/// A meshlet of one copy that may show, or a part of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) copy: u32,
    pub(super) meshlet: u32,
    /// Its triangles, in groups: the first one and the one after the last.
    pub(super) groups: (u32, u32),
    pub(super) lens: u32,
    pub(super) extent: Extent,
}

/// Boxes that one thread looks at in one go.
const AT_ONCE: u32 = 1024;

/// Some copies, by their places in the scene's list, and which of their meshlets.
type Share = Vec<(usize, Range<u32>)>;

/// How copies are seen, and which of their meshlets may show.
type Found = (Vec<Lens>, Vec<Candidate>);

/// The meshlets that may show.
///
/// `threads` are those that share the work; `None`: as many as it is worth.
pub(super) fn in_view(scene: &Scene<'_>, image: &Image, threads: Option<usize>) -> Result<Found> {
    let view = View::new(scene.camera)?;
    let shares = shares(scene)?;
    // About as many nanoseconds for a copy, and for each box.
    let work = |(_, meshlets): &(usize, Range<u32>)| 100 + 25 * meshlets.len() as u64;
    let threads = threads.unwrap_or_else(|| worth_it(shares.iter().flatten().map(work).sum()));
    let mut found: Vec<Result<Found>> = shares.iter().map(|_| Ok(Found::default())).collect();
    on_threads(threads, shares.iter().zip(&mut found), |(share, found)| {
        *found = in_share(scene, &view, image, share);
    });
    let mut all = Found::default();
    for found in found {
        let (mut lenses, mut candidates) = found?;
        let before = all.0.len() as u32;
        candidates.iter_mut().for_each(|candidate| candidate.lens += before);
        memory::reserve(&mut all.1, candidates.len(), "meshlets")?;
        all.0.append(&mut lenses);
        all.1.append(&mut candidates);
    }
    Ok(all)
}

/// All meshlets of the copies, in shares of [`AT_ONCE`].
fn shares(scene: &Scene<'_>) -> Result<Vec<Share>> {
    let (mut shares, mut share, mut room) = (Vec::new(), Share::new(), AT_ONCE);
    for (place, (_, placement)) in scene.copies.iter().enumerate() {
        let mut rest = scene.shapes.meshes[placement.mesh as usize].meshlets.clone();
        while !rest.is_empty() {
            let some = rest.start..rest.end.min(rest.start + room);
            (rest.start, room) = (some.end, room - some.len() as u32);
            memory::reserve(&mut share, 1, "meshlets")?;
            share.push((place, some));
            if room == 0 {
                shares.push(std::mem::take(&mut share));
                room = AT_ONCE;
            }
        }
    }
    shares.push(share);
    Ok(shares)
}

fn in_share(scene: &Scene<'_>, view: &View, image: &Image, share: &Share) -> Result<Found> {
    let (mut lenses, mut candidates) = Found::default();
    for (place, meshlets) in share {
        let (copy, placement) = scene.copies[*place];
        let mesh = &scene.shapes.meshes[placement.mesh as usize];
        let placed = view.placed(mesh, placement);
        let lens = Lens::new(scene.camera, image, &placed, placement);
        let before = candidates.len();
        if mesh.meshlets.len() > 1 && extent(Plain, &lens, image, mesh.min, mesh.max).is_none() {
            continue;
        }
        memory::reserve(&mut candidates, meshlets.len(), "meshlets")?;
        let index = lenses.len() as u32;
        with_eight!(eight => for number in meshlets.clone() {
            let meshlet = &scene.shapes.meshlets[number as usize];
            if let Some(extent) = extent(eight, &lens, image, meshlet.min, meshlet.max) {
                let groups = (0, meshlet.groups().end);
                candidates.push(Candidate { copy, meshlet: number, groups, lens: index, extent });
            }
        });
        if candidates.len() > before {
            lenses.push(lens);
        }
    }
    Ok((lenses, candidates))
}
