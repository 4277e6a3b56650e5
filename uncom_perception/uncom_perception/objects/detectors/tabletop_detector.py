# SPDX-License-Identifier: Apache-2.0
"""The default detector: what stands on the table plane, named by what can be measured on it (RGB-D)."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.exceptions import TableNotFoundError
from uncom_perception.exposure import exposure
from uncom_perception.image_arrays import RgbImage
from uncom_perception.objects.attributes.colour import name_colours
from uncom_perception.objects.attributes.lexicon import Lexicon, load_lexicon
from uncom_perception.objects.attributes.object_geometry import clean_points, convex_outline, geometry, support_heights
from uncom_perception.objects.attributes.phrase_matcher import DescribedObject, PhraseMatcher
from uncom_perception.objects.attributes.scene_builder import answer
from uncom_perception.objects.attributes.shape import measure
from uncom_perception.objects.detectors.detector import ObjectDetector
from uncom_perception.objects.detectors.options import TABLETOP_DETECTOR, TabletopDetectorOptions
from uncom_perception.objects.detectors.picture_detector import PictureDetector
from uncom_perception.objects.segments.object_masks import find_objects, hidden_share
from uncom_perception.objects.table.table_view import TableView, view_table
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import Geometry, HandsFrame, Mask, Scene, TableSurface


class TabletopDetector(ObjectDetector):
    """Plane, outline, objects on it, their attributes, the phrases that fit them; without depth, the picture alone."""

    def __init__(self, lexicon: Lexicon | None = None, *, options: TabletopDetectorOptions = TABLETOP_DETECTOR) -> None:
        """Name objects by a lexicon (the package's own if None)."""
        self._options = options
        self._matcher = PhraseMatcher(lexicon if lexicon is not None else load_lexicon())
        self._picture = PictureDetector(self._matcher)

    @property
    def name(self) -> str:
        """Name of the back end; it needs no weights."""
        return "tabletop (rgb-d, no weights)"

    def detect(self, frame: RgbdFrame, phrases: Sequence[str], hands: HandsFrame | None = None) -> Scene:
        """Return the scene; one without table and objects if no table is seen."""
        if frame.depth is None or frame.camera is None:
            return self._picture.detect(frame, phrases, hands)
        start = time.perf_counter()
        try:
            table, found = self._look(frame.rgb, view_table(frame.depth, frame.camera, frame.camera_in_base), hands)
        except TableNotFoundError:
            table, found = None, []
        objects = [candidate for _, _, candidate in found]
        scene = answer(
            self._matcher,
            [(mask, body) for mask, body, _ in found],
            objects,
            table,
            phrases,
            frame=frame,
            backend=self.name if table is not None else f"{self.name}: no table seen",
        )
        return dataclasses.replace(scene, latency_s=time.perf_counter() - start)

    def _look(
        self,
        image_rgb: RgbImage,
        view: TableView,
        hands: HandsFrame | None,
    ) -> tuple[TableSurface, list[tuple[Mask, Geometry, DescribedObject]]]:
        points, ground, viewer = view.points, view.ground, view.viewer
        gain = exposure(image_rgb)
        masks = find_objects(image_rgb, view, hands, gain)
        clouds = [clean_points(points[box], mask[box]) for mask, box in masks]
        seen = [
            (*mask, cloud)
            for mask, cloud in zip(masks, clouds, strict=True)
            if len(cloud) >= self._options.least_points
        ]
        hulls = [convex_outline(cloud) for *_, cloud in seen]
        bases = support_heights([cloud for *_, cloud in seen], hulls)
        found = []
        blurred = min(self._options.max_blur, max(0.0, (ground.plane.sigma_m - 0.001) / 0.002))
        for (mask, box, cloud), hull, base in zip(seen, hulls, bases, strict=True):
            shape = measure(cloud - np.array([0.0, 0.0, base], np.float32), viewer - np.array([0.0, 0.0, base]), hull)
            size = math.sqrt(shape.length * max(shape.width, shape.height))
            colours = name_colours(_surface_pixels(image_rgb[box], mask[box], options=self._options), gain)
            # What lies in an object is partly hidden by it, and may lean.
            hidden = max(
                hidden_share(mask, box, view.depth), self._options.hidden_on_other if base > 0.0 else 0.0, blurred
            )
            candidate = self._matcher.describe(
                shape, colours, size, hidden, _certainty(mask[box], options=self._options)
            )
            found.append((mask, geometry(cloud, ground, base, hull), candidate))
        return view.surface, found


def _certainty(mask: Mask, *, options: TabletopDetectorOptions = TABLETOP_DETECTOR) -> float:
    """Return how sure it is that a mask is an object: scraps of a few pixels often are the sensor's."""
    return float(np.clip(np.count_nonzero(mask) / options.sure_pixels, 0.3, 1.0))


def _surface_pixels(
    image_rgb: RgbImage, mask: Mask, *, options: TabletopDetectorOptions = TABLETOP_DETECTOR
) -> npt.NDArray[np.uint8]:
    """Return an object's pixels (N, 3) without its border, where the background shines through."""
    inner = np.flatnonzero(cv2.erode(np.ascontiguousarray(mask).view(np.uint8), np.ones((3, 3), np.uint8)))
    pixels = inner if len(inner) > options.least_inner_pixels else np.flatnonzero(mask)
    return np.asarray(image_rgb.reshape(-1, 3)[pixels[:: 1 + len(pixels) // options.max_colour_pixels]])
