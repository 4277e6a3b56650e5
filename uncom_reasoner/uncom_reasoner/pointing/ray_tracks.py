# SPDX-License-Identifier: Apache-2.0
"""Which rays are of one hand: by where it is, for the detector now and then takes a left hand for a right one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

import numpy as np

from uncom_reasoner.gesture_types import RayObservation
from uncom_reasoner.pointing.options import RAY_TRACK, RayTrackOptions


def associate_rays(
    observations: Sequence[RayObservation], options: RayTrackOptions = RAY_TRACK
) -> list[list[RayObservation]]:
    """Divide rays, in order of time, into those of each hand; two of one image are never of the same hand."""
    tracks: list[list[RayObservation]] = []
    for stamp_s, image in groupby(observations, key=lambda o: o.stamp_s):
        unmatched = list(image)
        recent = [track for track in tracks if stamp_s - track[-1].stamp_s <= options.same_hand_s]
        for track, ray in _match_nearest(recent, unmatched, options):
            track.append(ray)
            unmatched = [other for other in unmatched if other is not ray]
        for ray in unmatched:
            # A hand of this name that was elsewhere, or away: what divides it into dwells sees that.
            known = (t for t in reversed(tracks) if t[-1].hand == ray.hand and t[-1].stamp_s < stamp_s)
            track = next(known, [])
            if not track:
                tracks.append(track)
            track.append(ray)
    return tracks


def _match_nearest(
    tracks: Iterable[list[RayObservation]], rays: Sequence[RayObservation], options: RayTrackOptions
) -> list[tuple[list[RayObservation], RayObservation]]:
    """Return pairs of a track and the ray that goes on with it, nearest first."""
    pairs = []
    for track_index, track in enumerate(tracks):
        for ray_index, ray in enumerate(rays):
            last = track[-1]
            distance = float(np.linalg.norm(ray.tip_px - last.tip_px)) / ray.width
            if distance <= options.same_hand_widths:
                penalty = 0.0 if ray.hand == last.hand else options.other_name_widths
                pairs.append((distance + penalty, track_index, ray_index, track, ray))
    matches, used = [], set[tuple[str, int]]()
    for _, track_index, ray_index, track, ray in sorted(pairs, key=lambda pair: pair[:3]):
        if not {("track", track_index), ("ray", ray_index)} & used:
            used |= {("track", track_index), ("ray", ray_index)}
            matches.append((track, ray))
    return matches
