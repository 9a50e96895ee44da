"""Faults in pictures, data and jobs that their tests have to find: each is planted and must be red.

The faults are those that people make: axes swapped, an image mirrored, colours exchanged, depth of
another kind, a texel beside the right one.
Each test is called as it is, with the fault in the library's or the example's place.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

import hizvk
import hizvk.sweeping
import test_fill_depth
import test_foreign
import test_jobs
import test_show
import test_show_page
import test_show_views
import test_view_depth
import test_views_around
from hizvk import _corners, sparse, view_depth
from hizvk.show import levels, lines, seen, views
from hizvk.sweeping import cubes, terrain

if TYPE_CHECKING:
    from collections.abc import Callable


class Numpy:
    """NumPy for one module, with one function in the place of another."""

    def __init__(self, **others: Any) -> None:
        vars(self).update(others)

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)


class Fault(NamedTuple):
    """One planted fault."""

    where: Any
    """The module or class."""
    name: str
    """What is replaced in it."""
    made: Callable[[Any], Any]
    """The faulty one from the right one."""
    tests: tuple[Callable[..., object], ...]
    """Each of these has to fail; a fixture's value comes by its name."""
    error: type[Exception] = AssertionError
    """How they fail."""


def of_image(change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A writer of PNG files to which the picture comes changed."""
    return lambda png: lambda image: png(np.ascontiguousarray(change(image)))


def on_text(what: str, by: str) -> Callable[[Any], Any]:
    """A loader of examples in whose text something is replaced."""

    def made(load: Any) -> Any:
        def loaded(path: Any) -> Any:
            module = load(path)
            text = path.read_text(encoding="utf-8")
            assert what in text, f"{path.name} has no {what!r} any more"
            exec(compile(text.replace(what, by), str(path), "exec"), vars(module))
            return module

        return loaded

    return made


def other_level(level: Any) -> Any:
    """A level whose texels lie one column too far to the left."""
    return lambda self, *args, **more: np.roll(level(self, *args, **more), -1, axis=1)


def other_diagonal(mesh: Any) -> Any:
    """Squares split between their other two corners."""

    def made(grid: Any, steps: Any) -> hizvk.Mesh:
        right = mesh(grid, steps)
        columns = grid.shape[1]
        a = np.arange(grid.size - columns).reshape(-1, columns)[:, :-1].reshape(-1)
        b, c, d = a + 1, a + columns, a + columns + 1
        split = np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])
        return hizvk.Mesh(right.vertices, split)

    return made


def depths(device: hizvk.Device) -> None:
    test_show.test_depth_images_and_pyramids_show_depth(device)


def red_and_white(device: hizvk.Device) -> None:
    test_show.test_a_result_shows_red_and_white_boxes(device)


def linearised(device: hizvk.Device) -> None:
    test_view_depth.test_levels_of_each_camera(device, "standard finite")


def came_back(device: hizvk.Device) -> None:
    test_view_depth.test_metric_depth_comes_back(device, "reversed infinite", "distance")


def outlines() -> None:
    test_show.test_outlines_lie_where_the_camera_projects("perspective", reversed_z=True)


def boxes_of_cells() -> None:
    test_views_around.test_a_cell_s_box_holds_its_triangles(3.0)


def few_labels(tmp_path: Any) -> None:
    test_jobs.test_labels_may_be_few(tmp_path)


def kinds_of_cityjson(tmp_path: Any) -> None:
    test_jobs.test_cityjson_may_be_of_other_kinds(tmp_path)


def corners_of(order: str) -> Callable[[], None]:
    return lambda: test_foreign.test_boxes_from_corners_in_the_order_of_a_data_set(
        order, np.float64
    )


FAULTS = {
    # Pictures.
    "axes of levels swapped": Fault(
        levels, "png", of_image(lambda image: image.swapaxes(0, 1)), (depths,)
    ),
    "levels mirrored": Fault(levels, "png", of_image(lambda image: image[:, ::-1]), (depths,)),
    "a level one texel off": Fault(hizvk.Pyramid, "level", other_level, (depths, linearised)),
    "axes of a result swapped": Fault(
        seen, "png", of_image(lambda image: image.swapaxes(0, 1)), (red_and_white,)
    ),
    "a result mirrored": Fault(
        seen, "png", of_image(lambda image: image[:, ::-1]), (red_and_white,)
    ),
    "colours of pixels exchanged": Fault(
        seen, "png", of_image(lambda image: image[..., ::-1]), (red_and_white,)
    ),
    "colours of classes exchanged": Fault(
        seen, "CLASS_COLOURS", lambda old: (old[1], old[0], old[2]), (red_and_white,)
    ),
    "views in columns": Fault(
        views,
        "png",
        of_image(lambda image: image.swapaxes(0, 1)),
        (test_show_views.test_views_stand_in_rows_with_their_counts,),
    ),
    "views from the right": Fault(
        views,
        "png",
        of_image(lambda image: image[:, ::-1]),
        (test_show_views.test_views_stand_in_rows_with_their_counts,),
    ),
    "outlines upside down": Fault(
        view_depth.RayView,
        "clip_of",
        lambda clip_of: lambda self, at: clip_of(self, at) * (1.0, -1.0, 1.0, 1.0),
        (outlines,),
    ),
    "circles of spheres too small": Fault(
        lines,
        "_circles",
        lambda circles: lambda view, some: circles(view, some._replace(radii=0.9 * some.radii)),
        (outlines,),
    ),
    # Depth of other kinds.
    "depth as that of the other direction": Fault(
        view_depth.RayView,
        "depth_of",
        lambda depth_of: lambda self, ndc, level=0: depth_of(self, 1.0 - ndc, level),
        (linearised, came_back),
    ),
    "z for distance": Fault(
        view_depth.RayView,
        "ray_lengths",
        lambda _: lambda self: np.ones(self.size),
        (linearised, came_back),
    ),
    "rays through corners of pixels": Fault(
        view_depth.RayView,
        "_middles",
        lambda old: lambda self, *at: tuple(
            one - 1.0 / self.size[1 - k] for k, one in enumerate(old(self, *at))
        ),
        (came_back, test_view_depth.test_an_oblique_near_plane),
    ),
    # Data.
    "sparse depth filled with the nearest": Fault(
        sparse, "np", lambda _: Numpy(maximum=np.minimum), (test_fill_depth.test_filling_by_loops,)
    ),
    "a window one pixel too wide": Fault(
        sparse,
        "_farthest_after",
        lambda farthest: lambda depth, radius: farthest(depth, radius + 1),
        (test_fill_depth.test_filling_by_loops,),
    ),
    "corners of another order": Fault(
        _corners,
        "SIGNS",
        lambda old: {**old, "kitti": old["carla"], "carla": old["kitti"]},
        (corners_of("kitti"), corners_of("carla")),
        ValueError,
    ),
    "length and width exchanged": Fault(
        _corners,
        "SIGNS",
        lambda old: {**old, "kitti": (old["kitti"][2], old["kitti"][1], old["kitti"][0])},
        (corners_of("kitti"),),
    ),
    # Views around a place.
    "two faces of a cube exchanged": Fault(
        cubes,
        "FACES",
        lambda old: (old[1], old[0], *old[2:]),
        (test_views_around.test_the_faces_are_those_of_a_cube_map,),
    ),
    "a face upside down": Fault(
        cubes,
        "FACES",
        lambda old: (*old[:5], (old[5][0], old[5][1], (0.0, 1.0, 0.0))),
        (test_views_around.test_the_faces_are_those_of_a_cube_map,),
    ),
    "cells without the target's height": Fault(
        terrain,
        "_boxes",
        lambda boxes: lambda grid, there, steps, _: boxes(grid, there, steps, 0.0),
        (boxes_of_cells,),
    ),
    "rows' steps for columns": Fault(
        terrain,
        "_boxes",
        lambda boxes: lambda grid, there, steps, up: boxes(grid, there, steps[::-1], up),
        (boxes_of_cells,),
    ),
    "squares split the other way": Fault(
        terrain,
        "_mesh",
        other_diagonal,
        (test_views_around.test_the_other_diagonal_is_another_terrain,),
    ),
    "a near plane above the ground": Fault(
        terrain,
        "cube",
        lambda cube: lambda eye, *, size, near: cube(eye, size=size, near=64.0 * near),
        (test_views_around.test_the_eye_s_own_ground_is_seen_however_near,),
    ),
    # Examples of the jobs.
    "height, width, length": Fault(
        test_jobs, "load", on_text("table[:, [9, 7, 8]]", "table[:, [7, 8, 9]]"), (few_labels,)
    ),
    "y up in a KITTI label": Fault(
        test_jobs, "load", on_text("- half * (0, 1, 0)", "+ half * (0, 1, 0)"), (few_labels,)
    ),
    "regions without labels read": Fault(
        test_jobs, "load", on_text('if not line.startswith("DontCare")', ""), (few_labels,)
    ),
    "the coarsest level of detail": Fault(
        test_jobs, "load", on_text('float(each["lod"]))[-1:]', 'float(each["lod"]))[:1]'),
        (kinds_of_cityjson,),
    ),
    "holes closed": Fault(
        test_jobs, "load", on_text("len(rings) > 1 or ", ""), (kinds_of_cityjson,)
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_red(
    monkeypatch: pytest.MonkeyPatch, device: hizvk.Device, tmp_path: Any, name: str
) -> None:
    fault = FAULTS[name]
    given = {"device": device, "tmp_path": tmp_path}
    for test in fault.tests:
        wanted = test.__code__.co_varnames[: test.__code__.co_argcount]  # type: ignore[attr-defined]
        with monkeypatch.context() as planted:
            planted.setattr(fault.where, fault.name, fault.made(getattr(fault.where, fault.name)))
            with pytest.raises(fault.error):
                test(**{key: given[key] for key in wanted})


#: What is replaced in the page's program.
PAGE_FAULTS = {
    "mirrored": ("return [width / 2 + p[0]", "return [width / 2 - p[0]"),
    "upside down": ("height / 2 - p[1]", "height / 2 + p[1]"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGE_FAULTS)
def test_a_fault_in_the_page_is_red(
    monkeypatch: pytest.MonkeyPatch,
    device: hizvk.Device,
    tmp_path: Any,
    name: str,
) -> None:
    browser = test_show_page.Browser(tmp_path)
    what, by = PAGE_FAULTS[name]
    page = hizvk.show.page

    def faulty(*args: Any, **more: Any) -> str:
        text = page(*args, **more)
        assert what in text
        return text.replace(what, by)

    monkeypatch.setattr(test_show_page.show, "page", faulty)
    with pytest.raises(AssertionError):
        test_show_page.test_keys_mouse_and_pixels(browser, device, tmp_path)
