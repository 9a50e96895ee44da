"""Culls for several views in one call, and which instances a cull is restricted to.

Each view has a camera and the pyramid of its own depth, so each decides for itself.
What any of them keeps is the list that a renderer in stereo draws.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from . import _arguments, foreign
from ._awaited import Awaited
from ._core import ViewsCulling as CoreViews
from ._on_device import check_owner
from ._processes import cached_property
from .camera import Camera
from .pictured import PicturedViews
from .resources import Pyramid
from .result import DRAW_DTYPE, CullResult, shared
from .temporal import PassResult

if TYPE_CHECKING:
    from typing import TypeAlias

    import numpy.typing as npt

    from ._core import Culling as CoreCulling
    from ._on_device import Maker
    from .hints import Question
    from .resources import Instances

    _AmongLike: TypeAlias = "npt.ArrayLike | CullResult | ViewsResult | PassResult"

__all__ = ["ViewsResult", "among_of", "pairs"]

#: As `MAX_VIEWS` of the engine.
MOST_VIEWS = 256


class ViewsResult(PicturedViews, Awaited[CoreViews]):
    """The answer of `Device.cull` for several cameras: one submission and one readback.

    It is a sequence of V results, one `CullResult` per view.

    Examples
    --------
    Two eyes and a pillar: each eye loses another ball behind it.

    >>> import numpy as np, hizvk
    >>> device = hizvk.Device()
    >>> pillar = device.occluders(
    ...     [[-0.2, -9, -2], [0.2, -9, -2], [0.2, 9, -2], [-0.2, 9, -2]], [[0, 1, 2], [0, 2, 3]]
    ... )
    >>> eyes = [
    ...     hizvk.Camera.look_at((x, 0, 0), (x, 0, -1), fov_y_deg=60, size=(90, 90), near=0.1)
    ...     for x in (-0.1, 0.1)
    ... ]
    >>> pyramids = [device.pyramid(device.render_depth(pillar, eye)) for eye in eyes]
    >>> balls = device.instances(hizvk.Spheres([(0.9, 0, -10), (-0.9, 0, -10), (0, 0, -3)], 0.05))
    >>> seen = device.cull(balls, eyes, pyramids)
    >>> seen.mask.tolist()
    [[False, True, False], [True, False, False]]
    >>> seen.any.tolist(), seen.counts.tolist()
    ([True, True, False], [1, 1])
    """

    def __init__(self, device: Maker, culling: CoreViews, questions: Sequence[Question]) -> None:
        super().__init__(device, culling)
        self._questions = tuple(questions)

    def __len__(self) -> int:
        """The number of views."""
        return self._inner.num_views()

    def __getitem__(self, view: int) -> CullResult:
        """The answer for one view, with its verdicts, counts, lists and explanations.

        Parameters
        ----------
        view : int
            ``0 <= view < len(self)``, or from the end if negative.

        Raises
        ------
        TypeError
            If it is no integer.
        IndexError
            If there is no such view.
        """
        count = len(self)
        try:
            number = _arguments.integer("view", view, low=-count, high=count - 1)
        except ValueError:
            hint = "; the first one is 0" if view == count else ""
            raise IndexError(
                f"view: expected an integer in {-count}..{count - 1}, got {view}{hint}"
            ) from None
        return self._views[number]

    @cached_property
    def _views(self) -> tuple[CullResult, ...]:
        return tuple(
            CullResult(self._device, self._inner.view(number), question)
            for number, question in enumerate(self._questions)
        )

    @property
    def num_instances(self) -> int:
        """The number of instances that were tested in each view."""
        return self._inner.num_instances()

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_]:
        """``(V, N)`` bool: True for what each view keeps."""
        masks = self._inner.masks().reshape(len(self), self.num_instances)
        return shared(masks)  # type: ignore[no-any-return]

    @cached_property
    def any(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what at least one view keeps; the device has joined the masks."""
        return shared(self._inner.any())  # type: ignore[no-any-return]

    @cached_property
    def counts(self) -> npt.NDArray[np.intp]:
        """``(V,)`` int: how many instances each view keeps; ``seen[v].stats`` tells more."""
        return shared(np.count_nonzero(self.mask, axis=1))  # type: ignore[no-any-return]

    @cached_property
    def indices(self) -> npt.NDArray[np.uint32]:
        """``(count,)`` uint32, ascending: the list of what at least one view keeps.

        Raises
        ------
        ValueError
            If the cull was not asked for indices.
        """
        return shared(self._inner.any_indices())  # type: ignore[no-any-return]

    @cached_property
    def draws(self) -> npt.NDArray[np.void]:
        """``(D,)`` of `DRAW_DTYPE`: draw arguments for the list of what at least one view keeps.

        Raises
        ------
        ValueError
            If the cull was asked for neither draws nor indices.
        """
        return np.frombuffer(self._inner.any_draws(), dtype=DRAW_DTYPE)

    def _summary(self) -> str:
        return f": {len(self)} views of {self.num_instances} instances"


