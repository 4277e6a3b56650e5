# SPDX-License-Identifier: Apache-2.0
"""`uncom replay`: a bag into the live graph."""

from __future__ import annotations

import sys
import time
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import rclpy
from rclpy.executors import ExternalShutdownException

from uncom_bringup import output
from uncom_bringup.bags.bag_reader import BagReader, BagTopic
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.replay.keyboard import Keyboard
from uncom_bringup.replay.playback_clock import Playback, Played, prefetch
from uncom_bringup.replay.player_node import PlayerNode, PreparedMessage, chosen_topics
from uncom_bringup.ros.options import REPLAY_SESSION

_KEYS = "space: pause, s or right: one message, up and down: faster and slower, q: stop"


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """What to replay and how; start_s and duration_s are of the bag's time."""

    rate: float = 1.0
    loop: bool = False
    start_s: float = 0.0
    duration_s: float | None = None
    topics: Collection[str] = ()
    remap: Mapping[str, str] = field(default_factory=dict)
    clock: bool = False


class _ProgressBar:
    """A line on the terminal that tells how far the replay is; silent where there is no terminal."""

    def __init__(self, start_ns: int, length_s: float) -> None:
        self._start_ns, self._length_s = start_ns, max(length_s, 1e-9)
        self._terminal = sys.stderr.isatty()
        self._shown_s = 0.0

    def show(self, now_ns: int, state: str) -> None:
        if not self._terminal or time.monotonic() - self._shown_s < REPLAY_SESSION.bar_period_s:
            return
        self._shown_s = time.monotonic()
        done_s = min(max(0.0, 1e-9 * (now_ns - self._start_ns)), self._length_s)
        filled = round(REPLAY_SESSION.bar_chars * done_s / self._length_s)
        bar = "=" * filled + "-" * (REPLAY_SESSION.bar_chars - filled)
        sys.stderr.write(f"\r[{bar}] {done_s:6.1f} / {self._length_s:.1f} s  {state:<10}")
        sys.stderr.flush()

    def close(self) -> None:
        if self._terminal and self._shown_s:
            sys.stderr.write("\r" + " " * 70 + "\r")


def replay(path: Path, options: ReplayOptions) -> int:
    """Replay a bag; the body of the command. Returns the exit status.

    Raises:
        BagError: the bag cannot be read.
        BadInputError: it lacks what is asked for.
    """
    with BagReader(path) as bag:
        if options.start_s > bag.duration_s:
            raise BadInputError(
                f"--start {options.start_s:g} is after the bag's end; it is {bag.duration_s:.1f} s long"
            )
        chosen = chosen_topics(bag, options.topics)
        rclpy.init()
        try:
            node = PlayerNode(chosen, options.clock, options.remap)
            try:
                _play(bag, node, chosen, options)
            finally:
                node.destroy_node()
        except (KeyboardInterrupt, ExternalShutdownException):
            output.note("stopped")
        finally:
            rclpy.try_shutdown()
    return 0


def _play(bag: BagReader, node: PlayerNode, chosen: Collection[BagTopic], options: ReplayOptions) -> None:
    names = node.published_topics
    if not names:
        raise BadInputError(f"none of the bag's message types is installed here: {bag.path}")
    length_s = bag.duration_s - options.start_s
    if options.duration_s is not None:
        length_s = min(length_s, options.duration_s)
    with Keyboard() as keyboard:
        keys = f"; {_KEYS}" if keyboard.present else ""
        output.note(f"replaying {length_s:.1f} s, {len(names)} topics, at rate {options.rate:g}{keys}")
        time.sleep(REPLAY_SESSION.discovery_s)  # what is published before the listeners are found is lost to them
        start_ns = bag.start_ns + int(1e9 * options.start_s)
        while True:
            bar = _ProgressBar(start_ns, length_s)
            playback: Playback[PreparedMessage] = Playback(node.send, node.tell_time, keyboard.key, bar.show)
            latched = [topic.name for topic in chosen if topic.latched and topic.name in names]
            if options.start_s > 0.0 and latched:
                for message in bag.messages(latched, duration_s=options.start_s):
                    node.publish(message)  # what a late listener would have heard
            played = playback.play(prefetch(_prepared(bag, node, names, options)), start_ns, options.rate)
            bar.close()
            output.note(_summary(played))
            if not options.loop or not played.ended or not played.count:
                return


def _prepared(
    bag: BagReader, node: PlayerNode, names: Collection[str], options: ReplayOptions
) -> Iterator[PreparedMessage]:
    for message in bag.messages(names, options.start_s, options.duration_s):
        yield node.prepare(message)


def _summary(played: Played) -> str:
    late = f"half of them at most {1000 * played.median_late_s:.1f} ms late, 95 % {1000 * played.late_s:.1f} ms"
    return f"{played.count} messages replayed" + (f"; {late}" if played.count else "")
