# SPDX-License-Identifier: Apache-2.0
"""Reading bags: ROS 2 in MCAP and SQLite, ROS 1; whole, split, compressed or damaged."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import apsw
from backports import zstd
from rosbags.convert.converter import STATIC_MSGTYPE_RENAMES, is_same_wireformat, migrate_bytes
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import ConnectionExtRosbag1, MessageDefinitionFormat, QosDurability
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

from uncom_bringup.bags.bag_files import DAMAGE, BagFiles, bag_files, words
from uncom_bringup.bags.message_types import installed_store, register
from uncom_bringup.exceptions import BagError, UnknownTypeError

if TYPE_CHECKING:
    from rosbags.interfaces import Connection, MessageDefinition
    from rosbags.interfaces.typing import Typesdict

_LOG = logging.getLogger(__name__)
_DAMAGE = (*DAMAGE, AnyReaderError, TypesysError, apsw.Error)
_IDL = "=" * 80 + "\n"


@dataclass(frozen=True, slots=True)
class BagTopic:
    """One topic of a bag."""

    name: str
    type_name: str
    latched: bool


@dataclass(frozen=True, slots=True)
class BagMessage:
    """One message: time as recorded [ns] and its serialised (CDR) bytes."""

    topic: BagTopic
    time_ns: int
    data: bytes


class _Reader(AnyReader):
    """Takes the definitions in a bag one by one: one that cannot be read costs its topics and nothing else."""

    def _open(self) -> None:
        assert self.stack is not None  # noqa: S101  (made by the caller)
        for reader in self.readers:
            self.stack.enter_context(reader)
        self.connections = [connection for reader in self.readers for connection in reader.connections]
        found: Typesdict = {}
        for connection in self.connections:
            try:
                found.update(_definitions(connection.msgdef, connection.msgtype))
            except (TypesysError, AssertionError, ValueError) as error:
                _LOG.warning("%s: its definition of %s cannot be read", connection.topic, connection.msgtype)
                _LOG.debug("%s", error)
        base = installed_store() if self.is2 else get_typestore(Stores.ROS1_NOETIC)
        self.typestore = get_typestore(Stores.EMPTY)
        self.typestore.register({**base.fielddefs, **found})


def _definitions(definition: MessageDefinition, name: str) -> Typesdict:
    if definition.format == MessageDefinitionFormat.MSG:
        return get_types_from_msg(definition.data, name)
    if definition.format != MessageDefinitionFormat.IDL:
        return {}
    if not definition.data.startswith(f"{_IDL}IDL: "):
        return get_types_from_idl(definition.data)
    found: Typesdict = {}
    for part in definition.data.split(_IDL)[1:]:
        found.update(get_types_from_idl(part.split("\n", 1)[1]))
    return found


class BagReader:
    """A bag that is open for reading."""

    def __init__(self, path: Path) -> None:
        """Open a file (.mcap, .db3, .bag) or a folder; what is damaged is read as far as it goes, with a warning.

        Raises:
            BagError: nothing is there, or it cannot be read; the text says why.
        """
        self.path = path
        self._stack = ExitStack()
        self._converters: dict[str, Callable[[bytes], Any] | None] = {}
        try:
            self._files = bag_files(path, self._stack)
            self._reader = self._opened(self._files)
        except BaseException:
            self._stack.close()
            raise
        self._topics = {(c.topic, c.msgtype): _topic(c) for c in self._reader.connections}

    def _opened(self, files: BagFiles) -> AnyReader:
        reader = _Reader(files.paths)
        try:
            self._stack.enter_context(reader)
        except _DAMAGE as error:
            raise BagError(self.path, f"cannot be read ({words(error)})") from error
        if reader.message_count == 0:
            raise BagError(self.path, "holds no messages")
        return reader

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """The topics, by name."""
        return tuple(sorted(self._topics.values(), key=lambda topic: topic.name))

    @property
    def start_ns(self) -> int:
        """Time of the first message [ns]."""
        return int(self._reader.start_time)

    @property
    def duration_s(self) -> float:
        """From the first message to the last [s]."""
        return float(max(0.0, 1e-9 * (self._reader.end_time - self._reader.start_time)))

    def deserialise(self, message: BagMessage) -> Any:
        """Read a message's fields by the definition in the bag (no ROS needed).

        Raises:
            BagError: the bytes do not fit the definition.
        """
        store = installed_store() if self._files.is_ros1 else self._reader.typestore
        try:
            return store.deserialize_cdr(message.data, message.topic.type_name)
        except _DAMAGE as error:
            raise BagError(self.path, f"a message of {message.topic.name} is damaged ({words(error)})") from error

    def messages(
        self, names: Collection[str] | None = None, start_s: float = 0.0, duration_s: float | None = None
    ) -> Iterator[BagMessage]:
        """Yield messages in order of time, of all topics or only the named ones.

        start_s and duration_s count from the bag's first message. A bag that is cut off ends early with a warning; what
        came with ROS 1 and does not exist in ROS 2 is left out.

        Raises:
            BagError: not one message can be read.
        """
        wanted = [c for c in self._reader.connections if names is None or c.topic in names]
        if not wanted:
            return
        begin = self.start_ns + int(1e9 * start_s)
        end = None if duration_s is None else begin + int(1e9 * duration_s)
        count = 0
        try:
            for connection, time_ns, data in self._reader.messages(wanted, begin, end):
                plain = self._plain(connection, data)
                count += 1
                if plain is not None:
                    yield BagMessage(self._topics[connection.topic, connection.msgtype], time_ns, plain)
        except _DAMAGE as error:
            if count == 0:
                raise BagError(self.path, f"is damaged from its first message on ({words(error)})") from error
            _LOG.warning("bag %s is cut off or damaged after %d messages (%s)", self.path, count, words(error))
        if count == 0 and names is None and start_s == 0.0:
            raise BagError(self.path, "promises messages and holds none that can be read")

    def _plain(self, connection: Connection, data: bytes) -> bytes | None:
        if self._files.packed:
            return zstd.decompress(data)
        if not self._files.is_ros1:
            return bytes(data)
        name = connection.msgtype
        if name not in self._converters:
            self._converters[name] = self._converter(name, _ros2_name(name))
        convert = self._converters[name]
        return bytes(convert(data)) if convert is not None else None

    def _converter(self, old: str, new: str) -> Callable[[bytes], Any] | None:
        """Return what turns a message of ROS 1 into one of ROS 2, or None if there is no such message."""
        try:
            target = register(new)
        except UnknownTypeError as error:
            _LOG.warning("bag %s: topics of %s are left out: %s", self.path, old, error)
            return None
        source = self._reader.typestore
        if is_same_wireformat(source, target, old, new):
            return partial(target.ros1_to_cdr, typename=new)

        def migrate(data: bytes) -> Any:
            return migrate_bytes(source, target, old, new, {}, data, src_is2=False, dst_is2=True)

        return migrate

    def close(self) -> None:
        """Close the files."""
        self._stack.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close."""
        self.close()


def _ros2_name(name: str) -> str:
    return str(STATIC_MSGTYPE_RENAMES.get(name, name))


def _topic(connection: Connection) -> BagTopic:
    if isinstance(connection.ext, ConnectionExtRosbag1):
        return BagTopic(connection.topic, _ros2_name(connection.msgtype), bool(connection.ext.latching))
    latched = any(p.durability is QosDurability.TRANSIENT_LOCAL for p in connection.ext.offered_qos_profiles)
    return BagTopic(connection.topic, connection.msgtype, latched)
