# SPDX-License-Identifier: Apache-2.0
"""The reliability diagram shows every bin."""

from __future__ import annotations

from uncom_bringup.report import reliability


def test_every_bin_has_its_bar_and_the_error_is_told():
    bins = [
        {"low": 0.5, "high": 0.6, "count": 4, "probability": 0.55, "right": 0.5},
        {"low": 0.9, "high": 1.0, "count": 40, "probability": 0.97, "right": 0.975},
    ]
    drawn = str(reliability.draw(bins, 0.021))
    assert drawn.count("<rect") == 2
    assert drawn.count("<circle") == 2
    assert "expected calibration error 0.021" in drawn
    assert "40 choices" in drawn


def test_without_choices_nothing_is_drawn():
    assert str(reliability.draw([], 0.0)) == ""
