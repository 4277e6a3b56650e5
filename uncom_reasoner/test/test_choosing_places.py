# SPDX-License-Identifier: Apache-2.0
"""Where things may be put: relations in metres, free cells, reach, pointed places, receiving things."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from reasoner_scenes import SIZES, TABLE_Z, VIEW, Thing, command, evidence, pointing, reference, table
from shapely.geometry import Polygon
from uncom_common.primitive import Primitive
from uncom_language.types import Relation
from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.grounding.ground import ground
from uncom_reasoner.posterior.context import build_context
from uncom_reasoner.posterior.discourse_memory import DiscourseMemory
from uncom_reasoner.support.receptacle import find_opening
from uncom_reasoner.support.support_plane import build_surface, compute_footprint, find_centre
from uncom_reasoner.support.voronoi_cells import build_occupancy_map
from uncom_reasoner.types import Evidence, Status, TargetKind
from uncom_reasoner.weights import load_weights

LATER = np.arange(1.8, 2.6, 0.1)
MOVED = Thing("lemon_1", "lemon", 0.55, 0.35)
KINDS = ("bowl", "box", "mug", "bottle", "apple", "plate", "banana")
SETTINGS = settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])


@st.composite
def tables(draw):
    """Things that do not touch, the moved lemon first and a box that relations refer to."""
    seed = draw(st.integers(0, 10_000))
    rng = np.random.default_rng(seed)
    things = [MOVED]
    for kind in ["box", *rng.choice(KINDS, rng.integers(0, 5))]:
        for _ in range(30):
            x, y = rng.uniform(0.52, 0.85), rng.uniform(-0.4, 0.4)
            r = max(SIZES[kind][:2]) / 2.0
            if all(np.hypot(x - t.x, y - t.y) > r + max(SIZES[t.kind][:2]) / 2.0 + 0.01 for t in things):
                things.append(Thing(f"{kind}_{len(things)}", str(kind), x, y, rng.uniform(0, 3)))
                break
    assume(len(things) > 1 and [t.kind for t in things].count("box") == 1)
    return things


def place(cmd, things, hands=(), **kwargs):
    return ground(evidence(cmd, things, list(hands), **kwargs))


def to(relation: Relation, target="box", **kwargs):
    return command(
        reference("lemon", 0, 1), reference(target, 1.9, 2.3), relation=relation, primitive=Primitive.PLACE, **kwargs
    )


def here(word="here"):
    return command(
        reference("lemon", 0, 1),
        reference(word, 1.9, 2.3, concrete=False, deictic=word),
        relation=Relation.HERE,
        primitive=Primitive.PLACE,
    )


def outlines(decision, things, **kwargs):
    """The outlines of everything, with the moved thing where it is to go (both measured by the real code)."""
    cmd = to(Relation.NEXT_TO)
    e: Evidence = evidence(cmd, things, **kwargs)
    context = build_context(e, load_weights(), PlacingConfig(), DiscourseMemory())
    shapes = dict(context.footprints)
    moved = shapes.pop("lemon_1")
    goal = decision.grounded.target.pose[:2, 3] - find_centre(moved)
    return shapely.transform(moved, lambda p: p + goal), shapes, context.surface


@SETTINGS
@given(things=tables(), relation=st.sampled_from(["left_of", "right_of", "in_front_of", "behind", "next_to", "near"]))
def test_a_relative_place_satisfies_its_relation_and_touches_nothing(things, relation):
    decision = place(to(Relation(relation)), things)
    if decision.grounded.status is not Status.GROUNDED:
        assert "free place" in decision.grounded.reason
        return
    moved, shapes, surface = outlines(decision, things)
    box = shapes[next(t.id for t in things if t.kind == "box")]
    x, y = find_centre(moved) - find_centre(box)
    gap = moved.distance(box)
    assert {
        "left_of": y > abs(x),
        "right_of": -y > abs(x),
        "in_front_of": -x > abs(y),
        "behind": x > abs(y),
        "next_to": gap < 0.13,
        "near": gap < 0.26,
    }[relation]
    assert all(moved.distance(shape) >= 0.019 for shape in shapes.values())
    assert surface.polygon.buffer(-0.019).contains(moved)
    assert min(np.hypot(*(find_centre(moved) - s)) for s in np.array([[0, 0.19], [0, -0.19]])) <= 0.851


@SETTINGS
@given(things=tables())
def test_free_cells_hold_no_footprint_and_cells_fill_the_table(things):
    """M15, M16: no cell is unbounded, none outside, none free under a thing."""
    _, shapes, surface = outlines(place(here(), things, pointing((0.6, 0, TABLE_Z), (0.8, 0, 0.9), LATER)), things)
    cells = build_occupancy_map(surface.polygon, shapes, 0.06, 0.02)
    polygons = [Polygon(c.polygon) for c in cells]
    assert all(p.is_valid and surface.polygon.buffer(1e-6).contains(p) for p in polygons)
    assert sum(p.area for p in polygons) == pytest.approx(surface.polygon.area, rel=1e-6)
    for cell, polygon in zip(cells, polygons, strict=True):
        touched = {name for name, shape in shapes.items() if shape.buffer(0.02).intersects(polygon)}
        assert set(cell.occupied_by.split()) == touched


def test_cells_are_finer_near_things_and_the_same_every_time():
    shape = shapely.box(0.0, 0.0, 1.0, 0.5)
    thing = shapely.Point(0.5, 0.25).buffer(0.05)
    first, again = (build_occupancy_map(shape, {"a": thing}, 0.06, 0.02) for _ in range(2))
    assert all(np.array_equal(a.polygon, b.polygon) for a, b in zip(first, again, strict=True))
    near = [Polygon(c.polygon).area for c in first if 0.06 < np.hypot(*(c.centre - [0.5, 0.25])) < 0.11]
    assert np.median(near) < np.median([Polygon(c.polygon).area for c in first])


def test_a_table_of_any_shape_is_used_and_not_its_bounding_box():
    """M14: an L-shaped table; its missing corner is no place."""
    ell = np.array([[0.45, -0.5], [0.95, -0.5], [0.95, 0.0], [0.65, 0.0], [0.65, 0.5], [0.45, 0.5]])
    things = [Thing("lemon_1", "lemon", 0.55, 0.1), Thing("box_1", "box", 0.57, 0.32)]
    decision = place(to(Relation.BEHIND), things, table=table(ell))
    assert decision.grounded.status is Status.FAILED
    assert "free place" in decision.grounded.reason
    decision = place(to(Relation.RIGHT_OF), things, table=table(ell))
    moved, _, surface = outlines(decision, things, table=table(ell))
    assert surface.polygon.buffer(-0.019).contains(moved)


@pytest.mark.parametrize("metric", [True, False])
def test_here_is_where_the_finger_points(metric):
    goal = np.array([0.62, -0.1])
    tip = (0.72, -0.02, 0.86)
    hands = pointing((*goal, TABLE_Z), tip, LATER, noise=0.03, metric=metric)
    things = [MOVED, Thing("box_1", "box", 0.75, 0.2)]
    g = place(here(), things, hands).grounded
    assert (g.status, g.target.kind) == (Status.GROUNDED, TargetKind.AREA)
    assert np.hypot(*(g.target.pose[:2, 3] - goal)) < (0.04 if metric else 0.12)
    assert g.target.pose[2, 3] == pytest.approx(TABLE_Z)


def test_here_with_the_finger_on_a_container_means_the_container():
    things = [MOVED, Thing("bowl_1", "bowl", 0.6, -0.2)]
    g = place(here(), things, pointing((0.6, -0.2, 0.74), (0.75, -0.1, 0.95), LATER)).grounded
    assert (g.target.kind, g.target.detection.id) == (TargetKind.OBJECT, "bowl_1")


def test_here_beside_a_container_means_the_table():
    things = [MOVED, Thing("bowl_1", "bowl", 0.6, -0.2)]
    g = place(here(), things, pointing((0.6, 0.03, TABLE_Z), (0.75, 0.06, 0.9), LATER)).grounded
    assert g.target.kind is TargetKind.AREA


def test_there_without_a_gesture_is_asked_about():
    """M11: no gesture is no crash."""
    decision = place(here("there"), [MOVED, Thing("bowl_1", "bowl", 0.6, -0.2)])
    g = decision.grounded
    assert (g.status, g.reason) == (Status.AMBIGUOUS, "I did not see where you pointed.")
    assert (decision.doubt.part, decision.doubt.choices) == ("target", ())


def this_target(primitive=Primitive.PUT_IN):
    target = reference("this", 1.9, 2.3, concrete=False, deictic="this")
    return command(reference("lemon", 0, 1), target, primitive=primitive, relation=Relation.IN)


def test_this_is_the_container_nearest_to_the_ray():
    things = [
        MOVED,
        Thing("bowl_1", "bowl", 0.6, -0.2),
        Thing("bowl_2", "bowl", 0.7, 0.05),
        Thing("box_1", "box", 0.6, 0.0),
    ]
    g = place(this_target(), things, pointing((0.7, 0.05, 0.76), (0.85, 0.1, 0.95), LATER)).grounded
    assert g.target.detection.id == "bowl_2"


def test_this_far_from_every_thing_is_a_free_place():
    things = [MOVED, Thing("bowl_1", "bowl", 0.8, 0.3)]
    g = place(this_target(), things, pointing((0.6, -0.25, TABLE_Z), (0.7, -0.2, 0.85), LATER)).grounded
    assert g.target.kind is TargetKind.AREA
    assert g.primitive == "place"


def test_a_place_between_two_things_is_between_them():
    things = [MOVED, Thing("box_1", "box", 0.6, -0.25), Thing("bowl_1", "bowl", 0.65, 0.12)]
    g = place(to(Relation.BETWEEN, reference2=reference("bowl", 2.4, 2.6)), things).grounded
    a, b, p = np.array([0.6, -0.25]), np.array([0.65, 0.12]), g.target.pose[:2, 3]
    share = (p - a) @ (b - a) / ((b - a) @ (b - a))
    assert 0.2 < share < 0.8


def test_left_and_right_turn_round_for_the_speakers_side():
    things = [MOVED, Thing("box_1", "box", 0.6, 0.0)]
    y = {}
    for side in ("robot", "speaker"):
        decision = ground(evidence(to(Relation.LEFT_OF), things), placing=PlacingConfig(perspective=side))
        y[side] = decision.grounded.target.pose[1, 3]
    assert y["robot"] > 0.05
    assert y["speaker"] < -0.05


def test_in_the_corner_and_in_the_middle_are_parts_of_the_table():
    things = [MOVED, Thing("box_1", "box", 0.6, 0.2)]
    corner = reference("left front corner", 1, 2, concrete=False)
    g = place(command(reference("lemon", 0, 1), corner, relation=Relation.IN), things).grounded
    assert g.target.pose[0, 3] < 0.6
    assert g.target.pose[1, 3] > 0.3
    g = place(to(Relation.BETWEEN, target="table"), things).grounded
    assert np.hypot(*(g.target.pose[:2, 3] - [0.7, 0.0])) < 0.1


def test_on_the_table_is_anywhere_free():
    g = place(to(Relation.ON, target="table"), [MOVED, Thing("box_1", "box", 0.6, 0.2)]).grounded
    assert g.target.kind is TargetKind.AREA


def test_under_is_refused_in_words():
    g = place(to(Relation.UNDER), [MOVED, Thing("box_1", "box", 0.6, 0.2)]).grounded
    assert g.reason == "I cannot put things under other things."


def test_a_place_out_of_reach_is_not_chosen():
    things = [MOVED, Thing("box_1", "box", 0.85, 0.0)]
    g = place(to(Relation.BEHIND), things).grounded
    assert g.status is Status.FAILED


def test_a_hand_that_stays_on_the_object_does_not_point_at_the_target():
    things = [MOVED, Thing("bowl_1", "bowl", 0.6, 0.22), Thing("bowl_2", "bowl", 0.6, -0.2)]
    cmd = command(reference("lemon", 0.2, 0.6, deictic="this"), reference("bowl", 0.8, 1.2))
    g = place(cmd, things, pointing((0.55, 0.35, 0.745), (0.75, 0.4, 0.9), np.arange(0, 1, 0.1))).grounded
    assert (g.status, g.reason) == (Status.AMBIGUOUS, "I could not tell which bowl you mean: there are two.")


def test_a_full_table_is_said():
    """M20: a place must hold the thing."""
    crowd = [Thing(f"plate_{i}{j}", "plate", 0.57 + 0.26 * i, -0.38 + 0.25 * j) for i in range(2) for j in range(4)]
    moved = Thing("plate_9", "plate", 0.57, 0.38)
    cmd = command(reference("plate", 0, 1, deictic="this"), reference("table", 1, 2), relation=Relation.ON)
    hands = pointing((0.57, 0.38, 0.73), (0.7, 0.38, 0.85), np.arange(0, 1, 0.1))
    g = ground(evidence(cmd, [moved, *crowd[:3], *crowd[4:]], hands)).grounded
    assert g.status is Status.FAILED
    assert "free place" in g.reason


def test_what_does_not_fit_into_a_container_is_not_put_in():
    things = [Thing("plate_1", "plate", 0.6, 0.2), Thing("mug_1", "mug", 0.6, -0.2)]
    g = place(command(reference("plate", 0, 1), reference("mug", 1, 2)), things).grounded
    assert g.reason == "The plate does not fit in the mug."


def test_the_middle_of_an_opening_ignores_the_handle():
    rng = np.random.default_rng(0)
    thing = evidence(to(Relation.IN), [MOVED, Thing("bowl_1", "bowl", 0.6, 0.0)]).scene
    bowl = next(d for d in thing.detections if d.id == "bowl_1")
    handle = np.column_stack([rng.uniform(0.6, 0.61, 200), rng.uniform(0.08, 0.25, 200), np.full(200, 0.78)])
    cloud = np.vstack([bowl.geometry.cloud, handle]).astype(np.float32)
    pan = replace(bowl, geometry=replace(bowl.geometry, cloud=cloud))
    surface = build_surface(thing, VIEW, PlacingConfig())
    assert np.hypot(*(find_opening(pan, surface).centre - [0.6, 0.0])) < 0.015
    assert find_centre(compute_footprint(pan, surface))[1] > 0.03


def test_without_depth_places_are_found_in_the_picture():
    cmd = to(Relation.LEFT_OF)
    e = evidence(cmd, [MOVED, Thing("box_1", "box", 0.6, -0.1)])
    flat = replace(
        e.scene,
        frame_id="camera",
        table=replace(e.scene.table, polygon=np.zeros((0, 3))),
        detections=tuple(replace(d, geometry=None) for d in e.scene.detections),
    )
    decision = ground(replace(e, scene=flat))
    assert decision.grounded.status is Status.GROUNDED
    assert not decision.metric
    assert decision.grounded.target.pose is None
    box = next(d for d in flat.detections if d.id == "box_1").box
    assert decision.grounded.target.area[:, 0].mean() < box.x_min
