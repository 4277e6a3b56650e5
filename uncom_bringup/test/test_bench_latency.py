# SPDX-License-Identifier: Apache-2.0
"""What the latency benchmark makes of its answers."""

from __future__ import annotations

import pytest
from uncom_bringup.commands.benchmarks.latency import report_text
from uncom_bringup.ros.measure_latency import Answer, report_of


def answers(count):
    return [
        Answer(f"bag{i}", "take it", 0, {"speech": 0.1, "language": 0.01, "deciding": 0.01 * i, "all": 0.11 + 0.01 * i})
        for i in range(count)
    ]


def test_the_report_holds_median_and_the_19th_of_20():
    report = report_of(answers(20), 100.0, 101.0)
    assert report["stages_s"]["deciding"] == {"median": 0.095, "p95": 0.18, "worst": 0.19}
    assert report["stages_s"]["speech"]["median"] == 0.1
    assert report["commands"] == len(report["answers"]) == 20
    assert "20 commands; nodes' memory 100 -> 101 MB" in report_text(report)


def test_the_stages_add_up_to_the_whole():
    for answer in report_of(answers(3), 0.0, 0.0)["answers"]:
        assert answer["speech"] + answer["language"] + answer["deciding"] == pytest.approx(answer["all"])


def test_no_answer_is_an_empty_report_and_no_crash():
    assert report_of([], 0.0, 0.0)["stages_s"] == {}
    assert "0 commands" in report_text(report_of([], 0.0, 0.0))
