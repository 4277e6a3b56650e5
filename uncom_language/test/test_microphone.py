# SPDX-License-Identifier: Apache-2.0
"""A microphone that is not there is a clear error."""

from __future__ import annotations

import pytest
from uncom_language.exceptions import MicrophoneError
from uncom_language.speech.audio.microphone import Microphone


def test_a_microphone_that_is_not_there_is_one_clear_line():
    with pytest.raises(MicrophoneError, match=r"not installed|no microphone") as caught:
        Microphone("a microphone that nobody ever plugged in")
    assert "\n" not in str(caught.value)
