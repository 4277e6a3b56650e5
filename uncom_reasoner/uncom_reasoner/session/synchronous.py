# SPDX-License-Identifier: Apache-2.0
"""A session whose detector answers at once: for recordings, tests and tools of one's own."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from uncom_common.exceptions import UncomError
from uncom_perception.types import Scene

from uncom_reasoner.session.events import DecisionDue, Event, Events
from uncom_reasoner.session.session import Session
from uncom_reasoner.session.task import DetectionRequest

Detect: TypeAlias = Callable[[DetectionRequest], Scene]  # may raise an UncomError


def run_tasks(session: Session, detect: Detect) -> Events:
    """Move a session's tasks on until they wait for more images, hands, time or an answer; returns what is to be told.

    Args:
        session: whose clock says whether hands and images were waited for long enough.
        detect: finds the objects that the session asks for; a failure ends the task with its text.
    """
    told: list[Event] = []
    while events := session.advance(detector_ready=True):
        for event in events:
            if isinstance(event, DetectionRequest):
                try:
                    session.take_scene(event, detect(event))
                except UncomError as error:
                    told += session.take_failure(event, str(error))
            elif isinstance(event, DecisionDue):
                told += session.decide(event.task)
            else:
                told.append(event)
    return tuple(told)
