# SPDX-License-Identifier: Apache-2.0
"""Sound straight from a microphone of this machine (PortAudio through sounddevice, an extra)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from uncom_language.exceptions import MicrophoneError
from uncom_language.speech.audio.options import MICROPHONE, MicrophoneOptions


class Microphone:
    """Hands blocks of samples to a function, in the driver's thread."""

    def __init__(
        self, device: str = "", sample_rate: int = 0, channels: int = 1, options: MicrophoneOptions = MICROPHONE
    ) -> None:
        """Look for the microphone; `start` begins.

        Args:
            device: number or part of the name of an input; empty: the system's own choice.
            sample_rate: [Hz]; 0: what the device likes best.
            channels: how many are recorded; the recogniser hears their mean.
            options: length of the blocks, and which clocks of drivers are believed.

        Raises:
            MicrophoneError: sounddevice or PortAudio is missing, or there is no such input.
        """
        self._library = _load_sounddevice()
        chosen: int | str | None = int(device) if device.isdecimal() else device or None
        try:
            info = self._library.query_devices(chosen, "input")
            rate = float(sample_rate or info["default_samplerate"])
            self._library.check_input_settings(chosen, channels, "int16", None, rate)
        except (self._library.PortAudioError, ValueError, OSError) as error:
            raise MicrophoneError(_describe_missing_device(device, self._library, error)) from error
        self.name = str(info["name"])
        self.sample_rate = round(rate)
        self._device, self._channels, self._options = chosen, channels, options
        self._stream: Any = None

    def start(self, on_block: Callable[[npt.NDArray[np.int16], float], None]) -> None:
        """Start recording; each block comes with the age [s] of its first sample.

        Raises:
            MicrophoneError: the device does not open.
        """

        def on_samples(block: npt.NDArray[np.int16], frames: int, times: Any, _: object) -> None:
            age_s = max(0.0, float(times.currentTime - times.inputBufferAdcTime))
            on_block(np.array(block), age_s if age_s < self._options.max_age_s else frames / self.sample_rate)

        try:
            self._stream = self._library.InputStream(
                samplerate=self.sample_rate,
                blocksize=round(self._options.block_s * self.sample_rate),
                device=self._device,
                channels=self._channels,
                dtype="int16",
                callback=on_samples,
            )
            self._stream.start()
        except self._library.PortAudioError as error:
            raise MicrophoneError(f"the microphone {self.name!r} does not open: {_first_line(error)}") from error

    def stop(self) -> None:
        """Stop recording."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None


def _load_sounddevice() -> Any:
    try:
        import sounddevice  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise MicrophoneError("sounddevice is not installed: run ./uncom setup --full") from error
    except OSError as error:
        raise MicrophoneError("PortAudio is not installed: apt install libportaudio2") from error
    return sounddevice


def _describe_missing_device(device: str, library: Any, error: Exception) -> str:
    inputs = [str(info["name"]) for info in library.query_devices() if info["max_input_channels"] > 0]
    if not inputs:
        return "this machine has no microphone; send sound on the audio topic instead"
    return f"no microphone {device or '(default)'!r} ({_first_line(error)}); there are: {', '.join(inputs)}"


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0]
