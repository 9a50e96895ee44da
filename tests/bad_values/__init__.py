"""Bad arguments of every public function: the tables behind test_api_errors.py.

Each function has a table: valid arguments, and for each parameter bad values with the exception and
a part of its text.

- `shared`: values and valid arguments that several tables use
- `inputs`: bounds, cameras, meshes, and what else a call takes
- `devices`: what a device makes and does
- `results`: options, results and functions of the package
- `making_occluders`, `sweeps`, `methods`: each of these parts of the package
"""

from . import devices, inputs, making_occluders, methods, results, sweeps
from .shared import EYE4, GL, NAN, Bad, K, Table, camera, spheres

__all__ = [
    "EYE4",
    "GL",
    "MADE_BY_THE_PACKAGE",
    "NAN",
    "TABLES",
    "Bad",
    "K",
    "Table",
    "camera",
    "spheres",
]

#: By the function's name. None is in two parts.
TABLES: dict[str, Table] = {}
for _part in (inputs, devices, results, making_occluders, sweeps, methods):
    assert not TABLES.keys() & _part.TABLES.keys()
    TABLES |= _part.TABLES

#: Classes that only the package makes, so no argument can be bad.
MADE_BY_THE_PACKAGE = {
    "Adapter",
    "ApproximateResult",
    "BoundsCheck",
    "Comparison",
    "CullResult",
    "CullStats",
    "DepthImage",
    "Explanation",
    "HierarchyFrame",
    "InnerBoxes",
    "InnerPrisms",
    "Instances",
    "MapResult",
    "OccluderSelection",
    "Occluders",
    "OcclusionMap",
    "PassResult",
    "PointColours",
    "Projected",
    "ProxyCheck",
    "Pyramid",
    "Recommendation",
    "SplitMesh",
    "StageTime",
    "StageTimes",
    "Sweep",
    "Temporal",
    "TiledCoverage",
    "UnoccludedComparison",
    "ViewsResult",
}
