from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from ._core import OpenSet

def render(
    open: OpenSet, width: Any, height: Any, box: Any, proxy: Any, zoom: Any, yaw_deg: Any, pitch_deg: Any, look: Any,
    highlight: Optional[int], colour_by: str, orthographic: bool, segments: Any, /,
) -> npt.NDArray[np.uint8]: ...
