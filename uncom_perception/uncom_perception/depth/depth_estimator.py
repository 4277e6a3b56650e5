# SPDX-License-Identifier: Apache-2.0
"""Metric depth of plain images: what a back end offers, and the choice by name."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

from uncom_perception.exceptions import BackendUnavailableError


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
