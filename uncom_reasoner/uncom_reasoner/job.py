# SPDX-License-Identifier: Apache-2.0
"""One command on its way through the reasoner, and when it has what it needs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from uncom_language.types import Command, Span


class Stage(Enum):
    """Where a command is."""

    WAITING = "waiting"  # for hands and images up to the end of its words
    DETECTING = "detecting"
    DECIDING = "deciding"


@dataclass
class Job:
    """A command being grounded; wall times are of a steady clock [s]."""

    command: Command
    received_s: float
    received_wall_s: float
    stage: Stage = Stage.WAITING
    asked_wall_s: float = 0.0
    scene_s: float = 0.0
    with_hand: bool = False
    phrases: tuple[str, ...] = ()


def words_span(command: Command) -> Span:
    """Return the time from the first to the last word of a command's parts."""
    spans = [r.span for r in (command.object, command.target, command.reference2) if r is not None]
    if command.action_span is not None:
        spans.append(command.action_span)
    if not spans:
        return Span(0.0, 0.0)
    return Span(min(s.start_s for s in spans), max(s.end_s for s in spans))


def object_end(command: Command) -> float:
    """Return when the object was spoken of: the object frame (paper, section III-D)."""
    return command.object.span.end_s if command.object is not None else words_span(command).end_s


def target_end(command: Command) -> float:
    """Return when the target was spoken of: the target frame (paper, section III-D)."""
    return command.target.span.end_s if command.target is not None else words_span(command).end_s


def hands_complete(job: Job, latest_hands_s: float, now_s: float, wall_s: float, late_s: float, limit_s: float) -> bool:
    """Whether to wait no more: hands up to the end of the words (and a while), or the limit has passed.

    The limit counts on the clock of the stamps, and (three times as long) on the wall, should that clock stand still.
    """
    needed = words_span(job.command).end_s + late_s
    if latest_hands_s >= needed:
        return True
    return now_s >= max(needed, job.received_s) + limit_s or wall_s >= job.received_wall_s + 3.0 * limit_s
