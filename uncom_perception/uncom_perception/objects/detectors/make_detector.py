# SPDX-License-Identifier: Apache-2.0
"""Choice of the detector by name."""

from __future__ import annotations

from uncom_perception.config import DetectionConfig
from uncom_perception.exceptions import UnknownBackendError
from uncom_perception.objects.attributes.lexicon import load_lexicon
from uncom_perception.objects.detectors.detector import ObjectDetector
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.segmentation.cluster_segmenter import ClusterSegmenter
from uncom_perception.segmentation.segmenter import Segmenter

DETECTORS = ("tabletop", "grounding_dino")


def make_detector(
    backend: str,
    lexicon: str = "",
    *,
    model: str = "",
    device: str = "auto",
    box_threshold: float = 0.3,
    text_threshold: float = 0.25,
    batch: int = 4,
    segmenter: Segmenter | None = None,
) -> ObjectDetector:
    """Make a detector; all but the lexicon is for those with weights.

    Raises:
        UnknownBackendError: there is none of that name.
        InvalidLexiconError: the lexicon file cannot be read.
        NotInstalledError, ModelNotFoundError: its libraries or weights are missing.
    """
    if backend not in DETECTORS:
        raise UnknownBackendError("detection", backend, DETECTORS)
    if backend == "grounding_dino":
        from uncom_perception.objects.detectors.grounding_dino_detector import GroundingOptions, load_grounding_dino  # noqa: PLC0415  (only where it is asked for)

        options = GroundingOptions(box_threshold, text_threshold, batch=batch)
        return load_grounding_dino(segmenter if segmenter is not None else ClusterSegmenter(), model, device, options)
    return TabletopDetector(load_lexicon(lexicon or None))


def detector_from_config(config: DetectionConfig, segmenter: Segmenter) -> ObjectDetector:
    """Make the detector that a configuration asks for; see make_detector."""
    return make_detector(
        config.backend,
        config.lexicon,
        model=config.detection_model,
        device=config.device,
        box_threshold=config.box_threshold,
        text_threshold=config.text_threshold,
        batch=config.detection_batch,
        segmenter=segmenter,
    )
