# SPDX-License-Identifier: Apache-2.0
"""Metric depth of plain video: DINOv2 with a DPT head trained on indoor depth (weights Apache-2.0)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from uncom_common.camera import PinholeCamera
from uncom_common.pretrained_models import load_with_processor, pick_device, require

from uncom_perception.depth.depth_estimator import DepthEstimator
from uncom_perception.depth.options import DEPTH_SCALE, DepthScaleOptions
from uncom_perception.exceptions import TableNotFoundError
from uncom_perception.image_arrays import check_rgb
from uncom_perception.objects.table.table_plane import find_table_plane

DEFAULT_MODEL = "facebook/dpt-dinov2-small-nyu"


class DptDepth(DepthEstimator):
    """Depth in metres, as far as the weights know metres; see table_scale for their check."""

    def __init__(self, model: Any, processor: Any, name: str = DEFAULT_MODEL, *, device: str = "cpu") -> None:
        """Estimate with a DPTForDepthEstimation and its image processor."""
        self._model = model.to(device).eval()
        self._processor = processor
        self._name = name
        self._device = device

    @property
    def name(self) -> str:
        """Weights."""
        return f"dpt {self._name}"

    def estimate(self, image_rgb: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
        """Return the depth (H, W) [m] of an image (H, W, 3) uint8; NaN where it is not positive.

        Raises:
            InvalidImageError: not an RGB image.
        """
        check_rgb(image_rgb)
        torch = require("torch")
        inputs = self._processor(images=image_rgb, return_tensors="pt").to(self._device)
        with torch.inference_mode():
            outputs = self._model(**inputs)
        found = self._processor.post_process_depth_estimation(outputs, target_sizes=[image_rgb.shape[:2]])
        depth = found[0]["predicted_depth"].float().cpu().numpy()
        return np.where(depth > 0.0, depth, np.float32(np.nan)).astype(np.float32)


def table_scale(
    depth: npt.NDArray[np.float32],
    camera: PinholeCamera,
    camera_above_table_m: float,
    *,
    options: DepthScaleOptions = DEPTH_SCALE,
) -> float | None:
    """Return the factor that makes an estimated depth (H, W) [m] agree with the camera's height above the table [m].

    None where no table is seen or the factor is absurd.
    """
    sparse = depth[:: options.stride, :: options.stride].astype(float)
    v, u = np.nonzero(np.isfinite(sparse))
    points = camera.deproject(np.column_stack([u, v]) * float(options.stride), sparse[v, u])
    try:
        plane = find_table_plane(points, np.array([0.0, -0.8, -0.6]), gravity_known=False)
    except TableNotFoundError:
        return None
    height = abs(plane.offset)  # of the camera, which is the origin, above the plane
    if height < options.least_height_m:
        return None
    factor = camera_above_table_m / height
    return factor if options.least_scale < factor < options.greatest_scale else None


def load_dpt(model_id: str = "", device: str = "auto") -> DptDepth:
    """Load DINOv2 with a DPT head by name or folder.

    Raises:
        NotInstalledError, ModelNotFoundError: torch, transformers or the weights are missing.
        InvalidConfigError: a GPU is asked for and there is none.
    """
    name = model_id or DEFAULT_MODEL
    model, processor = load_with_processor("AutoModelForDepthEstimation", "AutoImageProcessor", name)
    return DptDepth(model, processor, name, device=pick_device(device))
