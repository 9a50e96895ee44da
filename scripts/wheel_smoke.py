"""Tries an installed wheel for a few seconds: `wheel_smoke.py`.

`wheel_smoke.py --no-driver` is for a machine without a device.
`--advice` prints how to install the extras, and `--extras` uses them.
"""

import sys

import numpy as np

import hizvk
from hizvk import _core

INSTALL_LINE = "apt install libvulkan1 mesa-vulkan-drivers"


def without_driver() -> None:
    """The import has worked; opening a device must say what to install."""
    try:
        hizvk.Device()
    except hizvk.NoAdapterError as error:
        assert INSTALL_LINE in str(error), (
            f"NoAdapterError: expected the line {INSTALL_LINE!r}, got {error}"
        )
        print(f"no driver: NoAdapterError: {error}")
    else:
        raise AssertionError("Device(): expected NoAdapterError without a driver")


def with_driver() -> None:
    """Culls two spheres, one behind and one before a wall that fills the view."""
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(90, 160), near=0.1)
    wall = np.full((90, 160), 10.0)
    spheres = hizvk.Spheres(np.array([[0.0, 0.0, -20.0], [0.0, 0.0, -5.0]]), np.array([1.0, 1.0]))
    device = hizvk.Device()
    mask = hizvk.visible(spheres, camera, depth=wall, kind="z", device=device)
    assert mask.tolist() == [False, True], f"visible: expected [False, True], got {mask.tolist()}"
    print(f"hizvk on {device.adapter}: one of two spheres is hidden, as it should be")


def with_extras() -> None:
    """The packages that the advice has installed are those that pictures and rays need."""
    from hizvk.commands import figure
    from hizvk.scenes import embree, mountains

    assert figure.can_draw(), "expected matplotlib"
    assert embree.can_cast(), "expected embreex"
    scene = mountains(trees=10, views=1)
    print(f"extras: {len(scene.views)} view of the mountains, which matplotlib ships")


if __name__ == "__main__":
    assert "site-packages" in hizvk.__file__, (
        f"hizvk comes from {hizvk.__file__}, not from the wheel"
    )
    for name in ("Yardstick", "YardstickCull", "YardstickReduction", "options_text"):
        assert not hasattr(_core, name), (
            f"hizvk._core.{name}: expected in a developer's module alone"
        )
    assert not _core.takes_planted_faults
    if "--advice" in sys.argv[1:]:
        from hizvk.extras import install_line

        print(install_line("viz", "scene"))
    elif "--extras" in sys.argv[1:]:
        with_extras()
    elif "--no-driver" in sys.argv[1:]:
        without_driver()
    else:
        with_driver()
