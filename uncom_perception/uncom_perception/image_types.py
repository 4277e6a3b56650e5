# SPDX-License-Identifier: Apache-2.0
"""Array types of colour and depth images."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
RgbImage = npt.NDArray[np.uint8]
DepthImage = npt.NDArray[np.float32]
