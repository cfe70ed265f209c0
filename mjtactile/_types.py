"""Arrays by what they hold, named once for the whole package."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

#: Numbers in double precision.
Array = npt.NDArray[np.float64]
#: Booleans.
Mask = npt.NDArray[np.bool_]
#: Indices into another array.
Indices = npt.NDArray[np.int64]
#: Arrays of any type by name, as files hold them.
Tables = dict[str, npt.NDArray[Any]]
