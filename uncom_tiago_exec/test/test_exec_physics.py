# SPDX-License-Identifier: Apache-2.0
"""Commands carried out by physics: what is taken is held by friction, and nothing else moves."""

import pytest
from exec_simulation import carry_out

pytestmark = pytest.mark.slow


def check(run):
    assert run.outcome.success, run.outcome.reason
    assert run.physical.success, run.physical.reason
    assert run.physical.others_moved_m < 0.02
    assert run.table_touches == 0
    assert run.home_error < 0.02


@pytest.mark.timeout(600)
def test_a_lemon_ends_in_a_bowl_across_the_middle():
    check(carry_out([("lemon", 0.58, 0.18, 0.6), ("bowl", 0.62, -0.1, 0.0), ("can", 0.75, 0.2, 0.0)], "put_in", 0, 1))


@pytest.mark.timeout(600)
def test_a_mug_ends_on_a_free_place():
    check(carry_out([("mug", 0.6, -0.15, 2.0), ("apple", 0.62, 0.2, 0.0)], "place", 0, place=(0.6, -0.35)))
