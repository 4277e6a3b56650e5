# SPDX-License-Identifier: Apache-2.0
"""What is written into a bag comes out of it, and what is damaged is said so."""

from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
import pytest
import rclpy.serialization as ros
from std_msgs.msg import Header, String
from uncom_bringup.bags import image_codec
from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.bags.bag_writer import BagWriter
from uncom_bringup.exceptions import BadInputError, BagError, OutputExistsError, UnknownTypeError
from uncom_bringup.graph.topics import RECORDED, Form
from uncom_bringup.monitor.conversions import compressed_from_image, compressed_to_image, message_class
from uncom_common.conversions import depth_from_msg, depth_to_msg

STRING = "std_msgs/msg/String"


def write(path, count=50, storage="mcap", **options):
    with BagWriter(path, storage, **options) as bag:
        bag.add_topic("/words", STRING)
        for number in range(count):
            bag.write("/words", 1_000_000 * (number + 1), ros.serialize_message(String(data=f"word {number}")))
    return path


@pytest.mark.parametrize(("storage", "name"), [("mcap", "a.mcap"), ("sqlite3", "a")])
def test_messages_come_out_in_order_with_their_times_and_bytes(tmp_path, storage, name):
    path = write(tmp_path / name, storage=storage)
    with BagReader(path) as bag:
        messages = list(bag.messages())
        assert [m.time_ns for m in messages] == [1_000_000 * (n + 1) for n in range(50)]
        assert [ros.deserialize_message(m.data, String).data for m in messages] == [f"word {n}" for n in range(50)]
        assert bag.duration_s == pytest.approx(0.049, abs=1e-6)


def test_every_recorded_type_has_its_definition_inside(tmp_path):
    """A bag can be read where our packages are not installed: by the definitions in it alone."""
    path = tmp_path / "all.mcap"
    with BagWriter(path) as bag:
        for topic in RECORDED:
            name = topic.type_name if topic.form is Form.PLAIN else "sensor_msgs/msg/CompressedImage"
            bag.add_topic(topic.stored_name, name, topic.latched)
            bag.write(topic.stored_name, 1, ros.serialize_message(message_class(name)()))
    with BagReader(path) as bag:
        messages = list(bag.messages())
        assert len(messages) == len(RECORDED)
        assert all(message.topic.type_name in bag._reader.typestore.fielddefs for message in messages)


def test_latched_topics_stay_latched(tmp_path):
    path = tmp_path / "latched.mcap"
    with BagWriter(path) as bag:
        bag.add_topic("/once", STRING, latched=True)
        bag.add_topic("/often", STRING)
        for topic in ("/once", "/often"):
            bag.write(topic, 1, ros.serialize_message(String(data="x")))
    with BagReader(path) as bag:
        assert {topic.name: topic.latched for topic in bag.topics} == {"/once": True, "/often": False}


def test_an_existing_bag_is_overwritten_only_by_force(tmp_path):
    path = write(tmp_path / "a.mcap", 3)
    with pytest.raises(OutputExistsError, match="--force"):
        write(path, 4)
    write(path, 5, force=True)
    with BagReader(path) as bag:
        assert len(list(bag.messages())) == 5
    assert [p.name for p in tmp_path.iterdir()] == ["a.mcap"]


def test_of_a_bag_that_fails_before_its_first_message_nothing_is_left(tmp_path):
    with pytest.raises(UnknownTypeError), BagWriter(tmp_path / "a.mcap") as bag:
        bag.add_topic("/thing", "no_such_msgs/msg/Thing")
    assert list(tmp_path.iterdir()) == []


def test_an_mcap_bag_needs_its_suffix(tmp_path):
    with pytest.raises(BadInputError, match=r"\.mcap"):
        BagWriter(tmp_path / "bag")


def test_an_unknown_type_is_named(tmp_path):
    with BagWriter(tmp_path / "a.mcap") as bag, pytest.raises(UnknownTypeError, match="no_such_msgs/msg/Thing"):
        bag.add_topic("/thing", "no_such_msgs/msg/Thing")


def test_a_folder_without_metadata_is_read_with_a_warning(tmp_path, caplog):
    path = write(tmp_path / "a", storage="sqlite3")
    (path / "metadata.yaml").unlink()
    with BagReader(path) as bag:
        assert len(list(bag.messages())) == 50
    assert "no metadata.yaml" in caplog.text


