# SPDX-License-Identifier: Apache-2.0
"""From labelled surfaces to things: fragments joined, hands and arms taken out, masks closed."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage
from uncom_common.camera import PinholeCamera

from uncom_perception.hands.detector import FINGERS, INDEX_MCP, MIDDLE_MCP, PINKY_MCP, WRIST
from uncom_perception.objects.segments import LabelImage, Surfaces, connected, foreground
from uncom_perception.objects.splitting import split_touching
from uncom_perception.objects.table import TopDown
from uncom_perception.types import HandsFrame, Mask

_MIN_PIXELS = 45
_MIN_EXTENT_M = 0.012
_FLOATING_M = 0.03
_CELL_M = 0.005
_FRAGMENT_PIXELS = 90
_SAME_LEVEL_M = 0.03
_TALLEST_M = 0.45


def find_things(
    surfaces: Surfaces,
    on_table: Mask,
    table: TopDown,
    around: TopDown,
    hands: HandsFrame | None,
    camera: PinholeCamera,
) -> list[Mask]:
    """Return one mask (H, W) for each thing on the table, hands and arms left out."""
    pixels = foreground(surfaces, on_table, around)
    pixels &= ~hand_pixels(surfaces, pixels, hands)
    labels = connected(surfaces, pixels)
    labels = split_touching(surfaces, _without_specks(labels))
    labels = _hollow_joined(surfaces, _joined(surfaces, labels))
    inside = table.inside(surfaces.ground_points[..., :2])
    boxes = label_boxes(labels)
    masks = []
    for label, box in boxes.items():
        mask = np.zeros(labels.shape, dtype=bool)
        mask[box] = labels[box] == label
        if _is_thing(surfaces, labels, label, box, inside, camera):
            masks.append(_closed(mask, box))
    return masks


def hand_pixels(surfaces: Surfaces, above: Mask, hands: HandsFrame | None) -> Mask:
    """Return the pixels of hands and of the bare forearms behind them: skin coloured and connected to the landmarks."""
    mask = np.zeros(above.shape, dtype=bool)
    if hands is None:
        return mask
    points = surfaces.ground_points
    for hand in hands.hands:
        skeleton, core = _skeleton(hand.landmarks, above.shape)
        sample = core & above
        if sample.sum() < 20:
            continue
        skin = _like_sample(surfaces.lab, surfaces.lab[sample])
        candidates = above & (skin | core)
        labels = connected(surfaces, candidates)
        touched = np.bincount(labels[sample], minlength=labels.max() + 1)
        touched[0] = 0
        chosen = np.flatnonzero(touched > max(10, 0.08 * touched.sum()))
        # What is at the depth of the finger bones belongs to the hand whatever its colour (nails, shadows, rings).
        hand_height = float(np.nanmedian(points[..., 2][sample]))
        close = skeleton & above & (points[..., 2] > min(0.02, 0.5 * hand_height)) & skin
        found = np.isin(labels, chosen) | close
        mask |= cv2.dilate(found.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    return mask


def bare_skin(lab: npt.NDArray[np.float32], above: Mask, hands: HandsFrame, scale: float = 1.0) -> Mask:
    """Return the pixels of hands and bare forearms in a picture without depth, scaled from the one the hands are of."""
    mask = np.zeros(above.shape, dtype=bool)
    for hand in hands.hands:
        thick, core = _skeleton(hand.landmarks * scale, above.shape)
        if core.sum() < 20:
            continue
        skin = _like_sample(lab, lab[core])
        labels, _ = ndimage.label((above & skin) | core)
        touched = np.unique(labels[core])
        mask |= np.isin(labels, touched[touched > 0]) | thick
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool))


def _like_sample(lab: npt.NDArray[np.float32], sample: npt.NDArray[np.float32]) -> Mask:
    """Return the pixels (H, W) whose colour is that of a sample (N, 3), lightness free within its shading."""
    middle = np.median(sample, axis=0)
    spread = np.maximum(1.4826 * np.median(np.abs(sample - middle), axis=0), (8.0, 4.0, 4.0))
    return np.asarray((np.abs(lab - middle) < np.array([5.0, 3.5, 3.5]) * spread).all(axis=2))


def _skeleton(landmarks: npt.NDArray[np.float64], shape: tuple[int, ...]) -> tuple[Mask, Mask]:
    """Draw a hand's bones, thick (all of the hand) and thin (surely hand)."""
    marks = np.round(landmarks[:, :2]).astype(np.int32)
    size = float(np.ptp(marks, axis=0).max())
    thick, thin = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    lines = [marks[list(joints)] for joints in FINGERS.values()]
    lines += [marks[[WRIST, joints[0]]] for joints in FINGERS.values()]
    palm = marks[[WRIST, 1, INDEX_MCP, MIDDLE_MCP, 13, PINKY_MCP]]
    for image, width in ((thick, max(3, round(0.16 * size))), (thin, max(1, round(0.04 * size)))):
        cv2.polylines(image, [line.reshape(-1, 1, 2) for line in lines], False, 1, width)
        cv2.fillPoly(image, [cv2.convexHull(palm.reshape(-1, 1, 2))], 1)
    return thick.astype(bool), thin.astype(bool)


