"""What can be seen in a city model: surfaces of a CityJSON file, from places on a square.

Every surface is an instance, and every surface that a fan of triangles fills hides others.
Conservative depth holds for every ray, so what is culled cannot be seen from that place at all.

Another file and other places: ``model_visibility.py town.city.json 85000,446490,3.6 ...``
"""

import json
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

import hizvk

TOWN = Path(__file__).parent / "data" / "town.city.json"
#: Geometries that have surfaces: a solid has lists of them, its shells.
SHAPES = ("Solid", "MultiSurface", "CompositeSurface")
#: On the square, 1.6 m above the ground, in the file's coordinates; z is up.
PLACES = [(x, y, 3.6) for x in (84_985.0, 85_000.0, 85_015.0) for y in (446_485.0, 446_505.0)]


def read_surfaces(path: Path) -> tuple[list[str], list[list[npt.NDArray[np.float64]]]]:
    """Of each surface: whose it is, and its rings of vertices."""
    model = json.loads(path.read_text())
    step = model.get("transform", {"scale": 1.0, "translate": 0.0})
    vertices = np.array(model["vertices"]) * step["scale"] + step["translate"]
    names, surfaces = [], []
    for name, thing in model["CityObjects"].items():
        shapes = [each for each in thing.get("geometry", []) if each["type"] in SHAPES]
        # The finest level of detail: coarser ones may be larger, and would hide what shows.
        for shape in sorted(shapes, key=lambda each: float(each["lod"]))[-1:]:
            parts = shape["boundaries"]
            for shell in parts if shape["type"] == "Solid" else [parts]:
                names += [name] * len(shell)
                surfaces += [[vertices[ring] for ring in rings] for rings in shell]
    return names, surfaces


def fan(rings: list[npt.NDArray[np.float64]]) -> list[tuple[int, int, int]]:
    """Triangles of a convex surface without holes, and none of others: those hide nothing here."""
    edges = np.roll(rings[0], -1, axis=0) - rings[0]
    turns = np.cross(edges, np.roll(edges, -1, axis=0))
    if len(rings) > 1 or (turns @ turns.sum(axis=0) < 0).any():
        return []
    return [(0, k, k + 1) for k in range(1, len(rings[0]) - 1)]


def main() -> None:
    """Looks in all directions from each place."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else TOWN
    places = [tuple(map(float, text.split(","))) for text in sys.argv[2:]] or PLACES
    names, surfaces = read_surfaces(path)
    meshes = [hizvk.Mesh(rings[0], fan(rings)) for rings in surfaces if fan(rings)]
    corners = [np.concatenate(rings) for rings in surfaces]
    boxes = hizvk.Boxes([c.min(axis=0) for c in corners], [c.max(axis=0) for c in corners])

    # Six cameras per place, which share a row of the result.
    cameras = [camera for place in places for camera in hizvk.cube(place, size=512, near=0.2)]
    seen = hizvk.sweep(
        boxes, cameras, occluders=meshes, groups=np.arange(len(cameras)) // 6,
        conservative=True, descent=4096, fit="volume",
    )  # fmt: skip
    owners = np.array(names)
    shown = [set(owners[seen.mask(k)]) for k in range(len(seen))]
    for place, count, buildings in zip(places, seen.counts, shown, strict=True):
        print(f"from {place}: {count} of {len(names)} surfaces, of {len(buildings)} buildings")
    everywhere, nowhere = set.intersection(*shown), set(names).difference(*shown)
    print(f"{len(set(names))} buildings: {len(everywhere)} show from all places, ", end="")
    print(f"{len(nowhere)} from none")


if __name__ == "__main__":
    print(__doc__) if "--help" in sys.argv else main()
