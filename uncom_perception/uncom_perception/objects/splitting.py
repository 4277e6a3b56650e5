# SPDX-License-Identifier: Apache-2.0
"""Things that touch: told apart where their surfaces meet in a fold.

Colour alone splits a box at its print, shape alone a pan at its handle; together they tell an apple from the box that
it leans on, and a lemon from the bowl that it lies in.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.joining import alike_colours, is_floor, is_handle
from uncom_perception.objects.merging import borders, evidence, merged, with_bridges
from uncom_perception.objects.numbers import quantile
from uncom_perception.objects.patches import Patches, patches_of
from uncom_perception.objects.segments import LabelImage, Surfaces, label_boxes
from uncom_perception.types import Mask

_MIN_PIXELS = 660  # smaller surfaces are one thing
_MIN_PATCH = 220  # pixels that a thing has at least
_MIN_SHARE = 0.04  # of the surface
_SMALL_TOP_M = 0.045  # narrower things on top of others are their caps and lids
_STRIDE = 2
_SPARSE = 4
_EVEN, _EVEN_SHARE = 8.0, 0.92  # of a and b in Lab, and the share of pixels within it
_SOLID = 0.93  # share of its convex outline in the image above which a surface is convex


def split_touching(surfaces: Surfaces, labels: LabelImage) -> tuple[LabelImage, npt.NDArray[np.int32]]:
    """Return labels in which things that meet in a fold have labels of their own, and which label each was (L + 1,)."""
    result = labels.copy()
    for label, box in label_boxes(labels).items():
        own = labels[box] == label
        part = surfaces.cut(box)
        if np.count_nonzero(own) < _MIN_PIXELS or _plainly_one(part, own):
            continue
        groups = _groups(part, own)
        if groups.max() > 1:
            result[box][own] = int(result.max()) + groups[own]
    origin = np.zeros(int(result.max()) + 1, np.int32)
    origin[result.ravel()] = labels.ravel()
    return result, origin


def _plainly_one(part: Surfaces, own: Mask) -> bool:
    """Whether a surface has one colour and a convex outline in the image, as hardly any two things together have."""
    some = own[::_SPARSE, ::_SPARSE]
    lab = part.lab[::_SPARSE, ::_SPARSE, 1:][some]
    if len(lab) == 0:
        return False
    off = np.abs(lab - np.median(lab, axis=0)).max(axis=1)
    if float((off < _EVEN).mean()) < _EVEN_SHARE:
        return False
    contours = cv2.findContours(np.ascontiguousarray(own).view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
    hull = cv2.convexHull(np.concatenate(contours))
    return float(np.count_nonzero(own)) > _SOLID * float(cv2.contourArea(hull))


def _groups(part: Surfaces, own: Mask) -> LabelImage:
    """Number the things (H, W) in one surface, from 1."""
    coarse = part.thinned(_STRIDE)
    points = coarse.ground_points
    known = own[::_STRIDE, ::_STRIDE] & np.isfinite(points[..., 2])
    if np.count_nonzero(known) < _MIN_PIXELS // _STRIDE**2:
        return own.astype(np.int32)
    patches = patches_of(points, _normals(points), coarse.lab, known, coarse.pixel_m)
    index = _grown(patches.index, own)
    a, b, length = borders(patches.index, coarse.across, coarse.down)
    a, b, length = with_bridges((a, b, length), borders(index, part.across, part.down))
    if len(a) == 0:
        return own.astype(np.int32)
    score, colour = evidence(patches, a, b)
    group = merged(patches, a, b, length, score, colour)
    least = max(_MIN_PATCH, _MIN_SHARE * float(np.count_nonzero(own))) / _STRIDE**2
    group = _without_scraps(group, patches.size, (a, b, length), least)
    group = _with_fittings(group, patches, points, (a, b))
    numbers = np.unique(group[1:], return_inverse=True)[1].reshape(-1) + 1
    return np.asarray(np.concatenate([[0], numbers])[index], dtype=np.int32)


def _without_scraps(
    group: npt.NDArray[np.int64],
    size: npt.NDArray[np.float64],
    pairs: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]],
    least: float,
) -> npt.NDArray[np.int64]:
    """Give groups of few pixels to the neighbour with which they share most of their border, the smallest first."""
    group = group.copy()
    a, b, length = pairs
    while True:
        pixels = np.bincount(group[1:], weights=size[1:], minlength=len(group))
        i, j = group[a], group[b]
        outer = i != j
        touching = np.unique(np.concatenate([i[outer], j[outer]]))
        small = touching[pixels[touching] < least]
        if len(small) == 0:
            return group
        scrap = int(small[pixels[small].argmin()])
        shared = np.bincount(j[outer & (i == scrap)], weights=length[outer & (i == scrap)], minlength=len(group))
        shared = shared + np.bincount(
            i[outer & (j == scrap)], weights=length[outer & (j == scrap)], minlength=len(group)
        )
        group[group == scrap] = int(shared.argmax())


def _with_fittings(
    group: npt.NDArray[np.int64],
    patches: Patches,
    points: npt.NDArray[np.float32],
    pairs: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]],
) -> npt.NDArray[np.int64]:
    """Join groups that are caps, handles or floors of others with them."""
    group = group.copy()
    a, b = pairs
    while True:
        i, j = group[a], group[b]
        touching = {(min(p), max(p)) for p in zip(i[i != j].tolist(), j[i != j].tolist(), strict=True)}
        image = group[patches.index]
        clouds = {k: points[(image == k) & (patches.index > 0)] for pair in touching for k in pair}
        colours = {k: np.median(patches.lab[group == k], axis=0) for k in clouds}
        fitting = next((p for p in sorted(touching) if _fit(*(clouds[k] for k in p), *(colours[k] for k in p))), None)
        if fitting is None:
            return group
        group[group == fitting[1]] = fitting[0]


def _fit(
    one: npt.NDArray[np.float32],
    other: npt.NDArray[np.float32],
    colour: npt.NDArray[np.float64],
    other_colour: npt.NDArray[np.float64],
) -> bool:
    alike = alike_colours(colour, other_colour)
    return _is_fitting(one, other, alike=alike) or _is_fitting(other, one, alike=alike)


def _grown(image: LabelImage, own: Mask) -> LabelImage:
    """Give every pixel of a surface the number of the nearest one in the thinned image."""
    full = np.zeros(own.shape, np.int32)
    full[::_STRIDE, ::_STRIDE] = image
    full[~own] = 0
    _, nearest = cv2.distanceTransformWithLabels(
        (full == 0).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    seeds = np.zeros(int(nearest.max()) + 1, np.int32)
    seeds[nearest[full > 0]] = full[full > 0]
    return np.asarray(np.where(own, seeds[nearest], 0), dtype=np.int32)


def _normals(points: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return unit normals (H, W, 3) of the surfaces, towards above or the camera, over windows of 9 pixels."""
    known = np.isfinite(points[..., 2])
    weight = np.maximum(cv2.blur(known.astype(np.float32), (5, 5)), 1e-3)[..., None]
    smooth = cv2.blur(np.where(known[..., None], points, np.float32(0.0)), (5, 5)) / weight
    along = np.zeros_like(smooth)
    down = np.zeros_like(smooth)
    along[:, 2:-2] = smooth[:, 4:] - smooth[:, :-4]
    down[2:-2] = smooth[4:] - smooth[:-4]
    normal = np.empty_like(smooth)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        normal[..., i] = down[..., j] * along[..., k] - down[..., k] * along[..., j]
    length = np.sqrt(np.einsum("ijk,ijk->ij", normal, normal))
    normal /= np.maximum(length, np.float32(1e-12))[..., None]
    return np.asarray(normal, dtype=np.float32)


def _is_fitting(mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32], *, alike: bool) -> bool:
    """Whether a patch is a small top of another (cap, lid, stem) or a thin part held in the air by it (handle)."""
    length = max(cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(mine[:, :2])))[1])
    low = quantile(mine[:, 2], 5)
    if low > quantile(theirs[:, 2], 80) and length < _SMALL_TOP_M:
        return True
    return is_handle(mine, theirs, alike=alike) or is_floor(mine, theirs, alike=alike)
