# SPDX-License-Identifier: Apache-2.0
"""Dry friction in the spindles of a gripper, which a force that pushes both fingers to one side has to overcome.

Both motors press with their whole effort on what is held, so neither holds its place; without friction a load along
the opening axis would push the fingers sideways as if they floated. A gear constraint between the fingers takes up to
the friction's force; where it gives way, the place it holds is drawn along (a bristle: Dahl 1968).
"""

from __future__ import annotations

import pybullet

from uncom_sim.exceptions import SimError
from uncom_sim.robot.options import FINGER_FRICTION, FingerFrictionOptions


class FingerFriction:
    """The two fingers of one gripper: joints of a body, by their indices."""

    def __init__(
        self,
        client: int,
        body: int,
        side: str,
        fingers: tuple[int, int],
        *,
        options: FingerFrictionOptions = FINGER_FRICTION,
    ) -> None:
        """Add the gear constraint between the two finger joints of a gripper at their present positions.

        Raises:
            SimError: PyBullet makes no such constraint.
        """
        self._options = options
        self._client = client
        self._gear = pybullet.createConstraint(
            body,
            fingers[0],
            body,
            fingers[1],
            jointType=pybullet.JOINT_GEAR,
            jointAxis=[1, 0, 0],
            parentFramePosition=[0, 0, 0],
            childFramePosition=[0, 0, 0],
            physicsClientId=client,
        )
        if self._gear < 0:
            raise SimError(f"PyBullet could not model the {side} gripper's spindles")
        self._held = 0.0
        self._hold()

    def follow(self, first: float, second: float) -> None:
        """Take the fingers' positions [m]; call once after each physics step."""
        lag = first - second - self._held
        if abs(lag) > self._options.bristle_m:
            self._held += lag - self._options.bristle_m if lag > 0.0 else lag + self._options.bristle_m
            self._hold()

    def _hold(self) -> None:
        pybullet.changeConstraint(
            self._gear,
            gearRatio=-1,
            maxForce=self._options.friction_n,
            erp=self._options.correction,
            relativePositionTarget=self._held,
            physicsClientId=self._client,
        )
