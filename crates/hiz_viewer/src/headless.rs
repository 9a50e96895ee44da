//! Frames without a window, as PNG files.

use crate::Failure;
use crate::args::Arguments;
use crate::controls::Controls;
use crate::gpu::{Gpu, IndirectChecks, instance};
use crate::picture::save;
use crate::renderer::Renderer;
use crate::scene::Scene;

/// Renders the frames that the arguments ask for, and tells what each drew.
///
/// # Errors
/// If there is no device or no such scene, and if files cannot be written.
pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut scene = Scene::by_name(arguments.scene_name())?;
    if !arguments.lods {
        scene = scene.without_lods();
    }
    std::fs::create_dir_all(&arguments.out)
        .map_err(|error| format!("--out: {}: {error}", arguments.out.display()))?;
    let gpu = Gpu::open(&instance(IndirectChecks::On), None)?;
    println!("adapter: {}", gpu.words());
    println!("{}", crate::culler::slack_in_words(&gpu.adapter));
    crate::sample_places::tell(&gpu, arguments.samples)?;
    let mut renderer = Renderer::new(gpu, scene, arguments.size, arguments.samples)?;
    renderer.mode = arguments.mode;
    let mut controls = Controls::new(renderer.scene.pose(0, arguments.frames), arguments.mode);
    for key in &arguments.keys {
        controls.press(*key, &mut renderer);
    }
    for frame in 0..arguments.frames {
        let pose = renderer.scene.pose(frame, arguments.frames);
        if renderer.scene.is_cut(frame, arguments.frames) {
            renderer.culler.cut();
        }
        let camera = renderer.scene.camera(&pose, arguments.size)?;
        if arguments.moving {
            renderer.step(frame)?;
        }
        renderer.draw(&camera)?;
        let path = arguments.out.join(format!(
            "{}_{}_{frame:03}.png",
            arguments.scene_name(),
            renderer.mode.name()
        ));
        let rgba = renderer.gpu.read_texture(&renderer.targets.picture_texture)?;
        save(&path, arguments.size, &rgba)?;
        println!("{}: {}", path.display(), renderer.lines().join("; "));
    }
    Ok(())
}
