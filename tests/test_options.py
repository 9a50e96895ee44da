"""`CullOptions` and `Outputs`: one definition in Python, one in Rust, and nothing between them."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest

import hizvk
from hizvk import _core, options

ROOT = Path(__file__).resolve().parents[1]
FIELDS = {
    cls.__name__: [one.name for one in dataclasses.fields(cls)]
    for cls in (hizvk.CullOptions, hizvk.Outputs)
}


#: The fields of `Outputs` that need the table of meshes of a device; test_emit.py has them.
OF_EMIT = ["meshes", "emit", "placement"]


def rust_fields(struct: str) -> list[str]:
    """The public fields of a struct of hiz_core."""
    for path in (ROOT / "crates" / "hiz_core" / "src").rglob("*.rs"):
        text = path.read_text(encoding="utf-8")
        found = re.search(rf"^pub struct {struct} \{{\n(.*?)^\}}", text, re.DOTALL | re.MULTILINE)
        if found:
            return re.findall(r"^    pub (\w+):", found[1], re.MULTILINE)
    raise LookupError(struct)


def test_rust_and_python_have_the_same_fields() -> None:
    assert rust_fields("CullOptions") == FIELDS["CullOptions"]
    # Rust's `emit` is an enum that holds what Python gives in three fields.
    *others, emit = rust_fields("Outputs")
    assert ([*others, *OF_EMIT], emit) == (FIELDS["Outputs"], "emit")


def test_the_defaults_are_the_same() -> None:
    rust_options, rust_outputs = _core.options_text(None, None)
    text, _ = _core.options_text(hizvk.CullOptions(), hizvk.Outputs())
    assert text == rust_options
    # What is left open is made during the cull in the order of the device, and later otherwise.
    _, text = _core.options_text(hizvk.CullOptions(order="any"), hizvk.Outputs())
    assert text == rust_outputs
    _, text = _core.options_text(hizvk.CullOptions(), hizvk.Outputs())
    assert text == rust_outputs.replace(
        "indices: true, draws: true", "indices: false, draws: false"
    )


#: Another value than the default for each field, and what the engine has then.
OTHERS: dict[str, tuple[Any, str]] = {
    "order": ("any", "order: Any"),
    "coverage": ("sample", "coverage: Sample"),
    "guard_px": (0.25, "guard_px: Some(0.25)"),
    "depth_slack": (0.125, "depth_slack: 0.125"),
    "depth_slack_abs": (0.5, "depth_slack_abs: 0.5"),
    "transform_slack": (4, "transform_slack: 4.0"),
    "footprint": (np.int64(8), "footprint: Eight"),
    "descent": (7, "descent: 7"),
    "fit": ("volume", "fit: Volume"),
    "hierarchy": (np.int64(2), "hierarchy: Tiers(2)"),
    "statistics": (True, "statistics: true"),
    "lod": (hizvk.LodByError(0.5), "lod: Error { pixels: 0.5 }"),
    "shadow": (
        hizvk.DirectionalLight((0, -1, 0), ((-2, -3, -4), (5, 6, 7)), 0.0, 0.5),
        "shadow: Some(DirectionalLight { direction: [0.0, -1.0, 0.0], "
        "receivers_min: [-2.0, -3.0, -4.0], receivers_max: [5.0, 6.0, 7.0], "
        "angular_radius: 0.0, filter_radius: 0.5 })",
    ),
    "mask": (False, "mask: false"),
    "verdicts": (False, "verdicts: false"),
    "indices": (True, "indices: true"),
    "draws": (True, "draws: true"),
    "pixels": (True, "pixels: true"),
    "pixel_budget": (9, "pixel_budget: Some(9)"),
    "capacity": (5, "capacity: Some(5)"),
    "draw": (
        hizvk.DrawTemplate(1, 2, -3, 4),
        "index_count: 1, first_index: 2, base_vertex: -3, first_instance: 4",
    ),
}


@pytest.mark.parametrize(
    "name", [n for n in [*FIELDS["CullOptions"], *FIELDS["Outputs"]] if n not in OF_EMIT]
)
def test_every_field_arrives_and_no_other_changes(name: str) -> None:
    value, expected = OTHERS[name]
    default = "".join(_core.options_text(hizvk.CullOptions(), hizvk.Outputs()))
    given, made = options.cull_request(None, None, {}, hizvk.Device.cull)
    if name in FIELDS["CullOptions"]:
        given = dataclasses.replace(given, **{name: value})
    else:
        made = dataclasses.replace(made, **{name: value})
    text = "".join(_core.options_text(given, made))
    assert expected in text
    changed = set(re.findall(r"\w+: [\w.()-]+", text)) - set(re.findall(r"\w+: [\w.()-]+", default))
    implied = {"indices: true", "draws: true"} if name == "order" else set()
    assert changed - implied == set(re.findall(r"\w+: [\w.()-]+", expected))


def test_the_keywords_are_the_fields() -> None:
    """Names and types, so that a type checker refuses what the dataclass refuses."""
    keywords = get_type_hints(options.OptionKeywords)
    assert keywords == get_type_hints(hizvk.CullOptions)
    outputs = get_type_hints(hizvk.Outputs)
    assert get_type_hints(options.CullKeywords) == keywords | {
        name: outputs[name] for name in ("pixel_budget", "capacity", "draw", *OF_EMIT)
    }


def test_every_field_is_documented_once() -> None:
    for cls in (hizvk.CullOptions, hizvk.Outputs):
        assert cls.__doc__ is not None
        for name in FIELDS[cls.__name__]:
            assert len(re.findall(rf"^    {name} : ", cls.__doc__, re.MULTILINE)) == 1, name
    # Whoever takes the objects refers to them.
    for function in (hizvk.Device.cull, hizvk.visible, hizvk.recommend):
        assert function.__doc__ is not None
        for name in FIELDS["CullOptions"]:
            assert not re.search(rf"^ +{name} : ", function.__doc__, re.MULTILINE), (function, name)


def test_objects_are_frozen_checked_and_compare() -> None:
    given = hizvk.CullOptions(footprint=4)
    with pytest.raises(dataclasses.FrozenInstanceError):
        given.footprint = 2  # type: ignore[misc]
    assert given == hizvk.CullOptions(footprint=np.int8(4))
    assert len({given, hizvk.CullOptions(footprint=4), hizvk.CullOptions()}) == 2
    with pytest.raises(ValueError, match="footprint: expected one of 1, 2, 4, 8, got 3"):
        dataclasses.replace(given, footprint=3)
    with pytest.raises(TypeError):
        hizvk.CullOptions("any")  # type: ignore[call-arg]


CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(8, 8), near=1.0)
BOUNDS = hizvk.Spheres(np.array([[0.0, 0, -2], [0, 0, -9]]), 0.5)


def test_objects_and_keywords_say_the_same() -> None:
    device = hizvk.Device()
    pyramid = device.pyramid(np.full((8, 8), 5.0), CAMERA, kind="z")
    crowd = device.instances(BOUNDS)
    whole = hizvk.CullOptions(order="any", statistics=True)
    draw = hizvk.DrawTemplate(36)
    results = [
        device.cull(crowd, CAMERA, pyramid, whole, hizvk.Outputs(capacity=0, draw=draw)),
        device.cull(crowd, CAMERA, pyramid, order="any", statistics=True, capacity=0, draw=draw),
        # Keywords take the place of fields.
        device.cull(
            crowd, CAMERA, pyramid, hizvk.CullOptions(statistics=True),
            hizvk.Outputs(capacity=7, draw=draw), order="any", capacity=0,
        ),
    ]  # fmt: skip
    for result in results:
        assert result.mask.tolist() == [True, False]
        assert (result.count, result.demand) == (0, 1)
        assert result.draws.tolist() == [(36, 0, 0, 0, 0)]
        assert result.stats.levels is not None
        assert result.device is device
    only = device.cull(crowd, CAMERA, pyramid, whole, ("mask",), capacity=1)
    with pytest.raises(ValueError, match="outputs: expected"):
        _ = only.verdicts
    seen = hizvk.visible(BOUNDS, CAMERA, depth=np.full((8, 8), 5.0), kind="z", options=whole)
    assert seen.tolist() == [True, False]


@pytest.mark.parametrize(
    ("wrong", "closest"),
    [("guard", "guard_px"), ("depth_slak", "depth_slack"), ("foot_print", "footprint")],
)
def test_an_unknown_keyword_is_told_the_closest_one(wrong: str, closest: str) -> None:
    device = hizvk.Device()
    pyramid = device.pyramid(np.full((8, 8), 5.0), CAMERA, kind="z")
    text = f"^{wrong}: expected no such parameter; the closest is {closest}, and all are .*order, "
    more: dict[str, Any] = {wrong: 1}
    with pytest.raises(TypeError, match=text):
        device.cull(device.instances(BOUNDS), CAMERA, pyramid, **more)
    with pytest.raises(TypeError, match=text):
        hizvk.visible(BOUNDS, CAMERA, depth=np.ones((8, 8)), kind="z", **more)
    # The keywords of outputs are the cull's alone.
    with pytest.raises(TypeError, match=r"^capacity: expected no such parameter"):
        hizvk.visible(BOUNDS, CAMERA, depth=np.ones((8, 8)), kind="z", capacity=1)  # type: ignore[call-arg]


def test_culls_in_turns_have_each_their_own_options() -> None:
    """What a device remembers of the last request answers the same two objects alone."""
    device = hizvk.Device()
    pyramid = device.pyramid(np.full((8, 8), 5.0), CAMERA, kind="z")
    crowd = device.instances(BOUNDS)
    plain, slack = hizvk.CullOptions(), hizvk.CullOptions(depth_slack=0.5)
    assert device.cull(crowd, CAMERA, pyramid, plain).mask.tolist() == [True, False]
    for _ in range(2):
        assert device.cull(crowd, CAMERA, pyramid, slack).mask.tolist() == [True, True]
        assert device.cull(crowd, CAMERA, pyramid, plain).mask.tolist() == [True, False]
        only = device.cull(crowd, CAMERA, pyramid, plain, ["indices"])
        assert only.indices.tolist() == [0]
        with pytest.raises(ValueError, match="outputs: expected"):
            _ = only.mask
    # Objects that were made and dropped one after the other may lie at the same place.
    for relative, expected in [(0.0, [True, False]), (0.5, [True, True])] * 8:
        options = hizvk.CullOptions(depth_slack=relative)
        assert device.cull(crowd, CAMERA, pyramid, options).mask.tolist() == expected
