# SPDX-License-Identifier: Apache-2.0
"""The inside of a cup that is painted otherwise than its outside: told by its shape alone."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import quantile
from uncom_perception.objects.segments.options import CAVITY, SURFACE_FIT, CavityOptions, SurfaceFitOptions
from uncom_perception.objects.segments.surface_fitting import has_top

Points = npt.NDArray[np.float32]


def is_inside(
    mine: Points,
    theirs: Points,
    viewer: npt.NDArray[np.floating],
    *,
    surface_fit_options: SurfaceFitOptions = SURFACE_FIT,
    cavity_options: CavityOptions = CAVITY,
) -> bool:
    """Whether points (N, 3) are what is seen over the rim of a hollow object, whose outside others (M, 3) are of.

    A back wall sags away from the viewer (3,), who sees a ball or a can behind it bulge, and a box as flat. Both end at
    one rim, and together they are about as deep as wide.
    """
    if min(len(mine), len(theirs)) < surface_fit_options.fragment_pixels:
        return False
    bottom, top = quantile(mine[:, 2], 3), quantile(mine[:, 2], 98)
    if abs(top - quantile(theirs[:, 2], 98)) > surface_fit_options.rim_m or has_top(mine) or has_top(theirs):
        return False
    upper = mine[mine[:, 2] > top - max(cavity_options.upper_share * (top - bottom), cavity_options.upper_m)]
    ahead = mine[:, :2].mean(axis=0) - viewer[:2]
    ahead = ahead / max(float(np.hypot(*ahead)), 1e-6)
    across, away = _seen_from(upper, viewer, ahead)
    left, right = quantile(across, 3), quantile(across, 97)
    width = right - left
    if not cavity_options.least_width_m < width < cavity_options.greatest_width_m:
        return False
    their_across, their_away = _seen_from(theirs, viewer, ahead)
    span = quantile(their_across, 98) - quantile(their_across, 2)
    deep = quantile(away, 98) - quantile(their_away, 2)
    if (
        width > cavity_options.wider_factor * span + cavity_options.wider_m
        or deep > cavity_options.deeper_factor * width + cavity_options.deeper_m
    ):
        return False
    if float((their_away < quantile(away, 50)).mean()) < cavity_options.nearer_share:
        return False
    x = (across - 0.5 * (left + right)) / (0.5 * width)
    bend = float(np.polyfit(x, away, 2)[0])
    return cavity_options.least_sag * width < -bend < cavity_options.greatest_sag * width


def _seen_from(
    points: Points, viewer: npt.NDArray[np.floating], ahead: npt.NDArray[np.floating]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return how far points (N, 3) are to the side of where a viewer looks, and how far away, seen from above [m]."""
    flat = points[:, :2].astype(float) - viewer[:2]
    return flat @ np.array([-ahead[1], ahead[0]]), flat @ ahead
