"""One HTML page of a cull's result, which turns and zooms in a browser without a network.

The page holds its data, and draws them with `web.js`: a rasteriser on a canvas, without libraries.
"""

from __future__ import annotations

import base64
import json
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .. import _arguments
from .._core import __version__
from .._types import Up, words
from ..mesh import A_MESH, meshes_of
from ..view_depth import RayView
from .colours import BACKGROUND, CLASS_COLOURS, FRUSTUM, INK
from .seen import seen_of
from .seen_plot import up_of
from .shapes import HIDDEN, KEPT, OUTSIDE

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from ..bounds import Bounds
    from ..mesh import Mesh, MeshLike
    from .seen import Seen
    from .shapes import Shapes

    _Doubles = npt.NDArray[np.float64]

__all__ = ["page"]

#: The most triangles of occluders in a page.
MOST_TRIANGLES: Final = 40_000
#: The colour of occluders that face the viewer.
OCCLUDER: Final = "#4c5f5a"
#: The vertical angle of the viewer in the place of a camera without one, in degrees.
PARALLEL_FOV: Final = 20.0
#: The share of the instances at each end of an axis that the first view does not wait for.
TAIL: Final = 0.01


def page(
    result: Any,
    bounds: Bounds | None = None,
    *,
    occluders: MeshLike | Sequence[MeshLike] | None = None,
    up: Up | None = None,
    most: int = 20_000,
    unit: str = "m",
    title: str | None = None,
) -> str:
    """The text of the page; `CullResult.save_html` writes it and describes the parameters."""
    seen = seen_of(result, bounds, _arguments.text("unit", unit))
    meshes = None
    if occluders is not None:
        meshes = meshes_of("occluders", occluders, f"{A_MESH}, or a list of them")
    most = _arguments.integer("most", most, low=1, high=2**31 - 1)
    if up is None:
        up_: str = up_of(seen.camera)
    else:
        up_ = _arguments.choice("up", up, words(Up))
    if title is not None:
        seen = seen._replace(title=_arguments.text("title", title))
    return page_of(seen, meshes, up_, most)


def page_of(seen: Seen, meshes: list[Mesh] | None, up: str, most: int) -> str:
    """The text of the page of what is shown, with at most `most` instances."""
    if seen.classes is None:
        raise ValueError(
            'outputs: expected "mask" or "verdicts" of a cull that is drawn, got neither'
        )
    shapes = seen.shapes(most)
    vertices, triangles, total = _occluders(meshes)
    view = RayView(seen.camera)
    origin = _middle(shapes, view)
    data = _scene(seen, shapes, view, up, origin)
    data["vertices"] = _coded(vertices - origin, np.float32)
    data["triangles"] = _coded(triangles, np.uint32)
    counts = seen.counts()
    rows = []
    for one in (KEPT, HIDDEN, OUTSIDE):
        if seen.names[one]:
            rows.append(_row(one, CLASS_COLOURS[one], seen.names[one], f"{counts[one]:,}"))
    if meshes is not None:
        rows.append(_row(3, OCCLUDER, "triangles that hide", f"{total:,}"))
    rows += [_row(None, "", *map(str, line)) for line in seen.numbers]
    told = [f"Hint: {hint}." for hint in seen.hints]
    if len(shapes.indices) < len(seen.classes):
        told.append(f"{len(shapes.indices):,} of {len(seen.classes):,} instances are drawn.")
    if len(triangles) < total:
        told.append(f"{len(triangles):,} of {total:,} triangles are drawn, the largest ones.")
    here = files(__package__)
    template = (here / "web.html").read_text(encoding="utf-8")
    return template.format(
        title=escape(seen.title),
        summary=escape(
            ", ".join(f"{n} {c:,}" for n, c in zip(seen.names, counts, strict=True) if n)
        ),
        rows="".join(rows),
        drawn=escape(" ".join(told)),
        unit=escape(seen.unit or "world units"),
        about=escape(f"{seen.camera!r}; hizvk {__version__}"),
        # "<" would end the script's element, or begin a comment in it.
        scene=json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
        script=(here / "web.js").read_text(encoding="utf-8"),
        background=BACKGROUND,
        ink=INK,
        frustum=FRUSTUM,
    )


def _row(number: int | None, colour: str, name: str, value: str) -> str:
    """A line of the table; with a number, a box that shows or leaves out what it names."""
    text = escape(name)
    if number is not None:
        mark = f'<span class="swatch" style="background:{colour}"></span>'
        text = f'<label><input type="checkbox" checked data-class="{number}"> {mark}{text}</label>'
    return f'<tr><td>{text}</td><td class="number">{escape(value)}</td></tr>'


