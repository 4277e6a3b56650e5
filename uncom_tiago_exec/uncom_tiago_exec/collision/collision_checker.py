# SPDX-License-Identifier: Apache-2.0
"""Collision checks of torso and arm against the body, the scene, and with an object in the hand."""

from __future__ import annotations

import copy
import logging
from bisect import bisect_left, bisect_right
from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Protocol, Self

import coal
import numpy as np
import pinocchio as pin

from uncom_tiago_exec.collision.convex_checker import ConvexChecker
from uncom_tiago_exec.collision.mesh_checker import MeshChecker, convex_checker_margins
from uncom_tiago_exec.collision.options import (
    COLLISION_CHECKER,
    CONVEX_CHECKER,
    CollisionCheckerOptions,
)
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.types import Attachment, FloatArray, Obstacle

_LOG = logging.getLogger(__name__)
HELD = "held"


@dataclass(frozen=True, slots=True)
class Margins:
    """Least distances [m]: arm to scene, fingers to scene, robot to itself, held object to scene."""

    scene: float = 0.01
    fingers: float = 0.004
    body: float = 0.01
    held: float = 0.006


@dataclass(frozen=True, slots=True)
class Contacts:
    """Contacts that are wanted: obstacles the fingers may touch, and obstacles the held object may touch."""

    fingers: frozenset[str] = field(default_factory=frozenset)
    held: frozenset[str] = field(default_factory=frozenset)


