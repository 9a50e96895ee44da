"""Pictures of pyramids, depth images, results and explanations, in notebooks and as figures.

What a picture must show is worked out here: places of walls, pixels of boxes, counts of verdicts.
"""

from __future__ import annotations

import copy
import gc
import io
import itertools
import pickle
import re
import subprocess
import sys
from base64 import b64decode
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk.commands.figure import can_draw
from hizvk.extras import install_line
from hizvk.remembered import MOST_HELD
from hizvk.show import colours, png, seen_plot, shapes
from hizvk.show.lines import outlines
from hizvk.view_depth import RayView
from pictures import decoded, near

WHITE, RED = (255, 255, 255), (255, 70, 56)
SIZE = (90, 160)
needs_matplotlib = pytest.mark.skipif(not can_draw(), reason="matplotlib is not installed")


def camera(**more: Any) -> hizvk.Camera:
    given = {"fov_y_deg": 60, "size": SIZE, "near": 0.1, **more}
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), **given)


def wall() -> npt.NDArray[np.float64]:
    """10 m away in the left half of the image, and nothing in the right half."""
    depth = np.full(SIZE, np.inf)
    depth[:, :80] = 10.0
    return depth


#: Left and right of the middle, 20 m away: the wall hides the first; the third is behind the eye.
BOXES = hizvk.Boxes(
    [(-5, -1, -21), (3, -1, -21), (0, 0, 5)], [(-3, 1, -19), (5, 1, -19), (1, 1, 6)]
)


def culled(device: hizvk.Device, bounds: Any = BOXES, **more: Any) -> hizvk.CullResult:
    view = camera()
    hiz = device.pyramid(wall(), view, kind="z")
    return device.cull(device.instances(bounds), view, hiz, **more)


def picture_in(html: str) -> bytes:
    found = re.search(r'src="data:image/png;base64,([\w+/=]+)"', html)
    assert found
    return b64decode(found[1])


# -- the writer ------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(1, 1, 3), (5, 3), (7, 130, 3), (1, 31), (64, 1, 3)])
def test_a_png_comes_back(shape: tuple[int, ...]) -> None:
    image = np.random.default_rng(1).integers(0, 256, shape, np.uint8)
    np.testing.assert_array_equal(decoded(png.png(image)).reshape(shape), image)


@needs_matplotlib
def test_other_readers_read_it() -> None:
    from PIL import Image

    image = np.random.default_rng(2).integers(0, 256, (9, 14, 3), np.uint8)
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(png.png(image)))), image)


# -- depth -----------------------------------------------------------------------------------------


def test_depth_images_and_pyramids_show_depth(device: hizvk.Device) -> None:
    hiz = device.pyramid(wall(), camera(), kind="z")
    shown = decoded(hiz._repr_png_())
    tall, wide = 288, 512  # level 0, its longer side 512
    assert near(shown[:tall, 256:wide], colours.rgb(colours.SKY), 0) == tall * 256
    assert near(shown[:tall, :256], colours.rgb(colours.SKY), 20) == 0
    # Level 1 stands beside it in half the size, and has the wall at its left, too.
    assert near(shown[:144, 516 + 128 : 516 + 256], colours.rgb(colours.SKY), 0) == 144 * 128
    page = hiz._repr_html_()
    assert decoded(picture_in(page)).shape == shown.shape
    rows = re.findall(r"<tr>(.*?)</tr>", page)
    cells = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in rows[1:]]
    assert [row[:2] for row in cells[:2]] == [["0", "90 x 160"], ["1", "45 x 80"]]
    assert [row[2:] for row in cells] == [["10", "infinite"]] * 7 + [["infinite", "infinite"]] * 2
    quad = [[-30, -30, -10], [0, -30, -10], [0, 30, -10], [-30, 30, -10]]
    image = device.render_depth(device.occluders(quad, [[0, 1, 2], [0, 2, 3]]), camera())
    assert near(decoded(image._repr_png_())[:, 256:], colours.rgb(colours.SKY), 0) == tall * 256
    assert "view depth z" in image._repr_html_()


def test_near_is_lighter_and_a_bare_matrix_shows_ndc(device: hizvk.Device) -> None:
    depth = np.repeat(np.geomspace(1.0, 100.0, SIZE[1])[None], SIZE[0], axis=0)
    shown = decoded(device.pyramid(depth, camera(), kind="z")._repr_png_())[:288, :512]
    lightness = shown.astype(float) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(lightness.mean(axis=0)[4:-4:32]) < -5.0).all()
    bare = hizvk.Camera.from_matrices(np.eye(4), size=SIZE, reversed_z=False)
    assert "NDC depth" in device.pyramid(np.full(SIZE, 0.5), bare, kind="ndc")._repr_html_()


