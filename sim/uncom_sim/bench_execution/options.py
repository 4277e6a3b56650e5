# SPDX-License-Identifier: Apache-2.0
"""Numbers of the execution benchmark."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class CaseOptions:
    """How single commands and their scenes are drawn."""

    rare_act_weight: float = tunable(
        1.5, meaning="by how much pushing, giving, pouring and pointing are rarer than picking and placing"
    )
    near_x_m: tuple[float, float] = tunable(
        (0.50, 0.70), unit="m", meaning="range of x of what is moved and where it goes"
    )
    near_y_m: float = tunable(0.36, unit="m", meaning="greatest y of the same, on the side of the arm")
    gap_m: float = tunable(0.05, unit="m", meaning="least gap between two outlines")
    attempts: int = tunable(600, meaning="arrangements that are tried with the same clutter")
    between_m: float = tunable(0.5, unit="m", meaning="greatest distance of two objects between which a third is put")
    across_m: float = tunable(0.1, unit="m", meaning="how far beyond the middle a place may be on the other arm's side")
    beside_gap_m: float = tunable(
        0.06, unit="m", meaning="gap beside a target into which an object is put: a hand's breadth"
    )
    least_move_m: float = tunable(0.12, unit="m", meaning="least way of an object that is moved")
    push_x_m: tuple[float, float] = tunable(
        (0.40, 0.75), unit="m", meaning="range of x of the hand where a push begins"
    )
    push_y_m: float = tunable(0.42, unit="m", meaning="greatest |y| of the hand where a push begins")
    longest_push_m: float = tunable(0.4, unit="m", meaning="longest way of a push")


@dataclass(frozen=True, slots=True)
class CommandOptions:
    """How the next command for one robot is drawn."""

    around_m: tuple[float, float, float] = tunable(
        (0.05, 0.10, 0.07),
        unit="m",
        meaning="how much nearer, farther and to either side of the work area what is asked for may stand",
    )
    clearances_m: tuple[float, ...] = tunable(
        (0.06, 0.05, 0.04, 0.03), unit="m", meaning="gaps between outlines, tried one after the other"
    )
    least_move_m: float = tunable(0.13, unit="m", meaning="least way that is worth a command")
    tries: int = tunable(300, meaning="places that are tried")
    fallen_m: float = tunable(0.05, unit="m", meaning="depth below the table at which an object counts as gone")
    shares: tuple[float, float, float] = tunable(
        (0.7, 0.2, 0.1), meaning="shares of commands to a place, beside another object, and to pick"
    )


@dataclass(frozen=True, slots=True)
class SequenceOptions:
    """Commands to one robot, one after the other."""

    warm_up_commands: int = tunable(20, meaning="commands before memory is looked at")
    settle_steps: int = tunable(120, meaning="physics steps between a command and its judgement")


@dataclass(frozen=True, slots=True)
class RunOptions:
    """When a single command counts as done."""

    moved_m: float = tunable(0.02, unit="m", meaning="way from which on a bystander counts as moved")
    settle_steps: int = tunable(240, meaning="physics steps between a command and its judgement")
    home_tolerance: float = tunable(
        0.03, unit="rad, or m", meaning="how far joints and base may be from where they began"
    )


@dataclass(frozen=True, slots=True)
class StepOptions:
    """Physics steps that the robot without ROS lets pass."""

    drive_steps: int = tunable(5, meaning="steps between two commands to the base")
    rest_steps: int = tunable(24, meaning="steps before a picture is taken")
    base_still_m_s: float = tunable(1e-3, unit="m/s", meaning="speed below which the base stands")


@dataclass(frozen=True, slots=True)
class StopOptions:
    """When a robot was stopped as it should, and how it is tried."""

    still_s: float = tunable(0.2, unit="s", meaning="time in which the robot must stand still")
    settling_speed: float = tunable(0.1, unit="rad/s, m/s", meaning="speed that may be left then")
    still: float = tunable(0.01, unit="rad, m", meaning="way that may be left then")
    seen_m: float = tunable(0.06, unit="m", meaning="greatest distance of what is seen from where it is")
    later_steps: int = tunable(48, meaning="physics steps in which that way is measured")
    finger_motion_s: float = tunable(0.6, unit="s", meaning="what the fingers take, about")
    tries: int = tunable(3, meaning="commands after a stop until one succeeds; the first should")
    fruitless: int = tunable(
        12, meaning="commands in a row in which the stage that is wanted does not come, after which it is given up"
    )
    stop_share: float = tunable(0.5, meaning="share of the times that a stage is stopped when it comes")


CASES = CaseOptions()
COMMANDS = CommandOptions()
SEQUENCES = SequenceOptions()
RUNS = RunOptions()
STEPS = StepOptions()
STOPS = StopOptions()