class StateConstraint(Protocol):
    """What a configuration has to keep beside the margins, such as that a held object stays upright."""

    @property
    def step(self) -> float:
        """Greatest distance [rad, or m] between two configurations of a path at which it is checked."""

    def holds(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) keeps it."""


def is_finger(link: str) -> bool:
    """Tell whether a link is a finger of a gripper."""
    return link.endswith("finger_link")


class CollisionChecker:
    """Checks configurations of one group in one scene; margins and allowed contacts are fixed when it is made."""

    def __init__(
        self,
        group: ArmGroup,
        obstacles: tuple[Obstacle, ...] = (),
        margins: Margins | None = None,
        contacts: Contacts | None = None,
        attachment: Attachment | None = None,
        *,
        options: CollisionCheckerOptions = COLLISION_CHECKER,
    ) -> None:
        """Choose the pairs and build the quick look; the close one is built when it is first needed."""
        self._options = options
        self._clearances_m = CONVEX_CHECKER.clearances_m
        self.group = group
        self.margins = margins or Margins()
        self.contacts = contacts or Contacts()
        self.checks = 0
        self.constraint: StateConstraint | None = None
        self._names = list(group.links)
        self._added: list[Any] = []
        self._near = group.bounds.pairs_in_reach(obstacles, max(self.margins.scene, self.margins.fingers))
        for obstacle in obstacles:
            self._add(obstacle, 0, 0, pin.SE3(obstacle.pose), "scene")
        if attachment is not None:
            frame = group.model.frames[group.tool]
            for part in attachment.parts:
                self._add(part, frame.parentJoint, group.tool, frame.placement * pin.SE3(part.pose), HELD)
        chosen = self._choose_pairs()
        self._pairs = [(i, j) for i, j, _ in chosen]
        self._margins = [margin for _, _, margin in chosen]
        self._meshes: MeshChecker | None = None
        asked = convex_checker_margins(group, self._margins)
        self._convex = ConvexChecker(group.covers, self._added, self._pairs, asked, len(group.body_pairs))

    def constrained(self, constraint: StateConstraint) -> Self:
        """Return a checker of the same pairs, margins and solids that also asks for a constraint."""
        checker = copy.copy(self)
        checker.constraint = constraint
        return checker

    def _add(self, obstacle: Obstacle, joint: int, frame: int, placement: Any, kind: str) -> None:
        x, y, z = obstacle.size
        shape = coal.Box(x, y, z) if obstacle.shape == "box" else coal.Cylinder(x / 2.0, z)
        name = f"{kind}:{obstacle.name}:{len(self._names)}"
        self._added.append(pin.GeometryObject(name, joint, frame, placement, shape))
        self._names.append(HELD if kind == HELD else obstacle.name)

    def _choose_pairs(self) -> list[tuple[int, int, float]]:
        """Return the pairs to check, each with its margin; those of the body come first."""
        robot = len(self.group.links)
        pairs = [(i, j, self.margins.body) for i, j in self.group.body_pairs]
        joints = [*self.group.joints, *(thing.parentJoint for thing in self._added)]
        held = [i for i in range(robot, len(joints)) if joints[i] != 0]
        for j in range(robot, len(joints)):
            if joints[j] == 0:
                pairs += self._with_scene(j, joints, held)
            else:  # the hand that holds it touches it
                pairs += [(i, j, self.margins.body) for i in range(robot) if joints[i] != joints[j]]
        return pairs

    def _with_scene(self, j: int, joints: list[int], held: list[int]) -> list[tuple[int, int, float]]:
        """Return the pairs of one solid of the scene with links and held solids, each with its margin."""
        name, pairs = self._names[j], []
        for i in np.flatnonzero(self._near[:, j - len(self.group.links)]).tolist():
            # the base stands still; the other arm goes up and down with the torso
            margin = self._scene_margin(self._names[i], name) if joints[i] != 0 else None
            if margin is not None:
                pairs.append((i, j, margin))
        if name not in self.contacts.held:
            pairs += [(min(i, j), max(i, j), self.margins.held) for i in held]
        return pairs

    def _scene_margin(self, link: str, obstacle: str) -> float | None:
        wanted = obstacle in self.contacts.fingers
        if is_finger(link):
            return None if wanted else self.margins.fingers
        return 0.0 if wanted else self.margins.scene

    def _mesh_checker(self) -> MeshChecker:
        """Return the checker of the meshes, made when it is first needed."""
        if self._meshes is None:
            self._meshes = MeshChecker(self.group, self._added, self._pairs, self._margins)
        return self._meshes

    def is_free(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) keeps every margin, and the constraint if there is one."""
        if self.constraint is not None and not self.constraint.holds(q):
            return False
        self.checks += 1
        return self._convex.is_free(q) or self._mesh_checker().is_free(q)

    def touching(self, q: FloatArray) -> tuple[tuple[str, str], ...]:
        """Return the names of all pairs that do not keep their margin."""
        return tuple(dict.fromkeys((self._pair_names(k)) for k in self._mesh_checker().violations(q)))

    def lower_margins_at(self, q: FloatArray) -> tuple[tuple[str, str], ...]:
        """Lower the margins that a start configuration does not keep to what it has; return what still touches.

        A margin never becomes less than zero: pairs that truly touch stay forbidden and are returned.
        """
        stuck, meshes, least = [], self._mesh_checker(), self._options.touching_m
        for k in meshes.violations(q):
            distance = meshes.distance(k)
            if distance <= least:
                stuck.append(self._pair_names(k))
            self._margins[k] = float(max(0.0, min(self._margins[k], 0.9 * distance - least)))
        meshes.lower(self._margins)
        self._convex.lower_margins(np.array(self._margins))
        return tuple(dict.fromkeys(stuck))

    def _pair_names(self, k: int) -> tuple[str, str]:
        first, second = self._pairs[k]
        return self._names[first], self._names[second]

    def path_is_free(self, path: FloatArray, step: float = 0.005) -> bool:
        """Check a polyline (N, 8) at every `step` [rad, or m] of its fastest joint."""
        return self.first_collision(path, step) is None

    def first_collision(self, path: FloatArray, step: float = 0.005) -> FloatArray | None:
        """Return a configuration of a polyline (N, 8) that does not keep its margins, or None.

        Every `step` is looked at, or lies so near to a configuration with room to spare that it is free as well.
        The whole way is looked at coarsely first: what is in the way is found sooner.
        """
        if self.constraint is not None:
            for q in densify(path, self.constraint.step):
                if not self.constraint.holds(q):
                    return np.asarray(q)
        points = densify(path, step)
        moved = self._convex.travel_along(points).tolist()
        # stretches whose middle is looked at next, and which room to ask for: what was missing nearby is not asked for
        stretches = deque(
            [
                (
                    0,
                    len(points),
                    0 if len(points) > self._options.few_states else len(self._clearances_m),
                )
            ]
        )
        while stretches:
            low, high, level = stretches.popleft()
            if low >= high:
                continue
            middle = bisect_left(moved, 0.5 * (moved[low] + moved[high - 1]), low, high - 1)
            level = self._clearance_level(points[middle], level)
            if level == len(self._clearances_m) and not self.is_free(points[middle]):
                return np.asarray(points[middle])
            room = self._clearances_m[level] if level < len(self._clearances_m) else 0.0
            stretches.append((low, bisect_left(moved, moved[middle] - room, low, middle), level))
            stretches.append((bisect_right(moved, moved[middle] + room, middle + 1, high), high, level))
        return None

    def segment_is_free(self, start: FloatArray, end: FloatArray, step: float = 0.005) -> bool:
        """Check a straight line (8,) to (8,) as path_is_free does; several times as fast for one line."""
        if self.constraint is not None:
            states = max(2, int(np.ceil(np.abs(end - start).max() / self.constraint.step)) + 1)
            if not all(self.constraint.holds(q) for q in np.linspace(start, end, states)):
                return False
        way = end - start
        count = max(1, int(np.ceil(np.abs(way).max() / step)))
        part = self._convex.travel_between(way) / count  # that solids move at most from one state to the next [m]
        reaches = [
            *(int(room / part) if part > 0.0 else count for room in self._clearances_m),
            0,
        ]
        stretches = deque([(0, count + 1, 0)])
        while stretches:
            low, high, level = stretches.popleft()
            middle = (low + high) // 2
            q = start + way * (middle / count)
            level = self._clearance_level(q, level)
            if level == len(self._clearances_m) and not self.is_free(q):
                return False
            reach = reaches[level]
            if low < middle - reach:
                stretches.append((low, middle - reach, level))
            if middle + reach + 1 < high:
                stretches.append((middle + reach + 1, high, level))
        return True

    def _clearance_level(self, q: FloatArray, level: int) -> int:
        """Return which of the clearances from `level` on there is at a configuration; their number if there is none."""
        while level < len(self._clearances_m) and not self._convex.has_clearance(q, self._clearances_m[level]):
            level += 1
        self.checks += 1
        return level


def densify(path: FloatArray, step: float) -> FloatArray:
    """Return a polyline (N, J) with points added so that no joint moves more than `step` between two."""
    if len(path) <= 1:
        return np.asarray(path)
    pieces = [path[:1]]
    for a, b in pairwise(path):
        count = max(1, int(np.ceil(np.abs(b - a).max() / step)))
        pieces.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    return np.vstack(pieces)
