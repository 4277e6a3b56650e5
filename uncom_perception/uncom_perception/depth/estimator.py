# SPDX-License-Identifier: Apache-2.0
"""Metric depth of plain images: what a back end offers, and the choice by name."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

from uncom_perception.exceptions import BackendUnavailableError, UnknownBackendError

ESTIMATORS = ("none", "dpt")


class DepthEstimator(ABC):
    """Estimates metric depth from one image."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Back end and weights, as told in every result."""

    @abstractmethod
    def estimate(self, image_rgb: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
        """Return the depth (H, W) [m] of an image (H, W, 3) uint8.

        Raises:
            BackendUnavailableError: there is no back end.
        """


class NoDepth(DepthEstimator):
    """The default: says that there is none."""

    @property
    def name(self) -> str:
        """Name of the back end."""
        return "none"

    def estimate(self, image_rgb: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:  # noqa: ARG002
        """Refuse.

        Raises:
            BackendUnavailableError: always.
        """
        raise BackendUnavailableError(
            "no depth back end: use a depth camera, or depth_backend:=dpt after ./uncom setup --full"
        )


def make_depth_estimator(name: str, model: str = "", device: str = "auto") -> DepthEstimator:
    """Make a depth back end.

    Raises:
        UnknownBackendError: there is none of that name.
        NotInstalledError, ModelNotFoundError: its libraries or weights are missing.
    """
    if name not in ESTIMATORS:
        raise UnknownBackendError("depth", name, ESTIMATORS)
    if name == "dpt":
        from uncom_perception.depth.dpt import load_dpt  # noqa: PLC0415  (only where it is asked for)

        return load_dpt(model, device)
    return NoDepth()
