"""Bad arguments: every parameter of every public function has a test of its error's text.

The tables are in bad_values/.
A text has to start with the parameter's name, and `test_every_parameter_has_a_bad_value` compares
the tables with the package, so that a new parameter without an entry fails.
"""

import dataclasses
import enum
import inspect
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import hizvk
from bad_values import EYE4, GL, MADE_BY_THE_PACKAGE, NAN, TABLES, Bad, K, camera, spheres


def cases() -> Iterator[Any]:
    for function, table in TABLES.items():
        for parameter, values in table.bad.items():
            for number, bad in enumerate(values):
                yield pytest.param(function, parameter, bad, id=f"{function}-{parameter}-{number}")


@pytest.mark.parametrize(("function", "parameter", "bad"), list(cases()))
def test_bad_argument(device: hizvk.Device, function: str, parameter: str, bad: Bad) -> None:
    value, exception, fragment = bad
    call, arguments = TABLES[function].make(device)
    # Of parameters that are alternatives, only the bad one is passed.
    if parameter == "world_from_camera":
        arguments.pop("camera_from_world", None)
    if function == "Camera.from_colmap" and parameter in ("camera_from_world", "world_from_camera"):
        del arguments["qvec"], arguments["tvec"]
    if (
        function == "Camera.from_opengl"
        and parameter not in ("projection", "size")
        and "world" not in parameter
    ):
        by_k = parameter in ("k", "pixel_center", "distortion")
        arguments |= {
            "near": 0.1,
            **({"k": K, "pixel_center": "half"} if by_k else {"fov_x_deg": 60}),
        }
        del arguments["projection"]
        if parameter == "fov_y_deg":
            del arguments["fov_x_deg"]
    if (
        function == "Camera.from_matrices"
        and parameter != "clip_from_world"
        and parameter.endswith(("world", "camera"))
    ):
        del arguments["clip_from_world"]
        arguments |= {"clip_from_camera": GL}
        if parameter == "clip_from_camera":
            arguments["camera_from_world"] = EYE4
    if function == "Device.occluders" and parameter == "vertices" and value is None:
        del arguments["triangles"]
    with pytest.raises(exception) as caught:
        call(**{**arguments, parameter: value})
    assert type(caught.value) is exception
    text = str(caught.value)
    # Some messages begin with several names, and an item of a list has its number.
    assert text.startswith((f"{parameter}:", f"{parameter}, ", f"{parameter}[")), text
    assert fragment in text


@pytest.mark.parametrize("function", TABLES)
def test_the_valid_arguments_are_valid(device: hizvk.Device, function: str) -> None:
    if function == "Camera":
        with pytest.raises(TypeError, match=r"use Camera\.look_at"):
            hizvk.Camera()
        return
    call, arguments = TABLES[function].make(device)
    call(**arguments)


def public_callables() -> dict[str, Callable[..., Any]]:
    """Every function, class and method that callers can pass arguments to."""
    found: dict[str, Callable[..., Any]] = {}
    for name in hizvk.reference.__all__:
        if inspect.isfunction(getattr(hizvk.reference, name)):
            found[f"reference.{name}"] = getattr(hizvk.reference, name)
    for name in hizvk.__all__:
        thing = getattr(hizvk, name)
        if inspect.isfunction(thing):
            found[name] = thing
        if not inspect.isclass(thing) or issubclass(thing, (Exception, enum.Enum)):
            continue
        if name not in MADE_BY_THE_PACKAGE:
            found[name] = thing
        inherited = [vars(base) for base in thing.__mro__ if base.__module__ == "hizvk.pictured"]
        for method in {*vars(thing), *(key for keys in inherited for key in keys)}:
            value = inspect.getattr_static(thing, method)
            if not method.startswith("_") and (
                inspect.isfunction(value) or isinstance(value, classmethod)
            ):
                found[f"{name}.{method}"] = getattr(thing, method)
    return found


def test_every_parameter_has_a_bad_value() -> None:
    found = public_callables()
    assert set(found) == set(TABLES)
    for name, function in found.items():
        parameters = set(inspect.signature(function).parameters) - {"self"}
        if "keywords" in parameters:
            of_culls = name in ("Device.cull", "Device.warm_up")
            keywords = hizvk.options.CullKeywords if of_culls else hizvk.options.OptionKeywords
            parameters = parameters - {"keywords"} | set(keywords.__annotations__)
        assert parameters == set(TABLES[name].bad), name


def test_strict_refuses_bad_bounds_and_names_them(device: hizvk.Device) -> None:
    bad = hizvk.Spheres(np.array([[0.0, 0, 0], [NAN, 0, 0]]), 1.0)
    with pytest.raises(ValueError, match="1") as caught:
        device.instances(bad, strict=True)
    assert "bounds" in str(caught.value) or "centers" in str(caught.value)
    assert device.instances(bad).invalid.tolist() == [1]


