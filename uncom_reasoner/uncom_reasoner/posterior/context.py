# SPDX-License-Identifier: Apache-2.0
"""What every step of one decision needs, worked out once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from shapely.geometry import Polygon
from uncom_language.types import Reference
from uncom_perception.types import Detection

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.detector_phrases import detector_phrase, resolve_antecedent
from uncom_reasoner.exceptions import InvalidGroundingError
from uncom_reasoner.gesture_types import Dwell
from uncom_reasoner.pointing.ray_fusion import segment_dwells
from uncom_reasoner.posterior.discourse_memory import DiscourseMemory
from uncom_reasoner.support.support_plane import Surface, build_surface, compute_footprint
from uncom_reasoner.types import Evidence
from uncom_reasoner.weights import Weights


@dataclass(frozen=True)
class Context:
    """Evidence with what follows from it directly: the support, outlines on it, and the dwells of the hands."""

    evidence: Evidence
    weights: Weights
    placing: PlacingConfig
    memory: DiscourseMemory
    surface: Surface
    footprints: Mapping[str, Polygon]
    dwells: tuple[Dwell, ...]

    @property
    def detections(self) -> tuple[Detection, ...]:
        """The objects that were seen."""
        return self.evidence.scene.detections

    def detection(self, detection_id: str) -> Detection:
        """Return the object with an id."""
        return next(d for d in self.detections if d.id == detection_id)

    def scores(self, phrase: str) -> tuple[tuple[float, ...], float]:
        """Return how well a phrase fits each object (probabilities), and that it fits none of them.

        Raises:
            InvalidGroundingError: the scene was not asked for the phrase.
        """
        try:
            index = self.evidence.phrases.index(phrase)
        except ValueError as error:
            raise InvalidGroundingError(f"the scene has no scores for {phrase!r}; detect with phrases_for()") from error
        scene = self.evidence.scene
        none: float = scene.phrase_none[index] if index < len(scene.phrase_none) else 0.5
        fits = tuple(d.phrase_scores[index] if index < len(d.phrase_scores) else 0.0 for d in self.detections)
        return fits, none

    def phrase(self, reference: Reference) -> str:
        """Return the detector's phrase for a reference of the command."""
        return detector_phrase(reference, resolve_antecedent(self.evidence.command, self.memory.noun))


def build_context(evidence: Evidence, weights: Weights, placing: PlacingConfig, memory: DiscourseMemory) -> Context:
    """Prepare a decision."""
    surface = build_surface(evidence.scene, evidence.view, placing)
    return Context(
        evidence=evidence,
        weights=weights,
        placing=placing,
        memory=memory,
        surface=surface,
        footprints={d.id: compute_footprint(d, surface) for d in evidence.scene.detections}
        | dict(evidence.given.moved),
        dwells=segment_dwells(evidence.rays, weights),
    )
