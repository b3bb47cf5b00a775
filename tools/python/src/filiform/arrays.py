"""The types of the arrays that the package returns."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
Rows = npt.NDArray[np.void]  # structured: named fields
Floats = npt.NDArray[np.float64]
Radii = npt.NDArray[np.float32]
Ids = npt.NDArray[np.int64]  # of samples
Ranks = npt.NDArray[np.uint32]  # rows of Cell.nodes
Types = npt.NDArray[np.uint16]  # codes of SWC
Picture = npt.NDArray[np.uint8]
