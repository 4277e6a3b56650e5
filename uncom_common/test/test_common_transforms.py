# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from uncom_common.exceptions import TransformError
from uncom_common.transforms import StampedTransform, TransformBuffer, apply, invert, matrix_from_pose, pose_from_matrix


def random_matrix(seed):
    rng = np.random.default_rng(seed)
    return matrix_from_pose(rng.normal(size=3), Rotation.random(rng=rng).as_quat())


def test_inverse_undoes_a_transform():
    matrix = random_matrix(1)
    points = np.random.default_rng(2).normal(size=(5, 3))
    assert np.allclose(apply(invert(matrix), apply(matrix, points)), points)


def test_pose_and_matrix_are_the_same_thing():
    matrix = random_matrix(3)
    assert np.allclose(matrix_from_pose(*pose_from_matrix(matrix)), matrix)


def buffer_with_chain():
    buffer = TransformBuffer()
    buffer.add(StampedTransform(0.0, "base", "torso", random_matrix(4)), static=True)
    buffer.add(StampedTransform(1.0, "torso", "head", matrix_from_pose([0, 0, 1], [0, 0, 0, 1])))
    buffer.add(StampedTransform(2.0, "torso", "head", matrix_from_pose([0, 0, 3], [0, 0, 1, 0])))
    buffer.add(StampedTransform(0.0, "base", "arm", random_matrix(5)), static=True)
    return buffer


def test_lookup_goes_up_one_branch_and_down_the_other():
    buffer = buffer_with_chain()
    there = buffer.lookup("head", "arm", 2.0)
    back = buffer.lookup("arm", "head", 2.0)
    assert np.allclose(there @ back, np.eye(4))


def test_lookup_interpolates_between_two_times():
    matrix = buffer_with_chain().lookup("head", "torso", 1.5)
    assert np.allclose(matrix[:3, 3], [0, 0, 2])
    assert abs(abs(Rotation.from_matrix(matrix[:3, :3]).magnitude()) - np.pi / 2) < 1e-9


def test_lookup_refuses_times_far_from_what_is_known():
    with pytest.raises(TransformError, match="latest is 2"):
        buffer_with_chain().lookup("head", "torso", 3.0)


def test_lookup_names_the_known_frames_when_one_is_missing():
    with pytest.raises(TransformError, match=r"not connected.*arm, base, head, torso"):
        buffer_with_chain().lookup("head", "camera", 1.5)


def test_time_that_jumps_back_starts_the_history_anew():
    buffer = buffer_with_chain()
    buffer.add(StampedTransform(0.5, "torso", "head", matrix_from_pose([0, 0, 9], [0, 0, 0, 1])))
    assert np.allclose(buffer.lookup("head", "torso", 0.5)[:3, 3], [0, 0, 9])
