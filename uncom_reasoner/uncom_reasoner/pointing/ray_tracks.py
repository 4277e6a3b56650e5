# SPDX-License-Identifier: Apache-2.0
"""Which rays are of one hand: by where it is, for the detector now and then takes a left hand for a right one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

import numpy as np

from uncom_reasoner.types import RayObservation

NEAR_WIDTHS = 0.1  # of the image's width: the same hand, whatever it is called
NEAR_S = 0.5
OTHER_NAME_WIDTHS = 0.05  # a hand of the other name is taken for the same if it is nearer by this


def tracks_of(observations: Sequence[RayObservation]) -> list[list[RayObservation]]:
    """Divide rays, in order of time, into those of each hand; two of one image are never of the same hand."""
    tracks: list[list[RayObservation]] = []
    for stamp, image in groupby(observations, key=lambda o: o.stamp_s):
        left = list(image)
        recent = [track for track in tracks if stamp - track[-1].stamp_s <= NEAR_S]
        for track, ray in _matches(recent, left):
            track.append(ray)
            left = [other for other in left if other is not ray]
        for ray in left:
            # A hand of this name that was elsewhere, or away: what divides it into looks sees that.
            known = (t for t in reversed(tracks) if t[-1].hand == ray.hand and t[-1].stamp_s < stamp)
            track = next(known, [])
            if not track:
                tracks.append(track)
            track.append(ray)
    return tracks


def _matches(
    tracks: Iterable[list[RayObservation]], rays: Sequence[RayObservation]
) -> list[tuple[list[RayObservation], RayObservation]]:
    """Return pairs of a track and the ray that goes on with it, nearest first."""
    near = []
    for number, track in enumerate(tracks):
        for place, ray in enumerate(rays):
            last = track[-1]
            far = float(np.linalg.norm(ray.tip_px - last.tip_px)) / ray.width
            if far <= NEAR_WIDTHS:
                near.append((far + (0.0 if ray.hand == last.hand else OTHER_NAME_WIDTHS), number, place, track, ray))
    found, used = [], set[tuple[str, int]]()
    for _, number, place, track, ray in sorted(near, key=lambda entry: entry[:3]):
        if not {("track", number), ("ray", place)} & used:
            used |= {("track", number), ("ray", place)}
            found.append((track, ray))
    return found
