"""Bad arguments: what a device makes and does."""

import numpy as np

import hizvk

from .shared import (
    BOUNDS,
    CAMERA,
    CAPACITY,
    DEPTH_SLACK,
    DEPTHS,
    DRAW,
    EYE4,
    FLAG,
    IMAGE,
    INVALID,
    KIND,
    LEVELS,
    LIMIT,
    NAN,
    NUMBER,
    OF_MESHES,
    OPTIONS,
    OPTIONS_OBJECT,
    OUTPUTS_OBJECT,
    PIXEL_BUDGET,
    PROGRESS,
    SCALE,
    SIZE,
    TETRAHEDRON,
    TOLERANCE,
    TRANSFORMS,
    TRIANGLES,
    VERTICES,
    Table,
    camera,
    cull_arguments,
    occlusion_map,
    spheres,
    unsigned,
)

TABLES: dict[str, Table] = {
    "DrawTemplate": Table(
        lambda _: (hizvk.DrawTemplate, {"index_count": 36}),
        {
            "index_count": unsigned("index_count"),
            "first_index": unsigned("first_index"),
            "first_instance": unsigned("first_instance"),
            "base_vertex": [
                (2**31, ValueError, "in -2147483648..2147483647"),
                (0.5, TypeError, "got float 0.5"),
            ],
        },
    ),
    "Device": Table(
        lambda _: (hizvk.Device, {}),
        {
            "adapter": [
                (
                    1.5,
                    TypeError,
                    "expected an adapter's index, a part of its name, or None, got float 1.5",
                ),
                (True, TypeError, "got bool True"),
                (-1, ValueError, "in 0..2147483647, got int -1"),
                (" ", ValueError, "got an empty string"),
            ]
        },
    ),
    "Device.instances": Table(
        lambda device: (device.instances, {"bounds": spheres()}),
        {
            "bounds": BOUNDS,
            "strict": FLAG,
            "order": [
                ("sorted", ValueError, 'expected one of "morton", "given", got str \'sorted\''),
                (None, TypeError, "got None"),
            ],
            "mesh_ids": [
                ([0.5], TypeError, "expected integer (1,), got (1,) float64"),
                ([0, 1], ValueError, "expected integer (1,), got (2,) int64"),
                ([-1], ValueError, "expected mesh ids from 0 on, or hizvk.ABSENT, got -1"),
                ([2**32], ValueError, "or hizvk.ABSENT, got 4294967296"),
                ([2**20], hizvk.LimitError, "1048577 requested, this device allows 65536"),
                ("mesh", TypeError, "got str 'mesh'"),
            ],
            "scales": [
                ([1.0, 2.0], ValueError, "expected float (1,) or one number, got (2,) float64"),
                ([-1.0], ValueError, "expected numbers from 0 on below 2^60, got -1"),
                ([NAN], ValueError, "got NaN at index 0"),
                ("large", TypeError, "got str 'large'"),
            ],
        },
    ),
    "Occluders.move": Table(
        lambda device: (
            device.occluders(np.zeros((3, 3)), [[0, 1, 2]]).move,
            {"mesh": 0, "transforms": EYE4},
        ),
        {
            "mesh": [
                (1, ValueError, "expected the number of one of the 1 meshes, got 1"),
                (-1, ValueError, "in 0..4294967295, got int -1"),
                ("door", TypeError, "got str 'door'"),
            ],
            "transforms": TRANSFORMS,
        },
    ),
    "Instances.update": Table(
        lambda device: (device.instances(spheres()).update, {"first": 0, "bounds": spheres()}),
        {
            "first": [
                (2, ValueError, "in 0..1, got int 2"),
                (-1, ValueError, "in 0..1, got int -1"),
                (0.0, TypeError, "got float 0.0"),
            ],
            "bounds": [
                *BOUNDS,
                (
                    hizvk.Boxes(np.zeros((1, 3)), np.ones((1, 3))),
                    TypeError,
                    "expected spheres as the instances are, got Boxes Boxes(1 of float64)",
                ),
                (
                    hizvk.Spheres(np.zeros((2, 3)), 1.0),
                    ValueError,
                    "expected at most 1 from instance 0 of 1 on, got 2",
                ),
            ],
            "strict": FLAG,
        },
    ),
    "Device.occluders": Table(
        lambda device: (device.occluders, {"vertices": np.zeros((3, 3)), "triangles": [[0, 1, 2]]}),
        {
            "vertices": [*VERTICES, (None, TypeError, "got None")],
            "triangles": TRIANGLES,
            "transforms": TRANSFORMS,
            "cull": [
                ("both", ValueError, 'expected one of "none", "back", "front", got str \'both\''),
                (None, TypeError, "got None"),
            ],
        },
    ),
    "Device.render_depth": Table(
        lambda device: (
            device.render_depth,
            {"occluders": device.occluders(np.zeros((3, 3)), [[0, 1, 2]]), "camera": camera()},
        ),
        {
            "occluders": [
                (
                    np.zeros((3, 3)),
                    TypeError,
                    "expected Occluders of Device.occluders, got (3, 3) float64",
                )
            ],
            "camera": CAMERA,
            "size": SIZE,
            "conservative": FLAG,
            "refinement": [
                (9, ValueError, "in 0..8"),
                (-1, ValueError, "in 0..8"),
                (2.0, TypeError, "got float 2.0"),
            ],
            "rasteriser": [
                ("gpu", ValueError, 'expected one of "auto", "device", "host", got str'),
                (None, TypeError, "got None"),
            ],
            "into": [
                (np.zeros((6, 8)), TypeError, "expected a DepthImage of Device.render_depth"),
            ],
            "only": [
                ("all", TypeError, "expected a CullResult, a bool (1,) array or an array of int"),
                ([0.0], TypeError, "got (1,) float64"),
                ([[0]], TypeError, "got (1, 1) int64"),
                ([1], ValueError, "expected numbers of copies in 0..0, got 1"),
                ([-1], ValueError, "expected numbers of copies in 0..0, got -1"),
                ([True, False], ValueError, "expected bool (1,), got (2,) bool"),
                (np.ma.masked_all(1, bool), TypeError, "got a masked array"),
            ],
            "max_triangles": LIMIT,
            "max_occluders": LIMIT,
            "progress": PROGRESS,
        },
    ),
    "Device.pyramid": Table(
        lambda device: (
            device.pyramid,
            {"depth": np.ones((6, 8)), "camera": camera(), "kind": "z"},
        ),
        {
            "depth": [*IMAGE, (None, TypeError, "got None")],
            "camera": CAMERA,
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "tolerance": TOLERANCE,
            "levels": LEVELS,
            "depths": DEPTHS,
        },
    ),
    "Device.receiver_mask": Table(
        lambda device: (
            device.receiver_mask,
            {
                "depth": np.ones((6, 8)),
                "camera": camera(),
                "light_camera": camera(),
                "kind": "z",
                "filter_radius": 0.1,
                "reach_px": 0.5,
                "depth_slack": 0.0,
                "depth_slack_abs": 0.0,
            },
        ),
        {
            "depth": [
                *IMAGE,
                (np.ones((6, 8, 4)), ValueError, "expected one sample per pixel, got 4"),
            ],
            "camera": CAMERA,
            "light_camera": CAMERA,
            "kind": KIND,
            "filter_radius": [*NUMBER, (-1.0, ValueError, "got float -1.0")],
            "reach_px": [
                *NUMBER,
                (17.0, ValueError, "at most 16, got float 17.0"),
                (0.3, ValueError, "expected a multiple of 1/256, got 0.3"),
            ],
            "depth_slack": DEPTH_SLACK,
            "depth_slack_abs": DEPTH_SLACK,
        },
    ),
    "Device.cull": Table(
        lambda device: (device.cull, cull_arguments(device)),
        {
            "instances": [
                (
                    spheres(),
                    TypeError,
                    "expected Instances of Device.instances, got Spheres Spheres(1",
                )
            ],
            "camera": [
                (None, TypeError, "expected a Camera or a sequence of Cameras, got None"),
                (EYE4, TypeError, "got (4, 4) float64"),
                ("front", TypeError, "got str 'front'"),
                ([], ValueError, "expected 1 to 256 views, got 0"),
                ([camera()] * 257, ValueError, "expected 1 to 256 views, got 257"),
                ([None], TypeError, "camera[0]: expected a Camera, got None"),
                (camera((6, 9)), ValueError, "expected the camera of the pyramid"),
                (
                    camera().resized((3, 4)),
                    ValueError,
                    "pass camera.resized((6, 8)), the same view; the promise is",
                ),
                (camera((6, 9)), ValueError, "depth of one camera says nothing about another one"),
            ],
            "pyramid": [
                (
                    np.zeros((6, 8)),
                    TypeError,
                    "expected a Pyramid of Device.pyramid, got (6, 8) float64",
                )
            ],
            "options": OPTIONS_OBJECT,
            "outputs": OUTPUTS_OBJECT,
            "among": [
                (
                    "all",
                    TypeError,
                    "expected a bool (1,) array, a CullResult, ViewsResult or PassResult",
                ),
                ([0], TypeError, "got (1,) int64"),
                ([True, False], ValueError, "got (2,) bool"),
                ([[True]], ValueError, "got (1, 1) bool"),
                (np.ma.masked_all(1, bool), TypeError, "got a masked array"),
            ],
            "wait": FLAG,
            **OPTIONS,
            "pixel_budget": PIXEL_BUDGET,
            "capacity": CAPACITY,
            "draw": DRAW,
            **OF_MESHES,
        },
    ),
    "Device.occlusion_map": Table(
        lambda device: (
            device.occlusion_map,
            {"occluders": device.occluders([TETRAHEDRON]), "camera": camera()},
        ),
        {
            "occluders": [(TETRAHEDRON, TypeError, "expected Occluders of Device.occluders")],
            "camera": [(None, TypeError, "expected a Camera, got None")],
            "size": [
                ((256, 255), ValueError, "expected powers of two up to 32768, got (256, 255)"),
                (256, TypeError, "got int 256"),
            ],
            "least": [
                (3, ValueError, "expected a power of two, got 3"),
                (512, ValueError, "expected an integer in 1..256, got int 512"),
            ],
            "regions": [
                (0, ValueError, "expected an integer in 1..256, got int 0"),
                (24, ValueError, "expected a power of two, got 24"),
            ],
            "max_triangles": [(-1, ValueError, "got int -1")],
            "max_occluders": [(0.5, TypeError, "got float 0.5")],
        },
    ),
    "OcclusionMap.level": Table(
        lambda device: (occlusion_map(device).level, {"level": 0}),
        {"level": [(7, ValueError, "in -7..6, got int 7"), (0.0, TypeError, "got float 0.0")]},
    ),
    "OcclusionMap.opacity": Table(
        lambda device: (occlusion_map(device).opacity, {"level": 0}),
        {"level": [(-8, ValueError, "in -7..6, got int -8")]},
    ),
    "OcclusionMap.least_counts": Table(
        lambda device: (occlusion_map(device).least_counts, {"negligible_px": 0}),
        {"negligible_px": [(-1, ValueError, "got int -1"), (1.0, TypeError, "got float 1.0")]},
    ),
    "BspTiling": Table(
        lambda device: (hizvk.BspTiling, {"occluders": device.occluders([TETRAHEDRON])}),
        {
            "occluders": [(TETRAHEDRON, TypeError, "expected Occluders of Device.occluders")],
            "leaf": [(0, ValueError, "got int 0"), (0.5, TypeError, "got float 0.5")],
            "most_parts": [
                (0.5, ValueError, "got float 0.5"),
                ("all", TypeError, "got str 'all'"),
                (NAN, ValueError, "got float nan"),
            ],
        },
    ),
    "BspTiling.draw": Table(
        lambda device: (
            hizvk.BspTiling(device.occluders([TETRAHEDRON])).draw,
            {"camera": camera()},
        ),
        {"camera": [(None, TypeError, "expected a Camera, got None")]},
    ),
    "Device.cull_map": Table(
        lambda device: (
            device.cull_map,
            {"bounds": spheres(), "camera": camera(), "maps": occlusion_map(device)},
        ),
        {
            "bounds": [(None, TypeError, "expected Spheres, Boxes, OrientedBoxes or Points")],
            "camera": [
                (None, TypeError, "expected a Camera, got None"),
                (camera(far=9.0), ValueError, "expected the view of the maps"),
            ],
            "maps": [(None, TypeError, "expected an OcclusionMap of Device.occlusion_map")],
            "negligible_px": [
                (-1, ValueError, "expected an integer in 0..4294967295, got int -1"),
                (0.5, TypeError, "got float 0.5"),
            ],
            "copies": [
                ([0, 1, 2], ValueError, "expected integer (1,), got"),
                ([0.5], TypeError, "expected integer (1,), got"),
                ([-1], ValueError, "expected numbers of copies from 0 on, or hizvk.ABSENT, got -1"),
            ],
        },
    ),
    "Device.cull_approximate": Table(
        lambda device: (
            device.cull_approximate,
            {
                "instances": device.instances(spheres()),
                "camera": camera(),
                "pyramid": device.pyramid(np.ones((6, 8)), camera(), kind="z"),
                "negligible_px": 4,
            },
        ),
        {
            "instances": [
                (spheres(), TypeError, "expected Instances of Device.instances, got Spheres")
            ],
            "camera": [
                (None, TypeError, "expected a Camera, got None"),
                (camera((6, 9)), ValueError, "expected the camera of the pyramid"),
            ],
            "pyramid": [(None, TypeError, "expected a Pyramid of Device.pyramid, got None")],
            "options": OPTIONS_OBJECT,
            "negligible_px": [
                (-1, ValueError, "expected an integer in 0..4294967295, got int -1"),
                (0.5, TypeError, "got float 0.5"),
            ],
            **OPTIONS,
        },
    ),
    "CullResult.visible_fraction": Table(
        lambda device: (
            device.cull(
                device.instances(spheres()),
                camera(),
                device.pyramid(np.ones((6, 8)), camera(), kind="z"),
                outputs=["pixels"],
            ).visible_fraction,
            {},
        ),
        {"objects_in_depth": FLAG},
    ),
    "visible_fraction": Table(
        lambda _: (hizvk.visible_fraction, {"pixels": np.zeros(2, hizvk.PIXELS_DTYPE)}),
        {
            "pixels": [
                (np.zeros(2), TypeError, "expected an array of PIXELS_DTYPE, got (2,) float64"),
                ([(1, 0, 1, 0, 0)], TypeError, "expected an array of PIXELS_DTYPE, got"),
            ],
            "objects_in_depth": FLAG,
        },
    ),
    "Device.temporal": Table(
        lambda device: (device.temporal, {"instances": device.instances(spheres())}),
        {
            "instances": [
                (spheres(), TypeError, "expected Instances of Device.instances, got Spheres")
            ],
            "early_capacity": [
                (-1, ValueError, "expected an integer in 0..4294967295, got int -1"),
                (2.0, TypeError, "got float 2.0"),
            ],
        },
    ),
    "Temporal.early": Table(
        lambda device: (
            device.temporal(device.instances(spheres())).early,
            {"camera": camera()},
        ),
        {
            "camera": CAMERA,
            "only": [
                ([True, False], ValueError, "expected bool (1,), got (2,) bool"),
                ([1], ValueError, "expected numbers of instances in 0..0, got 1"),
                ("all", TypeError, "got str 'all'"),
            ],
            "largest_px": [
                (-1, ValueError, "expected an integer in 0..2147483647, got int -1"),
                (1.5, TypeError, "got float 1.5"),
            ],
        },
    ),
    "Temporal.late": Table(
        lambda device: (
            device.temporal(device.instances(spheres())).late,
            {"camera": camera(), "depth": np.ones((6, 8)), "kind": "z"},
        ),
        {
            "camera": CAMERA,
            "depth": [*IMAGE, (None, TypeError, "got None")],
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "levels": LEVELS,
            "options": OPTIONS_OBJECT,
            **OPTIONS,
        },
    ),
    "Temporal.reset": Table(
        lambda device: (device.temporal(device.instances(spheres())).reset, {}), {}
    ),
    "Device.warm_up": Table(
        lambda device: (
            device.warm_up,
            {"instances": device.instances(spheres()), "camera": camera()},
        ),
        {
            "instances": [
                (
                    spheres(),
                    TypeError,
                    "expected Instances of Device.instances, got Spheres Spheres(1",
                )
            ],
            "camera": CAMERA,
            "options": OPTIONS_OBJECT,
            "outputs": OUTPUTS_OBJECT,
            "occluders": [
                (
                    np.zeros((3, 3)),
                    TypeError,
                    "expected Occluders of Device.occluders or None, got (3, 3) float64",
                )
            ],
            "levels": LEVELS,
            "depths": DEPTHS,
            "two_passes": FLAG,
            "samples": [
                (3, ValueError, "samples: expected one of (1, 2, 4, 8, 16), got 3"),
                (0, ValueError, "expected an integer in 1..16, got int 0"),
                (2.0, TypeError, "got float 2.0"),
            ],
            "views": [
                (0, ValueError, "expected an integer in 1..256, got int 0"),
                (257, ValueError, "got int 257"),
                (True, TypeError, "got bool True"),
            ],
            **OPTIONS,
            "pixel_budget": PIXEL_BUDGET,
            "capacity": CAPACITY,
            "draw": DRAW,
            **OF_MESHES,
        },
    ),
}
