# SPDX-License-Identifier: Apache-2.0
"""Cutlery: spoon."""

from __future__ import annotations

import numpy as np

from uncom_sim.objects.model import Contact, Model, assemble, paint
from uncom_sim.objects.palette import Rgb
from uncom_sim.objects.shapes import box_hull, tube

STEELWARE = Contact(friction=0.6, rolling=0.001, spinning=0.002)


def spoon(colour: Rgb) -> Model:
    """18 cm long along x, laid on its back, 45 g."""
    at = np.linspace(0.0, 1.0, 33)
    x = -0.09 + 0.18 * at
    half_width = np.interp(
        at,
        [0.0, 0.01, 0.04, 0.35, 0.62, 0.70, 0.80, 0.88, 0.95, 0.985, 1.0],
        [0.001, 0.006, 0.0085, 0.0055, 0.0045, 0.008, 0.0185, 0.0205, 0.016, 0.008, 0.0008],
    )
    half_height = np.interp(at, [0.0, 0.03, 0.6, 0.7, 0.88, 1.0], [0.0012, 0.0024, 0.0026, 0.0028, 0.0035, 0.001])
    z = np.interp(at, [0.0, 0.3, 0.6, 0.72, 0.85, 1.0], [0.0055, 0.010, 0.011, 0.0055, 0.0036, 0.0065])
    surface = tube(np.column_stack([x, np.zeros_like(x), z]), np.column_stack([half_width, half_height]), segments=14)
    # Hollow the upper side of the spoon's bowl.
    v = np.array(surface.vertices)
    depth = 1.0 - ((v[:, 0] - 0.066) / 0.026) ** 2 - (v[:, 1] / 0.019) ** 2
    upper = v[:, 2] > np.interp(v[:, 0], x, z)
    v[:, 2] -= np.where(upper, 0.0035 * np.clip(depth, 0.0, 1.0), 0.0)
    surface.vertices = v
    hulls = [
        box_hull((0.052, 0.034, 0.006), (0.064, 0.0, 0.003)),
        box_hull((0.060, 0.009, 0.006), (0.010, 0.0, 0.0105)),
        box_hull((0.072, 0.015, 0.006), (-0.054, 0.0, 0.0075)),
    ]
    end_x, drop = -0.06, 0.0045  # the handle's end is lower than its middle [m]
    hulls[2][:, 2] = np.where(hulls[2][:, 0] < end_x, hulls[2][:, 2] - drop, hulls[2][:, 2])
    return assemble([paint(surface, colour, crease_deg=70)], hulls, 0.045, STEELWARE)
