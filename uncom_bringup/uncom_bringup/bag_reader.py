# SPDX-License-Identifier: Apache-2.0
"""Reading bags: ROS 2 in MCAP and SQLite, whole or damaged."""

from __future__ import annotations

import logging
import sqlite3
import struct
import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import apsw
import yaml
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import QosDurability
from rosbags.rosbag1 import ReaderError as Reader1Error
from rosbags.rosbag2 import ReaderError as Reader2Error
from rosbags.typesys import TypesysError

from uncom_bringup.exceptions import BagError
from uncom_bringup.message_types import installed_store

if TYPE_CHECKING:
    from rosbags.interfaces import Connection

_LOG = logging.getLogger(__name__)

# What the readers below let through when a file is damaged.
_DAMAGE = (
    AnyReaderError,
    Reader1Error,
    Reader2Error,
    TypesysError,
    apsw.Error,
    sqlite3.Error,
    struct.error,
    zlib.error,
    AssertionError,
    EOFError,
    IndexError,
    KeyError,
    MemoryError,
    RuntimeError,
    TypeError,
    ValueError,
)
_SUFFIXES = (".mcap", ".db3", ".bag")


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


class BagReader:
    """A bag that is open for reading."""

    def __init__(self, path: Path) -> None:
        """Open a file (.mcap, .db3, .bag) or a folder; a folder without metadata is read file by file, with a warning.

        Raises:
            BagError: nothing is there, or it cannot be read; the text says why.
        """
        self.path = path
        self._reader = AnyReader(_files(path), default_typestore=installed_store())
        try:
            self._reader.open()
        except _DAMAGE as error:
            raise BagError(path, f"cannot be read ({_words(error)})") from error
        if not self._reader.is2:
            self.close()
            raise BagError(path, "is a ROS 1 bag; convert it with `rosbags-convert` to ROS 2 first")
        if self._reader.message_count == 0:
            self.close()
            raise BagError(path, "holds no messages")
        self._topics = {id_: _topic(connection) for id_, connection in self._by_key().items()}

    def _by_key(self) -> dict[tuple[str, str], Connection]:
        return {(connection.topic, connection.msgtype): connection for connection in self._reader.connections}

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
        try:
            return self._reader.deserialize(message.data, message.topic.type_name)
        except _DAMAGE as error:
            raise BagError(self.path, f"a message of {message.topic.name} is damaged ({_words(error)})") from error

    def messages(self, names: Collection[str] | None = None) -> Iterator[BagMessage]:
        """Yield messages in order of time, of all topics or only the named ones.

        A bag that is cut off ends early with a warning.

        Raises:
            BagError: not one message can be read.
        """
        wanted = [c for c in self._reader.connections if names is None or c.topic in names]
        if not wanted:
            return
        count = 0
        try:
            for connection, time_ns, data in self._reader.messages(connections=wanted):
                yield BagMessage(self._topics[connection.topic, connection.msgtype], time_ns, bytes(data))
                count += 1
        except _DAMAGE as error:
            if count == 0:
                raise BagError(self.path, f"is damaged from its first message on ({_words(error)})") from error
            _LOG.warning("bag %s is cut off or damaged after %d messages (%s)", self.path, count, _words(error))
        if count == 0 and names is None:
            raise BagError(self.path, "promises messages and holds none that can be read")

    def close(self) -> None:
        """Close the files."""
        if self._reader.stack is not None:
            self._reader.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close."""
        self.close()


def _files(path: Path) -> list[Path]:
    if not path.exists():
        raise BagError(path, "does not exist")
    if path.is_file():
        if path.suffix not in _SUFFIXES:
            raise BagError(path, f"is no bag; a bag ends in {', '.join(_SUFFIXES)} or is a folder")
        if path.stat().st_size == 0:
            raise BagError(path, "is empty")
        return [path]
    if (path / "metadata.yaml").exists():
        return _listed_files(path)
    files = sorted(file for file in path.iterdir() if file.suffix in (".mcap", ".db3") and file.stat().st_size > 0)
    if not files:
        raise BagError(path, "is a folder without metadata.yaml and without .mcap or .db3 files")
    _LOG.warning("bag %s has no metadata.yaml; reading its %d files as they are", path, len(files))
    return files


def _listed_files(folder: Path) -> list[Path]:
    """Return the files that metadata.yaml lists, or the folder itself where they are compressed as files or messages.

    Opened through its folder, a bag whose metadata and files write the same quality of service differently (as bags
    of Foxy do) has no messages for rosbags; the files themselves know all that is needed.
    """
    try:
        text = (folder / "metadata.yaml").read_text(encoding="utf-8")
        information = yaml.safe_load(text)["rosbag2_bagfile_information"]
        names = [Path(str(name)).name for name in information["relative_file_paths"]]
        compressed = (information.get("compression_mode") or "none").lower() != "none"
    except (yaml.YAMLError, KeyError, TypeError, AttributeError, UnicodeDecodeError) as error:
        raise BagError(folder, "its metadata.yaml is damaged; remove that file to read the data as they are") from error
    missing = [name for name in names if not (folder / name).is_file()]
    if missing or not names:
        raise BagError(
            folder, f"its metadata.yaml lists files that are missing: {', '.join(missing) or '(none listed)'}"
        )
    return [folder] if compressed else [folder / name for name in names]


def _topic(connection: Connection) -> BagTopic:
    profiles = getattr(connection.ext, "offered_qos_profiles", ())
    latched = any(profile.durability is QosDurability.TRANSIENT_LOCAL for profile in profiles)
    return BagTopic(connection.topic, connection.msgtype, latched)


def _words(error: BaseException) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    if "end magic" in text:
        text = "the file is cut off: its end is missing"
    return text if len(text) <= 200 else text[:197] + "..."
