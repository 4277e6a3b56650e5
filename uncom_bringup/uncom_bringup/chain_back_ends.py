# SPDX-License-Identifier: Apache-2.0
"""The back ends of the chained cores, made from the same parameters as the nodes make theirs."""

from __future__ import annotations

from uncom_language.config import LanguageConfig, SpeechConfig
from uncom_language.parser.understanding import Understanding
from uncom_language.speech.factory import make_recognizer
from uncom_language.speech.recognizer import Recognizer
from uncom_perception.config import DetectionConfig
from uncom_perception.objects.backends import make_detector
from uncom_perception.objects.detector import ObjectDetector
from uncom_perception.segmentation.backends import make_segmenter


def recognizer_of(config: SpeechConfig) -> Recognizer:
    """Make the recogniser as speech_node does."""
    words = tuple(filter(None, config.scene_words))
    return make_recognizer(config.backend, config.language, words, config.model)


def understanding_of(config: LanguageConfig) -> Understanding:
    """Make the language back end as language_node does."""
    return Understanding(config.backend, config.language, config.max_alternative_loss, model=config.model)


def detector_of(config: DetectionConfig) -> ObjectDetector:
    """Make the detector as detection_node does."""
    segmenter = make_segmenter(
        config.segmentation, config.segmentation_model, config.device, boxes_as_points=not config.sam_boxes
    )
    return make_detector(
        config.backend,
        config.lexicon,
        model=config.detection_model,
        device=config.device,
        box_threshold=config.box_threshold,
        text_threshold=config.text_threshold,
        segmenter=segmenter,
    )
