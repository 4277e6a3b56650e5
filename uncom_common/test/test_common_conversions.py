# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import Image
from uncom_common.camera import PinholeCamera
from uncom_common.exceptions import ImageFormatError, UnknownPrimitiveError
from uncom_common.primitive import Primitive
from uncom_common.transforms import StampedTransform, matrix_from_pose

from uncom_common import conversions as c
from uncom_interfaces.msg import Command

HEADER = c.header_to_msg(12.25, "camera")


def test_times_survive_the_round_trip_to_the_nanosecond_of_a_float():
    assert c.seconds_from_msg(c.time_to_msg(1_795_000_000.123456)) == pytest.approx(1_795_000_000.123456, abs=1e-6)
    assert c.seconds_from_msg(c.duration_to_msg(-0.25)) == pytest.approx(-0.25)


def test_pose_survives_the_round_trip():
    matrix = matrix_from_pose([1, 2, 3], Rotation.random(rng=np.random.default_rng(0)).as_quat())
    assert np.allclose(c.matrix_from_pose_msg(c.pose_to_msg(matrix)), matrix)


def test_stamped_transform_survives_the_round_trip():
    matrix = matrix_from_pose([1, 2, 3], Rotation.random(rng=np.random.default_rng(1)).as_quat())
    back = c.stamped_transform_from_msg(c.stamped_transform_to_msg(StampedTransform(3.5, "a", "b", matrix)))
    assert (back.stamp_s, back.parent, back.child) == (3.5, "a", "b")
    assert np.allclose(back.matrix, matrix)


def test_camera_survives_the_round_trip():
    camera = PinholeCamera(640, 480, 522.0, 521.0, 320.5, 240.5)
    assert c.camera_from_msg(c.camera_to_msg(camera, HEADER)) == camera


def test_colour_image_survives_the_round_trip_and_bgr_is_turned():
    image = np.random.default_rng(2).integers(0, 255, (4, 6, 3), dtype=np.uint8)
    msg = c.rgb_to_msg(image, HEADER)
    assert (c.rgb_from_msg(msg) == image).all()
    msg.encoding = "bgr8"
    assert (c.rgb_from_msg(msg) == image[..., ::-1]).all()


def test_row_padding_is_removed():
    msg = Image(header=HEADER, height=2, width=2, encoding="mono8", step=5, data=bytes([1, 2, 0, 0, 0, 3, 4, 0, 0, 0]))
    assert (c.rgb_from_msg(msg)[..., 0] == [[1, 2], [3, 4]]).all()


def test_depth_reads_metres_and_millimetres_and_marks_the_unknown():
    depth = np.array([[1.5, np.nan], [0.0, 2.0]], np.float32)
    back = c.depth_from_msg(c.depth_to_msg(depth, HEADER))
    assert (np.isnan(back) == [[False, True], [True, False]]).all()
    assert back[0, 0] == 1.5
    data = np.array([[1500, 0]], np.uint16).tobytes()
    msg = Image(header=HEADER, height=1, width=2, encoding="16UC1", step=4, data=data)
    assert c.depth_from_msg(msg)[0, 0] == pytest.approx(1.5)


@pytest.mark.parametrize(("encoding", "match"), [("bayer_rggb8", "bayer_rggb8"), ("rgb8", "holds only")])
def test_unreadable_images_are_refused_in_one_line(encoding, match):
    with pytest.raises(ImageFormatError, match=match):
        c.rgb_from_msg(Image(header=HEADER, height=4, width=4, encoding=encoding, step=12, data=bytes(3)))


def test_cloud_survives_the_round_trip_also_when_empty():
    points = np.random.default_rng(3).normal(size=(7, 3)).astype(np.float32)
    assert (c.cloud_from_msg(c.cloud_to_msg(points, HEADER)) == points).all()
    assert c.cloud_from_msg(c.cloud_to_msg(np.zeros((0, 3)), HEADER)).shape == (0, 3)


@pytest.mark.parametrize("primitive", Primitive)
def test_a_primitive_survives_the_round_trip(primitive):
    assert c.primitive_from_msg(c.primitive_to_msg(primitive)) is primitive


def test_the_constants_of_the_message_are_the_primitives():
    constants = {name for name in dir(type(Command)) if name.startswith("PRIMITIVE_")}
    constants -= {name for name in constants if not isinstance(getattr(Command, name), int)}
    assert constants == {f"PRIMITIVE_{primitive.name}" for primitive in Primitive}
    assert len({getattr(Command, name) for name in constants}) == len(Primitive)
    assert c.primitive_from_msg(Command().primitive) is Primitive.NONE


def test_a_number_that_stands_for_no_primitive_is_refused():
    with pytest.raises(UnknownPrimitiveError, match="primitive 200 is not one of 0 NONE, 1 PUT_IN"):
        c.primitive_from_msg(200)
