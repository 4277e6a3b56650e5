# SPDX-License-Identifier: Apache-2.0
"""The result of a demo as JSON, as one line and as an exit status."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from uncom_sim.scoring.end_state import PhysicalResult


@dataclass(frozen=True, slots=True)
class DemoResult:
    """The outcome of one demo; `reason` says in words why it failed, and is empty if it did not."""

    heard: str
    understood: Mapping[str, Any]
    chosen: Mapping[str, Any]
    physical: PhysicalResult
    success: bool
    reason: str
    timings_s: Mapping[str, float]
    backends: Mapping[str, str]
    artifacts: Mapping[str, str]

    @property
    def exit_status(self) -> int:
        """0 done, 1 understood but failed."""
        return 0 if self.success else 1

    def to_json(self) -> dict[str, Any]:
        """Return what `uncom demo --json` prints."""
        return {
            "heard": self.heard,
            "understood": dict(self.understood),
            "chosen": dict(self.chosen),
            "physical": self.physical.as_dict(),
            "success": self.success,
            "reason": self.reason,
            "timings_s": dict(self.timings_s),
            "backends": dict(self.backends),
            "artifacts": dict(self.artifacts),
        }

    def in_words(self) -> str:
        """Return the last line for people."""
        if self.success:
            return f"SUCCESS: {self.physical.reason}"
        return f"FAILED: {self.reason}"
