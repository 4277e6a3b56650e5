# SPDX-License-Identifier: Apache-2.0
"""The kinds of objects there are, the colour each has by nature, and a model of any of them in any colour."""

from __future__ import annotations

import functools
from collections.abc import Callable

from uncom_sim.exceptions import UnknownColourError, UnknownKindError
from uncom_sim.objects import cutlery, fruit, packages, vessels
from uncom_sim.objects.model import Model
from uncom_sim.objects.palette import COLOURS, SPELLINGS, Rgb

_BUILDERS: dict[str, tuple[Callable[[Rgb], Model], str, Rgb | None]] = {
    "banana": (fruit.banana, "yellow", (0.95, 0.79, 0.17)),
    "apple": (fruit.apple, "red", (0.74, 0.10, 0.11)),
    "lemon": (fruit.lemon, "yellow", (0.97, 0.86, 0.20)),
    "orange": (fruit.orange, "orange", (0.95, 0.52, 0.09)),
    "pear": (fruit.pear, "green", (0.62, 0.70, 0.22)),
    "mug": (vessels.mug, "blue", None),
    "cup": (vessels.cup, "white", None),
    "bowl": (vessels.bowl, "green", None),
    "plate": (vessels.plate, "white", None),
    "frying pan": (vessels.frying_pan, "black", None),
    "box": (packages.box, "brown", (0.60, 0.42, 0.25)),
    "cereal box": (packages.cereal_box, "orange", None),
    "bottle": (packages.bottle, "green", None),
    "can": (packages.can, "red", None),
    "spoon": (cutlery.spoon, "grey", (0.66, 0.67, 0.69)),
}
KINDS = tuple(_BUILDERS)


def kind_named(name: str) -> str:
    """Return the kind of a name; case, underscores and hyphens do not matter.

    Raises:
        UnknownKindError: there is no such kind.
    """
    kind = " ".join(name.lower().replace("_", " ").replace("-", " ").split())
    if kind not in _BUILDERS:
        raise UnknownKindError(name, KINDS)
    return kind


def colour_named(name: str) -> str:
    """Return the colour of a name in our spelling.

    Raises:
        UnknownColourError: there is no such colour.
    """
    colour = SPELLINGS.get(name.lower().strip(), name.lower().strip())
    if colour not in COLOURS:
        raise UnknownColourError(name, COLOURS)
    return colour


def natural_colour(kind: str) -> str:
    """Return the colour that a kind has when a scene names none."""
    return _BUILDERS[kind][1]


@functools.cache
def model(kind: str, colour: str) -> Model:
    """Build the model of a kind in a named colour; a kind in its natural colour has its natural tint."""
    builder, natural, tint = _BUILDERS[kind]
    return builder(tint if tint is not None and colour == natural else COLOURS[colour])
