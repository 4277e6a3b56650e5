# SPDX-License-Identifier: Apache-2.0
"""The fitted numbers of the posterior, kept as data: config/weights.yaml.

The file is YAML, one mapping from name to number. All names of `Weights` must be there and no others; all numbers are
at least 0, and probabilities lie between 0 and 1. A remark above a name says what it means. The parameter
`weights_file` of the reasoner node takes another file; `python -m uncom_reasoner.calibration.fit_weights` writes one
from takes with a known truth. Numbers that are not fitted are in the option classes of the rooms.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import yaml

from uncom_reasoner.exceptions import InvalidWeightsError

DEFAULT_FILE = Path(__file__).parent / "config" / "weights.yaml"


@dataclass(frozen=True, slots=True)
class Weights:
    """What config/weights.yaml holds.

    Attributes:
        phrase, ray, relation, position, discourse, plausible, rival: multipliers of the log factors of
            posterior/object_likelihood.py (`position` of all comparisons).
        none_discount: how much less likely "none of these" is than the detector says [log].
        stray_named, stray_deictic: probability that a gesture during a phrase is not about it, without and with a
            pointing word.
        boost_named, boost_deictic: share of a gesture's support that also counts against "none of these".
        ray_systematic_rad: error of pointing that does not average out over frames [rad].
        tip_sigma_m: error of the fingertip's place [m].
        depth_sigma_ratio: how much less sure a direction is along the line of sight than across it.
        early_s, late_s: standard deviations of pointing before and after the words [s].
        still_speed: fingertip speed at which a frame counts half [image widths / s].
        min_gesture_weight: least weight of frames that makes a gesture.
        near_ray_z: a bare "this" takes a container up to so many standard deviations from the ray.
        under_ray_z: "here" takes one only up to so many.
        min_probability, min_odds: the likeliest candidate is taken if its share among the objects and its odds against
            the second are at least these.
    """

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
        """Refuse probabilities outside 0 to 1 and negative numbers.

        Raises:
            InvalidWeightsError: there is one.
        """
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
