# SPDX-License-Identifier: Apache-2.0
"""Bags that others recorded: compressed, split, of ROS 1, cut off, with types that are not installed."""

from __future__ import annotations

import numpy as np
import pytest
import rclpy.serialization as ros
import yaml
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sensor_msgs.msg import Image
from std_msgs.msg import String
from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.exceptions import BagError
from uncom_common.conversions import rgb_from_msg

STRING = "std_msgs/msg/String"
COUNT = 200
PLUGINS = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}


def write(path, storage, mode=None, first=0, count=COUNT):
    """A bag of strings, one a millisecond, as another recorder writes it."""
    store = get_typestore(Stores.ROS2_JAZZY)
    writer = Writer(path, version=9, storage_plugin=PLUGINS[storage])
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection("/words", STRING, typestore=store)
        for number in range(first, first + count):
            text = f"word {number} " + "x" * 2000
            writer.write(topic, 1_000_000 * (number + 1), ros.serialize_message(String(data=text)))
    return path


def numbers(bag, **span):
    return [int(ros.deserialize_message(m.data, String).data.split()[1]) for m in bag.messages(**span)]


@pytest.mark.parametrize("storage", PLUGINS)
@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE, CompressionMode.STORAGE])
def test_compressed_bags_read_like_plain_ones(tmp_path, storage, mode):
    if storage == "sqlite3" and mode is CompressionMode.STORAGE:
        pytest.skip("SQLite has no compression of its own")
    with BagReader(write(tmp_path / "a", storage, mode)) as bag:
        assert numbers(bag) == list(range(COUNT))


def test_a_bag_that_is_split_reads_as_one_with_or_without_metadata(tmp_path, caplog):
    whole = tmp_path / "whole"
    whole.mkdir()
    names = []
    for part in range(11):
        folder = write(tmp_path / f"part{part}", "sqlite3", first=20 * part, count=20)
        names.append(f"whole_{part}.db3")
        next(folder.glob("*.db3")).rename(whole / names[-1])
    with BagReader(whole) as bag:
        assert numbers(bag) == list(range(220))
    assert "no metadata.yaml" in caplog.text
    content = yaml.safe_load((folder / "metadata.yaml").read_text())
    content["rosbag2_bagfile_information"]["relative_file_paths"] = names
    (whole / "metadata.yaml").write_text(yaml.safe_dump(content))
    with BagReader(whole) as bag:
        assert numbers(bag) == list(range(220))
        assert numbers(bag, start_s=0.1, duration_s=0.05) == list(range(100, 150))


@pytest.mark.parametrize("share", [0.0, 0.001, 0.01])
@pytest.mark.parametrize("storage", PLUGINS)
def test_a_bag_of_which_nothing_is_left_is_a_clear_error(tmp_path, storage, share):
    file = next(path for path in write(tmp_path / "a", storage).iterdir() if path.suffix in (".mcap", ".db3"))
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    with pytest.raises(BagError, match=r"(is empty|cannot be read|damaged)"), BagReader(file) as bag:
        list(bag.messages())


# Of a database, what is reached over a page that is gone is gone, too.
@pytest.mark.parametrize(
    ("storage", "share"), [("mcap", 0.5), ("mcap", 0.9), ("mcap", 0.999), ("sqlite3", 0.9), ("sqlite3", 0.999)]
)
def test_what_is_left_of_a_bag_that_is_cut_off_is_read_with_a_warning(tmp_path, caplog, storage, share):
    # A recorder that dies leaves the messages of finished chunks; they are small here to have several.
    folder = write(tmp_path / "a", storage, count=2000)
    file = next(path for path in folder.iterdir() if path.suffix in (".mcap", ".db3"))
    size = file.stat().st_size
    file.write_bytes(file.read_bytes()[: int(share * size)])
    with BagReader(folder) as bag:
        found = numbers(bag)
    assert found == list(range(len(found)))
    assert len(found) > 0.5 * share * 2000
    assert "saved" in caplog.text or "cut off" in caplog.text


def test_a_bag_of_ros_1_reads_as_ros_2(tmp_path):
    store = get_typestore(Stores.ROS1_NOETIC)
    types, path = store.types, tmp_path / "old.bag"
    picture = np.arange(4 * 6 * 3, dtype=np.uint8)
    with Writer1(path) as bag:
        words = bag.add_connection("/words", STRING, typestore=store, latching=1)
        images = bag.add_connection("/camera", "sensor_msgs/msg/Image", typestore=store)
        header = types["std_msgs/msg/Header"](seq=7, stamp=types["builtin_interfaces/msg/Time"](3, 5), frame_id="lens")
        image = types["sensor_msgs/msg/Image"](header, 4, 6, "rgb8", 0, 18, picture)
        bag.write(words, 1_000_000_000, store.serialize_ros1(types[STRING](data="hello"), STRING))
        bag.write(images, 2_000_000_000, store.serialize_ros1(image, "sensor_msgs/msg/Image"))
    with BagReader(path) as bag:
        assert {topic.name: topic.latched for topic in bag.topics} == {"/words": True, "/camera": False}
        first, second = bag.messages()
        assert ros.deserialize_message(first.data, String).data == "hello"
        read = ros.deserialize_message(second.data, Image)
        assert (read.header.stamp.sec, read.header.stamp.nanosec, read.header.frame_id) == (3, 5, "lens")
        assert np.array_equal(rgb_from_msg(read), picture.reshape(4, 6, 3))
        assert bag.deserialise(second).width == 6


def test_types_of_ros_1_that_ros_2_lacks_are_left_out_in_one_line(tmp_path, caplog):
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("string text", "odd_msgs/msg/Odd"))
    path = tmp_path / "odd.bag"
    with Writer1(path) as bag:
        odd = bag.add_connection("/odd", "odd_msgs/msg/Odd", typestore=store)
        words = bag.add_connection("/words", STRING, typestore=store)
        for number in range(3):
            bag.write(odd, number + 1, store.serialize_ros1(store.types["odd_msgs/msg/Odd"]("x"), "odd_msgs/msg/Odd"))
            bag.write(words, number + 1, store.serialize_ros1(store.types[STRING](data=f"word {number}"), STRING))
    with BagReader(path) as bag:
        assert numbers(bag) == [0, 1, 2]
    assert caplog.text.count("odd_msgs/msg/Odd") == 2  # once as the topic's type, once as what is not installed
    assert len(caplog.records) == 1


def test_a_definition_that_cannot_be_read_costs_its_topic_only(tmp_path):
    folder = write(tmp_path / "a", "mcap", count=3)
    file = next(folder.glob("*.mcap"))
    data = file.read_bytes()
    assert data.count(b"string data") >= 1
    file.write_bytes(data.replace(b"string data", b"str?ng data"))
    with BagReader(file) as bag:
        assert len(list(bag.messages())) == 3
