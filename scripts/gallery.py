#!/usr/bin/env python3
"""Draws the pictures of docs/gallery.md and docs/jobs/ from the examples; needs matplotlib.

``scripts/gallery.py driving points`` draws two of them, and without names all.
"""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

import hizvk

ROOT = Path(__file__).resolve().parents[1]
#: Where the pictures belong.
IMAGES = ROOT / "docs" / "images"
#: The middle of the town's square, in the file's coordinates.
SQUARE = (85_000.0, 446_500.0)


def example(name: str) -> Any:
    """A script of examples/ as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def box_edges(box: Any, camera: hizvk.Camera, i: int) -> list[Any]:
    """The twelve edges of an oriented box in the image: pairs of pixels."""
    signs = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    corners = box.centers[i] + (signs * box.half_sizes[i]) @ box.rotations[i].T
    pixels = camera.project(corners).pixels
    return [
        pixels[[a, b]]
        for a in range(8)
        for b in range(a + 1, 8)
        if np.abs(signs[a] - signs[b]).sum() == 2
    ]


def driving(path: Path) -> None:
    """The depth of the street, and its boxes: white what shows, red what is hidden."""
    job = example("driving_boxes")
    device = hizvk.Device()
    camera = job.read_camera(job.DATA / "kitti_calib.txt")
    _, _, boxes = job.read_labels(job.DATA / "kitti_label.txt")
    image = job.depth_image(device, camera, boxes)
    hiz = device.pyramid(image, camera, kind="z", scale=0.01, tolerance=hizvk.Tolerance(abs=0.005))
    seen = device.cull(
        device.instances(boxes), camera, hiz, coverage="sample", descent=4096, fit="volume"
    )
    figure = plt.figure(figsize=(12.42, 3.75), dpi=80)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.imshow(1.0 / np.maximum(image * 0.01, 1.0), cmap="viridis", vmax=0.13)
    for i in np.argsort(seen.mask):
        for edge in box_edges(boxes, camera, i):
            axes.plot(*(edge - 0.5).T, color="white" if seen.mask[i] else "#ff3b30", linewidth=0.9)
    axes.set(xlim=(-0.5, 1241.5), ylim=(374.5, -0.5), xticks=[], yticks=[])
    figure.savefig(path)


def points(path: Path) -> None:
    """The wall's cloud from above: by all photographs, and by those that see each point."""
    job = example("colour_points")
    with tempfile.TemporaryDirectory() as folder:
        ply = Path(folder) / "wall.ply"
        job.sys.argv = ["colour_points.py", str(ply)]
        job.main()
        data = ply.read_bytes().partition(b"end_header\n")[2]
    rows = np.frombuffer(data, np.dtype([("at", "<f4", 3), ("colour", "u1", 3)]))[::5]
    figure, both = plt.subplots(1, 2, figsize=(9, 3.2), dpi=80, layout="constrained")
    mean = np.array([job.RED, job.BLUE]).mean(axis=0) / 255
    for axes, colours, title in (
        (both[0], np.broadcast_to(mean, (len(rows), 3)), "every photograph counts"),
        (both[1], rows["colour"] / 255, "those that see the point"),
    ):
        axes.scatter(rows["at"][:, 0], rows["at"][:, 2], c=colours, s=1.5)
        axes.set(title=title, xlabel="x (m)", ylim=(-0.5, 0.5), yticks=(-0.2, 0.2))
    both[0].set_ylabel("z (m)")
    figure.savefig(path)


