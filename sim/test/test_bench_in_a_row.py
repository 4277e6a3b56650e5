# SPDX-License-Identifier: Apache-2.0
"""One robot carries out command after command: what is told of memory, drift and trouble is what was measured."""

import pytest
from uncom_sim.bench_in_a_row import Turn, resident_mb, run_in_a_row, summary_in_a_row, table


def test_memory_is_counted_from_after_the_warm_up_and_trouble_as_the_longest_run_of_failures():
    turns = [Turn("x", number not in (3, 4, 20), 0.001 * number, 0.0, 100.0 + number) for number in range(30)]
    total = summary_in_a_row(turns)
    assert (total["commands"], total["succeeded"], total["in_trouble"]) == (30, 27, 2)
    assert total["rss_growth_mb"] == pytest.approx(19.0)
    assert total["home_error_max"] == total["home_error_last"] == 0.029
    assert "27 of 30" in table({**total, "table_contacts": 0})


def test_resident_memory_grows_with_what_is_kept():
    before = resident_mb()
    kept = bytearray(60_000_000)
    kept[::4096] = b"x" * len(kept[::4096])
    assert 40.0 < resident_mb() - before < 90.0


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_a_hundred_commands_in_a_row_leak_nothing_and_end_at_the_start_pose():
    total = run_in_a_row(100, 7)
    assert total["succeeded"] >= 95, total["failures"]
    assert total["in_trouble"] <= 2
    assert total["home_error_max"] < 0.02
    assert total["base_drift_m"] < 0.02
    assert total["rss_growth_mb"] < 30.0
    assert total["table_contacts"] == 0
