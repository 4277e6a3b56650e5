# SPDX-License-Identifier: Apache-2.0
"""The depth back ends by name."""

from __future__ import annotations

from uncom_perception.depth.depth_estimator import DepthEstimator, NoDepth
from uncom_perception.exceptions import UnknownBackendError

ESTIMATORS = ("none", "dpt")


def make_depth_estimator(name: str, model: str = "", device: str = "auto") -> DepthEstimator:
    """Make a depth back end.

    Raises:
        UnknownBackendError: there is none of that name.
        NotInstalledError, ModelNotFoundError: its libraries or weights are missing.
    """
    if name not in ESTIMATORS:
        raise UnknownBackendError("depth", name, ESTIMATORS)
    if name == "dpt":
        from uncom_perception.depth.dpt_depth_estimator import load_dpt  # noqa: PLC0415  (only where it is asked for)

        return load_dpt(model, device)
    return NoDepth()
