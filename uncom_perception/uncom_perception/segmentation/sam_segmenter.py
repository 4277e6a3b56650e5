# SPDX-License-Identifier: Apache-2.0
"""SAM (Segment Anything; weights Apache-2.0), prompted by centre points as in the paper, or by boxes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from uncom_common.pretrained_models import load_with_processor, pick_device, require

from uncom_perception.exceptions import InvalidImageError
from uncom_perception.segmentation.segmenter import DepthImage, FloatArray, RgbImage, Segmenter
from uncom_perception.types import Box, Mask

DEFAULT_MODEL = "facebook/sam-vit-base"


class SamSegmenter(Segmenter):
    """The best of SAM's three masks for each prompt, by the IoU that it predicts, with its holes closed."""

    def __init__(
        self,
        model: Any,
        processor: Any,
        name: str = DEFAULT_MODEL,
        *,
        boxes_as_points: bool = True,
        device: str = "cpu",
    ) -> None:
        """Segment with a SamModel and its SamProcessor.

        Args:
            model: the model, on any device.
            processor: its processor.
            name: of the weights, as told in every result.
            boxes_as_points: prompt by the centre of a box, as the paper does, not by the box.
            device: where the model runs.
        """
        self._model = model.to(device).eval()
        self._processor = processor
        self._name = name
        self._boxes_as_points = boxes_as_points
        self._device = device

    @property
    def name(self) -> str:
        """Weights and kind of prompt."""
        return f"sam {self._name} ({'centre points' if self._boxes_as_points else 'boxes'})"

    def segment(
        self, image_rgb: RgbImage, depth: DepthImage | None, points: FloatArray, boxes: Sequence[Box]
    ) -> tuple[list[Mask], list[float]]:
        """Return masks and predicted IoUs; depth is not used."""
        del depth
        places = [(float(u), float(v)) for u, v in np.asarray(points, dtype=float).reshape(-1, 2)]
        if self._boxes_as_points:
            return self._prompted(image_rgb, [*places, *(box.center for box in boxes)], ())
        masks, scores = self._prompted(image_rgb, places, ())
        more, theirs = self._prompted(image_rgb, (), boxes)
        return [*masks, *more], [*scores, *theirs]

    def _prompted(
        self, image_rgb: RgbImage, points: Sequence[tuple[float, float]], boxes: Sequence[Box]
    ) -> tuple[list[Mask], list[float]]:
        if not points and not boxes:
            return [], []
        height, width = image_rgb.shape[:2]
        for u, v in (*points, *(box.center for box in boxes)):
            if not (0 <= u < width and 0 <= v < height):
                raise InvalidImageError(f"the point ({u:.0f}, {v:.0f}) is outside the image {width}x{height} px")
        prompts: dict[str, Any] = {}
        if points:
            prompts["input_points"] = [[[list(point)] for point in points]]
        if boxes:
            prompts["input_boxes"] = [[[b.x_min, b.y_min, b.x_max, b.y_max] for b in boxes]]
        torch = require("torch")
        inputs = self._processor(images=image_rgb, return_tensors="pt", **prompts)
        with torch.inference_mode():
            outputs = self._model(**{k: _placed(v, self._device) for k, v in inputs.items()}, multimask_output=True)
        masks = self._processor.image_processor.post_process_masks(
            outputs.pred_masks.cpu(), inputs["original_sizes"], inputs["reshaped_input_sizes"]
        )[0]
        scores = outputs.iou_scores[0].cpu().numpy()
        best = scores.argmax(axis=1)
        chosen = [_closed(masks[i, k].numpy().astype(bool)) for i, k in enumerate(best.tolist())]
        return chosen, [float(np.clip(scores[i, k], 0.0, 1.0)) for i, k in enumerate(best.tolist())]


def _placed(value: Any, device: str) -> Any:
    """Move a tensor; MPS and CUDA models take no 64-bit floats."""
    if not hasattr(value, "to"):
        return value
    return value.float().to(device) if value.is_floating_point() else value.to(device)


def _closed(mask: Mask) -> Mask:
    """Fill the holes of a mask."""
    part = mask.astype(np.uint8)
    contours, _ = cv2.findContours(part, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(part, contours, -1, 1, cv2.FILLED)
    return np.asarray(part.astype(bool))


def load_sam(model_id: str = "", device: str = "auto", *, boxes_as_points: bool = True) -> SamSegmenter:
    """Load SAM by name or folder.

    Raises:
        NotInstalledError, ModelNotFoundError: torch, transformers or the weights are missing.
        InvalidConfigError: a GPU is asked for and there is none.
    """
    name = model_id or DEFAULT_MODEL
    model, processor = load_with_processor("SamModel", "SamProcessor", name)
    return SamSegmenter(model, processor, name, boxes_as_points=boxes_as_points, device=pick_device(device))