def test_metadata_that_writes_its_quality_of_service_otherwise_loses_nothing(tmp_path):
    """Bags of older distributions do; opened naively they seem empty."""
    path = write(tmp_path / "a", storage="sqlite3")
    metadata = path / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("depth: 10", "depth: 7").replace("2147483647", "0"))
    with BagReader(path) as bag:
        assert len(list(bag.messages())) == 50


def test_a_missing_file_of_a_bag_is_named(tmp_path):
    path = write(tmp_path / "a", storage="sqlite3")
    next(path.glob("*.db3")).unlink()
    with pytest.raises(BagError, match="missing"):
        BagReader(path)


@pytest.mark.parametrize("name", ["nothing.mcap", "notes.txt", "folder"])
def test_what_is_no_bag_is_told_so(tmp_path, name):
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "folder").mkdir()
    with pytest.raises(BagError):
        BagReader(tmp_path / name)


def noisy_table(seed):
    """A slanted top with a box on it before a far wall: truth and measurement [m] as a depth camera gives them."""
    rng = np.random.default_rng(seed)
    truth = np.linspace(2.4, 0.7, 240)[:, None] * np.ones((1, 320))
    truth[:60] = 3.5
    truth[120:180, 100:200] = 0.9
    measured = truth + rng.normal(0.0, 0.0015, truth.shape) * truth**2
    measured[rng.random(truth.shape) < 0.02] = np.nan
    return truth, measured.astype(np.float32)


def test_stored_depth_is_as_near_to_the_truth_as_measured_depth_and_keeps_its_holes():
    for seed in range(3):
        truth, measured = noisy_table(seed)
        compressed = compressed_from_image(depth_to_msg(measured, Header()), Form.DEPTH)
        back = depth_from_msg(compressed_to_image(compressed))
        known = np.isfinite(measured)
        assert np.array_equal(np.isfinite(back), known)
        assert np.abs(back - truth)[known].mean() <= np.abs(measured - truth)[known].mean()
        assert np.abs(back - measured)[known].max() < 0.05 * truth.max()
        assert len(compressed.data) < 0.15 * 2 * measured.size


def test_depth_is_stored_as_the_image_transport_of_ros_reads_it():
    """compressed_depth_image_transport decodes floats as a / (value - b), a and b being in the header."""
    depth = np.array([[0.5, 1.0, 2.0, 4.0, np.nan, np.inf, 0.0]], np.float32)
    msg = compressed_from_image(depth_to_msg(np.repeat(depth, 8, 0), Header()), Form.DEPTH)
    assert msg.format == "32FC1; compressedDepth png"
    data = bytes(msg.data)
    code, a, b = struct.unpack_from("<iff", data)
    values = cv2.imdecode(np.frombuffer(data[12:], np.uint8), cv2.IMREAD_UNCHANGED)
    assert code == 0
    assert values.dtype == np.uint16
    assert a / (values[0, :4] - b) == pytest.approx(depth[0, :4], rel=0.02)
    assert not values[:, 4:].any()


def test_millimetres_of_other_recorders_are_read_too():
    image = np.array([[0, 1, 1234, 65535]], np.uint16)
    png = cv2.imencode(".png", image)[1].tobytes()
    for data in (png, struct.pack("<iff", 0, 0.0, 0.0) + png):
        depth = image_codec.decode_depth(data, "16UC1; compressedDepth png")
        assert np.isnan(depth[0, 0])
        assert depth[0, 1:] == pytest.approx([0.001, 1.234, 65.535])


def test_a_damaged_picture_is_an_error_in_words():
    endless = bytearray(cv2.imencode(".png", np.zeros((4, 4), np.uint16))[1].tobytes())
    endless[16:24] = struct.pack(">II", 400_000, 400_000)  # width and height in its header
    endless[29:33] = struct.pack(">I", zlib.crc32(endless[12:29]))
    for decode in (image_codec.decode_colour, image_codec.decode_depth):
        for data in (b"", b"\x89PNG but not really", bytes(100), bytes(endless)):
            with pytest.raises(BadInputError):
                decode(data)
