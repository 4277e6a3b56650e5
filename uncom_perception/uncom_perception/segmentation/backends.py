# SPDX-License-Identifier: Apache-2.0
"""Choice of the segmentation back end by name."""

from __future__ import annotations

from uncom_perception.exceptions import UnknownBackendError
from uncom_perception.segmentation.cluster import ClusterSegmenter
from uncom_perception.segmentation.segmenter import Segmenter

SEGMENTERS: dict[str, type[Segmenter]] = {"cluster": ClusterSegmenter}


def make_segmenter(name: str) -> Segmenter:
    """Make a segmentation back end.

    Raises:
        UnknownBackendError: there is none of that name.
    """
    if name not in SEGMENTERS:
        raise UnknownBackendError("segmentation", name, SEGMENTERS)
    return SEGMENTERS[name]()
