# SPDX-License-Identifier: Apache-2.0
"""Writing bags (rosbag2 format) with their message definitions inside."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer, WriterError

from uncom_bringup.bags.message_types import register
from uncom_bringup.exceptions import BadInputError, OutputExistsError

if TYPE_CHECKING:
    from rosbags.interfaces import Connection

_FOREVER = QosTime(2147483647, 4294967295)


def _qos(latched: bool) -> Qos:
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=10,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        deadline=_FOREVER,
        lifespan=_FOREVER,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=_FOREVER,
        avoid_ros_namespace_conventions=False,
    )


class BagWriter:
    """Writes one bag: a single .mcap file (chunks compressed with zstd), or a rosbag2 folder with SQLite.

    What is written lies in a hidden folder beside the bag until `close`, so that a bag that is there is whole.
    """

    def __init__(self, path: Path, storage: str = "mcap", force: bool = False) -> None:
        """Open.

        Raises:
            OutputExistsError: something is there already and `force` is not given.
            BadInputError: an MCAP path does not end in .mcap, or the folder cannot be written.
        """
        if storage == "mcap" and path.suffix != ".mcap":
            raise BadInputError(f"{path}: an MCAP bag is one file; give a name that ends in .mcap")
        if path.exists() and not force:
            raise OutputExistsError(path)
        self.path = path
        self._mcap = storage == "mcap"
        self._partial = path.with_name(f".{path.stem}.partial")
        shutil.rmtree(self._partial, ignore_errors=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        plugin = StoragePlugin.MCAP if self._mcap else StoragePlugin.SQLITE3
        self._writer = Writer(self._partial, version=8, storage_plugin=plugin)
        if self._mcap:
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        try:
            self._writer.open()
        except WriterError as error:
            raise BadInputError(f"{path}: {error}") from error
        self._connections: dict[str, Connection] = {}
        self._closed = False
        self.count = 0

    def add_topic(self, name: str, type_name: str, latched: bool = False) -> None:
        """Announce a topic before its first message; a second time does nothing.

        Raises:
            UnknownTypeError: the type is not installed.
        """
        if name not in self._connections:
            store = register(type_name)
            self._connections[name] = self._writer.add_connection(
                name, type_name, typestore=store, offered_qos_profiles=(_qos(latched),)
            )

    def write(self, topic: str, time_ns: int, data: bytes) -> None:
        """Write one serialised (CDR) message of an announced topic."""
        self._writer.write(self._connections[topic], time_ns, data)
        self.count += 1

    def close(self) -> Path:
        """Finish the bag and put it in its place; returns its path."""
        if self._closed:
            return self.path
        self._closed = True
        self._writer.close()
        if self.path.is_dir():
            shutil.rmtree(self.path)
        if self._mcap:
            next(self._partial.glob("*.mcap")).replace(self.path)
            shutil.rmtree(self._partial)
        else:
            if self.path.exists():
                self.path.unlink()
            self._partial.rename(self.path)
        return self.path

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish; of a bag that failed before its first message nothing is left."""
        if error is not None and self.count == 0:
            self._discard()
        else:
            self.close()

    def _discard(self) -> None:
        if not self._closed:
            self._closed = True
            self._writer.close()
            shutil.rmtree(self._partial, ignore_errors=True)
