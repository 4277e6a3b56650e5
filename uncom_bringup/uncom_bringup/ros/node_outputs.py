# SPDX-License-Identifier: Apache-2.0
"""What the nodes have published in answer to a bag, and what is missing; written and awaited by two threads."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable

from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.run_record import Event


class NodeOutputs:
    """Hands, transcripts, commands and decisions so far.

    hands_s: stamp of the newest hands [s]; transcripts: id and text of utterances that nobody has waited for yet;
    speech_changed: whether speech_node has said anything new since this was last set to False.
    """

    def __init__(self, check: Callable[[], None]) -> None:
        """Nothing is published yet; `check` raises GraphError when a node has died and is called while waiting."""
        self.hands_s = float("-inf")
        self.transcripts: list[tuple[str, str]] = []
        self.speech_changed = False
        self._check = check
        self._changed = threading.Condition()
        self._answered: Counter[str] = Counter()
        self._announced: dict[str, int] = {}
        self._undecided: dict[tuple[str, int], str] = {}

    def add(self, event: Event) -> None:
        """Take note of an event and wake who waits."""
        data = event.data
        with self._changed:
            if event.kind == run_record.HANDS:
                self.hands_s = event.stamp_s
            elif event.kind == run_record.SPEECH_STATUS:
                self.speech_changed = True
            elif event.kind == run_record.TRANSCRIPT:
                self.transcripts.append((str(data["utterance_id"]), str(data["text"])))
            elif event.kind == run_record.COMMAND:
                self._answered[str(data["utterance_id"])] += 1
                self._announced[str(data["utterance_id"])] = max(1, int(data["count"]))
                self._undecided[str(data["utterance_id"]), int(data["index"])] = str(data["text"])
            elif event.kind == run_record.GROUNDED:
                self._undecided.pop((str(data["utterance_id"]), int(data["index"])), None)
            self._changed.notify_all()

    def wait(self, condition: Callable[[], bool], limit_s: float) -> bool:
        """Wait until a condition on these outputs holds; False if it does not within limit_s of wall time."""
        deadline = time.monotonic() + limit_s
        with self._changed:
            while not condition():
                left_s = deadline - time.monotonic()
                if left_s <= 0.0:
                    return False
                self._changed.wait(min(0.5, left_s))
                self._check()
        return True

    def is_answered(self, utterance: str) -> bool:
        """Tell whether language_node has published all commands that it announced for an utterance."""
        return self._answered[utterance] >= self._announced.get(utterance, 1)

    def undecided(self) -> list[str]:
        """Return the texts of the commands that the reasoner has not decided on."""
        with self._changed:
            return list(self._undecided.values())
