# SPDX-License-Identifier: Apache-2.0
"""GroundingDINO (weights Apache-2.0): boxes for any phrase (paper, sections III-F and III-G)."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from uncom_common.pretrained_models import load_with_processor, pick_device, require

from uncom_perception.exceptions import TableNotFoundError
from uncom_perception.exposure import exposure
from uncom_perception.image_arrays import RgbImage
from uncom_perception.objects.attributes.colour import name_colours
from uncom_perception.objects.attributes.object_geometry import clean_points, geometry
from uncom_perception.objects.attributes.scene_builder import colour_attributes, is_table, mask_box, mask_slices
from uncom_perception.objects.detectors.detector import ObjectDetector
from uncom_perception.objects.detectors.options import (
    GROUNDING_DINO_FILTER,
    GroundingDinoFilterOptions,
)
from uncom_perception.objects.detectors.queries import query_of
from uncom_perception.objects.table.table_view import TableView, view_table
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.segmentation.segmenter import Segmenter
from uncom_perception.types import Attribute, Box, Detection, Geometry, HandsFrame, Mask, Scene, TableSurface

DEFAULT_MODEL = "IDEA-Research/grounding-dino-tiny"
_TABLE_QUERY = "table."


@dataclass(frozen=True, slots=True)
class GroundingOptions:
    """Thresholds of the box and of the words it is found by, overlap above which two boxes are one, queries at once."""

    box_threshold: float = 0.3
    text_threshold: float = 0.25
    same_overlap: float = 0.7
    batch: int = 4


class GroundingDinoDetector(ObjectDetector):
    """One query a phrase; the boxes of all are merged, masked by a segmenter, and placed by depth if there is."""

    def __init__(
        self,
        model: Any,
        processor: Any,
        segmenter: Segmenter,
        name: str = DEFAULT_MODEL,
        options: GroundingOptions | None = None,
        device: str = "cpu",
        *,
        grounding_dino_filter_options: GroundingDinoFilterOptions = GROUNDING_DINO_FILTER,
    ) -> None:
        """Detect with a GroundingDinoForObjectDetection and its processor."""
        self._grounding_dino_filter_options = grounding_dino_filter_options
        self._model = model.to(device).eval()
        self._processor = processor
        self._segmenter = segmenter
        self._name = name
        self._options = options if options is not None else GroundingOptions()
        self._device = device

    @property
    def name(self) -> str:
        """Weights of the boxes and of the masks."""
        return f"grounding dino {self._name}, masks by {self._segmenter.name}"

    def boxes(
        self, images: Sequence[RgbImage], queries: Sequence[str]
    ) -> list[tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]]:
        """Return boxes (N, 4) [px] and scores (N,) for each pair of an image and a query, several pairs at once.

        Pairs may be of one frame with several queries, or of several frames (of object and target, say).
        """
        torch = require("torch")
        found = []
        for start in range(0, len(queries), self._options.batch):
            some, texts = list(images[start:][: self._options.batch]), list(queries[start:][: self._options.batch])
            inputs = self._processor(images=some, text=texts, return_tensors="pt", padding=True).to(self._device)
            with torch.inference_mode():
                outputs = self._model(**inputs)
            results = self._processor.post_process_grounded_object_detection(
                outputs,
                inputs["input_ids"],
                threshold=self._options.box_threshold,
                text_threshold=self._options.text_threshold,
                target_sizes=[image.shape[:2] for image in some],
            )
            found += [
                (r["boxes"].double().cpu().numpy().reshape(-1, 4), r["scores"].double().cpu().numpy()) for r in results
            ]
        return found

    def detect(self, frame: RgbdFrame, phrases: Sequence[str], hands: HandsFrame | None = None) -> Scene:
        """Return the objects that the phrases find ("object" if there are none), and the table."""
        start = time.perf_counter()
        image_rgb, depth, camera = frame.rgb, frame.depth, frame.camera
        queries = [_TABLE_QUERY] + [query_of(p) for p in phrases if not is_table(p)]
        if len(queries) == 1:
            queries.append(query_of("objects"))
        unique = list(dict.fromkeys(queries))  # "the mug" and "mug in the bowl" are one query
        answers = dict(zip(unique, self.boxes([image_rgb] * len(unique), unique), strict=True))
        (tables, table_scores), *per_query = (answers[query] for query in queries)
        view = None
        if depth is not None and camera is not None:
            try:
                view = view_table(depth, camera, frame.camera_in_base)
            except TableNotFoundError:
                view = None
        merged, scores = _merged(per_query, self._options.same_overlap, image_rgb.shape)
        table = view.surface if view is not None else _table_box(tables, table_scores)
        keep = [
            i
            for i, box in enumerate(merged)
            if not _is_hand(box, hands, options=self._grounding_dino_filter_options) and not _is_whole_table(box, table)
        ]
        masks, _ = self._segmenter.segment(image_rgb, depth, np.zeros((0, 2)), [merged[i] for i in keep])
        scene = self._answer(image_rgb, masks, scores[keep], phrases, view)
        return dataclasses.replace(
            scene,
            table=table,
            frame_id=frame.frame_id,
            stamp_s=frame.stamp_s,
            backend=self.name,
            latency_s=time.perf_counter() - start,
        )

    def _answer(
        self,
        image_rgb: RgbImage,
        masks: Sequence[Mask],
        scores: npt.NDArray[np.float64],
        phrases: Sequence[str],
        view: TableView | None,
    ) -> Scene:
        """Put detections together; scores (N, M) are of M queries, one for each phrase that is not the table."""
        asked = [i for i, phrase in enumerate(phrases) if not is_table(phrase)]
        share = np.zeros((len(masks), len(phrases)))
        none = np.ones(len(phrases))
        for column, i in enumerate(asked):
            fit = np.clip(scores[:, column], 0.0, 0.995)
            none[i] = float(np.prod(1.0 - fit))
            share[:, i] = fit / max(float(fit.sum()), 1e-9) * (1.0 - none[i])
        gain = exposure(image_rgb)
        detections = []
        for n, mask in enumerate(masks):
            best = int(scores[n].argmax())
            label = query_of(phrases[asked[best]] if asked else "objects").rstrip(".")
            detections.append(
                Detection(
                    id=f"thing_{n + 1}",
                    label=label,
                    score=float(scores[n, best]),
                    box=mask_box(mask),
                    mask=mask,
                    geometry=_geometry(mask, view),
                    attributes=_colours(image_rgb, mask, gain),
                    phrase_scores=tuple(float(s) for s in share[n]),
                )
            )
        return Scene(0.0, "", tuple(detections), None, tuple(float(p) for p in none), "")


def _merged(
    per_query: Sequence[tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]], same: float, shape: tuple[int, ...]
) -> tuple[list[Box], npt.NDArray[np.float64]]:
    """Merge boxes that lie on one another, of one query or of several; scores (N, queries), 0 where not found."""
    every = [
        (float(s), q, b) for q, (boxes, scores) in enumerate(per_query) for b, s in zip(boxes, scores, strict=True)
    ]
    kept: list[npt.NDArray[np.float64]] = []
    rows: list[npt.NDArray[np.float64]] = []
    limit = np.array([shape[1], shape[0], shape[1], shape[0]], dtype=float)
    for score, query, box in sorted(every, key=lambda item: -item[0]):
        cut = np.clip(box, 0.0, limit)
        if (
            cut[2] - cut[0] < GROUNDING_DINO_FILTER.least_side_px
            or cut[3] - cut[1] < GROUNDING_DINO_FILTER.least_side_px
        ):
            continue
        at = next((i for i, other in enumerate(kept) if _overlap(cut, other) > same), None)
        if at is None:
            kept.append(cut)
            rows.append(np.zeros(len(per_query)))
            at = len(kept) - 1
        rows[at][query] = max(rows[at][query], score)
    found = [Box(*(float(v) for v in box)) for box in kept]
    return found, np.array(rows).reshape(len(rows), len(per_query))


def _overlap(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> float:
    """Return intersection over union of two boxes (4,)."""
    low, high = np.maximum(a[:2], b[:2]), np.minimum(a[2:], b[2:])
    common = float(np.prod(np.maximum(high - low, 0.0)))
    return common / max(float(np.prod(a[2:] - a[:2]) + np.prod(b[2:] - b[:2])) - common, 1e-9)


def _is_hand(
    box: Box, hands: HandsFrame | None, *, options: GroundingDinoFilterOptions = GROUNDING_DINO_FILTER
) -> bool:
    """Whether a box is that of a hand in the image."""
    four = np.array([box.x_min, box.y_min, box.x_max, box.y_max])
    for hand in hands.hands if hands is not None else ():
        marks = hand.landmarks[:, :2]
        if _overlap(four, np.concatenate([marks.min(axis=0), marks.max(axis=0)])) > options.max_hand_share:
            return True
    return False


def _is_whole_table(box: Box, table: TableSurface | None) -> bool:
    if table is None or len(table.image_polygon) == 0:
        return False
    low, high = table.image_polygon.min(axis=0), table.image_polygon.max(axis=0)
    return (
        _overlap(np.array([box.x_min, box.y_min, box.x_max, box.y_max]), np.concatenate([low, high]))
        > GROUNDING_DINO_FILTER.table_overlap
    )


def _table_box(boxes: npt.NDArray[np.float64], scores: npt.NDArray[np.float64]) -> TableSurface | None:
    if len(scores) == 0:
        return None
    x0, y0, x1, y1 = boxes[int(scores.argmax())]
    return TableSurface(np.zeros((0, 3)), np.zeros(3), np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))


def _geometry(mask: Mask, view: TableView | None) -> Geometry | None:
    if view is None:
        return None
    box = mask_slices(mask)
    cloud = clean_points(view.points[box], mask[box])
    return geometry(cloud, view.ground) if len(cloud) >= GROUNDING_DINO_FILTER.least_points else None


def _colours(image_rgb: RgbImage, mask: Mask, gain: float) -> tuple[Attribute, ...]:
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    shares = name_colours(
        image_rgb[inner if np.count_nonzero(inner) > GROUNDING_DINO_FILTER.least_inner_pixels else mask], gain
    )
    return colour_attributes(shares)


def load_grounding_dino(
    segmenter: Segmenter, model_id: str = "", device: str = "auto", options: GroundingOptions | None = None
) -> GroundingDinoDetector:
    """Load GroundingDINO by name or folder.

    Raises:
        NotInstalledError, ModelNotFoundError: torch, transformers or the weights are missing.
        InvalidConfigError: a GPU is asked for and there is none.
    """
    name = model_id or DEFAULT_MODEL
    model, processor = load_with_processor("GroundingDinoForObjectDetection", "AutoProcessor", name)
    return GroundingDinoDetector(model, processor, segmenter, name, options, pick_device(device))