def pairs(
    cameras: object, pyramids: object, device: object
) -> tuple[Sequence[Camera], Sequence[Pyramid]]:
    """The cameras and pyramids of several views, checked; cameras are compared by the caller."""
    for name, given, kind, expected in (
        ("camera", cameras, Camera, "a Camera or a sequence of Cameras"),
        ("pyramid", pyramids, Pyramid, "as many Pyramids of Device.pyramid as cameras"),
    ):
        if isinstance(given, str) or not isinstance(given, Sequence):
            got = _arguments.describe(given)
            raise TypeError(f"{name}: expected {expected}, got {got}")
        for number, one in enumerate(given):
            if not isinstance(one, kind):
                got = _arguments.describe(one)
                raise TypeError(f"{name}[{number}]: expected a {kind.__name__}, got {got}")
            if isinstance(one, Pyramid):
                check_owner(f"{name}[{number}]", one, device)
        if not 1 <= len(given) <= MOST_VIEWS:
            raise ValueError(f"{name}: expected 1 to {MOST_VIEWS} views, got {len(given)}")
    assert isinstance(cameras, Sequence)
    assert isinstance(pyramids, Sequence)
    if len(cameras) != len(pyramids):
        raise ValueError(
            f"pyramid: expected {len(cameras)}, one for each camera, got {len(pyramids)}"
        )
    return cameras, pyramids


def among_of(
    among: _AmongLike | None, instances: Instances, device: object
) -> npt.NDArray[np.bool_] | CoreCulling | CoreViews | None:
    """What `among` names, as the compiled module takes it."""
    if among is None:
        return None
    count = len(instances)
    if isinstance(among, PassResult):
        check_owner("among", among, device)
        among = among.mask
    if isinstance(among, (CullResult, ViewsResult)):
        check_owner("among", among, device)
        of = len(among) if isinstance(among, CullResult) else among.num_instances
        if of != count:
            raise ValueError(f"among: expected a result of {count} instances, got one of {of}")
        return among._inner
    expected = f"a bool ({count},) array, a CullResult, ViewsResult or PassResult"
    if _arguments.is_masked(among):
        raise TypeError(
            f"among: expected {expected}, got a masked array; "
            "fill it first, with .filled(False) or (True)"
        )
    among = foreign.as_numpy("among", expected, among)
    try:
        flags = np.asarray(among)
    except ValueError as error:
        raise ValueError(f"among: expected {expected}, got no array ({error})") from None
    if flags.dtype != np.bool_:
        got = _arguments.describe(among if flags.dtype == object else flags)
        raise TypeError(f"among: expected {expected}, got {got}")
    if flags.shape != (count,):
        raise ValueError(f"among: expected {expected}, got {_arguments.describe(flags)}")
    return np.ascontiguousarray(flags)
