# SPDX-License-Identifier: Apache-2.0
"""The outcome of one take, as it is stored and counted."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Outcome:
    """One take: what was said and meant, what was understood, and what other ways of deciding made of it.

    variants maps the name of a strategy or ablation to whether it was right; swapped_fits tells that the
    sentence of the other take, used in "swapped_words", asks for the same as the take's own; latency_s is processor
    time by stage.
    """

    take: str
    scenario: int
    index: int
    seed: int
    manner: str
    subjects: dict[str, str]
    said: str
    heard: str
    meant: dict[str, Any]
    got: dict[str, Any]
    right: bool
    why: str
    stage: str = ""
    relation: str = ""
    understood_relation: str = ""
    variants: dict[str, bool] = field(default_factory=dict)
    swapped_fits: bool = False
    latency_s: dict[str, float] = field(default_factory=dict)
    made_s: float = 0.0
    key: str = ""
    pictures: tuple[str, ...] = ()
    notes: dict[str, Any] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Outcome:
        """Read what `as_dict` gave."""
        return cls(**{**data, "pictures": tuple(data.get("pictures", ()))})
