# SPDX-License-Identifier: Apache-2.0
"""Choice of detector, segmentation and depth back ends by name."""

from __future__ import annotations

from uncom_perception.exceptions import UnknownBackendError
from uncom_perception.objects.detector import ObjectDetector
from uncom_perception.objects.lexicon import load_lexicon
from uncom_perception.objects.tabletop import TabletopDetector

DETECTORS = ("tabletop",)


def make_detector(backend: str, lexicon: str = "") -> ObjectDetector:
    """Make a detector.

    Raises:
        UnknownBackendError: there is none of that name.
        InvalidLexiconError: the lexicon file cannot be read.
    """
    if backend not in DETECTORS:
        raise UnknownBackendError("detection", backend, DETECTORS)
    return TabletopDetector(load_lexicon(lexicon or None))
