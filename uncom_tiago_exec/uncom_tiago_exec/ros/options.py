# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune how the execution node talks to the robot."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class RobotConnectionOptions:
    """How long the robot's answers are waited for, and when it counts as silent."""

    poll_s: float = tunable(0.02, unit="s", meaning="period at which a waiting thread looks whether to go on")
    silence_s: float = tunable(
        0.2, unit="s", meaning="wall time that silence must last for, in which messages that wait are handled"
    )
    overtime_s: float = tunable(
        5.0, unit="s", meaning="time that a controller, or the base, may take longer than planned before it is stuck"
    )
    acceptance_s: float = tunable(
        1.0, unit="s", meaning="time until a controller has taken a goal and tells how far it is"
    )
    least_motion: float = tunable(1e-5, unit="rad or m", meaning="difference of two joint states that is a motion")
    arrival: float = tunable(
        0.01, unit="rad or m", meaning="distance from the end of its motion at which a joint need not move any more"
    )
    look_s: float = tunable(20.0, unit="s", meaning="time for a picture and its detections")
    odometry_s: float = tunable(1.0, unit="s", meaning="time until the odometry tells something")


ROBOT_CONNECTION = RobotConnectionOptions()
