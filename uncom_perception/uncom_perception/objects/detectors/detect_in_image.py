# SPDX-License-Identifier: Apache-2.0
"""Detection in one picture, for the command line."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from uncom_perception.objects.attributes.lexicon import load_lexicon
from uncom_perception.objects.attributes.scene_builder import is_table, mask_box
from uncom_perception.objects.detectors.options import DETECTION_REPORT, DetectionReportOptions
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import Detection, Scene, TableSurface


@functools.cache
def _detector(lexicon: str = "") -> TabletopDetector:
    return TabletopDetector(load_lexicon(lexicon or None))


def detect_in_image(
    frame: RgbdFrame,
    phrase: str,
    lexicon: str = "",
    *,
    options: DetectionReportOptions = DETECTION_REPORT,
) -> Scene:
    """Find what a phrase means in one image; depth and camera make it metric.

    Detections that the phrase fits come best first; each score is how well the phrase fits that object by itself.
    "table" gives the table, "objects" everything on it. The lexicon is a file with more words for objects.

    Raises:
        InvalidLexiconError: the lexicon cannot be read.
    """
    scene = _detector(lexicon).detect(frame, [phrase])
    if is_table(phrase):
        found = [] if scene.table is None else [_table_detection(scene.table, frame.rgb.shape)]
        return dataclasses.replace(scene, detections=tuple(found))
    fits = own_fits([d.phrase_scores[0] for d in scene.detections], scene.phrase_none[0])
    pairs = zip(scene.detections, fits, strict=True)
    kept = sorted((pair for pair in pairs if pair[1] >= options.least_fit), key=lambda pair: -pair[1])
    return dataclasses.replace(scene, detections=tuple(dataclasses.replace(d, score=fit) for d, fit in kept))


def scene_to_json(scene: Scene) -> dict[str, Any]:
    """Return what `uncom detect --json` prints."""
    detections = []
    for d in scene.detections:
        body = d.geometry
        detections.append(
            {
                "label": d.label,
                "score": round(d.score, 4),
                "box": [round(v, 1) for v in (d.box.x_min, d.box.y_min, d.box.x_max, d.box.y_max)],
                "centroid_m": None if body is None else [round(float(v), 4) for v in body.centroid],
                "size_m": None if body is None else [round(float(v), 4) for v in body.size],
            }
        )
    table = None
    if scene.table is not None:
        outline = scene.table.polygon if len(scene.table.polygon) else scene.table.image_polygon
        table = [[round(float(v), 4) for v in corner] for corner in outline]
    return {"detections": detections, "table": table, "backend": scene.backend}


def own_fits(shares: Sequence[float], none: float) -> list[float]:
    """Return how well a phrase fits each object by itself, 0 to 1, from the probabilities that it means each or none.

    The fits are in the ratio of the shares, and none of them holds with the probability that each fails by itself.
    """
    top = max(shares, default=0.0)
    if top <= 0.0 or none >= 1.0:
        return [0.0 for _ in shares]
    ratios = [share / top for share in shares]
    low, high = 0.0, 1.0 - 1e-12
    goal = math.log(max(none, 1e-300))
    for _ in range(60):
        best = 0.5 * (low + high)
        if sum(math.log1p(-best * ratio) for ratio in ratios) > goal:
            low = best
        else:
            high = best
    return [0.5 * (low + high) * ratio for ratio in ratios]


def _table_detection(table: TableSurface, shape: tuple[int, ...]) -> Detection:
    mask = np.zeros(shape[:2], np.uint8)
    if len(table.image_polygon):
        cv2.fillPoly(mask, [np.round(table.image_polygon).astype(np.int32).reshape(-1, 1, 2)], 1)
    return Detection("table", "table", 1.0, mask_box(mask.astype(bool)), mask.astype(bool), None, (), (1.0,))
