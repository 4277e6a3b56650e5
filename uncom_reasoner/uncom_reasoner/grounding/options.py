# SPDX-License-Identifier: Apache-2.0
"""Numbers of grounding a command: containers, groups, sides and places; logs and thresholds are the posterior's."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ContainerOptions:
    """Which objects are containers, and when "here" means one (paper, section III-H)."""

    min_share: float = tunable(0.3, meaning="a container's score is this share of the best one's")
    min_score: float = tunable(0.1, meaning="and at least this")
    hollow_m: float = tunable(0.015, unit="m", meaning="what is deeper than this is put into, else onto")
    hit_margin_m: float = tunable(
        0.02, unit="m", meaning='"here" means a container only if the ray meets the table within this of its outline'
    )


@dataclass(frozen=True, slots=True)
class AsideOptions:
    """Moving an object to a side of where it is."""

    usual_m: float = tunable(0.12, unit="m", meaning='how far "move it to the left" goes')
    tolerance: float = tunable(0.4, meaning="the place may be this share of the way off")


@dataclass(frozen=True, slots=True)
class GroupOptions:
    """Which objects a reference to several means."""

    member_odds: float = tunable(5.0, meaning="an object this much less likely than the best one is of another kind")
    pointed_odds: float = tunable(
        30.0, meaning="the same with a gesture: fingers that pass over several objects fit some better than others"
    )


@dataclass(frozen=True, slots=True)
class PerspectiveOptions:
    """Whose left and right is meant."""

    same_place_m: float = tunable(0.06, unit="m", meaning="places nearer than this are the same outcome")
    min_prior: float = tunable(0.02, meaning="a side that is less likely is not weighed")
    ambiguous_share: float = tunable(
        0.7, meaning="likelihood of a side by which the command is ambiguous, where one by which it can be done has 1"
    )
    infeasible_share: float = tunable(
        0.4, meaning="the same where it cannot be done: an impossible wish stays more likely than the odd side"
    )


CONTAINERS = ContainerOptions()
ASIDE = AsideOptions()
GROUP = GroupOptions()
PERSPECTIVE = PerspectiveOptions()
