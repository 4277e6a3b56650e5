# SPDX-License-Identifier: Apache-2.0
"""What every step of one decision needs, worked out once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from shapely.geometry import Polygon
from uncom_language.types import Reference
from uncom_perception.types import Detection

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.detector_phrases import antecedent_of, detector_phrase
from uncom_reasoner.exceptions import InvalidGroundingError
from uncom_reasoner.pointing.ray_fusion import dwells_of
from uncom_reasoner.posterior.discourse_memory import Memory
from uncom_reasoner.support.support_plane import Surface, footprint, surface_of
from uncom_reasoner.types import Dwell, Evidence
from uncom_reasoner.weights import Weights


@dataclass(frozen=True)
class Context:
    """Evidence with what follows from it directly: the support, outlines on it, and the dwells of the hands."""

    evidence: Evidence
    weights: Weights
    placing: PlacingConfig
    memory: Memory
    surface: Surface
    footprints: Mapping[str, Polygon]
    dwells: tuple[Dwell, ...]

    @property
    def things(self) -> tuple[Detection, ...]:
        """What was seen."""
        return self.evidence.scene.detections

    def thing(self, thing_id: str) -> Detection:
        """Return the thing with an id."""
        return next(d for d in self.things if d.id == thing_id)

    def scores(self, phrase: str) -> tuple[tuple[float, ...], float]:
        """Return how well a phrase fits each thing, and none of them.

        Raises:
            InvalidGroundingError: the scene was not asked for the phrase.
        """
        try:
            index = self.evidence.phrases.index(phrase)
        except ValueError as error:
            raise InvalidGroundingError(f"the scene has no scores for {phrase!r}; detect with phrases_of()") from error
        scene = self.evidence.scene
        none: float = scene.phrase_none[index] if index < len(scene.phrase_none) else 0.5
        fits = tuple(d.phrase_scores[index] if index < len(d.phrase_scores) else 0.0 for d in self.things)
        return fits, none

    def phrase(self, reference: Reference) -> str:
        """Return the detector's phrase for a reference of the command."""
        return detector_phrase(reference, antecedent_of(self.evidence.command, self.memory.noun))


def context_of(evidence: Evidence, weights: Weights, placing: PlacingConfig, memory: Memory) -> Context:
    """Prepare a decision."""
    surface = surface_of(evidence.scene, evidence.view, placing)
    return Context(
        evidence=evidence,
        weights=weights,
        placing=placing,
        memory=memory,
        surface=surface,
        footprints={d.id: footprint(d, surface) for d in evidence.scene.detections} | dict(evidence.given.moved),
        dwells=dwells_of(evidence.rays, weights),
    )