@pytest.mark.parametrize("size", [(1, 1), (1, 257), (257, 1), (1080, 1920)])
def test_images_of_any_size(device: hizvk.Device, size: tuple[int, int]) -> None:
    view = camera(size=size)
    hiz = device.pyramid(np.full(size, 10.0), view, kind="z")
    seen = device.cull(device.instances(BOXES), view, hiz)
    for thing in (hiz, seen, seen.explain(0)):
        assert decoded(thing._repr_png_()).size > 0
        assert len(thing._repr_html_()) < 100_000


#: Linear RGB as people without red and without green receptors see it (Machado, Oliveira and
#: Fernandes 2009, severity 1).
BLIND = {
    "nobody": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}


@pytest.mark.parametrize("who", BLIND)
def test_colours_can_be_told_apart(who: str) -> None:
    """By at least 25 in CIELAB, where 2 is a difference that people notice."""

    def lab(colour: str) -> npt.NDArray[np.float64]:
        given = np.array(colours.rgb(colour)) / 255.0
        linear = np.where(given <= 0.04045, given / 12.92, ((given + 0.055) / 1.055) ** 2.4)
        linear = np.clip(BLIND[who] @ linear, 0.0, 1.0)
        to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
        xyz = np.array(to_xyz) @ linear / (0.9505, 1.0, 1.089)
        f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
        return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])

    drawn = [*colours.CLASS_COLOURS, colours.FRUSTUM, colours.BACKGROUND]
    for one, other in itertools.combinations(drawn, 2):
        assert np.linalg.norm(lab(one) - lab(other)) > 25.0, (one, other)
    lightness = [lab(colour)[0] for colour in colours.VIRIDIS]
    assert (np.diff(lightness) > 3.0).all()


@pytest.mark.parametrize(
    ("depth", "expected"),
    [
        ([np.inf, np.inf], (0.0, 1.0, False)),
        ([2.0, 2.0], (1.8, 2.2, False)),
        ([1.0, 3.0], (1.01, 2.99, False)),
        ([1.0, 100.0], (1.495, 99.505, True)),
        ([-1.0, 100.0], (-0.495, 99.495, False)),
    ],
)
def test_scales(depth: list[float], expected: tuple[float, float, bool]) -> None:
    scale = colours.scale_of(np.array(depth))
    assert scale == pytest.approx(expected, rel=1e-2)
    assert np.isnan(scale.places(np.array([np.inf, np.nan]))).all()
    assert scale.places(np.array([scale.low, scale.high])).tolist() == [0.0, 1.0]


# -- results ---------------------------------------------------------------------------------------


def test_a_result_shows_red_and_white_boxes(device: hizvk.Device) -> None:
    seen = culled(device)
    assert seen.verdicts.tolist() == [hizvk.Verdict.OCCLUDED, hizvk.Verdict.VISIBLE, 0]
    shown = decoded(seen._repr_png_())
    # The boxes lie 3 to 5 m beside the middle, 19 to 21 m away: at most 5 / 19 of the view depth.
    across = 320 / (np.tan(np.radians(30)) * 16 / 9)
    for colour, side, other in (
        (RED, shown[:, :320], shown[:, 320:]),
        (WHITE, shown[:, 320:], shown[:, :320]),
    ):
        assert near(side, colour) > 100
        assert near(other, colour) == 0
    columns = np.flatnonzero((np.abs(shown.astype(int) - WHITE).max(axis=2) <= 40).any(axis=0))
    assert columns[0] == pytest.approx(320 + across * 3 / 21, abs=2)
    assert columns[-1] == pytest.approx(320 + across * 5 / 19, abs=2)
    page = seen._repr_html_()
    assert decoded(picture_in(page)).shape == shown.shape
    for text, count in (("kept", 1), ("culled: hidden", 1), ("culled: outside the view", 1)):
        assert re.search(rf"{text}</td><td[^>]*>{count}</td>", page), text


def test_a_notebook_shows_hints(device: hizvk.Device) -> None:
    behind = hizvk.Boxes([(-1.0, -1, 5), (1, 1, 7)], [(0.0, 0, 6), (2, 2, 8)])
    seen = culled(device, behind)
    (hint,) = seen.hints()
    assert f"Hint: {escape(hint)}" in seen._repr_html_()
    assert "Hint" not in culled(device)._repr_html_()


