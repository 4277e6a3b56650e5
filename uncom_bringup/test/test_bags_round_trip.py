# SPDX-License-Identifier: Apache-2.0
"""What is written into a bag comes out of it, and what is damaged is said so."""

from __future__ import annotations

import numpy as np
import pytest
import rclpy.serialization as ros
from std_msgs.msg import Header, String
from uncom_bringup.bag_reader import BagReader
from uncom_bringup.bag_writer import BagWriter
from uncom_bringup.conversions import compressed_from_image, message_class
from uncom_bringup.exceptions import BadInputError, BagError, OutputExistsError, UnknownTypeError
from uncom_bringup.topics import RECORDED, Form
from uncom_common.conversions import depth_to_msg

from uncom_bringup import image_codec

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


def test_an_mcap_bag_needs_its_suffix(tmp_path):
    with pytest.raises(BadInputError, match=r"\.mcap"):
        BagWriter(tmp_path / "bag")


def test_an_unknown_type_is_named(tmp_path):
    with BagWriter(tmp_path / "a.mcap") as bag, pytest.raises(UnknownTypeError, match="no_such_msgs/msg/Thing"):
        bag.add_topic("/thing", "no_such_msgs/msg/Thing")


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.9, 0.999])
def test_a_bag_that_is_cut_off_is_a_clear_error(tmp_path, share):
    data = write(tmp_path / "whole.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: int(share * len(data))])
    with pytest.raises(BagError, match=r"cut\.mcap: (is empty|cannot be read)"), BagReader(cut) as bag:
        list(bag.messages())


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


def test_depth_keeps_millimetres_and_holes(tmp_path):
    rng = np.random.default_rng(3)
    depth = rng.uniform(0.3, 8.0, (48, 64)).astype(np.float32)
    depth[rng.random((48, 64)) < 0.1] = np.nan
    compressed = compressed_from_image(depth_to_msg(depth, Header()), Form.DEPTH)
    back = image_codec.decode_depth(bytes(compressed.data))
    assert np.array_equal(np.isnan(back), np.isnan(depth))
    assert np.nanmax(np.abs(back - depth)) <= 0.00051


def test_a_damaged_picture_is_an_error_in_words():
    for decode in (image_codec.decode_colour, image_codec.decode_depth):
        for data in (b"", b"\x89PNG but not really", bytes(100)):
            with pytest.raises(BadInputError):
                decode(data)
