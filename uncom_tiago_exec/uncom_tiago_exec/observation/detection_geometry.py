# SPDX-License-Identifier: Apache-2.0
"""Where detections stand and how large they are, from their point clouds alone."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from uncom_perception.types import Detection

from uncom_tiago_exec.types import FloatArray

_OUTLIERS = 0.02  # share of the points at either end that an outline leaves out
_LEAST_EXTENT_M = 1e-3


def points_of(detections: Iterable[Detection]) -> FloatArray:
    """Return all points (N, 3) of detections, in their frame [m]; none of what was seen without depth."""
    clouds = (d.geometry.cloud for d in detections if d.geometry is not None)
    return np.vstack([np.zeros((0, 3)), *(np.asarray(cloud, dtype=float).reshape(-1, 3) for cloud in clouds)])


def footprint_centre(detection: Detection) -> FloatArray:
    """Return the centre (2,) of the axis-aligned outline as seen from above [m]; NaN without depth."""
    if detection.geometry is None:
        return np.full(2, np.nan)
    cloud = np.asarray(detection.geometry.cloud, dtype=float).reshape(-1, 3)
    if len(cloud) == 0:
        return np.asarray(detection.geometry.pose[:2, 3], dtype=float)
    low, high = (np.quantile(cloud[:, :2], share, axis=0) for share in (_OUTLIERS, 1.0 - _OUTLIERS))
    return np.asarray(0.5 * (low + high))


def distance_between(detection: Detection, place: FloatArray) -> float:
    """Return how far the footprint centre is from a place (2,) [m]."""
    return float(np.linalg.norm(footprint_centre(detection) - place))


def visible_extent(detection: Detection) -> float:
    """Return the diagonal of the axis-aligned box around what is seen of an object [m]."""
    if detection.geometry is None or len(detection.geometry.cloud) == 0:
        return 0.0
    return float(np.linalg.norm(np.ptp(np.asarray(detection.geometry.cloud), axis=0)))


def extent_ratio(detection: Detection, other: Detection) -> float:
    """Return the visible extent of a detection as a multiple of another one's."""
    return visible_extent(detection) / max(visible_extent(other), _LEAST_EXTENT_M)


def extent_misfit(detection: Detection, extent: float) -> float:
    """Return the absolute logarithm of the ratio of a visible extent and another one [m]."""
    ratio = max(visible_extent(detection), _LEAST_EXTENT_M) / max(extent, _LEAST_EXTENT_M)
    return abs(float(np.log(ratio)))
