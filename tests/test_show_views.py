"""The picture, table and figure of a result of several views."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk.commands.figure import can_draw
from hizvk.show import colours, views
from pictures import decoded, near
from test_show import picture_in

WHITE, RED = (255, 255, 255), (255, 70, 56)
SIZE = (30, 60)
#: Of a view in the picture, and from one to the next.
TALL, WIDE, GAP = 120, 240, 4
needs_matplotlib = pytest.mark.skipif(not can_draw(), reason="matplotlib is not installed")


def looking(turn_deg: float, size: tuple[int, int] = SIZE) -> hizvk.Camera:
    a = np.radians(turn_deg)
    to = (np.sin(a), 0.0, -np.cos(a))
    return hizvk.Camera.look_at((0, 0, 0), to, fov_y_deg=40, size=size, near=0.1)


#: A ball ahead at 10 m and one behind it at 30 m; a third at the right.
BALLS = hizvk.Spheres([(0.0, 0, -10), (0.0, 0, -30), (30.0, 0, 0)], [1.0, 1.0, 1.0])


def culled(
    device: hizvk.Device, cameras: list[hizvk.Camera], bounds: Any = BALLS, **more: Any
) -> hizvk.ViewsResult:
    walls = [device.pyramid(np.full(one.size, 20.0), one, kind="z") for one in cameras]
    return device.cull(device.instances(bounds), cameras, walls, **more)


def cells(page: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", page)
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]


def part(shown: npt.NDArray[np.uint8], row: int, column: int) -> npt.NDArray[np.uint8]:
    top, left = row * (TALL + GAP), column * (WIDE + GAP)
    return shown[top : top + TALL, left : left + WIDE]


def test_views_stand_in_rows_with_their_counts(device: hizvk.Device) -> None:
    """Ahead, at the right, behind: the wall is at 20 m in all of them."""
    seen = culled(device, [looking(0.0), looking(90.0), looking(180.0)])
    assert seen.mask.tolist() == [[True, False, False], [False, False, False], [False] * 3]
    shown = decoded(seen._repr_png_())
    assert shown.shape == (2 * TALL + GAP, 2 * WIDE + GAP, 3)
    for row, column, kept, hidden in (
        (0, 0, True, True),
        (0, 1, False, True),
        (1, 0, False, False),
    ):
        assert (near(part(shown, row, column), WHITE) > 20) == kept
        assert (near(part(shown, row, column), RED) > 20) == hidden
    assert near(part(shown, 1, 1), WHITE, 0) == TALL * WIDE  # there is no fourth view
    assert near(shown[:, WIDE : WIDE + GAP], WHITE, 0) == shown.shape[0] * GAP
    page = seen._repr_html_()
    assert decoded(picture_in(page)).shape == shown.shape
    assert cells(page) == [
        ["view", "kept", "culled: hidden", "culled: outside the view"],
        ["0", "1", "1", "1"],
        ["1", "0", "1", "2"],
        ["2", "0", "0", "3"],
    ]
    assert "ViewsResult: 3 views of 3 instances" in page


def test_of_many_views_some_are_shown(device: hizvk.Device) -> None:
    count = 100
    seen = culled(device, [looking(3.6 * k) for k in range(count)])
    shown = decoded(seen._repr_png_())
    assert shown.shape == (3 * (TALL + GAP) - GAP, 4 * (WIDE + GAP) - GAP, 3)
    page = seen._repr_html_()
    assert "Shown, in rows from the top left: views 0, 9, 18, 27, 36," in page
    assert "81, 90, 99 of 0 to 99." in page
    assert "The table has 24 of 100 views." in page
    rows = cells(page)[1:]
    assert len(rows) == 24
    assert [int(row[1]) for row in rows] == [int(seen.counts[int(row[0])]) for row in rows]
    assert len(page) < 400_000


def test_views_of_several_sizes_and_without_verdicts(device: hizvk.Device) -> None:
    cameras = [looking(0.0), looking(0.0, (60, 30))]
    seen = culled(device, cameras, outputs=["mask"])
    shown = decoded(seen._repr_png_())
    assert shown.shape == (240, 2 * WIDE + GAP, 3)
    background = colours.rgb(colours.BACKGROUND)
    assert near(shown[TALL:, :WIDE], background, 0) == TALL * WIDE
    assert near(shown[:, WIDE + GAP + 120 :], background, 0) == 240 * 120
    assert cells(seen._repr_html_()) == [["view", "kept"], ["0", "1"], ["1", "1"]]
    listed = culled(device, cameras, outputs=["indices"])
    assert "<img" in listed._repr_html_()


def test_bounds_that_are_not_known_are_named(device: hizvk.Device) -> None:
    crowd = device.instances(BALLS)
    crowd.update(0, hizvk.Spheres([(0.0, 0, -9)], 1.0))
    hiz = device.pyramid(np.full(SIZE, 20.0), looking(0.0), kind="z")
    seen = device.cull(crowd, [looking(0.0)], [hiz])
    assert ".plot(bounds) draws them" in seen._repr_html_()
    with pytest.raises(ValueError, match=r"^bounds: expected the bounds of the 3 instances"):
        seen.plot()


@needs_matplotlib
def test_a_figure_has_a_panel_per_view(device: hizvk.Device) -> None:
    seen = culled(device, [looking(0.0), looking(90.0), looking(180.0)])
    figure = seen.plot()
    titles = [axis.get_title() for axis in figure.axes if axis.axison]
    assert titles == [
        "view 0: 1 kept, 2 culled",
        "view 1: 0 kept, 3 culled",
        "view 2: 0 kept, 3 culled",
    ]
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == list(views.CLASSES)
    assert decoded(figure._repr_png_()).size > 0
    many = culled(device, [looking(3.6 * k) for k in range(30)]).plot(BALLS, most=1)
    assert len([axis for axis in many.axes if axis.axison]) == views.MOST_VIEWS
    assert many._suptitle.get_text().endswith(
        "views 0, 3, 5, 8, 11, 13, 16, 18, 21, 24, 26, 29 of 0 to 29"
    )
    assert culled(device, [looking(0.0)], outputs=["mask"]).plot().axes[0].axison
