# SPDX-License-Identifier: Apache-2.0
"""A simulated estimator of 6-DoF poses (paper: iChores, GDRNet++): true poses with errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation
from uncom_common.exceptions import InvalidConfigError
from uncom_common.transforms import FloatArray, invert
from uncom_perception.types import ObjectModel

from uncom_sim.objects.catalogue import model, natural_colour
from uncom_sim.types import ObjectState

Triangles = npt.NDArray[np.int64]


@dataclass(frozen=True)
class ExternalPosesConfig:
    """Errors of the estimator, how often it answers, and whether it has meshes of the objects."""

    sigma_m: float = field(default=0.006, metadata={"description": "standard deviation of positions [m]"})
    sigma_rad: float = field(default=0.05, metadata={"description": "standard deviation of orientations [rad]"})
    found: float = field(default=0.9, metadata={"description": "share of the things that are found in a message"})
    meshes: bool = field(default=True, metadata={"description": "give the mesh of each thing, too"})
    rate_hz: float = field(default=4.0, metadata={"description": "messages in a second of the simulation at most"})
    seed: int = field(default=0, metadata={"description": "of the errors"})

    def __post_init__(self) -> None:
        """Reject values that cannot work."""
        if not 0.0 <= self.found <= 1.0:
            raise InvalidConfigError("found", self.found, "must be between 0 and 1")
        if self.rate_hz <= 0.0:
            raise InvalidConfigError("rate_hz", self.rate_hz, "must be above 0")


class PoseEstimator:
    """Draws an estimator's errors; the same seed and calls give the same ones."""

    def __init__(self, config: ExternalPosesConfig | None = None) -> None:
        """Seed the errors; config None is the default configuration."""
        self._config = ExternalPosesConfig() if config is None else config
        self._rng = np.random.default_rng(self._config.seed)

    def estimate(self, truth: Sequence[ObjectState], base: FloatArray | None = None) -> tuple[ObjectModel, ...]:
        """Return label, score, pose and mesh of each object that is found.

        Args:
            truth: where the objects are.
            base: pose (4, 4) of the frame in which to answer; None answers in the frame of the truth.
        """
        config, rng = self._config, self._rng
        found = []
        for state in truth:
            if rng.random() >= config.found:
                continue
            score = float(rng.uniform(0.6, 0.99))
            pose = state.pose.copy()
            pose[:3, 3] += rng.normal(0.0, config.sigma_m, 3)
            turn = Rotation.from_rotvec(rng.normal(0.0, config.sigma_rad, 3))
            pose[:3, :3] = turn.as_matrix() @ pose[:3, :3]
            mesh = mesh_of(state.kind) if config.meshes else (np.zeros((0, 3)), np.zeros((0, 3), np.int64))
            found.append(ObjectModel(state.kind, score, pose if base is None else invert(base) @ pose, *mesh))
        return tuple(found)


@cache
def mesh_of(kind: str) -> tuple[FloatArray, Triangles]:
    """Return vertices (N, 3) [m] in the body frame and triangles (M, 3) of a kind; its colour does not change them."""
    vertices, triangles, first = [], [], 0
    for part in model(kind, natural_colour(kind)).parts:
        vertices.append(part.vertices)
        triangles.append(part.faces + first)
        first += len(part.vertices)
    return np.concatenate(vertices), np.concatenate(triangles)