def _without_specks(labels: LabelImage) -> LabelImage:
    sizes = np.bincount(labels.ravel())
    keep = sizes >= 12
    keep[0] = False
    renumber = np.zeros(len(sizes), np.int32)
    renumber[keep] = np.arange(1, keep.sum() + 1)
    return renumber[labels]


def label_boxes(labels: LabelImage) -> dict[int, tuple[slice, slice]]:
    """Return rows and columns that each label covers."""
    return {i + 1: (box[0], box[1]) for i, box in enumerate(ndimage.find_objects(labels)) if box is not None}


def _joined(surfaces: Surfaces, labels: LabelImage) -> LabelImage:
    """Join surfaces of one thing that holes or its own shape part in the image: they meet seen from above.

    Front and inner back wall of a cup, say. Only surfaces of alike colour, or small fragments, are joined.
    """
    count = int(labels.max())
    if count < 2:
        return labels
    used = labels > 0
    flat = surfaces.ground_points[used]
    ids = labels[used]
    cells = np.round(flat[:, :2] / _CELL_M).astype(np.int64)
    cells -= cells.min(axis=0)
    width = int(cells[:, 0].max()) + 3
    key = (cells[:, 1] + 1) * width + cells[:, 0] + 1
    colours = _label_colours(surfaces, labels)
    sizes = np.bincount(ids, minlength=count + 1)[1:]
    both = key * (count + 1) + ids
    pairs, place = np.unique(both, return_inverse=True)
    level = np.bincount(place, weights=flat[:, 2]) / np.bincount(place)
    contacts = _contacts(pairs // (count + 1), pairs % (count + 1), level, width, count)
    parent = np.arange(count + 1)
    order = np.argwhere(np.triu(contacts) >= 2)
    for i, j in sorted(order.tolist(), key=lambda pair: -int(contacts[pair[0], pair[1]])):
        small = min(sizes[i - 1], sizes[j - 1]) < _FRAGMENT_PIXELS
        if small or (_alike(colours[i - 1], colours[j - 1]) and contacts[i, j] >= 4):
            a, b = _root(parent, i), _root(parent, j)
            parent[max(a, b)] = min(a, b)
    roots = np.array([_root(parent, i) for i in range(count + 1)])
    renumber = np.unique(roots, return_inverse=True)[1].astype(np.int32)
    return np.asarray(renumber[labels], dtype=np.int32)


def _contacts(
    cells: npt.NDArray[np.int64], ids: npt.NDArray[np.int64], level: npt.NDArray[np.float64], width: int, count: int
) -> npt.NDArray[np.int32]:
    """Count the neighbouring cells, seen from above, in which two labels lie at about the same height."""
    contacts = np.zeros((count + 1, count + 1), np.int32)
    owner: dict[int, list[tuple[int, float]]] = {}
    for cell, label, height in zip(cells.tolist(), ids.tolist(), level.tolist(), strict=True):
        owner.setdefault(cell, []).append((label, height))
    for cell, here in owner.items():
        for step in (0, 1, width, width + 1, width - 1):
            for i, high in here:
                for j, other in owner.get(cell + step, ()):
                    if i != j and abs(high - other) < _SAME_LEVEL_M:
                        contacts[i, j] += 1
                        contacts[j, i] += 1
    return contacts


def _alike(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> bool:
    """Whether two Lab colours may be one surface in light and in shade, where chroma shrinks with lightness."""
    if abs(float(a[0] - b[0])) > 38.0:
        return False
    plain = float(np.hypot(*(a[1:] - b[1:])))
    relative = float(np.hypot(*(a[1:] / (a[0] + 12.0) - b[1:] / (b[0] + 12.0))))
    return plain < 14.0 or relative < 0.22


def _hollow_joined(surfaces: Surfaces, labels: LabelImage) -> LabelImage:
    """Join the front of a hollow thing and what is seen of its inside over the rim, where the rim itself was lost.

    Such surfaces border one another in the image, are alike in colour, and together are hardly longer than alone.
    """
    boxes = label_boxes(labels)
    if len(boxes) < 2:
        return labels
    kernel = np.ones((9, 9), np.uint8)
    corners: dict[int, npt.NDArray[np.float32]] = {}
    parent = np.arange(int(labels.max()) + 1)
    for i, box in boxes.items():
        rows = slice(max(0, box[0].start - 5), box[0].stop + 5)
        columns = slice(max(0, box[1].start - 5), box[1].stop + 5)
        part = labels[rows, columns]
        near = cv2.dilate((part == i).astype(np.uint8), kernel).astype(bool)
        others, counts = np.unique(part[near & (part > 0) & (part != i)], return_counts=True)
        for j in others[counts >= 25].tolist():
            if j > i or _root(parent, i) == _root(parent, j):
                continue
            facing = (part == i) & cv2.dilate((part == j).astype(np.uint8), kernel).astype(bool)
            lab = surfaces.lab[rows, columns]
            if _alike(np.median(lab[facing], axis=0), np.median(lab[near & (part == j)], axis=0)):
                hulls = [corners.setdefault(k, _hull(surfaces, labels, k, boxes[k])) for k in (i, j)]
                if _one_body(*hulls):
                    a, b = _root(parent, i), _root(parent, j)
                    parent[max(a, b)] = min(a, b)
    roots = np.array([_root(parent, i) for i in range(len(parent))])
    return np.asarray(np.unique(roots, return_inverse=True)[1].astype(np.int32)[labels], dtype=np.int32)


def _hull(surfaces: Surfaces, labels: LabelImage, label: int, box: tuple[slice, slice]) -> npt.NDArray[np.float32]:
    flat = surfaces.ground_points[box][labels[box] == label][:, :2]
    return np.asarray(cv2.convexHull(np.ascontiguousarray(flat, dtype=np.float32))[:, 0], dtype=np.float32)


def _one_body(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> bool:
    """Whether two outlines seen from above are parts of one compact thing."""
    sides = [cv2.minAreaRect(hull)[1] for hull in (a, b, np.concatenate([a, b]))]
    longest = max(*sides[0], *sides[1])
    return bool(max(sides[2]) < 1.15 * longest + 0.006 and min(sides[2]) > 0.5 * min(longest, 0.25))


def _label_colours(surfaces: Surfaces, labels: LabelImage) -> npt.NDArray[np.float32]:
    """Return the median Lab colour of each label from 1 on."""
    colours = np.zeros((int(labels.max()), 3), np.float32)
    for label, box in label_boxes(labels).items():
        own = surfaces.lab[box][labels[box] == label]
        colours[label - 1] = np.median(own[:: max(1, len(own) // 400)], axis=0)
    return colours


def _root(parent: npt.NDArray[np.int64], i: int) -> int:
    while parent[i] != i:
        i = int(parent[i])
    return i


def _is_thing(
    surfaces: Surfaces, labels: LabelImage, label: int, box: tuple[slice, slice], inside: Mask, camera: PinholeCamera
) -> bool:
    """Whether a surface is a thing that stands on the table (or on another thing), not an arm, a hand or a speck."""
    own = labels[box] == label
    points = surfaces.ground_points[box][own]
    if len(points) < _MIN_PIXELS or np.ptp(points[:, :2], axis=0).max() < _MIN_EXTENT_M:
        return False
    if np.percentile(points[:, 2], 98) > _TALLEST_M:
        return False
    share_inside = float(inside[box][own].mean())
    if share_inside < 0.6:
        return False
    outside = points[~inside[box][own]]
    if len(outside) and float(np.ptp(outside[:, :2], axis=0).max()) > 0.2:
        return False
    # The lower half of a round thing is not seen from above, so it seems to begin at up to half its width.
    width = float(np.ptp(points[:, :2], axis=0).min())
    if np.percentile(points[:, 2], 4) < max(_FLOATING_M, 0.015 + 0.5 * width):
        return True
    return not _hovers(labels, label, box, camera)


def _hovers(labels: LabelImage, label: int, box: tuple[slice, slice], camera: PinholeCamera) -> bool:
    """Whether the bare table is seen below a thing that does not reach it."""
    own = (labels[box] == label).astype(np.uint8)
    padded = np.zeros((own.shape[0] + 8, own.shape[1]), np.uint8)
    padded[: own.shape[0]] = own
    below = (np.roll(padded, 6, axis=0) > 0) & (cv2.dilate(padded, np.ones((3, 3), np.uint8)) == 0)
    v, u = np.nonzero(below)
    v, u = v + box[0].start, u + box[1].start
    seen = v < camera.height
    v, u = v[seen], u[seen]
    if len(v) < 5:
        return False
    return float((labels[v, u] == 0).mean()) > 0.6


def hidden_share(mask: Mask, depth: npt.NDArray[np.float32]) -> float:
    """Return how much of a thing's outline is not its own: cut by the image's border or by something nearer, 0 to 1."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    y0, x0 = max(0, int(rows[0]) - 5), max(0, int(columns[0]) - 5)
    box = np.s_[y0 : int(rows[-1]) + 6, x0 : int(columns[-1]) + 6]
    part = mask[box].astype(np.uint8)
    own = np.where((part > 0) & np.isfinite(depth[box]), depth[box], np.float32(0.0)).astype(np.float32)
    ring = (cv2.dilate(part, np.ones((9, 9), np.uint8)) > 0) & (cv2.dilate(part, np.ones((5, 5), np.uint8)) == 0)
    with np.errstate(invalid="ignore"):
        nearer = ring & (depth[box] < cv2.dilate(own, np.ones((9, 9), np.uint8)) - 0.03)
    cut = int(mask[:, :2].any(axis=1).sum() + mask[:, -2:].any(axis=1).sum())
    cut += int(mask[:2].any(axis=0).sum() + mask[-2:].any(axis=0).sum())
    outline = float(ring.sum()) / 2.0 + cut
    return float(np.clip(2.5 * (0.5 * float(nearer.sum()) + cut) / max(outline, 1.0), 0.0, 1.0))


def _closed(mask: Mask, box: tuple[slice, slice]) -> Mask:
    """Close the holes that missing depth leaves in a mask."""
    rows = slice(max(0, box[0].start - 4), box[0].stop + 4)
    columns = slice(max(0, box[1].start - 4), box[1].stop + 4)
    part = np.ascontiguousarray(mask[rows, columns]).astype(np.uint8)
    part = cv2.morphologyEx(part, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5)))
    result = np.zeros_like(mask)
    result[rows, columns] = part.astype(bool)
    return result
