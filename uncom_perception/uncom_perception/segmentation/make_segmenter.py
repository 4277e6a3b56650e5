# SPDX-License-Identifier: Apache-2.0
"""Choice of the segmentation back end by name."""

from __future__ import annotations

from uncom_perception.config import DetectionConfig
from uncom_perception.exceptions import UnknownBackendError
from uncom_perception.segmentation.cluster_segmenter import ClusterSegmenter
from uncom_perception.segmentation.segmenter import Segmenter

SEGMENTERS = ("cluster", "sam")


def make_segmenter(name: str, model: str = "", device: str = "auto", *, boxes_as_points: bool = True) -> Segmenter:
    """Make a segmentation back end.

    Raises:
        UnknownBackendError: there is none of that name.
        NotInstalledError, ModelNotFoundError: its libraries or weights are missing.
    """
    if name not in SEGMENTERS:
        raise UnknownBackendError("segmentation", name, SEGMENTERS)
    if name == "sam":
        from uncom_perception.segmentation.sam_segmenter import load_sam  # noqa: PLC0415  (only where it is asked for)

        return load_sam(model, device, boxes_as_points=boxes_as_points)
    return ClusterSegmenter()


def segmenter_from_config(config: DetectionConfig) -> Segmenter:
    """Make the segmentation back end that a configuration asks for; see make_segmenter."""
    return make_segmenter(
        config.segmentation, config.segmentation_model, config.device, boxes_as_points=not config.sam_boxes
    )
