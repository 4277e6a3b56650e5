# SPDX-License-Identifier: Apache-2.0
"""Fruit: banana, apple, lemon, orange, pear."""

from __future__ import annotations

import itertools

import numpy as np
import trimesh

from uncom_sim.objects.model import Contact, Model, assemble, paint, ramp_tile
from uncom_sim.objects.palette import COLOURS, Rgb, mixed
from uncom_sim.objects.shapes import revolve, smooth_profile, tube, turned_hull

# Real fruit is soft and uneven and soon stops; rolling friction stands for that.
FRUIT = Contact(friction=0.9, rolling=0.004, spinning=0.003, restitution=0.05)
_STEM: Rgb = (0.33, 0.22, 0.12)


def banana(colour: Rgb) -> Model:
    """Lie on its side: 17 cm along the curve, 3.4 cm thick, 120 g."""
    bend_radius, thickness = 0.12, 0.0172
    half_angle = 0.17 / bend_radius / 2.0
    at = np.linspace(-1.0, 1.0, 25)
    angles = at * half_angle
    path = np.column_stack(
        [bend_radius * np.sin(angles), bend_radius * (np.cos(angles) - 0.88), np.full(len(at), thickness)]
    )
    swell = np.interp(
        at, [-1, -0.93, -0.75, -0.4, 0.4, 0.72, 0.82, 0.95, 1], [0.2, 0.42, 0.8, 1, 1, 0.72, 0.4, 0.3, 0.26]
    )
    swell[1:-1] = np.convolve(swell, [0.25, 0.5, 0.25], mode="valid")
    skin = paint(
        tube(path, np.column_stack([swell * thickness, swell * thickness * 0.96]), segments=14),
        ramp_tile(
            [
                (0.0, (0.20, 0.14, 0.08)),
                (0.05, mixed(colour, (0.25, 0.18, 0.08), 0.5)),
                (0.12, colour),
                (0.78, colour),
                (0.9, mixed(colour, COLOURS["green"], 0.25)),
                (0.97, (0.30, 0.22, 0.10)),
                (1.0, (0.20, 0.14, 0.08)),
            ]
        ),
        lambda v, _: np.column_stack(
            [(np.arctan2(v[:, 0], v[:, 1] + 0.88 * bend_radius) / half_angle + 1.0) / 2.0, np.full(len(v), 0.5)]
        ),
        crease_deg=60,
    )
    cuts = (0, 4, 9, 15, 20, 24)
    rings = [tube(path[a : b + 1], swell[a : b + 1] * thickness, segments=10) for a, b in itertools.pairwise(cuts)]
    return assemble([skin], [np.asarray(ring.vertices) for ring in rings], 0.12, FRUIT)


def apple(colour: Rgb) -> Model:
    """7.4 cm across, 6.8 cm high, 160 g."""
    points = [(0.0, 0.007), (0.012, 0.001), (0.022, 0.0035), (0.032, 0.017), (0.037, 0.036), (0.034, 0.053)]
    points += [(0.024, 0.0655), (0.012, 0.0665), (0.004, 0.061), (0.0, 0.058)]
    low, high = mixed(colour, COLOURS["yellow"], 0.25), mixed(colour, COLOURS["yellow"], 0.12)
    skin = paint(
        revolve(smooth_profile(points, 22), 36),
        ramp_tile([(0.0, low), (0.3, colour), (0.8, colour), (0.97, high), (1.0, mixed(colour, _STEM, 0.5))]),
        lambda v, _: np.column_stack([v[:, 2] / 0.068, np.full(len(v), 0.5)]),
        crease_deg=80,
    )
    stem = paint(_stem(0.058, 0.018, 0.0016), _STEM)
    hull = turned_hull([(0.018, 0.0008), (0.0325, 0.018), (0.037, 0.036), (0.034, 0.053), (0.02, 0.0662)], 16)
    return assemble([skin, stem], [hull], 0.16, FRUIT)


