//! What culling is worth: whole frames of each scene, drawn in every way on the same views.
//!
//! The ways take turns frame by frame, so a busy machine slows all of them.
//! Times are medians; "of in view" is the median of the ratios frame by frame.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Instant;

use hiz_core::ImageSize;

use crate::Failure;
use crate::args::Arguments;
use crate::gpu::{Gpu, IndirectChecks, instance};
use crate::picture::{self, Picture};
use crate::queries::{Queries, Read};
use crate::renderer::{Mode, Renderer};
use crate::scene::{NAMES, Scene};

/// Every so many frames are measured, and not only timed.
const MEASURED: usize = 4;

/// A way to draw frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Lists { mode: Mode, lods: bool },
    Queries(Read),
}

/// The ways, with what the table says; the second is what the others are compared with.
const WAYS: [(Way, &str); 8] = [
    (Way::Lists { mode: Mode::All, lods: false }, "all bodies"),
    (Way::Lists { mode: Mode::Frustum, lods: false }, "in view"),
    (Way::Lists { mode: Mode::OnePass, lods: false }, "one pass"),
    (Way::Lists { mode: Mode::TwoPasses, lods: false }, "two passes"),
    (Way::Lists { mode: Mode::Frustum, lods: true }, "in view, LODs"),
    (Way::Lists { mode: Mode::TwoPasses, lods: true }, "two passes, LODs"),
    (Way::Queries(Read::AtOnce), "queries, read at once"),
    (Way::Queries(Read::AFrameLate), "queries, a frame late"),
];
const IN_VIEW: usize = 1;

/// What was found out about a way.
#[derive(Debug, Default)]
struct Found {
    milliseconds: Vec<f64>,
    /// Without wgpu's own check of indirect draws.
    unchecked: Vec<f64>,
    bodies: Vec<f64>,
    triangles: Vec<f64>,
    complexity: Vec<f64>,
    /// Pixels that differ from what all in view show.
    differing: usize,
}

/// The renderers of a scene on one device.
struct Stage {
    without_lods: Renderer,
    with_lods: Renderer,
    at_once: Queries,
    late: Queries,
}

impl Stage {
    fn new(gpu: &Arc<Gpu>, name: &str, arguments: &Arguments) -> Result<Self, Failure> {
        let build =
            |scene| Renderer::new(Arc::clone(gpu), scene, arguments.size, arguments.samples);
        let without_lods = build(Scene::by_name(name)?.without_lods())?;
        Ok(Self {
            at_once: Queries::new(&without_lods)?,
            late: Queries::new(&without_lods)?,
            with_lods: build(Scene::by_name(name)?)?,
            without_lods,
        })
    }

    fn renderer(&mut self, lods: bool) -> &mut Renderer {
        if lods { &mut self.with_lods } else { &mut self.without_lods }
    }

    fn cut(&self) {
        self.with_lods.culler.cut();
        self.without_lods.culler.cut();
    }

    /// Draws a frame in a way and returns its milliseconds.
    fn draw(&mut self, way: Way, camera: &hiz_core::Camera) -> Result<f64, Failure> {
        let begin = Instant::now();
        match way {
            Way::Lists { mode, lods } => {
                let renderer = self.renderer(lods);
                renderer.mode = mode;
                renderer.draw_scene(camera)?;
                renderer.gpu.wait()?;
            }
            Way::Queries(Read::AtOnce) => {
                self.at_once.draw(&self.without_lods, camera, Read::AtOnce)?;
            }
            Way::Queries(Read::AFrameLate) => {
                self.late.draw(&self.without_lods, camera, Read::AFrameLate)?;
            }
        }
        Ok(1e3 * begin.elapsed().as_secs_f64())
    }

    /// Counts what the last frame drew, and reads its picture if the way has one to compare.
    fn measure(&mut self, way: Way, found: &mut Found) -> Result<Picture, Failure> {
        let (bodies, triangles) = match way {
            Way::Lists { lods, .. } => {
                let renderer = self.renderer(lods);
                renderer.count()?;
                found.complexity.push(picture::depth_complexity(renderer)?);
                (renderer.counts.drawn.iter().sum(), renderer.counts.triangles)
            }
            Way::Queries(Read::AtOnce) => self.at_once.drawn,
            Way::Queries(Read::AFrameLate) => self.late.drawn,
        };
        found.bodies.push(f64::from(bodies));
        found.triangles.push(triangles as f64);
        picture::read(self.renderer(matches!(way, Way::Lists { lods: true, .. })))
    }
}

