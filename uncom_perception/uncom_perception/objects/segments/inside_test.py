# SPDX-License-Identifier: Apache-2.0
"""The inside of a cup that is painted otherwise than its outside: told by its shape alone."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from uncom_perception.objects.segments.surface_fitting import FRAGMENT_PIXELS, RIM_M, has_top
from uncom_perception.objects.table.order_statistics import quantile

Points = npt.NDArray[np.float32]

_LEAST_WIDTH_M, _LARGEST_WIDTH_M = 0.03, 0.32
_UPPER_SHARE, _UPPER_M = 0.4, 0.012  # of what is seen of the inside: its wall below the rim
_SAGGING, _DEEPEST = 0.13, 0.8  # of its width: how much farther away the middle of the back wall is than its ends
_WIDER, _WIDER_M = 1.15, 0.008
_ROUND, _ROUND_M = 1.5, 0.02
_NEARER_SHARE = 0.85


def is_inside(mine: Points, theirs: Points, viewer: npt.NDArray[np.floating]) -> bool:
    """Whether points (N, 3) are what is seen over the rim of a hollow thing, whose outside others (M, 3) are of.

    A back wall sags away from the viewer (3,), who sees a ball or a can behind it bulge, and a box as flat. Both end at
    one rim, and together they are about as deep as wide.
    """
    if min(len(mine), len(theirs)) < FRAGMENT_PIXELS:
        return False
    bottom, top = quantile(mine[:, 2], 3), quantile(mine[:, 2], 98)
    if abs(top - quantile(theirs[:, 2], 98)) > RIM_M or has_top(mine) or has_top(theirs):
        return False
    upper = mine[mine[:, 2] > top - max(_UPPER_SHARE * (top - bottom), _UPPER_M)]
    ahead = mine[:, :2].mean(axis=0) - viewer[:2]
    ahead = ahead / max(float(np.hypot(*ahead)), 1e-6)
    across, away = _seen_from(upper, viewer, ahead)
    left, right = quantile(across, 3), quantile(across, 97)
    width = right - left
    if not _LEAST_WIDTH_M < width < _LARGEST_WIDTH_M:
        return False
    their_across, their_away = _seen_from(theirs, viewer, ahead)
    span = quantile(their_across, 98) - quantile(their_across, 2)
    deep = quantile(away, 98) - quantile(their_away, 2)
    if width > _WIDER * span + _WIDER_M or deep > _ROUND * width + _ROUND_M:
        return False
    if float((their_away < quantile(away, 50)).mean()) < _NEARER_SHARE:
        return False
    x = (across - 0.5 * (left + right)) / (0.5 * width)
    bend = float(np.polyfit(x, away, 2)[0])
    return _SAGGING * width < -bend < _DEEPEST * width


def _seen_from(
    points: Points, viewer: npt.NDArray[np.floating], ahead: npt.NDArray[np.floating]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return how far points (N, 3) are to the side of where a viewer looks, and how far away, seen from above [m]."""
    flat = points[:, :2].astype(float) - viewer[:2]
    return flat @ np.array([-ahead[1], ahead[0]]), flat @ ahead
