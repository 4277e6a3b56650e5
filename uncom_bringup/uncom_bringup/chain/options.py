# SPDX-License-Identifier: Apache-2.0
"""Numbers of transcribing a recording."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class TranscriptionOptions:
    """How the sound of a recording is fed to the transcriber."""

    chunk_s: float = tunable(0.05, unit="s", meaning="length of the chunks: that of the robot's audio driver")
    quiet_s: float = tunable(1.0, unit="s", meaning="quiet after the recording, so that the last word has its end")
    max_wait_s: float = tunable(
        600.0, unit="s", meaning="longest wait for one chunk, so that none is dropped on a slow machine"
    )


TRANSCRIPTION = TranscriptionOptions()
