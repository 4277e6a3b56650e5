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

from uncom_perception.hands.detection.detector import RawHand
from uncom_perception.hands.options import FINGER_DEPTH, FingerDepthOptions
from uncom_perception.image_arrays import FloatArray

DepthImage = npt.NDArray[np.float32]


def on_its_finger(
    hand: RawHand,
    line: tuple[int, ...],
    depth: DepthImage,
    camera: PinholeCamera,
    *,
    options: FingerDepthOptions = FINGER_DEPTH,
) -> RawHand:
    """Return a hand whose landmarks of a line, base to tip, lie on the finger in the depth image (H, W) [m].

    It is the same hand where they do so already, and where the depth does not show a finger.
    """
    base, tip = hand.landmarks[line[0], :2], hand.landmarks[line[-1], :2]
    back = base - tip
    length = float(np.linalg.norm(back))
    if length < options.least_length_px:
        return hand
    aside = np.array([-back[1], back[0]]) / length
    shares = np.linspace(0.04, options.seen_share, options.steps)
    reach = max(3, round(options.half_window * length))
    offsets = np.arange(-reach, reach + 1)
    places = tip + shares[:, None, None] * back + offsets[None, :, None] * aside
    z = _sampled(depth, places)
    found = _middles(z, offsets, camera.fx, options=options)
    if len(found) < options.least_samples or shares[found[-1][0]] - shares[found[0][0]] < options.least_span:
        return hand
    s = np.array([shares[k] for k, _ in found])
    middle = np.array([m for _, m in found])
    slope, shift = np.polyfit(s, middle, 1)
    if float(np.abs(middle - slope * s - shift).max()) > options.line_spread * length:
        return hand
    if not options.least_correction_rad < abs(math.atan2(slope, length)) < options.greatest_correction_rad:
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


def _middles(
    z: FloatArray, offsets: npt.NDArray[np.int64], focal_px: float, *, options: FingerDepthOptions = FINGER_DEPTH
) -> list[tuple[int, float]]:
    """Follow a finger from its tip by profiles of depth across it (steps, offsets); return steps and its middles [px].

    It ends where it is no longer as narrow as a finger.
    """
    found: list[tuple[int, float]] = []
    middle, nearest = 0.0, math.nan
    for k, profile in enumerate(z):
        near = np.abs(offsets - middle) <= 0.5 * offsets[-1]
        known = near & np.isfinite(profile)
        if np.count_nonzero(known) < options.least_known:
            continue
        here = float(np.sort(profile[known])[1])  # the finger is nearer than what is behind it
        if found and abs(here - nearest) > 2.0 * options.thickness_m:
            break
        own = np.flatnonzero(np.abs(profile - here) < options.thickness_m)
        runs = np.split(own, np.flatnonzero(np.diff(own) > options.longest_gap) + 1)
        run = min(runs, key=lambda r: float(np.abs(offsets[r] - middle).min()))
        width = (offsets[run[-1]] - offsets[run[0]] + 1) * here / focal_px
        if width > options.greatest_width_m or run[0] == 0 or run[-1] == len(offsets) - 1:
            if found:
                break
            continue
        if width < options.least_width_m:
            continue
        middle, nearest = 0.5 * float(offsets[run[0]] + offsets[run[-1]]), here
        found.append((k, middle))
    return found
