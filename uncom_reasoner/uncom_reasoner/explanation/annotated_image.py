# SPDX-License-Identifier: Apache-2.0
"""The annotated picture of a decision, as in the paper's figure.

Object frame and target frame side by side; candidates boxed, the chosen one orange with the contour of its mask, a
chosen area as its outline, the pointing ray green; caption "object - action - target".
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from uncom_common.transforms import apply, invert
from uncom_perception.types import Box, Detection

from uncom_reasoner.types import Candidate, Decision, FloatArray, PhraseRay, Status, View

Picture = npt.NDArray[np.uint8]

ORANGE = (255, 140, 0)
GREEN = (40, 220, 60)
GREY = (225, 225, 225)
CAPTION_BACKGROUND = 24
CAPTION_HEIGHT = 36
GAP = 4
LEAST_SHOWN = 0.02  # a candidate less likely than this is not boxed
RAY_FINGERS = 8.0  # how far the ray is drawn if it meets nothing chosen


def annotate(object_frame: Picture, target_frame: Picture, decision: Decision, view: View) -> Picture:
    """Draw a decision on its two frames (H, W, 3) RGB; returns (H + caption, 2 W + gap, 3) RGB.

    Works with no gesture, no mask, no depth, no target, and for a command that failed.
    """
    g = decision.grounded
    left, right = object_frame.copy(), target_frame.copy()
    _boxes(left, g.object_candidates)
    if g.object is not None:
        _thing(left, g.object)
    _ray(left, decision.object_ray, g.object.box if g.object is not None else None)
    _boxes(right, g.target_candidates)
    if decision.reference is not None:
        _boxes(right, decision.reference.candidates)
        reference = next(c for c in decision.reference.candidates if c.chosen)
        if reference.box is not None:
            _box(right, reference.box, GREY, 2)
    if g.target.detection is not None:
        _thing(right, g.target.detection)
    area = _area_pixels(decision, view) if g.target.detection is None else np.zeros((0, 2))
    _area(right, area)
    _spot(right, decision, view)
    end = g.target.detection.box if g.target.detection is not None else _bounds(area)
    _ray(right, decision.target_ray, end)
    if right.shape[0] != left.shape[0]:
        size = (round(right.shape[1] * left.shape[0] / right.shape[0]), left.shape[0])
        right = np.asarray(cv2.resize(right, size), dtype=np.uint8)
    gap = np.full((left.shape[0], GAP, 3), CAPTION_BACKGROUND, dtype=np.uint8)
    body = np.hstack([left, gap, right])
    return np.ascontiguousarray(np.vstack([body, _caption(caption(decision), body.shape[1])]))


def caption(decision: Decision) -> str:
    """Return "object - action - target", with the reason behind it if the command failed."""
    g = decision.grounded
    text = " - ".join(part for part in (g.object_text, g.action_text, g.target_text) if part)
    return text if g.status is Status.GROUNDED else f"{text}: {g.reason}" if text else g.reason


def _boxes(image: Picture, candidates: tuple[Candidate, ...]) -> None:
    for candidate in candidates:
        if candidate.box is None or candidate.chosen or candidate.probability < LEAST_SHOWN:
            continue
        _box(image, candidate.box, GREY, 1)
        _label(image, f"{candidate.label} {candidate.probability:.2f}", candidate.box, GREY)


def _thing(image: Picture, thing: Detection) -> None:
    if thing.mask.shape == image.shape[:2] and thing.mask.any():
        contours, _ = cv2.findContours(thing.mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        tint = image[thing.mask].astype(float) * 0.65 + np.array(ORANGE, dtype=float) * 0.35
        image[thing.mask] = tint.astype(np.uint8)
        cv2.drawContours(image, contours, -1, ORANGE, 2, cv2.LINE_AA)
    _box(image, thing.box, ORANGE, 2)
    _label(image, thing.label, thing.box, ORANGE)


def _box(image: Picture, box: Box, colour: tuple[int, int, int], width: int) -> None:
    cv2.rectangle(image, (round(box.x_min), round(box.y_min)), (round(box.x_max), round(box.y_max)), colour, width)


def _label(image: Picture, text: str, box: Box, colour: tuple[int, int, int]) -> None:
    place = (round(box.x_min), max(12, round(box.y_min) - 4))
    cv2.putText(image, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.putText(image, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, 1, cv2.LINE_AA)


def _area_pixels(decision: Decision, view: View) -> FloatArray:
    area = decision.grounded.target.area
    if len(area) == 0:
        return np.zeros((0, 2))
    if not decision.metric:
        return area[:, :2]
    if view.camera is None or view.transform_camera_to_scene is None:
        return np.zeros((0, 2))
    pixels = view.camera.project(apply(invert(view.transform_camera_to_scene), area))
    return pixels if np.isfinite(pixels).all() else np.zeros((0, 2))


def _area(image: Picture, pixels: FloatArray) -> None:
    if len(pixels) < 3:
        return
    outline = np.round(np.clip(pixels, -4096, 4096)).astype(np.int32)
    layer = image.copy()
    cv2.fillPoly(layer, [outline], ORANGE)
    image[:] = (0.65 * image + 0.35 * layer).astype(np.uint8)
    cv2.polylines(image, [outline], isClosed=True, color=ORANGE, thickness=2, lineType=cv2.LINE_AA)


def _spot(image: Picture, decision: Decision, view: View) -> None:
    """Mark where on the support the middle of the moved thing goes."""
    pose = decision.grounded.target.pose
    if pose is None or view.camera is None or view.transform_camera_to_scene is None:
        return
    pixel = view.camera.project(apply(invert(view.transform_camera_to_scene), pose[None, :3, 3]))[0]
    if np.isfinite(pixel).all():
        place = tuple(int(v) for v in np.round(np.clip(pixel, -4096, 4096)))
        cv2.drawMarker(image, place, ORANGE, cv2.MARKER_TILTED_CROSS, 12, 2, cv2.LINE_AA)


def _bounds(pixels: FloatArray) -> Box | None:
    if len(pixels) == 0:
        return None
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    return Box(float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def _ray(image: Picture, ray: PhraseRay | None, end: Box | None) -> None:
    if ray is None or not ray.present:
        return
    dwell, _ = max(ray.dwells, key=lambda entry: entry[1])
    length = RAY_FINGERS * dwell.finger_px
    if end is not None:
        length = max(float((np.array(end.center) - dwell.tip_px) @ dwell.direction_px), dwell.finger_px)
    base = dwell.tip_px - dwell.finger_px * dwell.direction_px
    tip = dwell.tip_px + length * dwell.direction_px
    points = [tuple(int(v) for v in np.round(np.clip(p, -4096, 4096))) for p in (base, tip)]
    cv2.arrowedLine(image, points[0], points[1], GREEN, 2, cv2.LINE_AA, tipLength=0.05)
    cv2.circle(image, tuple(int(v) for v in np.round(dwell.tip_px)), 4, GREEN, -1, cv2.LINE_AA)


def _caption(text: str, width: int) -> Picture:
    strip: Picture = np.full((CAPTION_HEIGHT, width, 3), CAPTION_BACKGROUND, dtype=np.uint8)
    plain = text.encode("ascii", "replace").decode("ascii")  # all that OpenCV's font has
    scale = 0.65
    size = cv2.getTextSize(plain, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)[0]
    scale *= min(1.0, (width - 16) / max(size[0], 1))
    size = cv2.getTextSize(plain, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)[0]
    place = ((width - size[0]) // 2, (CAPTION_HEIGHT + size[1]) // 2)
    cv2.putText(strip, plain, place, cv2.FONT_HERSHEY_SIMPLEX, scale, (255, 255, 255), 1, cv2.LINE_AA)
    return strip
