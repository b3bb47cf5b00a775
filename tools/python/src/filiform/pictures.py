"""Pictures of a set or a cell, without a display."""

from __future__ import annotations

from typing import Any, Sequence, Union

import numpy as np
import numpy.typing as npt

from .arrays import Picture
from .png import encode
from .scene import Scene

_VIEWS = {
    "front": (0.0, 0.0), "back": (180.0, 0.0), "right": (90.0, 0.0), "left": (-90.0, 0.0),
    "top": (0.0, 90.0), "bottom": (0.0, -90.0),
}


def render(
    scene: Scene,
    *,
    size: tuple[int, int] = (1280, 800),
    camera: Union[str, Sequence[Any]] = "front",
    box: npt.ArrayLike | None = None,
    proxy: npt.ArrayLike | None = None,
    zoom: float = 300.0,
    highlight: Any = None,
    colour_by: str = "cell",
    orthographic: bool = False,
    segments: int = 2_000_000,
) -> Picture:
    """Draw a set, or one cell of it highlighted among the others.

    Parameters
    ----------
    size : width and height, pixels, at most 8192.
    camera : front, back, left, right, top, bottom; (yaw, pitch) in degrees; or (eye, target), two points in um.
    box : (2, 3), um, to frame. Default: the whole set; for a cell, its bounds.
    proxy : (3,), um: look closely at this place, `zoom` um across.
    highlight : a cell to emphasise: a name or a Cell.
    colour_by : cell, type, depth, radius or tile.
    segments : draw at most this many; a set with levels of detail is then drawn coarser.

    Returns an array (height, width, 3), uint8, rows from the top. Raises ImportError without OpenGL (Debian:
    libegl1, libopengl0, libgl1-mesa-dri), ValueError for a wrong option. Do not draw in a process that was forked after its
    parent has drawn: OpenGL does not survive a fork.

    >>> ff.render(s, size=(64, 48)).shape
    (48, 64, 3)
    """
    if not hasattr(scene, "_scene"):
        raise TypeError(f"scene: expected a Set or a Cell, got {type(scene).__name__}")
    owner, index, bounds = scene._scene()
    box = bounds if box is None and proxy is None else box
    current = owner._handle.current()  # first: a closed set is named, also where nothing can be drawn
    try:
        from . import _render
    except ImportError as error:
        raise ImportError(f"this build of filiform draws no pictures: {error}") from None

    look: Any = None
    if isinstance(camera, str):
        if camera not in _VIEWS:
            raise ValueError(f"camera: unknown view {camera!r}; choose from {' '.join(_VIEWS)}")
        yaw, pitch = _VIEWS[camera]
    else:
        angles = np.asarray(camera, dtype=float)
        if angles.shape == (2,):
            yaw, pitch = angles.tolist()
        elif angles.shape == (2, 3):
            yaw, pitch, look = 0.0, 0.0, angles
        else:
            raise ValueError("camera: expected a name, (yaw, pitch) in degrees, or two points")
    try:
        width, height = size
    except (TypeError, ValueError):
        raise ValueError("size: expected (width, height)") from None
    if highlight is not None:
        index = owner._index_of(highlight)
    return _render.render(
        current, width, height, box, proxy, zoom, yaw, pitch, look, index, colour_by, orthographic, segments
    )


def notebook_png(scene: Scene) -> bytes | None:
    """The picture that a notebook shows; None where nothing can be drawn."""
    if scene._scene()[0].closed:
        return None
    try:
        return encode(render(scene, size=(640, 400), segments=300_000))
    except (ImportError, RuntimeError, ValueError):
        return None
