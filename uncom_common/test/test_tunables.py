# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune say what they mean."""

from dataclasses import dataclass, replace

from uncom_common.tunables import tunable, tunables_of


@dataclass(frozen=True, slots=True)
class Options:
    clearance_m: float = tunable(0.005, unit="m", meaning="least gap", source="measured by a test")
    heights_m: tuple[float, ...] = tunable((0.12, 0.08), unit="m", meaning="heights to try, highest first")
    name: str = "not a tunable"


def test_a_tunable_is_an_ordinary_field():
    assert Options().clearance_m == 0.005
    assert replace(Options(), clearance_m=0.01).clearance_m == 0.01


def test_tunables_are_listed_with_unit_meaning_and_source():
    first, second = tunables_of(Options)
    assert (first.name, first.value, first.unit, first.meaning) == ("clearance_m", 0.005, "m", "least gap")
    assert first.source == "measured by a test"
    assert second.value == (0.12, 0.08)
    assert first.group.endswith("Options")
