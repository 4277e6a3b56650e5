# SPDX-License-Identifier: Apache-2.0
"""Collision checks of torso and arm with the body and the scene, and of an object in the hand.

A configuration is checked with convex covers first and, where they do not prove it free, with the meshes. A path is
checked at configurations a small step apart, most of which need no check of their own: if a configuration keeps its
margins with a clearance c to spare, so does every configuration within a travel of c of it (convex_checker.py). An
interval of the path is checked at its middle; what the clearance found there covers is done, and the rest on both
sides is checked in the same manner (adaptive bisection: Schwarzer, Saha and Latombe 2005).
"""

from __future__ import annotations

import copy
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
    MARGINS,
    CollisionCheckerOptions,
    ConvexCheckerOptions,
    Margins,
)
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.types import Attachment, FloatArray, Obstacle

HELD = "held"


@dataclass(frozen=True, slots=True)
class Contacts:
    """Contacts that are allowed.

    Attributes:
        fingers: names of obstacles that the fingers may touch.
        held: names of obstacles that the held object may touch.
    """

    fingers: frozenset[str] = field(default_factory=frozenset)
    held: frozenset[str] = field(default_factory=frozenset)


class StateConstraint(Protocol):
    """A condition on configurations in addition to the margins, such as that a held object stays upright."""

    @property
    def step(self) -> float:
        """Greatest change of a joint [rad, or m] between two configurations of a path at which it is checked."""

    def holds(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) fulfils it."""


def is_finger(link: str) -> bool:
    """Tell whether a link is a finger of a gripper."""
    return link.endswith("finger_link")


class CollisionChecker:
    """Checks configurations of one group in one scene, with margins and allowed contacts fixed at construction.

    Attributes:
        group: that moves.
        margins: least distances.
        contacts: that are allowed.
        checks: number of checks so far.
        constraint: further condition on configurations, or None.
    """

    def __init__(
        self,
        group: ArmGroup,
        obstacles: tuple[Obstacle, ...] = (),
        margins: Margins | None = None,
        contacts: Contacts | None = None,
        attachment: Attachment | None = None,
        *,
        options: CollisionCheckerOptions = COLLISION_CHECKER,
        convex_options: ConvexCheckerOptions = CONVEX_CHECKER,
    ) -> None:
        """Choose the pairs and build the checker with covers; that with meshes is built when it is first needed.

        Args:
            group: that moves.
            obstacles: of the scene, in base_footprint.
            margins: least distances; the default ones if None.
            contacts: that are allowed; none if None.
            attachment: object in the hand.
            options: numbers that tune it.
            convex_options: numbers that tune checks with covers.
        """
        self._options = options
        self._clearances_m = convex_options.clearances_m
        self.group = group
        self.margins = margins or MARGINS
        self.contacts = contacts or Contacts()
        self.checks = 0
        self.constraint: StateConstraint | None = None
        self._names = list(group.links)
        self._added: list[Any] = []
        self._in_reach = group.bounds.pairs_in_reach(obstacles, max(self.margins.scene, self.margins.fingers))
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
        required = convex_checker_margins(group, self._margins)
        self._convex = ConvexChecker(
            group.covers, self._added, self._pairs, required, len(group.body_pairs), options=convex_options
        )

    def constrained(self, constraint: StateConstraint) -> Self:
        """Return a checker of the same pairs, margins and solids that requires a constraint as well."""
        checker = copy.copy(self)
        checker.constraint = constraint
        return checker

    def _add(self, obstacle: Obstacle, joint: int, frame: int, placement: Any, kind: str) -> None:
        """Add a solid to the shapes, at a placement in the frame of a joint."""
        x, y, z = obstacle.size
        shape = coal.Box(x, y, z) if obstacle.shape == "box" else coal.Cylinder(x / 2.0, z)
        name = f"{kind}:{obstacle.name}:{len(self._names)}"
        self._added.append(pin.GeometryObject(name, joint, frame, placement, shape))
        self._names.append(HELD if kind == HELD else obstacle.name)

    def _choose_pairs(self) -> list[tuple[int, int, float]]:
        """Return the pairs of shapes to check, each with its margin [m]; those of the robot with itself come first."""
        robot = len(self.group.links)
        pairs = [(i, j, self.margins.body) for i, j in self.group.body_pairs]
        joints = [*self.group.joints, *(solid.parentJoint for solid in self._added)]
        held = [i for i in range(robot, len(joints)) if joints[i] != 0]
        for j in range(robot, len(joints)):
            if joints[j] == 0:
                pairs += self._with_scene(j, joints, held)
            else:  # links on the joint that carries a held solid touch it
                pairs += [(i, j, self.margins.body) for i in range(robot) if joints[i] != joints[j]]
        return pairs

    def _with_scene(self, j: int, joints: list[int], held: list[int]) -> list[tuple[int, int, float]]:
        """Return the pairs of obstacle j with links and held solids, each with its margin [m]."""
        name, pairs = self._names[j], []
        for i in np.flatnonzero(self._in_reach[:, j - len(self.group.links)]).tolist():
            # links on joint 0 are of the base, which stands still; the other arm rises and falls with the torso
            margin = self._scene_margin(self._names[i], name) if joints[i] != 0 else None
            if margin is not None:
                pairs.append((i, j, margin))
        if name not in self.contacts.held:
            pairs += [(min(i, j), max(i, j), self.margins.held) for i in held]
        return pairs

    def _scene_margin(self, link: str, obstacle: str) -> float | None:
        """Return the margin of a link with an obstacle [m]; None if they may touch."""
        allowed = obstacle in self.contacts.fingers
        if is_finger(link):
            return None if allowed else self.margins.fingers
        return 0.0 if allowed else self.margins.scene

    def _mesh_checker(self) -> MeshChecker:
        """Return the checker of the meshes, made when it is first needed."""
        if self._meshes is None:
            self._meshes = MeshChecker(self.group, self._added, self._pairs, self._margins)
        return self._meshes

    def is_free(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) keeps every margin and fulfils the constraint, if there is one."""
        if self.constraint is not None and not self.constraint.holds(q):
            return False
        self.checks += 1
        return self._convex.is_free(q) or self._mesh_checker().is_free(q)

    def touching(self, q: FloatArray) -> tuple[tuple[str, str], ...]:
        """Return the pairs that do not keep their margin at a configuration (8,): names of links or obstacles."""
        return tuple(dict.fromkeys((self._pair_names(k)) for k in self._mesh_checker().violations(q)))

    def lower_margins_at(self, q: FloatArray) -> tuple[tuple[str, str], ...]:
        """Lower the margins that a start configuration (8,) does not keep, so that it does.

        A margin never becomes negative: pairs that touch stay forbidden.

        Returns:
            The pairs that touch, as names of links or obstacles.
        """
        touching, meshes, least = [], self._mesh_checker(), self._options.touching_m
        for k in meshes.violations(q):
            distance = meshes.distance(k)
            if distance <= least:
                touching.append(self._pair_names(k))
            lowered = self._options.lowered_share * distance - least
            self._margins[k] = float(max(0.0, min(self._margins[k], lowered)))
        meshes.lower_margins(self._margins)
        self._convex.lower_margins(np.array(self._margins))
        return tuple(dict.fromkeys(touching))

    def _pair_names(self, k: int) -> tuple[str, str]:
        """Return the names of the two sides of pair k: links, obstacles, or "held"."""
        first, second = self._pairs[k]
        return self._names[first], self._names[second]

    def path_is_free(self, path: FloatArray, step: float | None = None) -> bool:
        """Tell whether a polyline (N, 8) is free at every `step`, see first_collision."""
        return self.first_collision(path, step) is None

    def first_collision(self, path: FloatArray, step: float | None = None) -> FloatArray | None:
        """Return a configuration (8,) of a polyline that is not free, or None.

        Let t_i be the travel from the start to configuration i of the densified path. If configuration m has the
        clearance c, all i with |t_i - t_m| <= c are free, and only those left and right of them remain. Intervals
        are processed breadth first, so that the whole path is looked at coarsely before any part closely: a collision
        is found sooner. Within an interval a clearance that was not found around it is not looked for again; where
        none is found the configuration itself is checked.

        Args:
            path: waypoints (N, 8).
            step: greatest change of a joint [rad, or m] between two configurations; that of the options if None.
        """
        if self.constraint is not None:
            for q in densify(path, self.constraint.step):
                if not self.constraint.holds(q):
                    return np.asarray(q)
        points = densify(path, self._options.step if step is None else step)
        travel = self._convex.travel_along(points).tolist()
        first_level = 0 if len(points) > self._options.few_states else len(self._clearances_m)
        intervals = deque([(0, len(points), first_level)])  # first, one past the last, clearance to begin with
        while intervals:
            low, high, level = intervals.popleft()
            if low >= high:
                continue
            middle = bisect_left(travel, 0.5 * (travel[low] + travel[high - 1]), low, high - 1)
            level = self._clearance_level(points[middle], level)
            if level == len(self._clearances_m) and not self.is_free(points[middle]):
                return np.asarray(points[middle])
            clearance = self._clearances_m[level] if level < len(self._clearances_m) else 0.0
            intervals.append((low, bisect_left(travel, travel[middle] - clearance, low, middle), level))
            intervals.append((bisect_right(travel, travel[middle] + clearance, middle + 1, high), high, level))
        return None

    def segment_is_free(self, start: FloatArray, end: FloatArray, step: float | None = None) -> bool:
        """Tell whether the straight line between two configurations (8,) is free at every `step`.

        The same as path_is_free, but several times as fast for one segment: its configurations are equally spaced, so
        that a clearance covers a fixed number of them.
        """
        if self.constraint is not None:
            states = max(2, int(np.ceil(np.abs(end - start).max() / self.constraint.step)) + 1)
            if not all(self.constraint.holds(q) for q in np.linspace(start, end, states)):
                return False
        difference = end - start
        count = max(1, int(np.ceil(np.abs(difference).max() / (self._options.step if step is None else step))))
        travel = self._convex.travel_between(difference) / count  # from one configuration to the next [m]
        covered = [*(int(clearance / travel) if travel > 0.0 else count for clearance in self._clearances_m), 0]
        intervals = deque([(0, count + 1, 0)])  # first, one past the last, clearance to begin with
        while intervals:
            low, high, level = intervals.popleft()
            middle = (low + high) // 2
            q = start + difference * (middle / count)
            level = self._clearance_level(q, level)
            if level == len(self._clearances_m) and not self.is_free(q):
                return False
            neighbours = covered[level]
            if low < middle - neighbours:
                intervals.append((low, middle - neighbours, level))
            if middle + neighbours + 1 < high:
                intervals.append((middle + neighbours + 1, high, level))
        return True

    def _clearance_level(self, q: FloatArray, level: int) -> int:
        """Return the index, from `level` on, of the first clearance that a configuration has; their number if none."""
        while level < len(self._clearances_m) and not self._convex.has_clearance(q, self._clearances_m[level]):
            level += 1
        self.checks += 1
        return level


def densify(path: FloatArray, step: float) -> FloatArray:
    """Return a polyline (N, J) with points added such that no joint changes by more than `step` between two."""
    if len(path) <= 1:
        return np.asarray(path)
    pieces = [path[:1]]
    for a, b in pairwise(path):
        count = max(1, int(np.ceil(np.abs(b - a).max() / step)))
        pieces.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    return np.vstack(pieces)
