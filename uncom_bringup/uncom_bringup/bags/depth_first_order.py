# SPDX-License-Identifier: Apache-2.0
"""Order of a bag's messages in which no picture waits for its depth."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace

from uncom_perception.frames import read_stamp_ns

from uncom_bringup.bags.bag_reader import BagMessage


def with_depth_first(
    messages: Iterable[BagMessage], pictures: Collection[str], depths: Collection[str], later_ns: int
) -> Iterator[BagMessage]:
    """Yield messages in order, but each picture's depth right before it, at the picture's time.

    A camera's driver sends a picture and its depth one after the other. Who examines a picture when it comes would
    wait for a depth of which only a clock could tell that it does not come.

    Args:
        messages: of a bag, in order of time.
        pictures: names of topics of pictures; the type begins with a header.
        depths: names of topics of depth images; one of the same stamp belongs to a picture.
        later_ns: so much later than its picture a depth may have been recorded [ns].
    """
    pairs = _Pairs(pictures, depths, later_ns)
    for message in messages:
        pairs.waiting.append(message)
        yield from pairs.ready(last=False)
    yield from pairs.ready(last=True)


class _Pairs:
    """What waits behind a picture whose depth may still come; that picture is the first of them."""

    def __init__(self, pictures: Collection[str], depths: Collection[str], later_ns: int) -> None:
        self.waiting: deque[BagMessage] = deque()
        self._pictures, self._depths, self._later_ns = pictures, depths, later_ns
        self._gone: set[int] = set()  # stamps of depths that were yielded

    def ready(self, *, last: bool) -> Iterator[BagMessage]:
        """Yield what need not wait; all of it if nothing comes any more."""
        while self.waiting:
            first = self.waiting[0]
            if first.topic.name in self._pictures and self._depths and read_stamp_ns(first.data) not in self._gone:
                depth = self._depth_of(first)
                if depth is not None:
                    self.waiting.remove(depth)
                    yield self._leaves(replace(depth, time_ns=first.time_ns))
                elif not last and self.waiting[-1].time_ns <= first.time_ns + self._later_ns:
                    return
            yield self._leaves(self.waiting.popleft())

    def _leaves(self, message: BagMessage) -> BagMessage:
        if message.topic.name in self._depths:
            self._gone.add(read_stamp_ns(message.data))
        return message

    def _depth_of(self, picture: BagMessage) -> BagMessage | None:
        stamp = read_stamp_ns(picture.data)
        of_depth = (message for message in self.waiting if message.topic.name in self._depths)
        return next((message for message in of_depth if read_stamp_ns(message.data) == stamp), None)
