# SPDX-License-Identifier: Apache-2.0
"""Which skill carries out which primitive.

A new act is a class in a file of its own and its instance in SKILLS.
"""

from __future__ import annotations

from collections.abc import Iterable

from uncom_common.primitive import Primitive

from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.skills.give import GiveSkill
from uncom_tiago_exec.skills.pick import PickSkill
from uncom_tiago_exec.skills.place import PlaceSkill
from uncom_tiago_exec.skills.point import PointSkill
from uncom_tiago_exec.skills.pour import PourSkill
from uncom_tiago_exec.skills.push import PushSkill
from uncom_tiago_exec.skills.skill import Skill


class SkillRegistry:
    """The skills of a robot, by primitive."""

    def __init__(self, skills: Iterable[Skill]) -> None:
        """Register skills.

        Raises:
            ValueError: two of them claim one primitive.
        """
        self._skills: dict[Primitive, Skill] = {}
        for skill in skills:
            for primitive in skill.primitives:
                if primitive in self._skills:
                    raise ValueError(f"{primitive.name} has two skills: {self._skills[primitive]} and {skill}")
                self._skills[primitive] = skill

    def __contains__(self, primitive: Primitive) -> bool:
        """Tell whether there is a skill for a primitive."""
        return primitive in self._skills

    def __getitem__(self, primitive: Primitive) -> Skill:
        """Return the skill for a primitive.

        Raises:
            RefusedError: there is none, or no action was named.
        """
        if primitive is Primitive.NONE:
            raise RefusedError("I was not told what to do")
        if primitive not in self._skills:
            raise RefusedError(f"I have not learned to {primitive.value.replace('_', ' ')} yet")
        return self._skills[primitive]


SKILLS = SkillRegistry((PickSkill(), PlaceSkill(), PushSkill(), PourSkill(), GiveSkill(), PointSkill()))
