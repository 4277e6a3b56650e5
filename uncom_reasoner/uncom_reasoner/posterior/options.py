# SPDX-License-Identifier: Apache-2.0
"""Numbers of the posterior that are not fitted; those that are fitted on takes are in config/weights.yaml (`Weights`).

Logs are natural logarithms.
"""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ObjectLikelihoodOptions:
    """The factors of an object's probability."""

    min_probability: float = tunable(1e-6, meaning="least probability of a phrase or an anchor that is told apart")
    sure_gesture: float = tunable(
        2.0, meaning="a gesture with this multiple of min_gesture_weight is surely about its words"
    )
    rival_min_log: float = tunable(-3.0, meaning="most that another noun of the command takes from an object")
    answer_log: float = tunable(-40.0, meaning="log of what an answer, or a container squarely pointed at, rules out")
    far_ranks: float = tunable(4.0, meaning="objects of another kind stand so many ranks behind in every order")
    known_place_sigma_m: float = tunable(
        0.04, unit="m", meaning='spread of an object around where "it" was or went (discourse)'
    )
    unknown_log: float = tunable(-6.0, meaning='log of an object that was nowhere near there, for "it"')
    same_again_log: float = tunable(-5.0, meaning='log of the very object that was spoken of, for "the other one"')
    container_min_best: float = tunable(0.05, meaning="least score as a container that the best one is taken to have")
    container_min_share: float = tunable(0.03, meaning="least share of the best score as a container")
    flat_receiver_share: float = tunable(0.5, meaning="plausibility counts this much where it is put on or stacked")
    reach_sigma_m: float = tunable(0.15, unit="m", meaning="spread beyond the reach of the arms")
    reach_min_log: float = tunable(-1.0, meaning="log of what no arm reaches: it may still be meant")


@dataclass(frozen=True, slots=True)
class ComparisonOptions:
    """Objects set against each other."""

    kind_share: float = tunable(0.2, meaning="objects with this share of the best score are of the kind compared")
    rank_log: float = tunable(-2.5, meaning="log for each place in an order that an object is off")
    max_ranks: float = tunable(4.0, meaning="being off by more places counts as by so many")
    rank_softness: float = tunable(0.3, meaning="softness of an order, as a share of what is clearly different")
    clear_place_m: float = tunable(0.03, unit="m", meaning="the order of places that differ by less is not clear")
    clear_size_log: float = tunable(0.03, meaning="the order of sizes that differ by less (log) is not clear")
    compared_min_log: float = tunable(-6.0, meaning="log of a comparison that does not hold at all")
    larger_log: float = tunable(0.05, meaning="an object larger by this (log) is larger")
    larger_softness: float = tunable(0.5, meaning="softness of that border, as a share of it")
    same_size_sigma: float = tunable(0.15, meaning="sizes that differ by this (log) are a standard deviation apart")
    same_shape_sigmas: float = tunable(2.0, meaning="spread of shapes, as a multiple of the spread of sizes")
    min_share: float = tunable(0.03, meaning="least share of a colour or kind, also where it was not seen at all")
    unknown_likeness: float = tunable(0.5, meaning="likeness where colour, shape or kind is not known")
    label_sure_min: float = tunable(0.3, meaning="least probability that two labels are right")
    label_sure_max: float = tunable(0.97, meaning="greatest probability that two labels are right")
    similar_low: float = tunable(0.35, meaning='mean likeness that counts nothing towards "similar"')
    similar_range: float = tunable(0.5, meaning="mean likeness above that which counts fully")
    min_extent_m: float = tunable(1e-3, unit="m", meaning="least side of an object when shapes are compared")


@dataclass(frozen=True, slots=True)
class ChoiceOptions:
    """When the likeliest candidate is taken, and when it is asked about; the thresholds themselves are weights."""

    near_miss_probability: float = tunable(
        0.03, meaning="an object this likely is asked about though the words do not fit"
    )
    near_miss_odds: float = tunable(2.0, meaning="but only with these odds against all others")
    near_miss_ray_log: float = tunable(2.0, meaning="or if a gesture prefers it by this log")
    close_factor: float = tunable(1.5, meaning="candidates are asked about up to this multiple of min_odds")
    sure_colour: float = tunable(0.5, meaning="a colour more probable than this is named")


OBJECT_LIKELIHOOD = ObjectLikelihoodOptions()
COMPARISON = ComparisonOptions()
CHOICE = ChoiceOptions()
