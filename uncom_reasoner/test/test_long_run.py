# SPDX-License-Identifier: Apache-2.0
"""Hundreds of commands: nothing grows."""

from __future__ import annotations

import gc
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from reasoner_scenes import POSE, TABLE_Z, Thing, command, evidence, pointing, reference
from uncom_common.primitive import Primitive
from uncom_language.types import Act, Command, Relation
from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.dialogue.conversation import Conversation
from uncom_reasoner.pointing.ray_fusion import observe_rays
from uncom_reasoner.types import Status
from uncom_reasoner.weights import load_weights


@pytest.mark.slow
def test_memory_is_flat_over_500_commands():
    """Named, pointed, relative and ambiguous commands by turns, the last answered, corrected or left alone."""
    things = [Thing("lemon_1", "lemon", 0.6, 0.2), Thing("lemon_2", "lemon", 0.6, -0.3), Thing("box_1", "box", 0.62, 0)]
    hands = observe_rays(pointing((0.6, 0.2, TABLE_Z), (0.8, 0.1, 0.9), np.arange(0.2, 1.0, 0.1)), lambda _: POSE)
    commands = [
        command(reference("box", 0.3, 0.9)),
        command(reference("lemon", 0.3, 0.9, deictic="this")),
        command(
            reference("lemon", 0.3, 0.9, deictic="this"),
            reference("box", 1.2, 1.6),
            relation=Relation.RIGHT_OF,
            primitive=Primitive.PLACE,
        ),
        command(reference("lemon", 5.0, 5.5)),
    ]
    made = [evidence(cmd, things) for cmd in commands]
    talk = Conversation(load_weights(), PlacingConfig())
    sizes, statuses = [], set()
    tracemalloc.start()
    try:
        for number in range(500):
            turn = talk.decide(replace(made[number % 4], rays=hands), float(number), 0)
            statuses.add(turn.decisions[0].grounded.status)
            if turn.question is not None:
                ending = talk.dialogue.heard(Command("u", Act.NO if number % 8 == 3 else Act.STOP, "no"))
                talk.conclude(ending, float(number))
            if number % 100 == 99:
                gc.collect()
                sizes.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert statuses >= {Status.GROUNDED, Status.AMBIGUOUS}
    assert sizes[-1] - sizes[0] < 300_000
