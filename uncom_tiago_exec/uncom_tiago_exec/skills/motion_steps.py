# SPDX-License-Identifier: Apache-2.0
"""A grasp that works as joint paths, and joint paths as timed steps: taking an object, setting it down."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.place_poses import Place
from uncom_tiago_exec.planning.arm_planner import TABLE_ONLY, ArmPlanner
from uncom_tiago_exec.planning.carry_planner import plan_upright_motion
from uncom_tiago_exec.planning.plan import GripStep, MoveStep, Step
from uncom_tiago_exec.skills.options import MOTION_STEPS, MotionStepOptions
from uncom_tiago_exec.trajectory.rest_to_rest import shortest_time
from uncom_tiago_exec.types import FloatArray, Stage


@dataclass(frozen=True, slots=True)
class Reach:
    """A grasp that works, with the joint paths of its straight parts.

    Attributes:
        arm: planner of the arm that grasps.
        grasp: pose and opening of the hand.
        approach: path (N, 8) to the grasp.
        lift: path (N, 8) from the grasp to the lifted object.
        place: where the object is set down, or None if it is kept in the hand.
        lower: path (N, 8) from above the place down to it.
        retreat: path (N, 8) of the opened hand away from the object that was set down.
        release_gap: gap between the fingers at which the object is released [m].
        over: path (N, 8) from the lifted object to above its place, where a straight path leads there.
        options: paces and weights.
    """

    arm: ArmPlanner
    grasp: Grasp
    approach: FloatArray
    lift: FloatArray
    place: Place | None = None
    lower: FloatArray | None = None
    retreat: FloatArray | None = None
    release_gap: float = 0.0
    over: FloatArray | None = None
    options: MotionStepOptions = MOTION_STEPS

    @property
    def carrying_speed_scale(self) -> float:
        """Share of the full speed at which the object is carried: doubtful grasps and long pendulums are not shaken."""
        pads = self.grasp.pose[2, 3] + self.arm.group.gripper.tip * self.grasp.approach[2]
        lever = abs(float(pads - self.arm.scene.moved.middle[2]))
        options = self.options
        swing = 1.0 / (1.0 + options.lever_weight * max(0.0, lever - options.short_lever_m))
        speed_scale = (options.least_quality_speed_scale + options.quality_speed_scale * self.grasp.quality) * swing
        return float(np.clip(speed_scale, options.slowest_carrying_speed_scale, options.fastest_carrying_speed_scale))

    def hop(self) -> float:
        """Rough time from the lifted object to above its place [s]."""
        if self.lower is None:
            return 0.0
        path = np.vstack([self.lift[-1], self.lower[0]]) if self.over is None else self.over
        return float((np.abs(np.diff(path, axis=0)) / self.arm.limits.velocity).max(axis=1).sum())

    def cost(self) -> float:
        """Rough time of the free motions, increased for low grasp quality: a lost object costs more than a path [s]."""
        speed = self.arm.limits.velocity
        hops = [(self.arm.start, self.approach[0])]
        if self.lower is not None and self.retreat is not None:
            hops += [(self.lift[-1], self.lower[0]), (self.retreat[-1], self.arm.start)]
        motion = sum(float((np.abs(b - a) / speed).max()) for a, b in hops)
        options = self.options
        quality = max(self.grasp.quality, options.least_quality)
        return float((motion + options.fixed_time_s) / quality**options.quality_power)


def taking_steps(reach: Reach) -> tuple[Step, ...]:
    """Return the steps from the start to the lifted object."""
    arm, grasp, options = reach.arm, reach.grasp, reach.options
    free, reaching = arm.free_motion_checker(grasp.opening), arm.approach_checker(grasp.opening)
    start = arm.group.clamp(arm.start)
    go = arm.transit(free, start, [reach.approach[0]])
    lifting = arm.carry_checker(grasp, TABLE_ONLY)
    return (
        GripStep(Stage.APPROACHING, grasp.opening, detail="opening the fingers"),
        move(arm, Stage.APPROACHING, (go, free, 1.0), "to the object"),
        move(arm, Stage.APPROACHING, (reach.approach, reaching, options.approach_speed_scale), "straight in"),
        GripStep(Stage.GRASPING, max(0.0, grasp.width - options.squeeze_m), holding=True, detail="closing the fingers"),
        move(
            arm,
            Stage.LIFTING,
            (reach.lift, lifting, min(reach.carrying_speed_scale, options.lift_speed_scale)),
            "straight up",
        ),
    )


def placing_steps(reach: Reach, home: FloatArray, gap: float, *, strict: bool = False) -> tuple[Step, ...]:
    """Return the steps from the lifted object to the arm at home (8,) with its fingers at a gap [m].

    Raises:
        PlanningError: there is no path to the place, or home; strict, none on which the object stays upright.
    """
    if reach.place is None or reach.lower is None or reach.retreat is None:
        return ()
    arm, grasp, options = reach.arm, reach.grasp, reach.options
    carrying = arm.carry_checker(grasp, frozenset())
    over = reach.over
    if over is None:
        over = plan_upright_motion(arm, grasp, reach.lift[-1], reach.lower[0], strict=strict)
    touches = frozenset({arm.scene.moved.name})
    leaving = arm.retreat_checker(reach.release_gap, reach.place.motion, touches)
    away = arm.retreat_checker(reach.release_gap, reach.place.motion, frozenset())
    goal = arm.group.clamp(home)
    if not away.is_free(goal):
        away.lower_margins_at(goal)
    back = arm.transit(away, reach.retreat[-1], [goal])
    lowering = arm.carry_checker(grasp, reach.place.touches)
    down = move(
        arm,
        Stage.PLACING,
        (reach.lower, lowering, min(reach.carrying_speed_scale, options.lower_speed_scale)),
        "straight down",
    )
    return (
        move(
            arm,
            Stage.TRANSFERRING,
            (over, carrying, min(reach.carrying_speed_scale, options.transfer_speed_scale)),
            "to the place",
        ),
        _until_contact(down, options.contact_tolerance),
        GripStep(Stage.PLACING, reach.release_gap, detail="letting go"),
        move(arm, Stage.RETREATING, (reach.retreat, leaving, options.retreat_speed_scale), "straight out"),
        move(arm, Stage.HOMING, (end_at(back, home), away, 1.0), "back to the start"),
        GripStep(Stage.HOMING, gap, detail="fingers as before"),
    )


def _until_contact(step: MoveStep, tolerance: float) -> MoveStep:
    """Let a motion end where a joint lags by a tolerance [rad, m]: what turned between the fingers rests earlier."""
    return replace(step, trajectory=replace(step.trajectory, tolerance=tolerance))


def move(arm: ArmPlanner, stage: Stage, motion: tuple[FloatArray, CollisionChecker, float], detail: str) -> MoveStep:
    """Return the timed step of a motion: path (N, 8) [rad, m], its collision checker, and share of the full speed."""
    path, checker, speed_scale = motion
    limits = arm.limits
    least = shortest_time(path[0], path[-1], (limits.velocity, limits.acceleration, limits.jerk))
    return MoveStep(stage, arm.timed(path, checker, speed_scale), detail, least)


def end_at(path: FloatArray, q: FloatArray) -> FloatArray:
    """Return the path with its end set to the true start, which noise may have put outside the limits."""
    return np.vstack([path[:-1], q])
