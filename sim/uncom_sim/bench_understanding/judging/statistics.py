# SPDX-License-Identifier: Apache-2.0
"""Confidence intervals of shares, and quantiles."""

from __future__ import annotations

import math

_Z95 = 1.959963984540054


def wilson(right: int, total: int, z: float = _Z95) -> tuple[float, float]:
    """Return the Wilson score interval (95 % by default) of a share, each from 0 to 1; (0, 1) of nothing."""
    if total == 0:
        return 0.0, 1.0
    share = right / total
    centre = (share + z * z / (2.0 * total)) / (1.0 + z * z / total)
    half = z / (1.0 + z * z / total) * math.sqrt(share * (1.0 - share) / total + z * z / (4.0 * total * total))
    return max(0.0, centre - half), min(1.0, centre + half)


def quantile(values: list[float], share: float) -> float:
    """Return the value below which a share of the values lies; 0 of none."""
    if not values:
        return 0.0
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]
