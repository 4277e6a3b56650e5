# SPDX-License-Identifier: Apache-2.0
"""What the full back ends share: optional libraries, devices, and clear errors where weights are missing."""

from __future__ import annotations

import importlib
import os
import socket
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from uncom_language.exceptions import ModelNotFoundError, NotInstalledError

_HUB_TIMEOUT_S = 5.0


def require(module: str) -> Any:
    """Import an optional library.

    Raises:
        NotInstalledError: it is not there.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise NotInstalledError(module.partition(".")[0]) from error


def pick_device(device: str) -> tuple[str, Any]:
    """Return the device and the number format of weights: bfloat16 on a GPU, float32 else.

    Args:
        device: "auto", "cpu", "cuda" or as PyTorch names it.
    """
    torch = require("torch")
    chosen = ("cuda" if torch.cuda.is_available() else "cpu") if device == "auto" else device
    return chosen, torch.bfloat16 if chosen.startswith("cuda") else torch.float32


def load_pretrained(kind: Any, name: str, **options: Any) -> Any:
    """Load a part of a model from a folder, the cache, or the hub, in this order.

    Raises:
        ModelNotFoundError: it is in none of them, or what is there cannot be read.
    """
    folder = Path(name).exists()
    try:
        return kind.from_pretrained(name, local_files_only=True, **options)
    except _LOADING_ERRORS as error:
        if folder or not _hub_answers():
            where = "the folder" if folder else "the cache, and the model hub cannot be reached"
            raise ModelNotFoundError(name, where, _first_line(error)) from error
    try:
        return kind.from_pretrained(name, **options)
    except _LOADING_ERRORS as error:
        raise ModelNotFoundError(name, "the cache or on the model hub", _first_line(error)) from error


_LOADING_ERRORS = (OSError, ValueError, RuntimeError, KeyError)


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0][:200]


def _hub_answers() -> bool:
    """Whether the model hub can be reached at all; its own client tries for a minute."""
    address = urlsplit(os.environ.get("HF_ENDPOINT", "https://huggingface.co"))
    try:
        with socket.create_connection((address.hostname or "", address.port or 443), timeout=_HUB_TIMEOUT_S):
            return True
    except OSError:
        return False
