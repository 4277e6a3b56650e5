# SPDX-License-Identifier: Apache-2.0
"""Hollow and flat tableware: bowl, mug, cup, plate, frying pan."""

from __future__ import annotations

import numpy as np
import trimesh

from uncom_sim.objects.model import Contact, Model, Opening, assemble, paint
from uncom_sim.objects.palette import STEEL, Rgb, mixed
from uncom_sim.objects.shapes import (
    Profile,
    box_hull,
    disc_hull,
    revolve,
    ring_hulls,
    rounded_box,
    smooth_profile,
    tube,
)

CERAMIC = Contact(friction=0.7, spinning=0.002)
METAL = Contact(friction=0.6, spinning=0.002)


def bowl(colour: Rgb) -> Model:
    """18.4 cm across, 6.6 cm high, 400 g."""
    outer = [(0.040, 0.0), (0.045, 0.005), (0.068, 0.023), (0.084, 0.044), (0.092, 0.0645)]
    inner = [(0.038, 0.0095), (0.043, 0.0105), (0.064, 0.026), (0.0795, 0.046), (0.0875, 0.0645)]
    skin = paint(_vessel(smooth_profile(outer[1:], 9), smooth_profile(inner[1:], 9), outer[0], 0.0095), colour)
    hulls = [*ring_hulls(inner[1:], outer[1:], 18), disc_hull(0.043, 0.0, 0.0095, 18)]
    return assemble([skin], hulls, 0.40, CERAMIC, Opening((0.0, 0.0), 0.0875, 0.0095, 0.0655))


def mug(colour: Rgb) -> Model:
    """8.2 cm across, 9.5 cm high, straight, with a handle to one side (+x), 320 g."""
    radius, height, inside = 0.041, 0.095, 0.0368
    skin = paint(
        _vessel(
            [(radius, 0.003), (radius, height - 0.0015)],
            [(inside, 0.010), (inside, height - 0.0015)],
            (radius - 0.003, 0.0),
            0.006,
        ),
        colour,
    )
    angles = np.linspace(np.radians(80), np.radians(-80), 13)
    path = np.column_stack([radius - 0.008 + 0.034 * np.cos(angles), np.zeros(13), 0.048 + 0.032 * np.sin(angles)])
    handle = paint(tube(path, np.full((13, 2), (0.0045, 0.0062)), 10, up=(0, 1, 0)), colour, crease_deg=70)
    hulls = [
        *ring_hulls([(inside, 0.0), (inside, height)], [(radius, 0.0), (radius, height)], 16),
        disc_hull(inside, 0.0, 0.006, 16),
        box_hull((0.009, 0.011, 0.044), (radius + 0.0215, 0.0, 0.048)),
        box_hull((0.022, 0.011, 0.010), (radius + 0.009, 0.0, 0.0755)),
        box_hull((0.022, 0.011, 0.010), (radius + 0.009, 0.0, 0.0205)),
    ]
    return assemble([skin, handle], hulls, 0.32, CERAMIC, Opening((0.0, 0.0), inside, 0.006, height))


def cup(colour: Rgb) -> Model:
    """A beaker without handle: 8.4 cm across at the top, 5.8 cm at the bottom, 8 cm high, 180 g."""
    outer = [(0.029, 0.003), (0.034, 0.030), (0.0395, 0.062), (0.042, 0.079)]
    inner = [(0.0245, 0.009), (0.0305, 0.031), (0.036, 0.062), (0.0385, 0.079)]
    skin = paint(_vessel(outer, inner, (0.027, 0.0), 0.006), colour)
    hulls = [*ring_hulls([(0.024, 0.0), *inner[1:]], [(0.028, 0.0), *outer[1:]], 16), disc_hull(0.027, 0.0, 0.006, 16)]
    return assemble([skin], hulls, 0.18, CERAMIC, Opening((0.0, 0.0), 0.0385, 0.006, 0.080))


def plate(colour: Rgb) -> Model:
    """22 cm across, 2 cm high, 420 g."""
    outer = [(0.070, 0.002), (0.082, 0.006), (0.096, 0.012), (0.110, 0.0185)]
    inner = [(0.068, 0.0055), (0.080, 0.0085), (0.095, 0.0155), (0.1085, 0.0205)]
    skin = paint(_vessel(outer, inner, (0.066, 0.0), 0.005), colour, crease_deg=25)
    hulls = [
        *ring_hulls([(0.066, 0.005), *inner[1:]], [(0.066, 0.0), *outer[1:]], 20),
        disc_hull(0.070, 0.0, 0.005, 20),
    ]
    return assemble([skin], hulls, 0.42, CERAMIC, Opening((0.0, 0.0), 0.1085, 0.005, 0.0205))


def frying_pan(colour: Rgb) -> Model:
    """22 cm across, 4.5 cm high, handle of 16 cm to one side (+x), 750 g."""
    outer = [(0.088, 0.002), (0.098, 0.014), (0.108, 0.0425)]
    inner = [(0.086, 0.007), (0.0945, 0.016), (0.1045, 0.0425)]
    skin = paint(_vessel(outer, inner, (0.085, 0.0), 0.005), colour, crease_deg=25)
    shaft = rounded_box((0.165, 0.026, 0.013), 0.006)
    shaft.apply_transform(trimesh.transformations.rotation_matrix(np.radians(-6.0), [0, 1, 0]))
    shaft.apply_translation([0.185, 0.0, 0.034])
    handle = paint(shaft, mixed(colour, (0.05, 0.05, 0.05), 0.85), crease_deg=60)
    rivet = paint(trimesh.creation.icosphere(2, 0.004).apply_translation([0.1035, 0.0, 0.030]), STEEL)
    hulls = [*ring_hulls(inner, outer, 20), disc_hull(0.092, 0.0, 0.005, 20), np.asarray(shaft.vertices)[::3]]
    return assemble([skin, handle, rivet], hulls, 0.75, METAL, Opening((0.0, 0.0), 0.1045, 0.005, 0.0435))


def _vessel(outer: Profile, inner: Profile, foot: tuple[float, float], floor: float) -> trimesh.Trimesh:
    """Turn a hollow vessel: foot (radius, 0), outer and inner wall bottom to top, a rounded lip, a floor [m]."""
    (r_out, z_top), (r_in, _) = outer[-1], inner[-1]
    lip = [(r_out - 0.25 * (r_out - r_in), z_top + 0.0012), (r_in + 0.25 * (r_out - r_in), z_top + 0.0012)]
    floor_edge = (inner[0][0] - 0.004, floor)
    return revolve([(0.0, 0.0), foot, *outer, *lip, *reversed(list(inner)), floor_edge, (0.0, floor)], 40)
