# SPDX-License-Identifier: Apache-2.0
"""What the full back ends share: optional libraries, devices, and clear errors where weights are missing."""

from __future__ import annotations

import importlib
import socket
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from uncom_common.exceptions import InvalidConfigError, ModelNotFoundError, NotInstalledError
from uncom_common.options import WEIGHT_LOADING


def require(module: str) -> Any:
    """Import an optional library.

    Raises:
        NotInstalledError: it is not there.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise NotInstalledError(module.partition(".")[0]) from error


def pick_device(name: str) -> str:
    """Return a device as PyTorch names it; "auto" is the GPU where there is one.

    Raises:
        NotInstalledError: torch is missing.
        InvalidConfigError: a GPU is asked for and there is none.
    """
    available = require("torch").cuda.is_available()
    if name == "auto":
        return "cuda" if available else "cpu"
    if name.startswith("cuda") and not available:
        raise InvalidConfigError("device", name, "torch sees no GPU; use cpu")
    return name


def weights_format(device: str) -> Any:
    """Return the number format of the weights of large models: bfloat16 on a GPU, else float32."""
    torch = require("torch")
    return torch.bfloat16 if device.startswith("cuda") else torch.float32


def load_with_processor(model: str, processor: str, name: str) -> tuple[Any, Any]:
    """Load a model and its processor by their classes in Transformers, without bars and notes on the way.

    Raises:
        NotInstalledError: torch or transformers is missing.
        ModelNotFoundError: see load_pretrained.
    """
    require("torch")
    transformers = require("transformers")
    transformers.logging.set_verbosity_error()
    transformers.logging.disable_progress_bar()
    return load_pretrained(getattr(transformers, model), name), load_pretrained(getattr(transformers, processor), name)


def load_pretrained(kind: Any, name: str, **options: Any) -> Any:
    """Load a part of a model from a folder, the cache, or the hub, in this order.

    Raises:
        ModelNotFoundError: it is in none of them, or what is there cannot be read.
    """
    folder = Path(name).exists()
    try:
        return kind.from_pretrained(name, local_files_only=True, **options)
    except _LOADING_ERRORS as error:
        if folder or not _is_hub_reachable():
            where = "the folder" if folder else "the cache, and the model hub cannot be reached"
            raise ModelNotFoundError(name, where, _first_line(error)) from error
    try:
        return kind.from_pretrained(name, **options)
    except _LOADING_ERRORS as error:
        raise ModelNotFoundError(name, "the cache or on the model hub", _first_line(error)) from error


_LOADING_ERRORS = (OSError, ValueError, RuntimeError, KeyError)


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0][: WEIGHT_LOADING.max_error_characters]


def _is_hub_reachable() -> bool:
    """Whether the model hub can be reached at all; its own client tries for a minute."""
    address = urlsplit(require("huggingface_hub.constants").ENDPOINT)
    try:
        with socket.create_connection(
            (address.hostname or "", address.port or 443), timeout=WEIGHT_LOADING.hub_timeout_s
        ):
            return True
    except OSError:
        return False
