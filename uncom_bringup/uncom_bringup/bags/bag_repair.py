# SPDX-License-Identifier: Apache-2.0
"""Saves what can be read of a bag that was cut off: its whole records go into a new file.

MCAP: https://mcap.dev/spec (a file is a row of records; what is written last, the index, can be done without).
"""

from __future__ import annotations

import io
import logging
import shutil
import sqlite3
import struct
from contextlib import closing
from enum import IntEnum
from pathlib import Path
from typing import BinaryIO

from uncom_bringup.bags.options import BAG_FILE, BagFileOptions

_LOG = logging.getLogger(__name__)
_MAGIC = b"\x89MCAP0\r\n"
_RECORD_HEAD = struct.Struct("<BQ")  # code and size of the content
_SQLITE_HEADER_BYTES = 100


class _Opcode(IntEnum):
    """Kinds of records that a repaired file has; MCAP specification, section "Records"."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    DATA_END = 0x0F


_COPIED = (_Opcode.SCHEMA, _Opcode.CHANNEL, _Opcode.MESSAGE, _Opcode.CHUNK)


def repair_mcap(source: Path, target: Path) -> int:
    """Copy the whole records of a damaged MCAP file into a new one without index; returns how many hold messages.

    A file whose profile is not that of ROS 2 gets it: whether its messages are of ROS shows when they are read.
    """
    count = 0
    with source.open("rb") as old, target.open("wb") as new:
        if old.read(len(_MAGIC)) != _MAGIC:
            return 0
        new.write(_MAGIC)
        new.write(_record(_Opcode.HEADER, _text("ros2") + _text("uncom")))
        while (found := _next(old)) is not None:
            code, content = found
            if code == _Opcode.DATA_END:
                break
            if code in _COPIED:
                new.write(_record(code, content))
                count += code in (_Opcode.MESSAGE, _Opcode.CHUNK)
        new.write(_record(_Opcode.DATA_END, struct.pack("<I", 0)))
        new.write(_record(_Opcode.FOOTER, struct.pack("<QQI", 0, 0, 0)))
        new.write(_MAGIC)
    return count


def _next(stream: BinaryIO) -> tuple[int, bytes] | None:
    """Read a record; None at the end and where only a part of one is left."""
    head = stream.read(_RECORD_HEAD.size)
    if len(head) < _RECORD_HEAD.size:
        return None
    code, size = _RECORD_HEAD.unpack(head)
    here = stream.tell()
    if size > stream.seek(0, io.SEEK_END) - here:
        return None
    stream.seek(here)
    return code, stream.read(size)


def _record(code: int, content: bytes) -> bytes:
    return _RECORD_HEAD.pack(code, len(content)) + content


def _text(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def repair_sqlite(source: Path, target: Path, options: BagFileOptions = BAG_FILE) -> int:
    """Copy the rows of a damaged database that can be read into a new one; returns how many messages.

    SQLite reads nothing of a file that is shorter than its header says (https://sqlite.org/fileformat.html), so that
    what is missing is made up by zeros first.
    """
    padded = target.with_name(f"padded-{target.name}")
    shutil.copyfile(source, padded)
    with padded.open("r+b") as file:
        head = file.read(_SQLITE_HEADER_BYTES)
        if len(head) == _SQLITE_HEADER_BYTES and head.startswith(b"SQLite format 3"):
            (page_size,), (pages,) = struct.unpack(">H", head[16:18]), struct.unpack(">I", head[28:32])
            size = pages * (65536 if page_size == 1 else page_size)
            if padded.stat().st_size < size <= options.max_growth * padded.stat().st_size:
                file.truncate(size)
    with closing(sqlite3.connect(padded)) as old, closing(sqlite3.connect(target)) as new:
        count = _copy_rows(old, new)
    padded.unlink()
    return count


def _copy_rows(old: sqlite3.Connection, new: sqlite3.Connection) -> int:
    count = 0
    tables = old.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table' AND sql NOT NULL").fetchall()
    for name, sql in tables:
        if name.startswith("sqlite_"):
            continue
        new.execute(sql)
        try:
            for row in old.execute(f'SELECT * FROM "{name}"'):  # noqa: S608  (names from the file itself)
                new.execute(f'INSERT INTO "{name}" VALUES ({", ".join("?" * len(row))})', row)  # noqa: S608
                count += name == "messages"
        except sqlite3.DatabaseError as error:
            _LOG.debug("table %s is damaged: %s", name, error)
    new.commit()
    return count
