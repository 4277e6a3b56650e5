# SPDX-License-Identifier: Apache-2.0
"""Node parameters as fields of frozen configuration classes: default, description, and the values that are usable.

    @dataclass(frozen=True, slots=True)
    class CameraConfig:
        rate_hz: float = parameter(8.0, "images a second [1/s]", minimum=0.1, maximum=60.0)

        def __post_init__(self) -> None:
            check_parameters(self)

`ConfiguredNode` declares them in ROS; the reference pages of the documentation list them with their ranges.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, TypeVar

from uncom_common.exceptions import InvalidConfigError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

ValueT = TypeVar("ValueT")


def parameter(
    default: ValueT,
    description: str,
    *,
    minimum: float | None = None,
    maximum: float | None = None,
    choices: tuple[Any, ...] = (),
) -> ValueT:
    """Declare a field of a configuration class.

    Args:
        default: value where nothing else is given.
        description: what it does, with its unit in brackets; becomes the ROS description.
        minimum: least usable value; None for none.
        maximum: greatest usable value; None for none.
        choices: the only usable values; of a tuple's elements where the field is one.
    """
    usable = {"minimum": minimum, "maximum": maximum, "choices": choices}
    # To a type checker the field is its default value, as with dataclasses.field.
    return dataclasses.field(default=default, metadata={"description": description, **usable})


def usable_values(item: dataclasses.Field[Any]) -> str:
    """Return the usable values of a field in words, or an empty text where any will do."""
    low, high, choices = (item.metadata.get(key) for key in ("minimum", "maximum", "choices"))
    if choices:
        return " or ".join(map(str, choices))
    if low is not None and high is not None:
        return f"{low:g} to {high:g}"
    if low is not None:
        return f"at least {low:g}"
    return "" if high is None else f"at most {high:g}"


def check_parameters(config: DataclassInstance) -> None:
    """Refuse values outside what their fields declare; the body of a configuration's `__post_init__`.

    Raises:
        InvalidConfigError: a value is not usable; the text names the usable ones.
    """
    for item in dataclasses.fields(config):
        value = getattr(config, item.name)
        if not _is_usable(item, value):
            raise InvalidConfigError(item.name, value, f"must be {usable_values(item)}")


def _is_usable(item: dataclasses.Field[Any], value: Any) -> bool:
    low, high, choices = (item.metadata.get(key) for key in ("minimum", "maximum", "choices"))
    values = value if isinstance(value, tuple) else (value,)
    # Written so that a value that is not a number (NaN) is refused.
    return all(
        (not choices or each in choices) and (low is None or each >= low) and (high is None or each <= high)
        for each in values
    )
