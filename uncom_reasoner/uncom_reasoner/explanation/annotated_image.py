# SPDX-License-Identifier: Apache-2.0
"""The annotated picture of a decision, as in the paper's figure.

Object frame and target frame side by side; candidates boxed, the chosen one orange with the contour of its mask, a
chosen area as its outline, the pointing ray green; caption "object - action - target".
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from uncom_common.transforms import FloatArray, apply, invert
from uncom_perception.types import Box, Detection

from uncom_reasoner.explanation.options import ANNOTATION, AnnotationOptions, Colour
from uncom_reasoner.gesture_types import PhraseRay
from uncom_reasoner.types import Candidate, Decision, Status, View

Picture = npt.NDArray[np.uint8]


def annotate(
    object_frame: Picture,
    target_frame: Picture,
    decision: Decision,
    view: View,
    options: AnnotationOptions = ANNOTATION,
) -> Picture:
    """Draw a decision on its two frames (H, W, 3) RGB; returns (H + caption, 2 W + gap, 3) RGB.

    Works with no gesture, no mask, no depth, no target, and for a command that failed.

    Args:
        object_frame: image of when the object was spoken of; it is not changed.
        target_frame: image of when the target was spoken of; it is not changed.
        decision: that is drawn.
        view: the camera that saw both.
        options: sizes and colours.
    """
    pen = _Pen(options)
    g = decision.grounded
    object_picture, target_picture = object_frame.copy(), target_frame.copy()
    pen.draw_candidates(object_picture, g.object_candidates)
    if g.object is not None:
        pen.draw_chosen(object_picture, g.object)
    pen.draw_ray(object_picture, decision.object_ray, g.object.box if g.object is not None else None)
    pen.draw_candidates(target_picture, g.target_candidates)
    if decision.reference is not None:
        pen.draw_candidates(target_picture, decision.reference.candidates)
        reference = next(c for c in decision.reference.candidates if c.chosen)
        if reference.box is not None:
            pen.draw_box(target_picture, reference.box, options.candidate_colour, 2)
    if g.target.detection is not None:
        pen.draw_chosen(target_picture, g.target.detection)
    area = _project_area(decision, view) if g.target.detection is None else np.zeros((0, 2))
    pen.draw_area(target_picture, area)
    pen.mark_place(target_picture, decision, view)
    end = g.target.detection.box if g.target.detection is not None else _bounding_box(area)
    pen.draw_ray(target_picture, decision.target_ray, end)
    height = object_picture.shape[0]
    if target_picture.shape[0] != height:
        size = (round(target_picture.shape[1] * height / target_picture.shape[0]), height)
        target_picture = np.asarray(cv2.resize(target_picture, size), dtype=np.uint8)
    gap = np.full((height, options.gap_px, 3), options.caption_background, dtype=np.uint8)
    body = np.hstack([object_picture, gap, target_picture])
    return np.ascontiguousarray(np.vstack([body, pen.write_caption(caption(decision), body.shape[1])]))


def caption(decision: Decision) -> str:
    """Return "object - action - target", with the reason behind it if the command failed."""
    g = decision.grounded
    text = " - ".join(part for part in (g.object_text, g.action_text, g.target_text) if part)
    return text if g.status is Status.GROUNDED else f"{text}: {g.reason}" if text else g.reason


def _project_area(decision: Decision, view: View) -> FloatArray:
    """Return the outline of the target's area in the image (N, 2) [px], empty if it cannot be told."""
    area = decision.grounded.target.area
    if len(area) == 0:
        return np.zeros((0, 2))
    if not decision.metric:
        return area[:, :2]
    if view.camera is None or view.transform_camera_to_scene is None:
        return np.zeros((0, 2))
    pixels = view.camera.project(apply(invert(view.transform_camera_to_scene), area))
    return pixels if np.isfinite(pixels).all() else np.zeros((0, 2))


def _bounding_box(pixels: FloatArray) -> Box | None:
    if len(pixels) == 0:
        return None
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    return Box(float(low[0]), float(low[1]), float(high[0]), float(high[1]))