def _scene(seen: Seen, shapes: Shapes, view: RayView, up: str, origin: _Doubles) -> dict[str, Any]:
    """What the script reads; positions are relative to `origin`, so float32 holds them."""
    kind = "boxes"
    if shapes.axes is None:
        kind = "spheres" if shapes.radii.any() else "points"
        sizes: _Doubles = shapes.radii if kind == "spheres" else np.zeros(0)
    else:
        sizes = shapes.axes
        halves = np.diagonal(sizes, axis1=1, axis2=2)
        if np.array_equal(sizes, np.eye(3) * halves[:, None, :]):
            sizes = halves
        else:
            kind = "oriented"
    centers = shapes.centers - origin
    eye = view.eye if view.eye is not None else view.corners(1.0)[:4].mean(axis=0)
    eye = eye - origin
    reach = _reach(centers, eye)
    ahead = np.concatenate([(centers - eye) @ view.forward, [0.0]])
    far = max(1.1 * float(ahead.max()), 0.05 * reach)
    bottom, top = view.corners(1.0)[[0, 3]]
    fov = PARALLEL_FOV
    if view.eye is not None:
        half = 0.5 * np.linalg.norm(top - bottom) / ((bottom - view.eye) @ view.forward)
        fov = 2.0 * float(np.degrees(np.arctan(half)))
    axis = np.zeros(3)
    axis["xyz".index(up[-1])] = -1.0 if up.startswith("-") else 1.0
    first = np.roll(np.abs(axis), 1)
    return {
        "kind": kind,
        "origin": origin.tolist(),
        "centers": _coded(centers, np.float32),
        "sizes": _coded(sizes, np.float32),
        "classes": _coded(shapes.classes, np.uint8),
        "indices": _coded(shapes.indices, np.uint32),
        "names": list(seen.names),
        "colours": [*CLASS_COLOURS, OCCLUDER],
        "background": BACKGROUND,
        "frustumColour": FRUSTUM,
        "basis": [first.tolist(), np.cross(axis, first).tolist(), axis.tolist()],
        "mirrored": bool(np.linalg.det([view.right, view.up, view.forward]) > 0.0),
        "reach": reach,
        "frustum": (view.corners(far) - origin).ravel().tolist(),
        "camera": {
            "eye": eye.tolist(),
            "forward": view.forward.tolist(),
            "fov": min(max(fov, 10.0), 120.0),
            "distance": max(float(-eye @ view.forward), 0.2 * reach),
        },
    }


def _middle(shapes: Shapes, view: RayView) -> _Doubles:
    """The middle of most instances, or a point before the eye without any."""
    if len(shapes.centers):
        ends = np.quantile(shapes.centers, (TAIL, 1.0 - TAIL), axis=0)
        middle: _Doubles = ends.mean(axis=0)
        return middle
    ahead: _Doubles = view.corners(1.0)[4:].mean(axis=0)
    return ahead


def _reach(centers: _Doubles, eye: _Doubles) -> float:
    """How far most instances and the eye are from the middle."""
    far = np.linalg.norm(centers, axis=1)
    most = float(np.quantile(far, 1.0 - TAIL)) if len(far) else 1.0
    return max(most, min(float(np.linalg.norm(eye)), 3.0 * most), 1e-6)


def _occluders(meshes: list[Mesh] | None) -> tuple[_Doubles, npt.NDArray[np.intp], int]:
    """Vertices and triangles of all places of all meshes, and how many triangles there are."""
    parts: list[_Doubles] = [np.zeros((0, 3, 3))]
    total = 0
    for mesh in meshes or ():
        corners = np.asarray(mesh.vertices, np.float64)[mesh.triangles]
        places = [np.eye(4)] if mesh.transforms is None else np.asarray(mesh.transforms, np.float64)
        for place in places:
            total += len(corners)
            parts.append(_largest(corners @ place[:3, :3].T + place[:3, 3]))
    soup = _largest(np.concatenate(parts))
    vertices, triangles = np.unique(soup.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, triangles.reshape(-1, 3), total


def _largest(triangles: _Doubles) -> _Doubles:
    """At most `MOST_TRIANGLES` of them."""
    if len(triangles) <= MOST_TRIANGLES:
        return triangles
    edges = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return triangles[np.sort(np.argsort(-areas, kind="stable")[:MOST_TRIANGLES])]


def _coded(array: npt.NDArray[Any], dtype: npt.DTypeLike) -> str:
    """The array's bytes, little-endian, as base64."""
    raw = np.ascontiguousarray(array, np.dtype(dtype).newbyteorder("<")).tobytes()
    return base64.b64encode(raw).decode("ascii")
