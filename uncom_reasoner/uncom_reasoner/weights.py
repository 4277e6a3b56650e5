# SPDX-License-Identifier: Apache-2.0
"""The numbers of the posterior, kept as data (config/weights.yaml)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import yaml

from uncom_reasoner.exceptions import InvalidWeightsError

DEFAULT_FILE = Path(__file__).parent / "config" / "weights.yaml"


@dataclass(frozen=True, slots=True)
class Weights:
    """What config/weights.yaml holds; the file says what each number means."""

    phrase: float
    ray: float
    relation: float
    position: float
    discourse: float
    plausible: float
    rival: float
    none_discount: float
    stray_named: float
    stray_deictic: float
    boost_named: float
    boost_deictic: float
    ray_systematic_rad: float
    tip_sigma_m: float
    depth_sigma_ratio: float
    early_s: float
    late_s: float
    still_speed: float
    min_gesture_weight: float
    near_ray_z: float
    under_ray_z: float
    min_probability: float
    min_odds: float

    def __post_init__(self) -> None:
        """Reject numbers that mean nothing."""
        for name in ("stray_named", "stray_deictic", "min_probability"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise InvalidWeightsError(f"weight {name}={getattr(self, name)!r} must lie between 0 and 1")
        for field in dataclasses.fields(self):
            if not getattr(self, field.name) >= 0.0:
                raise InvalidWeightsError(f"weight {field.name}={getattr(self, field.name)!r} must not be negative")


def load_weights(path: str | Path = "") -> Weights:
    """Read a weights file; an empty path is the shipped one.

    Raises:
        InvalidWeightsError: the file is missing, not YAML, or has missing, unknown or unusable entries.
    """
    file = Path(path) if str(path) else DEFAULT_FILE
    try:
        data = yaml.safe_load(file.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError) as error:
        raise InvalidWeightsError(f"cannot read the weights file {file}: {error}") from error
    names = {field.name for field in dataclasses.fields(Weights)}
    if not isinstance(data, dict) or set(data) != names:
        wrong = sorted(set(data) ^ names) if isinstance(data, dict) else ["the whole file"]
        raise InvalidWeightsError(f"weights file {file}: missing or unknown: {', '.join(map(str, wrong))}")
    try:
        return Weights(**{name: float(value) for name, value in data.items()})
    except (TypeError, ValueError) as error:
        raise InvalidWeightsError(f"weights file {file}: {error}") from error
