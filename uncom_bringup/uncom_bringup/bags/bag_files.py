# SPDX-License-Identifier: Apache-2.0
"""Which files a bag is made of, as files that can be read: found, decompressed, repaired where they are cut off."""

from __future__ import annotations

import logging
import shutil
import sqlite3
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import yaml
from backports import zstd
from rosbags.rosbag1 import ReaderError as Reader1Error
from rosbags.rosbag2 import Reader, ReaderError

from uncom_bringup.bags.bag_repair import repair_mcap, repair_sqlite
from uncom_bringup.bags.options import BAG_FILE, BagFileOptions
from uncom_bringup.exceptions import BagError

_LOG = logging.getLogger(__name__)

ROS2, ROS1, ZSTD = (".mcap", ".db3"), ".bag", ".zstd"
_SUFFIXES = (*ROS2, ROS1, *(suffix + ZSTD for suffix in ROS2))
# What reading a damaged file can end in.
DAMAGE = (
    Reader1Error,
    ReaderError,
    sqlite3.Error,
    zstd.ZstdError,
    AssertionError,
    EOFError,
    IndexError,
    KeyError,
    MemoryError,
    RuntimeError,
    TypeError,
    ValueError,
)


@dataclass(frozen=True, slots=True)
class BagFiles:
    """Files of one bag, in order of time; with `packed`, each message in them is compressed by itself (zstd)."""

    paths: tuple[Path, ...]
    packed: bool = False

    @property
    def is_ros1(self) -> bool:
        """Whether they are a bag of ROS 1."""
        return self.paths[0].suffix == ROS1


def bag_files(path: Path, stack: ExitStack) -> BagFiles:
    """Find the files of a bag; what has to be written anew lies in a folder that `stack` removes.

    Raises:
        BagError: nothing is there, or it cannot be read; the text says why.
    """
    listed, packed = _listed(path)
    ready: list[Path] = []
    for file in listed:
        if file.stat().st_size == 0:
            if len(listed) == 1:
                raise BagError(path, "is empty")
            _LOG.warning("bag %s: %s is empty and left out", path, file.name)
            continue
        plain = _unpacked(path, file, stack) if file.suffix == ZSTD else file
        ready.append(plain if plain.suffix == ROS1 else _whole(path, plain, stack))
    if not ready:
        raise BagError(path, "holds empty files only")
    return BagFiles(tuple(ready), packed)


def _listed(path: Path) -> tuple[list[Path], bool]:
    if not path.exists():
        raise BagError(path, "does not exist")
    if path.is_file():
        if not path.name.endswith(_SUFFIXES):
            raise BagError(path, f"is no bag; a bag ends in {', '.join(_SUFFIXES[:3])} or is a folder")
        return [path], False
    if (path / "metadata.yaml").exists():
        return _in_metadata(path)
    # Split bags number their files: take 10 after 9.
    files = sorted(
        (file for file in path.iterdir() if file.name.endswith(_SUFFIXES) and not file.name.endswith(ROS1)),
        key=lambda file: (len(file.name), file.name),
    )
    if not files:
        raise BagError(path, "is a folder without metadata.yaml and without .mcap or .db3 files")
    _LOG.warning("bag %s has no metadata.yaml; reading its %d files as they are", path, len(files))
    return files, False


def _in_metadata(folder: Path) -> tuple[list[Path], bool]:
    """Return the files that metadata.yaml lists, and whether their messages are compressed one by one.

    Its other contents are in the files, too, and where the two differ (as in bags of Foxy), the files are right.
    """
    try:
        text = (folder / "metadata.yaml").read_text(encoding="utf-8")
        information = yaml.safe_load(text)["rosbag2_bagfile_information"]
        names = [Path(str(name)).name for name in information["relative_file_paths"]]
        packed = (information.get("compression_mode") or "none").lower() == "message"
    except (yaml.YAMLError, KeyError, TypeError, AttributeError, UnicodeDecodeError) as error:
        raise BagError(folder, "its metadata.yaml is damaged; remove that file to read the data as they are") from error
    missing = [name for name in names if not (folder / name).is_file()]
    if missing or not names:
        raise BagError(
            folder, f"its metadata.yaml lists files that are missing: {', '.join(missing) or '(none listed)'}"
        )
    return [folder / name for name in names], packed


def _unpacked(bag: Path, file: Path, stack: ExitStack) -> Path:
    target = _scratch(stack) / file.stem
    try:
        with zstd.open(file, "rb") as packed, target.open("wb") as plain:
            shutil.copyfileobj(packed, plain)
    except (zstd.ZstdError, EOFError) as error:
        if target.stat().st_size == 0:
            raise BagError(bag, f"{file.name} cannot be decompressed ({words(error)})") from error
        _LOG.warning("bag %s: %s is cut off (%s)", bag, file.name, words(error))
    return target


def _whole(bag: Path, file: Path, stack: ExitStack) -> Path:
    """Return the file if it opens, or what can be saved of it in a new one."""
    try:
        with Reader(file):
            return file
    except DAMAGE as error:
        why = words(error)
    target = _scratch(stack) / file.name
    repair = repair_mcap if file.suffix == ".mcap" else repair_sqlite
    try:
        saved = repair(file, target)
        if saved:
            with Reader(target) as reader:
                count = reader.message_count
            if count:
                _LOG.warning("bag %s: %s is damaged (%s); saved %d messages of it", bag, file.name, why, count)
                return target
    except DAMAGE as error:
        _LOG.debug("repair of %s failed: %s", file, error)
    raise BagError(bag, f"cannot be read ({why})")


def _scratch(stack: ExitStack) -> Path:
    return Path(stack.enter_context(TemporaryDirectory(prefix="uncom-bag-")))


def words(error: BaseException, options: BagFileOptions = BAG_FILE) -> str:
    """Write an error of a reader as one line."""
    text = " ".join(str(error).split()) or type(error).__name__
    if "end magic" in text:
        text = "the file is cut off: its end is missing"
    most = options.max_error_chars
    return text if len(text) <= most else text[: most - 3] + "..."