def test_results_without_verdicts(device: hizvk.Device) -> None:
    page = culled(device, outputs=["mask"])._repr_html_()
    assert re.search(r"kept</td><td[^>]*>1</td>", page)
    assert re.search(r"culled</td><td[^>]*>2</td>", page)
    listed = culled(device, outputs=["indices"], capacity=1)
    assert "<img" in listed._repr_html_()


def test_what_is_not_known_is_said(device: hizvk.Device) -> None:
    crowd = device.instances(BOXES)
    hiz = device.pyramid(wall(), camera(), kind="z")
    before = device.cull(crowd, camera(), hiz)
    crowd.update(0, hizvk.Boxes([(3.0, -1, -21)], [(5.0, 1, -19)]))
    after = device.cull(crowd, camera(), hiz)
    assert near(decoded(before._repr_png_()), RED) > 100
    assert near(decoded(after._repr_png_()), RED) == 0
    assert "are not known any more" in after._repr_html_()
    for call in (after.plot, lambda: after.save_html("nowhere.html")):
        with pytest.raises(ValueError, match=r"^bounds: expected the bounds of the 3 instances"):
            call()
    many = np.zeros((MOST_HELD + 1, 3))
    large = device.cull(device.instances(hizvk.Spheres(many, 1.0)), camera(), hiz)
    gc.collect()
    assert large._question.remembered.bounds() is None
    held = hizvk.Spheres(many, 1.0)
    assert device.instances(held)._remembered.bounds() is held


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_outlines_lie_where_the_camera_projects(kind: str, reversed_z: bool) -> None:
    eye, target = (1e6, 2.0, 3.0), (1e6 + 1, 1.5, -4.0)
    if kind == "perspective":
        view = hizvk.Camera.look_at(
            eye, target, fov_y_deg=60, size=SIZE, near=0.1, far=100, reversed_z=reversed_z
        )
    else:
        view = hizvk.Camera.orthographic(
            eye, target, height=12, size=SIZE, near=0.1, far=100, reversed_z=reversed_z
        )
    rng = np.random.default_rng(3)
    centers = rng.uniform((-2, -2, -12), (2, 2, -8), (40, 3)) + eye
    turns, _ = np.linalg.qr(rng.normal(size=(40, 3, 3)))
    boxes = hizvk.OrientedBoxes(centers, rng.uniform(0.1, 1.0, (40, 3)), turns)
    some = np.arange(40)
    lines, owners = outlines(RayView(view), shapes.shapes_of(boxes, np.zeros(40, np.uint8), some))
    assert np.bincount(owners).tolist() == [12] * 40
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    for i in range(40):
        corners = centers[i] + (signs * boxes.half_sizes[i]) @ turns[i].T
        expected = view.project(corners).pixels
        for end in lines[owners == i].reshape(-1, 2):
            assert np.abs(expected - end).max(axis=1).min() < 1e-4
    # Points of a sphere lie within its outline, and nearly touch it.
    radii = rng.uniform(0.1, 1.0, 40)
    balls = hizvk.Spheres(centers, radii)
    lines, owners = outlines(RayView(view), shapes.shapes_of(balls, np.zeros(40, np.uint8), some))
    on_it = rng.normal(size=(4000, 3))
    on_it /= np.linalg.norm(on_it, axis=1, keepdims=True)
    for i in range(40):
        dots = view.project(centers[i] + radii[i] * on_it).pixels
        ring = lines[owners == i][:, 0]
        middle = ring.mean(axis=0)
        turned = np.linspace(0, 2 * np.pi, 16)
        for along in np.stack([np.cos(turned), np.sin(turned)], axis=1):
            reach, limit = ((dots - middle) @ along).max(), ((ring - middle) @ along).max()
            assert reach == pytest.approx(limit, rel=0.03)


def test_a_line_through_the_eye_plane_is_cut_off() -> None:
    long = hizvk.Boxes([(-1.0, -1.0, -9.0)], [(1.0, 1.0, 9.0)])
    shown = shapes.shapes_of(long, np.zeros(1, np.uint8), np.arange(1))
    lines, _ = outlines(RayView(camera()), shown)
    assert len(lines) == 8  # the four edges around the near end lie behind the eye
    assert np.isfinite(lines).all()
    # Edges along the view run towards the middle, and end five half images beside it.
    along = lines[np.ptp(lines, axis=1).max(axis=1) > 100]
    assert len(along) == 4
    across, down = np.abs(along - (80, 45)).transpose(2, 0, 1)
    np.testing.assert_allclose(across, down, rtol=1e-9)
    np.testing.assert_allclose(down.max(axis=1), 5 * 45, rtol=1e-9)


