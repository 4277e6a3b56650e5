# SPDX-License-Identifier: Apache-2.0
"""Where the finger really is, by its own pixels in a depth image.

A hand that is taken for its mirror image has its index finger at the wrong edge of the palm: its tip is right, its
base is not. The finger that the depth camera sees tells.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from uncom_common.camera import PinholeCamera

from uncom_perception.hands.detector import FloatArray, RawHand

DepthImage = npt.NDArray[np.float32]

_STEPS = 14  # samples along the finger
_SEEN = 0.75  # share of the finger, from its tip on, that is looked at: behind it are the knuckles
_HALF_WINDOW = 0.4  # of the finger's length, to either side
_THICK_M = 0.015  # deeper or nearer than the finger: something else
_MIN_WIDTH_M, _MAX_WIDTH_M = 0.006, 0.028
_MIN_SPAN = 0.3  # of the finger that must be seen
_SPREAD = 0.06  # of the finger's length: its middle lies on a line
_LEAST_RAD, _MOST_RAD = math.radians(6.0), math.radians(40.0)  # of corrections that are made


def on_its_finger(hand: RawHand, line: tuple[int, ...], depth: DepthImage, camera: PinholeCamera) -> RawHand:
    """Return a hand whose landmarks of a line, base to tip, lie on the finger in the depth image (H, W) [m].

    It is the same hand where they do so already, and where the depth does not show a finger.
    """
    base, tip = hand.landmarks[line[0], :2], hand.landmarks[line[-1], :2]
    back = base - tip
    length = float(np.linalg.norm(back))
    if length < 12.0:
        return hand
    aside = np.array([-back[1], back[0]]) / length
    shares = np.linspace(0.04, _SEEN, _STEPS)
    reach = max(3, round(_HALF_WINDOW * length))
    offsets = np.arange(-reach, reach + 1)
    places = tip + shares[:, None, None] * back + offsets[None, :, None] * aside
    z = _sampled(depth, places)
    found = _middles(z, offsets, camera.fx)
    if len(found) < 6 or shares[found[-1][0]] - shares[found[0][0]] < _MIN_SPAN:
        return hand
    s = np.array([shares[k] for k, _ in found])
    middle = np.array([m for _, m in found])
    slope, shift = np.polyfit(s, middle, 1)
    if float(np.abs(middle - slope * s - shift).max()) > _SPREAD * length:
        return hand
    if not _LEAST_RAD < abs(math.atan2(slope, length)) < _MOST_RAD:
        return hand
    new_tip, new_base = tip + shift * aside, base + (shift + slope) * aside
    marks = hand.landmarks.copy()
    marks[list(line), :2] = new_base + np.linspace(0.0, 1.0, len(line))[:, None] * (new_tip - new_base)
    return replace(hand, landmarks=marks)


def _sampled(depth: DepthImage, places: FloatArray) -> FloatArray:
    """Return the depth at places (..., 2) [px], NaN where it is unknown or outside."""
    u, v = np.round(places[..., 0]).astype(int), np.round(places[..., 1]).astype(int)
    inside = (u >= 0) & (v >= 0) & (u < depth.shape[1]) & (v < depth.shape[0])
    z = depth[v.clip(0, depth.shape[0] - 1), u.clip(0, depth.shape[1] - 1)].astype(float)
    return np.where(inside & (z > 0.0), z, np.nan)


def _middles(z: FloatArray, offsets: npt.NDArray[np.int64], focal_px: float) -> list[tuple[int, float]]:
    """Follow a finger from its tip by profiles of depth across it (steps, offsets); return steps and its middles [px].

    It ends where it is no longer as narrow as a finger.
    """
    found: list[tuple[int, float]] = []
    middle, nearest = 0.0, math.nan
    for k, profile in enumerate(z):
        near = np.abs(offsets - middle) <= 0.5 * offsets[-1]
        known = near & np.isfinite(profile)
        if np.count_nonzero(known) < 3:
            continue
        here = float(np.sort(profile[known])[1])  # the finger is nearer than what is behind it
        if found and abs(here - nearest) > 2.0 * _THICK_M:
            break
        own = np.flatnonzero(np.abs(profile - here) < _THICK_M)
        runs = np.split(own, np.flatnonzero(np.diff(own) > 2) + 1)
        run = min(runs, key=lambda r: float(np.abs(offsets[r] - middle).min()))
        width = (offsets[run[-1]] - offsets[run[0]] + 1) * here / focal_px
        if width > _MAX_WIDTH_M or run[0] == 0 or run[-1] == len(offsets) - 1:
            if found:
                break
            continue
        if width < _MIN_WIDTH_M:
            continue
        middle, nearest = 0.5 * float(offsets[run[0]] + offsets[run[-1]]), here
        found.append((k, middle))
    return found
