# SPDX-License-Identifier: Apache-2.0
"""The manipulation primitives: what a command asks the robot to do with an object."""

from __future__ import annotations

from enum import Enum


class Primitive(str, Enum):
    """One primitive; the value is its spelling in JSON, the number of a message is `Command.PRIMITIVE_<name>`."""

    PUT_IN = "put_in"  # into a container or a corner
    PUT_ON = "put_on"  # on top of another object
    PLACE = "place"  # at a place of the table
    STACK = "stack"
    POUR = "pour"
    PUSH = "push"
    PICK = "pick"  # and keep it in the hand
    GIVE = "give"
    POINT = "point"
    NONE = "none"  # no action was named