/// Runs the scenes, and prints and writes the table.
///
/// # Errors
/// If there is no device, and if the table cannot be written.
pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let checked = Gpu::open(&instance(IndirectChecks::On), None)?;
    let unchecked = Gpu::open(&instance(IndirectChecks::Off), None)?;
    let ImageSize { width, height } = arguments.size;
    let mut page = format!(
        "Whole frames of {width}x{height} with {} sample(s) per pixel on {}, {} per scene.\n",
        arguments.samples,
        checked.words(),
        arguments.frames
    );
    let names: Vec<&str> = arguments
        .scene
        .as_deref()
        .map_or_else(|| NAMES.into_iter().chain(["castle"]).collect(), |n| vec![n]);
    for name in names {
        if name == "castle"
            && let Err(error) = Scene::by_name(name)
        {
            writeln!(page, "\nThe castle is left out: {error}.")?;
            continue;
        }
        eprintln!("{name} ...");
        let mut stages =
            [Stage::new(&checked, name, arguments)?, Stage::new(&unchecked, name, arguments)?];
        let found = measured(&mut stages, arguments)?;
        page += &table(name, &stages[0].without_lods, &found)?;
    }
    print!("{page}");
    std::fs::create_dir_all(&arguments.out)?;
    let path = arguments.out.join("bench.md");
    std::fs::write(&path, &page).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(())
}

fn measured(stages: &mut [Stage; 2], arguments: &Arguments) -> Result<Vec<Found>, Failure> {
    let frames = arguments.frames;
    let mut found: Vec<_> = WAYS.iter().map(|_| Found::default()).collect();
    let has_lods = stages[0].with_lods.scene.kinds.iter().any(|kind| kind.lods.len() > 1);
    // Drivers compile in the first frames.
    for frame in 0..frames + 2 {
        let place = frame.saturating_sub(2);
        let pose = stages[0].without_lods.scene.pose(place, frames);
        if stages[0].without_lods.scene.is_cut(place, frames) {
            stages.iter().for_each(Stage::cut);
        }
        let camera = stages[0].without_lods.scene.camera(&pose, arguments.size)?;
        let mut references: [Option<Picture>; 2] = [None, None];
        for ((way, _), found) in WAYS.iter().zip(&mut found) {
            let lods = matches!(way, Way::Lists { lods: true, .. });
            if lods && !has_lods {
                continue;
            }
            let [with, without] = stages.each_mut().map(|stage| stage.draw(*way, &camera));
            if frame < 2 {
                with?;
                without?;
                continue;
            }
            found.milliseconds.push(with?);
            found.unchecked.push(without?);
            if frame % MEASURED != 0 {
                continue;
            }
            let seen = stages[0].measure(*way, found)?;
            match (way, &references[usize::from(lods)]) {
                (Way::Lists { mode: Mode::Frustum, .. }, _) => {
                    references[usize::from(lods)] = Some(seen);
                }
                (Way::Lists { mode: Mode::All, .. }, _) | (_, None) => {}
                (_, Some(reference)) => {
                    found.differing += seen.difference(reference).differing_pixels;
                }
            }
        }
    }
    Ok(found)
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}

fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len().max(1) as f64
}

/// The table of one scene.
fn table(name: &str, renderer: &Renderer, found: &[Found]) -> Result<String, Failure> {
    let mut page = format!(
        "\n### {name}: {} bodies, {:.2} M triangles\n\n",
        renderer.on_device.num_bodies,
        renderer.scene.num_triangles() as f64 / 1e6
    );
    page += "| drawn | frame, ms | of in view | unchecked, ms | bodies | triangles | \
             depth complexity | differing |\n|---|---|---|---|---|---|---|---|\n";
    let in_view = &found[IN_VIEW].milliseconds;
    for ((_, what), found) in WAYS.iter().zip(found) {
        if found.milliseconds.is_empty() {
            continue;
        }
        let ratios = found.milliseconds.iter().zip(in_view).map(|(a, b)| a / b).collect();
        let complexity = if found.complexity.is_empty() {
            "-".to_owned()
        } else {
            format!("{:.2}", mean(&found.complexity))
        };
        writeln!(
            page,
            "| {what} | {:.1} | {:.2} | {:.1} | {:.0} | {:.0} k | {complexity} | {} |",
            median(found.milliseconds.clone()),
            median(ratios),
            median(found.unchecked.clone()),
            mean(&found.bodies),
            mean(&found.triangles) / 1e3,
            found.differing
        )?;
    }
    let hidden = 1.0 - mean(&found[3].triangles) / mean(&found[IN_VIEW].triangles);
    writeln!(
        page,
        "\nOf the triangles in view, {:.0} % are in bodies that two passes leave out.",
        100.0 * hidden
    )?;
    Ok(page)
}
