# SPDX-License-Identifier: Apache-2.0
"""Covers in place of meshes: nothing is called free that is not, and nothing that is free is refused."""

import coal
import numpy as np
import pinocchio as pin
import pytest
from exec_fixtures import robot, start_positions
from scipy.optimize import nnls
from uncom_tiago_exec.collision.collision_checker import CollisionChecker, Contacts, densify
from uncom_tiago_exec.collision.options import CONVEX_CHECKER
from uncom_tiago_exec.robot.convex_covers import convex_covers, mesh_hash, shape_corners
from uncom_tiago_exec.robot.options import CONVEX_COVERS
from uncom_tiago_exec.scene.obstacles import make_upright_pose
from uncom_tiago_exec.types import SIDES, Attachment, Obstacle

_TABLE = Obstacle("table", "box", (0.56, 1.06, 0.08), make_upright_pose(np.array([0.7, 0.0, 0.68]), 0.0))


def _scene(rng, count):
    solids = [_TABLE]
    for i in range(count):
        size = tuple(rng.uniform([0.04, 0.04, 0.05], [0.12, 0.1, 0.25]))
        at = np.array([rng.uniform(0.45, 0.9), rng.uniform(-0.5, 0.5), 0.72 + size[2] / 2.0])
        shape = "cylinder" if i % 2 else "box"
        size = (size[0], size[0], size[2]) if i % 2 else size
        solids.append(Obstacle(f"thing{i}", shape, size, make_upright_pose(at, rng.uniform(-3.0, 3.0))))
    return tuple(solids)


def _checker(side, seed):
    """Return a checker in a scene of its own: with something in the hand, or with a thing the fingers may touch."""
    rng = np.random.default_rng(seed)
    group = robot().group(side, start_positions())
    pose = np.eye(4)
    pose[:3, 3] = [0.03, 0.0, -0.02]
    held = Attachment((Obstacle("held", "cylinder", (0.06, 0.06, 0.16), pose),)) if seed % 2 else None
    contacts = Contacts(held=frozenset({"table"})) if seed % 2 else Contacts(fingers=frozenset({"thing1"}))
    checker = CollisionChecker(group, _scene(rng, 8), contacts=contacts, attachment=held)
    home = group.clamp(group.vector(start_positions()))
    if seed % 3:
        checker.lower_margins_at(home)
    return checker, home, rng


def _is_free_by_meshes(checker, q):
    """Look at the meshes and solids alone: each pair by itself, without covers, maps or a broad phase."""
    return not checker.touching(q)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("side", SIDES)
def test_the_covers_never_calls_free_what_the_meshes_do_not(side, seed):
    checker, home, rng = _checker(side, seed)
    group = checker.group
    states = [*rng.uniform(group.lower, group.upper, (250, 8)), *group.clamp(home + rng.normal(0.0, 0.3, (250, 8)))]
    said, true = [checker.is_free(q) for q in states], [_is_free_by_meshes(checker, q) for q in states]
    assert said == true
    assert 50 < sum(true) < 480


def test_nearly_all_free_states_are_told_by_the_covers_alone():
    checker, _, rng = _checker("left", 3)
    free = [q for q in rng.uniform(checker.group.lower, checker.group.upper, (600, 8)) if checker.is_free(q)]
    quick = sum(checker._convex.is_free(q) for q in free)
    assert quick > 0.93 * len(free)


@pytest.mark.parametrize("seed", range(3))
def test_a_path_is_free_if_and_only_if_every_state_on_it_is(seed):
    checker, home, rng = _checker(SIDES[seed % 2], seed)
    group, verdicts = checker.group, []
    for _ in range(25):
        path = group.clamp(home + np.cumsum(rng.normal(0.0, 0.25, (4, 8)), axis=0))
        every = all(checker.is_free(q) for q in densify(path, 0.01))
        assert checker.path_is_free(path, 0.01) == every
        found = checker.first_collision(path, 0.01)
        assert found is None or not checker.is_free(found)
        verdicts.append(every)
    assert True in verdicts
    assert False in verdicts


def test_far_fewer_states_of_a_free_path_are_looked_at_than_lie_on_it():
    checker, _, rng = _checker("left", 3)
    group, looked_at, lie_there = checker.group, 0, 0
    for _ in range(60):
        a, b = rng.uniform(group.lower, group.upper, (2, 8))
        path = np.vstack([a, a + 0.3 * (b - a)])
        before = checker.checks
        if checker.path_is_free(path, 0.005):
            looked_at += checker.checks - before
            lie_there += len(densify(path, 0.005))
    assert 0 < looked_at < 0.4 * lie_there


def test_no_solid_moves_farther_than_the_bound_that_lets_states_be_left_out():
    checker, _, rng = _checker("left", 3)
    quick, group = checker._convex, checker.group
    model, data, geometry = group.model, group.model.createData(), checker._mesh_checker()._geometry
    gdata = geometry.createData()
    movable = [i for i, g in enumerate(geometry.geometryObjects) if g.parentJoint > 1]
    corners = {i: shape_corners(geometry.geometryObjects[i].geometry) for i in movable}

    def places(q, base):
        pin.updateGeometryPlacements(model, data, geometry, gdata, q)
        frame = data.oMi[1].inverse() if base else pin.SE3.Identity()
        return {i: (frame * gdata.oMg[i]) for i in movable}

    share = {i: quick.clearance_shares(geometry.geometryObjects[i].parentJoint) for i in movable}
    for _ in range(60):
        a = rng.uniform(group.lower, group.upper)
        b = group.clamp(a + rng.normal(0.0, 0.1, 8))
        travel = float(quick.travel_along(np.vstack([a, b]))[-1])
        for rising in (False, True):
            first, second = places(a, rising), places(b, rising)
            for i in movable:
                ends = [corners[i] @ p[i].rotation.T + p[i].translation for p in (first, second)]
                moved = float(np.linalg.norm(ends[1] - ends[0], axis=1).max())
                assert moved <= travel * share[i][int(rising)] + 1e-9


def test_every_point_of_a_mesh_is_within_the_radius_of_one_of_its_bodies():
    rng = np.random.default_rng(4)
    for solid in robot().geometry.geometryObjects:
        if not isinstance(solid.geometry, coal.BVHModelBase):
            continue
        vertices = shape_corners(solid.geometry)
        for detailed in (True, False):
            covers = convex_covers(vertices, detailed=detailed)
            assert all(len(c.corners) <= CONVEX_COVERS.max_corners for c in covers)
            points = np.vstack([vertices[::7], rng.dirichlet(np.full(len(vertices), 0.02), 25) @ vertices])
            for point in points:
                assert min(_apart(c.corners, point) - c.radius for c in covers) < 1e-6


def _apart(corners, point):
    weights, _ = nnls(np.vstack([corners.T, np.full(len(corners), 1e3)]), np.append(point, 1e3))
    return float(np.linalg.norm(weights @ corners / weights.sum() - point))


def test_a_mesh_that_no_file_knows_gets_one_coarse_body():
    points = np.random.default_rng(7).normal(size=(400, 3))
    points *= 0.05 / np.linalg.norm(points, axis=1, keepdims=True)
    covers = convex_covers(points, detailed=True)
    assert len(covers) == 1
    assert 0.001 < covers[0].radius < 0.03
    assert mesh_hash(points) != mesh_hash(points + 1e-3)


def test_clearances_go_from_wide_to_narrow():
    assert list(CONVEX_CHECKER.clearances_m) == sorted(CONVEX_CHECKER.clearances_m, reverse=True)
