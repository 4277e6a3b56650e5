# SPDX-License-Identifier: Apache-2.0
"""Parameters refuse what they declare to be unusable, and say what is usable."""

import dataclasses
import math
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st
from uncom_common.exceptions import InvalidConfigError
from uncom_common.parameters import check_parameters, parameter, usable_values


@dataclass(frozen=True, slots=True)
class Config:
    rate_hz: float = parameter(8.0, "images a second [1/s]", minimum=0.1, maximum=60.0)
    attempts: int = parameter(3, "attempts", minimum=1)
    side: str = parameter("left", "which arm", choices=("left", "right"))
    styles: tuple[str, ...] = parameter(("a",), "styles", choices=("a", "b"))
    anything: str = parameter("", "free text")

    def __post_init__(self):
        check_parameters(self)


def test_defaults_are_usable():
    assert Config().rate_hz == 8.0


@given(st.floats())
def test_a_value_is_refused_exactly_outside_its_range(value):
    if 0.1 <= value <= 60.0:
        assert Config(rate_hz=value).rate_hz == value
    else:
        with pytest.raises(InvalidConfigError, match=r"rate_hz.*0\.1 to 60"):
            Config(rate_hz=value)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"attempts": 0}, "at least 1"),
        ({"side": "up"}, "left or right"),
        ({"styles": ("a", "c")}, "a or b"),
        ({"rate_hz": math.nan}, "0.1 to 60"),
    ],
)
def test_the_refusal_names_the_usable_values(wrong, text):
    with pytest.raises(InvalidConfigError, match=text):
        Config(**wrong)


def test_the_description_and_the_usable_values_can_be_listed():
    fields = {item.name: item for item in dataclasses.fields(Config)}
    assert fields["rate_hz"].metadata["description"] == "images a second [1/s]"
    assert usable_values(fields["anything"]) == ""