def test_what_belongs_to_another_device_is_refused(device: hizvk.Device) -> None:
    other = hizvk.Device()
    view = camera()
    pyramid = device.pyramid(np.ones((6, 8)), view, kind="z")
    instances = device.instances(spheres())
    occluders = device.occluders(np.zeros((3, 3)), [[0, 1, 2]])
    image = device.render_depth(occluders, view)
    with pytest.raises(
        ValueError, match="instances: expected Instances of this device, got one of another Device"
    ):
        other.cull(instances, view, pyramid)
    with pytest.raises(ValueError, match="pyramid: expected Pyramid of this device"):
        other.cull(other.instances(spheres()), view, pyramid)
    with pytest.raises(ValueError, match="occluders: expected Occluders of this device"):
        other.render_depth(occluders, view)
    with pytest.raises(ValueError, match="instances: expected Instances of this device"):
        other.warm_up(instances, view)
    with pytest.raises(ValueError, match="occluders: expected Occluders of this device"):
        other.warm_up(other.instances(spheres()), view, occluders=occluders)
    with pytest.raises(ValueError, match="depth: expected DepthImage of this device"):
        other.pyramid(image)


def test_a_rendered_image_has_its_camera_and_kind(device: hizvk.Device) -> None:
    view = camera()
    image = device.render_depth(device.occluders(np.zeros((3, 3)), [[0, 1, 2]]), view)
    with pytest.raises(TypeError, match="camera: expected nothing beside a DepthImage"):
        device.pyramid(image, view)  # type: ignore[call-overload]
    with pytest.raises(
        TypeError,
        match="kind: expected nothing beside a DepthImage, which has its own, got str 'z'",
    ):
        device.pyramid(image, kind="z")  # type: ignore[call-overload]
    with pytest.raises(ValueError, match="camera: expected the camera of depth"):
        hizvk.visible(spheres(), camera((6, 9)), depth=image)
    with pytest.raises(TypeError, match="kind: expected nothing beside a DepthImage"):
        hizvk.visible(spheres(), view, depth=image, kind="z")


@pytest.mark.parametrize(
    ("meshes", "exception", "fragment"),
    [
        (
            [np.zeros((3, 3))],
            TypeError,
            "vertices[0]: expected a Mesh, a mesh of trimesh, Open3D or PyVista, or a list of them "
            "when triangles is left out",
        ),
        (
            [(np.zeros((3, 2)), [[0, 1, 2]])],
            ValueError,
            "vertices[0]: vertices: expected float (V, 3), got (3, 2)",
        ),
        (
            [(np.zeros((3, 3)), [[0, 1, 9]])],
            ValueError,
            "vertices[0]: triangles: expected vertex indices in 0..2",
        ),
        ("mesh", TypeError, "got str 'mesh'"),
    ],
)
def test_bad_lists_of_meshes(
    device: hizvk.Device, meshes: Any, exception: type[Exception], fragment: str
) -> None:
    with pytest.raises(exception) as caught:
        device.occluders(meshes)
    assert fragment in str(caught.value)
    with pytest.raises(TypeError, match="transforms: expected nothing beside a list of meshes"):
        device.occluders([], transforms=EYE4)  # type: ignore[call-overload]


def test_ndc_has_no_units_and_no_integers(device: hizvk.Device) -> None:
    with pytest.raises(ValueError, match='scale: expected 1 for the kind "reversed_ndc"'):
        device.pyramid(np.ones((6, 8)), camera(), kind="reversed_ndc", scale=0.5)
    with pytest.raises(
        TypeError, match=r"depth: expected float \(height, width\), or whole numbers"
    ):
        device.pyramid(np.ones((6, 8), dtype=np.uint16), camera(), kind="reversed_ndc")
    with pytest.raises(
        ValueError, match=r'kind: expected "ndc" \(0 near and 1 far\) .* got "reversed_ndc"'
    ):
        device.pyramid(np.ones((6, 8)), camera(reversed_z=False), kind="reversed_ndc")


def test_only_one_way_to_say_where_the_camera_is() -> None:
    with pytest.raises(
        ValueError, match=r"camera_from_world, world_from_camera: expected exactly one .*, got both"
    ):
        hizvk.Camera.from_opengl(GL, camera_from_world=EYE4, world_from_camera=EYE4, size=(6, 8))
    with pytest.raises(ValueError, match=r"clip_from_world: expected alone, .* got both"):
        hizvk.Camera.from_matrices(GL, camera_from_world=EYE4, size=(6, 8), reversed_z=False)


def test_objects_are_immutable() -> None:
    view = camera()
    with pytest.raises(AttributeError, match="a Camera is immutable"):
        view.size = (1, 1)  # type: ignore[misc]
    with pytest.raises(AttributeError, match="a Camera is immutable"):
        del view._inner
    with pytest.raises(dataclasses.FrozenInstanceError):
        spheres().radii = np.ones(1)  # type: ignore[misc]