def lemon(colour: Rgb) -> Model:
    """Lie on its side: 6.7 cm long with its two nubs, 5.1 cm thick, 100 g."""
    r = 0.0255
    points = [(0.0, -0.0345), (0.0048, -0.0335), (0.0075, -0.0298), (0.0145, -0.0248), (0.0221, -0.0145), (r, 0.0)]
    points += [(0.0221, 0.0145), (0.0145, 0.0240), (0.0070, 0.0280), (0.0052, 0.0308), (0.0, 0.0325)]
    turn = np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, r], [0, 0, 0, 1.0]])
    body = revolve(smooth_profile(points, 26), 28)
    body.apply_transform(turn)
    skin = paint(
        body,
        ramp_tile([(0.0, mixed(colour, COLOURS["green"], 0.35)), (0.08, colour), (1.0, colour)]),
        lambda v, _: np.column_stack([(v[:, 0] + 0.0345) / 0.067, np.full(len(v), 0.5)]),
        crease_deg=80,
    )
    hull = turned_hull([(0.0048, -0.0335), *points[3:8], (0.0052, 0.0308)], 14)
    return assemble([skin], [hull @ turn[:3, :3].T + turn[:3, 3]], 0.10, FRUIT)


def orange(colour: Rgb) -> Model:
    """7.2 cm across, 170 g."""
    r = 0.036
    angles = np.linspace(-np.pi / 2.0, np.pi / 2.0, 20)
    skin = paint(
        revolve([(r * float(np.cos(a)), r * 0.965 * (1.0 + float(np.sin(a)))) for a in angles], 36),
        ramp_tile([(0.0, colour), (0.96, colour), (0.99, mixed(colour, COLOURS["green"], 0.7)), (1.0, _STEM)]),
        lambda v, _: np.column_stack([v[:, 2] / (2 * 0.965 * r), np.full(len(v), 0.5)]),
        crease_deg=80,
    )
    rings = np.linspace(-1.2, 1.2, 7)
    hull = turned_hull([(r * float(np.cos(a)), r * 0.965 * (1.0 + float(np.sin(a)))) for a in rings], 16)
    hull[:, 2] = np.clip((hull[:, 2] - 0.036) * 1.04 + 0.036, 0.0, None)
    return assemble([skin], [hull], 0.17, FRUIT)


def pear(colour: Rgb) -> Model:
    """Stand: 6.8 cm across at the bottom, 9.6 cm high without the stem, 170 g."""
    points = [(0.0, 0.004), (0.014, 0.0005), (0.026, 0.006), (0.034, 0.027), (0.030, 0.047), (0.0215, 0.066)]
    points += [(0.0165, 0.082), (0.0105, 0.093), (0.003, 0.0955), (0.0, 0.095)]
    skin = paint(
        revolve(smooth_profile(points, 24), 32),
        ramp_tile([(0.0, mixed(colour, _STEM, 0.4)), (0.1, colour), (0.9, colour), (1.0, mixed(colour, _STEM, 0.4))]),
        lambda v, _: np.column_stack([v[:, 2] / 0.096, np.full(len(v), 0.5)]),
        crease_deg=80,
    )
    stem = paint(_stem(0.094, 0.018, 0.0018), _STEM)
    lower = turned_hull([(0.019, 0.0004), (0.026, 0.006), (0.034, 0.027), (0.030, 0.047), (0.0215, 0.066)], 14)
    upper = turned_hull([(0.0215, 0.066), (0.0165, 0.082), (0.008, 0.095)], 10)
    return assemble([skin, stem], [lower, upper], 0.17, FRUIT)


def _stem(z: float, length: float, radius: float) -> trimesh.Trimesh:
    t = np.linspace(0.0, 1.0, 5)
    path = np.column_stack([0.006 * t**2, np.zeros(5), z + length * t])
    return tube(path, np.full(5, radius), segments=8, up=(0, 1, 0))
