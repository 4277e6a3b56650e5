# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune the transcription of a stream of sound."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class StreamingOptions:
    """How sound is handed to the recogniser and how its state is reported."""

    backlog_s: float = tunable(120.0, unit="s", meaning="sound that may wait for the recogniser before it is dropped")
    min_pause_s: float = tunable(
        0.12, unit="s", meaning="shortest pause after which the words so far are tested for being a whole sentence"
    )
    complete_pause_s: float = tunable(
        0.18, unit="s", meaning="silence that ends an utterance which is a whole command by then"
    )
    status_period_s: float = tunable(1.0, unit="s", meaning="sound after which an unchanged status is reported again")
    stop_timeout_s: float = tunable(10.0, unit="s", meaning="longest wait for the worker at the end")


STREAMING = StreamingOptions()
