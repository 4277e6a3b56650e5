# SPDX-License-Identifier: Apache-2.0
"""Counts contacts of the robot with the table and with objects that it never held."""

from __future__ import annotations

from collections.abc import Mapping

import pybullet

from uncom_sim.world.options import PHYSICS, PhysicsOptions


class ContactCounter:
    """Counts touches of the table and of bystanders: objects that the robot never held between two fingers."""

    def __init__(
        self,
        client: int,
        robot: int,
        table: int,
        objects: Mapping[str, int],
        fingers: Mapping[int, int],
        *,
        options: PhysicsOptions = PHYSICS,
    ) -> None:
        """Bodies are PyBullet ids; fingers maps the index of each finger link to a number of its gripper."""
        self._options = options
        self._client = client
        self._robot = robot
        self._table = table
        self._names = {body: name for name, body in objects.items()}
        self._fingers = dict(fingers)
        self._last: dict[int, float] = {}
        self._touches: dict[int, int] = {}
        self._held: set[int] = set()
        self._between: frozenset[int] = frozenset()
        self._forces: dict[int, float] = {}

    def update(self, time_s: float) -> None:
        """Evaluate the contacts of the physics step just made, at a simulated time [s]."""
        grips: dict[tuple[int, int], set[int]] = {}
        touched = set()
        for contact in pybullet.getContactPoints(self._robot, physicsClientId=self._client):
            link, other = (contact[3], contact[2]) if contact[1] == self._robot else (contact[4], contact[1])
            near_only = contact[8] > 0.0 and contact[9] <= 0.0  # what presses may be some micrometres away
            if near_only or (other != self._table and other not in self._names):
                continue
            touched.add(other)
            self._forces[other] = max(self._forces.get(other, 0.0), float(contact[9]))
            if link in self._fingers:
                grips.setdefault((other, self._fingers[link]), set()).add(link)
        self._between = frozenset(other for (other, _), links in grips.items() if len(links) > 1)
        self._held |= self._between
        for other in touched:
            if time_s - self._last.get(other, -1e9) > self._options.contact_gap_s:
                self._touches[other] = self._touches.get(other, 0) + 1
            self._last[other] = time_s

    @property
    def table(self) -> int:
        """How many times the robot touched the table."""
        return self._touches.get(self._table, 0)

    @property
    def bystanders(self) -> int:
        """How many times the robot touched objects that it never held."""
        return sum(n for body, n in self._touches.items() if body != self._table and body not in self._held)

    @property
    def forces(self) -> dict[str, float]:
        """Greatest normal force [N] between the robot and each object it touched; the table is called "table"."""
        names = {**self._names, self._table: "table"}
        return {names[body]: round(force, 2) for body, force in self._forces.items()}

    @property
    def between_fingers(self) -> frozenset[str]:
        """Ids of the objects that are between two fingers of one hand now."""
        return frozenset(self._names[body] for body in self._between if body in self._names)

    @property
    def held(self) -> frozenset[str]:
        """Ids of the objects that were between two fingers at some time."""
        return frozenset(self._names[body] for body in self._held if body in self._names)
