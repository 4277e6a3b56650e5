# SPDX-License-Identifier: Apache-2.0
"""Errors of uncom_common."""

from __future__ import annotations

from collections.abc import Iterable


class UncomError(Exception):
    """Base of every error that an UNCOM package raises; its text is one line for the user."""


class InvalidConfigError(UncomError, ValueError):
    """A configuration value is not usable."""

    def __init__(self, name: str, value: object, why: str) -> None:
        """Say that the parameter `name` must not have this value, and why."""
        self.name = name
        self.value = value
        super().__init__(f"parameter {name}={value!r}: {why}")


class TransformError(UncomError, LookupError):
    """A transform is not known (yet) or frames are not connected."""

    def __init__(self, target_frame: str, source_frame: str, why: str, known: Iterable[str] = ()) -> None:
        """Say between which frames there is no transform, why, and which frames are known."""
        self.target_frame = target_frame
        self.source_frame = source_frame
        frames = ", ".join(sorted(known))
        super().__init__(
            f"no transform {source_frame} -> {target_frame}: {why}" + (f" (known frames: {frames})" if frames else "")
        )


class ImageFormatError(UncomError, ValueError):
    """An image has an encoding or a size that cannot be read."""


class UnknownPrimitiveError(UncomError, ValueError):
    """A message holds a number that stands for no primitive."""

    def __init__(self, number: int, known: Iterable[str]) -> None:
        """Say which number is not in the enumeration, and list its members as "number name"."""
        self.number = number
        super().__init__(f"primitive {number} is not one of {', '.join(known)}")


class NotInstalledError(UncomError, ImportError):
    """An optional library is missing."""

    def __init__(self, library: str, hint: str = "run ./uncom setup --full") -> None:
        """Say which library is missing, and in `hint` how to install it."""
        self.library = library
        super().__init__(f"{library} is not installed: {hint}")


class ModelNotFoundError(UncomError, OSError):
    """Weights of a full model are nowhere to be had."""

    def __init__(self, name: str, where: str, why: str) -> None:
        """Say where no usable weights of the model `name` are, and why those found are not usable."""
        self.model = name
        super().__init__(f"no usable weights of {name!r} in {where} ({why})")
