# SPDX-License-Identifier: Apache-2.0
"""What changed between two runs: words, parts of commands, candidates, probabilities, choice."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from difflib import SequenceMatcher
from itertools import zip_longest
from pathlib import Path
from typing import Any

from uncom_bringup.exceptions import BadInputError
from uncom_bringup.report.options import COMPARISON
from uncom_bringup.report.reproducible_result import COMMANDS_FILE

_COMMAND_PARTS = ("act", "text", "object", "action", "target", "relation", "reason")


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What counts as the same."""

    probability: float = 0.001
    place_m: float = 0.001
    time_s: float = 0.001


@dataclass(frozen=True, slots=True)
class Difference:
    """One object that changed: of what sort, where, and from what to what."""

    kind: str  # words, times, command, decision, choice, candidates, probability
    where: str
    before: Any
    after: Any

    def in_words(self) -> str:
        """Return one line."""
        return f"{self.kind:<12} {self.where}: {_text(self.before)} -> {_text(self.after)}"

    def to_json(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return asdict(self)


def load_answer(path: Path) -> dict[str, Any]:
    """Read the answer of a run: a folder that demo or understand left, its command.json, or an answer by itself.

    Raises:
        BadInputError: there is none.
    """
    file = path / COMMANDS_FILE if path.is_dir() else path
    if not file.is_file():
        raise BadInputError(f"{file} does not exist; give a folder that `uncom understand` or `uncom demo` left")
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise BadInputError(f"{file} is not JSON ({error})") from error
    found = content.get("answer", content) if isinstance(content, dict) else None
    if not isinstance(found, dict) or not isinstance(found.get("commands"), list) or "utterances" not in found:
        raise BadInputError(f"{file} holds no answer of a run")
    return found


def compare(
    before: Mapping[str, Any], after: Mapping[str, Any], tolerance: Tolerance | None = None
) -> list[Difference]:
    """Return what changed between two answers, in the order of the chain."""
    tolerance = tolerance or Tolerance()
    return [*_heard(before, after, tolerance), *_commands(before, after, tolerance)]


def _heard(before: Mapping[str, Any], after: Mapping[str, Any], tolerance: Tolerance) -> Iterator[Difference]:
    pairs = zip_longest(before["utterances"], after["utterances"])
    for number, (old, new) in enumerate(pairs, start=1):
        where = f"utterance {number}"
        if old is None or new is None:
            yield Difference("words", where, old and old["text"], new and new["text"])
        elif old["text"] != new["text"]:
            yield Difference("words", where, old["text"], new["text"])
            yield from _changed_words(where, old["text"].split(), new["text"].split())
        else:
            yield from _times(where, old["words"], new["words"], tolerance)


def _changed_words(where: str, old: Sequence[str], new: Sequence[str]) -> Iterator[Difference]:
    for change, a, b, c, d in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if change != "equal":
            yield Difference("words", f"{where}, word {a + 1}", " ".join(old[a:b]) or None, " ".join(new[c:d]) or None)


def _times(
    where: str, old: Sequence[Mapping[str, Any]], new: Sequence[Mapping[str, Any]], tolerance: Tolerance
) -> Iterator[Difference]:
    """Compare the times of the same words, from the first word on: two recordings need not begin at the same time."""
    for was, now in zip(old, new, strict=False):
        for end in ("start", "end"):
            a, b = was[end] - old[0]["start"], now[end] - new[0]["start"]
            if abs(a - b) > tolerance.time_s + 1e-9:
                yield Difference("times", f'{where}, {end} of "{was["text"]}"', round(a, 3), round(b, 3))


def _commands(before: Mapping[str, Any], after: Mapping[str, Any], tolerance: Tolerance) -> Iterator[Difference]:
    for number, (old, new) in enumerate(zip_longest(before["commands"], after["commands"]), start=1):
        where = f"command {number}"
        if old is None or new is None:
            yield Difference("command", where, old and old["text"], new and new["text"])
            continue
        for part in _COMMAND_PARTS:
            if old.get(part) != new.get(part):
                yield Difference("command", f"{where}, {part}", old.get(part), new.get(part))
        decisions = zip_longest(old["decisions"], new["decisions"])
        for place, (was, now) in enumerate(decisions, start=1):
            here = where if len(old["decisions"]) <= 1 else f"{where}, part {place}"
            if was is None or now is None:
                yield Difference("decision", here, was and was["status"], now and now["status"])
            else:
                yield from _decision(here, was, now, tolerance)


def _decision(where: str, old: Mapping[str, Any], new: Mapping[str, Any], tolerance: Tolerance) -> Iterator[Difference]:
    for part in ("status", "reason"):
        if old[part] != new[part]:
            yield Difference("decision", f"{where}, {part}", old[part], new[part])
    for part in ("object", "target", "area"):
        was, now = old["chosen"][part], new["chosen"][part]
        if (was is None) != (now is None) or (was is not None and _far(was, now, tolerance.place_m)):
            yield Difference("choice", f"{where}, {part}", was, now)
    for part in ("object", "target"):
        name = f"{part}_probability"
        if abs(old[name] - new[name]) > tolerance.probability:
            yield Difference("probability", f"{where}, {part}", old[name], new[name])
        yield from _candidates(where, part, old[f"{part}_candidates"], new[f"{part}_candidates"], tolerance)


def _far(a: Sequence[float], b: Sequence[float], most: float) -> bool:
    return any(abs(p - q) > most + 1e-9 for p, q in zip(a, b, strict=True))


def _candidates(
    where: str, part: str, old: Sequence[Mapping[str, Any]], new: Sequence[Mapping[str, Any]], tolerance: Tolerance
) -> Iterator[Difference]:
    left = list(new)
    for was in old:
        now = max(left, key=lambda other: _overlap(was["box"], other["box"]), default=None)
        if now is None or _overlap(was["box"], now["box"]) < COMPARISON.min_overlap:
            yield Difference("candidates", f"{where}, {part}", was["label"], None)
            continue
        left.remove(now)
        if was["label"] != now["label"]:
            yield Difference("candidates", f"{where}, {part}", was["label"], now["label"])
        if abs(was["probability"] - now["probability"]) > tolerance.probability:
            yield Difference("probability", f"{where}, {part}, {was['label']}", was["probability"], now["probability"])
    for now in left:
        yield Difference("candidates", f"{where}, {part}", None, now["label"])


def _overlap(a: Sequence[float], b: Sequence[float]) -> float:
    """Return intersection over union of two boxes (x_min, y_min, x_max, y_max); points and lines count as one pixel."""
    width = min(a[2], b[2]) - max(a[0], b[0]) + 1.0
    height = min(a[3], b[3]) - max(a[1], b[1]) + 1.0
    if width <= 0.0 or height <= 0.0:
        return 0.0
    areas = [(box[2] - box[0] + 1.0) * (box[3] - box[1] + 1.0) for box in (a, b)]
    return width * height / (sum(areas) - width * height)


def _text(value: Any) -> str:
    if value is None:
        return "(nothing)"
    if isinstance(value, float):
        return f"{value:.4g}"
    return json.dumps(value, ensure_ascii=False) if not isinstance(value, str) else f'"{value}"'
