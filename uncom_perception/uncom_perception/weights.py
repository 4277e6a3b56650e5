# SPDX-License-Identifier: Apache-2.0
"""Loading of models with weights (Transformers); nothing here is imported before a back end with weights is made."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from uncom_perception.exceptions import BackendUnavailableError


def torch_modules() -> tuple[Any, Any]:
    """Return the modules torch and transformers.

    Raises:
        BackendUnavailableError: one of them is not installed.
    """
    try:
        import torch  # noqa: PLC0415  (takes seconds, and is optional)
        import transformers  # noqa: PLC0415
    except ImportError as error:
        missing = error.name or "transformers"
        raise BackendUnavailableError(f"{missing} is not installed: run ./uncom setup --full") from error
    transformers.logging.set_verbosity_error()
    transformers.logging.disable_progress_bar()
    return torch, transformers


def device_named(name: str) -> str:
    """Return a torch device: "auto" is the GPU if there is one.

    Raises:
        BackendUnavailableError: there is no such device here, or torch is not installed.
    """
    torch, _ = torch_modules()
    if name == "auto":
        return "cuda" if torch.cuda.is_available() else "cpu"
    if name.startswith("cuda") and not torch.cuda.is_available():
        raise BackendUnavailableError(f"the device {name!r} is asked for but torch sees no GPU; use device:=cpu")
    return name


def pretrained(load: Callable[..., Any], model_id: str) -> Any:
    """Load a model or its processor by name or folder.

    Raises:
        BackendUnavailableError: it is not on this machine and cannot be had, or is of another kind.
    """
    try:
        return load(model_id)
    except (OSError, ValueError, KeyError) as error:
        cause = " ".join(str(error).split())[:160]
        raise BackendUnavailableError(
            f"cannot load {model_id!r}: name a model of the right kind, or a folder with its weights, or connect "
            f"to the network once ({cause})"
        ) from error