def test_a_sample_is_spread_and_keeps_small_classes() -> None:
    classes = np.full(100_000, shapes.OUTSIDE, np.uint8)
    classes[::1000] = shapes.KEPT
    classes[7] = shapes.HIDDEN
    picked = shapes.chosen(classes, 1000)
    assert len(picked) <= 1000
    assert len(set(picked.tolist())) == len(picked)
    counts = np.bincount(classes[picked], minlength=3)
    assert counts[shapes.HIDDEN] == 1
    assert counts[shapes.KEPT] == 100
    assert counts[shapes.OUTSIDE] > 800
    assert np.diff(picked).max() < 300
    np.testing.assert_array_equal(shapes.chosen(classes[:50], 50), np.arange(50))


def test_invalid_bounds_are_left_out(device: hizvk.Device) -> None:
    bounds = hizvk.Boxes([(np.nan, 0, 0), (3, -1, -21)], [(1, 1, 1), (5, 1, -19)])
    seen = culled(device, bounds)
    assert near(decoded(seen._repr_png_()), WHITE) > 100
    assert re.search(
        r"kept because their bounds are invalid</td><td[^>]*>1</td>", seen._repr_html_()
    )


def test_texts_are_escaped() -> None:
    from hizvk.show.html import document

    page = document("<script>", None, table=(["<b>"], [["&", "<i>"]]), notes=["<u>"])
    assert not re.search(r"<(script|b|i|u)>(?!&lt;)", page.replace("<b>&lt;", ""))


# -- explanations ----------------------------------------------------------------------------------


def test_an_explanation_shows_its_rectangle(device: hizvk.Device) -> None:
    seen = culled(device)
    told = seen.explain(0)
    assert told.rectangle is not None
    shown = decoded(told._repr_png_())
    assert near(shown, WHITE, 0) > 50
    page = told._repr_html_()
    assert "instance 0: occluded" in page
    assert "view depth 10" in page
    assert "instance 2: outside" in seen.explain(2)._repr_html_()


def test_copies_are_equal_and_say_that_they_cannot_be_drawn(device: hizvk.Device) -> None:
    told = culled(device).explain(0)
    for other in (pickle.loads(pickle.dumps(told)), copy.deepcopy(told)):
        assert other == told
        with pytest.raises(ValueError, match=r"has lost its pyramid.*CullResult\.explain"):
            other.plot()
        assert other._repr_html_() is None  # a notebook shows its text
        assert other._repr_png_() is None