def models(path: Path) -> None:
    """The town from above: buildings by the number of places that may see them."""
    job = example("model_visibility")
    names, surfaces = job.read_surfaces(job.TOWN)
    meshes = [hizvk.Mesh(rings[0], job.fan(rings)) for rings in surfaces if job.fan(rings)]
    corners = [np.concatenate(rings) for rings in surfaces]
    boxes = hizvk.Boxes([c.min(axis=0) for c in corners], [c.max(axis=0) for c in corners])
    cameras = [camera for place in job.PLACES for camera in hizvk.cube(place, size=512, near=0.2)]
    seen = hizvk.sweep(
        boxes,
        cameras,
        occluders=meshes,
        groups=np.arange(len(cameras)) // 6,
        conservative=True,
        descent=4096,
        fit="volume",
    )
    owners = np.array(names)
    figure, axes = plt.subplots(figsize=(7, 6.4), dpi=80, layout="constrained")
    colours = plt.get_cmap("viridis", len(job.PLACES) + 1)
    for name in dict.fromkeys(names):
        count = sum(bool(seen.mask(k)[owners == name].any()) for k in range(len(seen)))
        ground = surfaces[names.index(name)][0]
        ground = ground - (*SQUARE, 0.0)
        axes.fill(ground[:, 0], ground[:, 1], color=colours(count) if count else "#ff3b30")
    axes.plot(*(np.array(job.PLACES)[:, :2] - SQUARE).T, "k^", markersize=7)
    axes.set(aspect="equal", xlabel="east of the square (m)", ylabel="north of it (m)")
    axes.set_title("how many of six places (triangles) may see a building; red: none")
    bar = mpl.cm.ScalarMappable(mpl.colors.BoundaryNorm(np.arange(8) - 0.5, 7), colours)
    figure.colorbar(bar, ax=axes, ticks=range(7), shrink=0.8)
    figure.savefig(path)


def lesson() -> tuple[Any, Any, Any]:
    """The lesson's pyramid and cull, and the explanation of a hidden ball."""
    camera = hizvk.Camera.look_at((0, 2, 0), (0, 2, -1), fov_y_deg=60, size=(256, 512), near=0.1)
    device = hizvk.Device()
    walls = [
        hizvk.Mesh([(a, 0, z), (b, 0, z), (b, top, z), (a, top, z)], [(0, 1, 2), (0, 2, 3)])
        for a, b, top, z in ((-6, -1, 5.0, -10.0), (1, 9, 4.0, -14.0))
    ]
    hiz = device.pyramid(device.render_depth(device.occluders(walls), camera))
    random = np.random.default_rng(5)
    centers = random.uniform((-12, 0, -40), (12, 5, -4), (2000, 3))
    balls = hizvk.Spheres(centers, random.uniform(0.1, 0.5, 2000))
    seen = device.cull(device.instances(balls), camera, hiz)
    return hiz, seen, seen.explain(0)


def pyramid(path: Path) -> None:
    """What `hiz.plot()` draws."""
    lesson()[0].plot().savefig(path, dpi=70)


def result(path: Path) -> None:
    """What `seen.plot()` draws."""
    lesson()[1].plot(most=500).savefig(path, dpi=70)


def explanation(path: Path) -> None:
    """What `seen.explain(0).plot()` draws."""
    lesson()[2].plot().savefig(path, dpi=70)


def turning(path: Path) -> None:
    """What a browser shows of `seen.save_html(...)`; needs Chromium."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        print(f"{path.name}: not drawn without chromium")
        return
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "seen.html"
        lesson()[1].save_html(page)
        subprocess.run(
            [
                browser,
                "--headless",
                "--no-sandbox",
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--window-size=1100,600",
                "--virtual-time-budget=3000",
                f"--screenshot={path}",
                page.as_uri(),
            ],
            check=True,
            capture_output=True,
            timeout=120,
        )


PICTURES = {
    "driving": driving,
    "points": points,
    "models": models,
    "pyramid": pyramid,
    "result": result,
    "explanation": explanation,
    "turning": turning,
}


def main(names: list[str]) -> int:
    """Draws the pictures of these names."""
    mpl.use("agg")
    for name in names or PICTURES:
        path = IMAGES / f"job_{name}.png"
        PICTURES[name](path)
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size // 1024} KiB")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