class _Pen:
    """Draws into pictures (H, W, 3) RGB with the sizes and colours of its options."""

    def __init__(self, options: AnnotationOptions) -> None:
        self._options = options

    def draw_candidates(self, image: Picture, candidates: tuple[Candidate, ...]) -> None:
        colour = self._options.candidate_colour
        for candidate in candidates:
            if candidate.box is None or candidate.chosen or candidate.probability < self._options.min_probability:
                continue
            self.draw_box(image, candidate.box, colour, 1)
            self._write_label(image, f"{candidate.label} {candidate.probability:.2f}", candidate.box, colour)

    def draw_chosen(self, image: Picture, detection: Detection) -> None:
        colour, tint = self._options.chosen_colour, self._options.tint
        mask = detection.mask
        if mask.shape == image.shape[:2] and mask.any():
            contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
            tinted = image[mask].astype(float) * (1.0 - tint) + np.array(colour, dtype=float) * tint
            image[mask] = tinted.astype(np.uint8)
            cv2.drawContours(image, contours, -1, colour, 2, cv2.LINE_AA)
        self.draw_box(image, detection.box, colour, 2)
        self._write_label(image, detection.label, detection.box, colour)

    def draw_box(self, image: Picture, box: Box, colour: Colour, width: int) -> None:
        low, high = (round(box.x_min), round(box.y_min)), (round(box.x_max), round(box.y_max))
        cv2.rectangle(image, low, high, colour, width)

    def _write_label(self, image: Picture, text: str, box: Box, colour: Colour) -> None:
        corner = (round(box.x_min), max(12, round(box.y_min) - 4))
        for ink, width in (((0, 0, 0), 3), (colour, 1)):  # a dark rim keeps it readable on every ground
            cv2.putText(
                image, text, corner, cv2.FONT_HERSHEY_SIMPLEX, self._options.label_scale, ink, width, cv2.LINE_AA
            )

    def draw_area(self, image: Picture, pixels: FloatArray) -> None:
        """Draw an area by its outline (N, 2) [px]; an empty one is not drawn."""
        if len(pixels) == 0:
            return
        limit, colour, tint = self._options.limit_px, self._options.chosen_colour, self._options.tint
        outline = np.round(np.clip(pixels, -limit, limit)).astype(np.int32)
        layer = image.copy()
        cv2.fillPoly(layer, [outline], colour)
        image[:] = ((1.0 - tint) * image + tint * layer).astype(np.uint8)
        cv2.polylines(image, [outline], isClosed=True, color=colour, thickness=2, lineType=cv2.LINE_AA)

    def mark_place(self, image: Picture, decision: Decision, view: View) -> None:
        """Mark where on the support the middle of the moved object goes."""
        pose = decision.grounded.target.pose
        if pose is None or view.camera is None or view.transform_camera_to_scene is None:
            return
        pixel = view.camera.project(apply(invert(view.transform_camera_to_scene), pose[None, :3, 3]))[0]
        if np.isfinite(pixel).all():
            colour = self._options.chosen_colour
            cv2.drawMarker(image, self._pixel(pixel), colour, cv2.MARKER_TILTED_CROSS, 12, 2, cv2.LINE_AA)

    def draw_ray(self, image: Picture, ray: PhraseRay | None, end: Box | None) -> None:
        """Draw the main dwell of a gesture, up to what was chosen if anything was."""
        if ray is None or not ray.present:
            return
        colour = self._options.ray_colour
        dwell, _ = max(ray.dwells, key=lambda entry: entry[1])
        length = self._options.ray_fingers * dwell.finger_px
        if end is not None:
            length = max(float((np.array(end.center) - dwell.tip_px) @ dwell.direction_px), dwell.finger_px)
        base = self._pixel(dwell.tip_px - dwell.finger_px * dwell.direction_px)
        tip = self._pixel(dwell.tip_px + length * dwell.direction_px)
        cv2.arrowedLine(image, base, tip, colour, 2, cv2.LINE_AA, tipLength=0.05)
        cv2.circle(image, self._pixel(dwell.tip_px), 4, colour, -1, cv2.LINE_AA)

    def _pixel(self, point: FloatArray) -> tuple[int, int]:
        limit = self._options.limit_px
        u, v = (int(value) for value in np.round(np.clip(point, -limit, limit)))
        return u, v

    def write_caption(self, text: str, width: int) -> Picture:
        """Return a strip (caption height, width, 3) with a text in its middle, small enough to fit."""
        options = self._options
        strip: Picture = np.full((options.caption_height_px, width, 3), options.caption_background, dtype=np.uint8)
        plain = text.encode("ascii", "replace").decode("ascii")  # all that OpenCV's font has
        scale = options.caption_scale
        size = cv2.getTextSize(plain, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)[0]
        scale *= min(1.0, (width - options.caption_margin_px) / max(size[0], 1))
        size = cv2.getTextSize(plain, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)[0]
        corner = ((width - size[0]) // 2, (options.caption_height_px + size[1]) // 2)
        cv2.putText(strip, plain, corner, cv2.FONT_HERSHEY_SIMPLEX, scale, (255, 255, 255), 1, cv2.LINE_AA)
        return strip