def test_what_a_lost_device_holds_shows_as_text(
    device: hizvk.Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    hiz = device.pyramid(wall(), camera(), kind="z")

    def lost(*_: object, **__: object) -> None:
        raise hizvk.DeviceLostError("the device is lost")

    monkeypatch.setattr(hizvk.Pyramid, "level", lost)
    assert hiz._repr_html_() is None
    assert hiz._repr_png_() is None


@needs_matplotlib
def test_a_member_of_a_hidden_group_names_the_groups_test(device: hizvk.Device) -> None:
    low = np.random.default_rng(5).uniform((-9, -1, -40), (-4, 1, -30), (2000, 3))
    seen = culled(device, hizvk.Boxes(low, low + 0.1), hierarchy=True)
    told = next(one for i in range(0, 2000, 100) if (one := seen.explain(i)).group is not None)
    assert "its group of 64 was hidden as a whole" in texts(told.plot())
    assert told.group is not None
    assert "nearest depth of the instance: 3" in texts(told.group.plot())


# -- figures ---------------------------------------------------------------------------------------


def texts(figure: Any) -> str:
    from matplotlib.text import Text

    return "\n".join(one.get_text() for one in figure.findobj(Text))


@needs_matplotlib
def test_figures_have_units_and_counts(device: hizvk.Device) -> None:
    hiz = device.pyramid(wall(), camera(), kind="z", depths="both", levels=(1, 2))
    figure = hiz.plot("nearest", kind="distance", unit="km")
    assert "distance along the ray (km)" in texts(figure)
    assert len([axis for axis in figure.axes if axis.get_title().startswith("level")]) == 3
    assert "view depth z (m)" in texts(hiz.plot())
    seen = culled(device)
    figure = seen.plot(unit="ft")
    for text in ("kept: 1", "culled: hidden: 1", "outside the view: 1", "x (ft)", "z (ft)"):
        assert text in texts(figure)
    assert decoded(figure._repr_png_()).shape[2] == 4
    crowd = hizvk.Spheres(np.random.default_rng(4).normal(size=(500, 3)) * 30, 0.3)
    drawn = re.search(
        r"outside the view: (\d+) \((\d+) drawn\)", texts(culled(device, crowd).plot(most=40))
    )
    assert drawn
    assert 4 <= int(drawn[2]) <= 40 < int(drawn[1])


@needs_matplotlib
def test_an_explanation_as_a_figure(device: hizvk.Device) -> None:
    told = culled(device).explain(0)
    figure = told.plot()
    written = texts(figure)
    assert "nearest depth of the instance: 19" in written
    for (x, y), level in zip(told.texels, told.texel_levels, strict=True):
        assert f"level {level}, ({x}, {y})" in written
    dots = [line.get_xdata() for line in figure.axes[1].lines]
    assert [float(np.ravel(x)[0]) for x in dots[: len(told.texels)]] == pytest.approx(
        [10.0] * len(told.texels), rel=1e-5
    )
    assert "No texel was read" in texts(culled(device).explain(2).plot())


@pytest.mark.parametrize(
    ("up", "right", "top", "turned"),
    [
        ("z", "x", "y", False),
        ("-z", "x", "y", True),
        ("y", "x", "z", True),
        ("-y", "x", "z", False),
        ("x", "y", "z", False),
        ("-x", "y", "z", True),
    ],
)
def test_maps_are_not_mirrored(up: str, right: str, top: str, turned: bool) -> None:
    above = seen_plot.Above.of(up)
    assert ("xyz"[above.right], "xyz"[above.top], above.top_grows_down) == (right, top, turned)
    axes = np.eye(3)
    upwards = axes[above.top] * (-1 if turned else 1)
    towards_viewer = axes["xyz".index(up[-1])] * (-1 if up[0] == "-" else 1)
    np.testing.assert_array_equal(np.cross(axes[above.right], upwards), towards_viewer)


def test_up_is_the_cameras() -> None:
    down = hizvk.Camera.look_at(
        (0, 0, 9), (0, 1, 0), up=(0, 0, 1), fov_y_deg=60, size=SIZE, near=0.1
    )
    assert seen_plot.up_of(down.resized((45, 80))) == "z"
    kitti = hizvk.Camera.from_opencv(
        [[90.0, 0, 80], [0, 90, 45], [0, 0, 1]], camera_from_world=np.eye(4), size=SIZE, near=0.1,
        pixel_center="half",
    )  # fmt: skip
    assert seen_plot.up_of(kitti) == "-y"


def test_without_matplotlib_the_message_has_the_line() -> None:
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "import numpy as np, hizvk\n"
        "d = hizvk.Device()\n"
        "c = hizvk.Camera.look_at((0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(9, 16), near=1)\n"
        "p = d.pyramid(np.full(c.size, 20.0), c, kind='z')\n"
        "assert p._repr_png_() and p._repr_html_()\n"
        "try: p.plot()\n"
        "except ImportError as error: print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=60
    )
    assert done.stdout.startswith("a figure needs matplotlib, which is not installed: ")
    assert install_line("viz") in done.stdout


@pytest.mark.parametrize("outputs", [["pixels"], ["indices"], ["draws"], ["mask"], ["verdicts"]])
def test_a_notebook_shows_a_result_of_any_outputs(
    device: hizvk.Device, outputs: list[hizvk.OutputName]
) -> None:
    """One ball before a wall, one behind it: what tells so is counted, however it was asked."""
    view = camera()
    hiz = device.pyramid(np.full(view.size, 5.0), view, kind="z")
    balls = device.instances(hizvk.Spheres([(0, 0, -4), (0, 0, -9)], 0.2))
    seen = device.cull(balls, view, hiz, outputs=outputs)
    page = seen._repr_html_()
    assert "<img" in page
    if outputs != ["draws"]:
        names = {"pixels": ("may show a pixel", "shows none")}.get(outputs[0])
        for name in names or ("kept",):
            assert re.search(rf"{name}</td>\s*<td[^>]*>1<", page), (name, page[-800:])
