# SPDX-License-Identifier: Apache-2.0
"""The command line as a user meets it: help, bad input in one line, exit status, JSON and nothing else."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from uncom_bringup.command_options import read_picture

from uncom_bringup import cli, output

TIMEOUT_S = 120


def uncom(*arguments: str, stdin: str = "") -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "uncom_bringup.cli", *arguments],
        input=stdin,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )


def test_help_names_every_command_and_is_quick():
    result = uncom("--help")
    assert result.returncode == 0
    assert set(cli.COMMANDS) <= set(result.stdout.split())


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_every_command_has_help(command, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.build_parser().parse_args([command, "--help"])
    assert stop.value.code == 0
    assert command in capsys.readouterr().out


def test_the_command_line_starts_without_the_heavy_libraries():
    code = (
        "import sys; from uncom_bringup import cli; cli.build_parser(); "
        "print(sorted({'rclpy', 'cv2', 'numpy', 'mediapipe', 'pybullet', 'pinocchio'} & set(sys.modules)))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert result.stdout.strip() == "[]"


def test_the_version_is_that_of_the_package():
    assert uncom("--version").stdout == uncom("version").stdout


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Files of every wrong sort, by the names that BAD uses."""
    folder = tmp_path_factory.mktemp("bad")
    lemon = '{"kind": "lemon", "x": 0.6, "y": 0}'
    contents = {
        "text": ("notes.txt", b"no picture, no sound, no bag"),
        "empty": ("empty.wav", b""),
        "teapot": ("teapot.json", b'{"objects": [{"kind": "teapot", "x": 0.6, "y": 0}], "say": "x"}'),
        "broken": ("broken.json", b"{"),
        "overlap": ("overlap.json", f'{{"objects": [{lemon}, {lemon}], "say": "take the lemon"}}'.encode()),
        "video": ("clip.mp4", b"no video at all"),
        "damaged": ("damaged.mcap", b"\x89MCAP0\r\n" + bytes(range(200))),
    }
    picture = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
    for name, file, pixels in (
        ("png", "cut.png", picture),
        ("jpeg", "cut.jpg", picture),
        ("tiff", "cut.tiff", picture),
        ("depth", "cut_depth.png", picture[..., 0].astype(np.uint16) * 8),
    ):
        whole = cv2.imencode(Path(file).suffix, pixels)[1].tobytes()
        contents[name] = (file, whole[: len(whole) // 2])
    contents["picture"] = ("whole.png", cv2.imencode(".png", picture)[1].tobytes())
    contents["camera"] = ("camera.json", b'{"fx": 60, "fy": 60, "cx": 32, "cy": 24}')
    paths = {"folder": str(folder), "none": str(folder / "none"), "out": str(folder / "out")}
    for name, (file, data) in contents.items():
        (folder / file).write_bytes(data)
        paths[name] = str(folder / file)
    return paths


BAD = {
    "unknown command": "dance",
    "unknown option": "parse --loudly",
    "sound that is not there": "transcribe {none}.wav",
    "sound that is empty": "transcribe {empty}",
    "sound that is text": "transcribe {text} --json",
    "picture that is text": "point {text} --json",
    "picture that is a folder": "point {folder}",
    "picture that is cut short": "point {png} --json",
    "JPEG that is cut short": "point {jpeg}",
    "detect in a PNG that is cut short": "detect {png} mug --json",
    "detect in a JPEG that is cut short": "detect {jpeg} mug",
    "detect in a TIFF that is cut short": "detect {tiff} mug",
    "depth that is cut short": "detect {picture} mug --depth {depth} --camera {camera}",
    "depth without camera": "detect {text} mug --depth {text}",
    "detect in text": "detect {text} mug",
    "unknown scenario": "demo --scenario xii --json --out {out}",
    "unknown kind": "demo --scene {teapot} --out {out}",
    "broken scene": "demo --scene {broken} --out {out}",
    "overlapping objects": "demo --scene {overlap} --json --out {out}",
    "scene that is not there": "demo --scene {none}.json --out {out}",
    "scenario and scene": "demo --scenario i --scene {teapot} --out {out}",
    "seed that is no number": "demo --seed many --out {out}",
    "folder that holds something": "demo --out {folder}",
    "bag that is not there": "replay {none}.mcap",
    "bag that is damaged": "replay {damaged}",
    "bag that is text": "replay {text}",
    "rate of zero": "replay {damaged} --rate 0",
    "record over something": "record {damaged}",
    "record without suffix": "record {none}",
    "understand what is not there": "understand {none}.mcap --out {out}",
    "understand a video that is none": "understand {video} --out {out}",
    "compare with nothing": "compare {none} {none}",
    "compare text": "compare {text} {text}",
    "replay under no name": "replay {damaged} --remap a=b",
    "replay from before the beginning": "replay {damaged} --start -1",
    "understand text": "understand {text} --out {out}",
    "unknown benchmark": "bench luck",
    "scenario on the robot": "up --robot --scenario i",
    "unknown folder to test": "test uncom_magic",
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_clear_line_and_status_2(case, files, capfd, monkeypatch):
    # In this process, to import what is heavy once; descriptor 1 stays pytest's.
    monkeypatch.setattr(output, "claim_stdout", lambda: None)
    try:
        status = cli.run([word.format(**files) for word in BAD[case].split()])
    except SystemExit as stop:
        status = stop.code
    said = capfd.readouterr()  # with what native libraries write to the descriptor
    assert status == 2
    assert said.out == ""
    assert said.err.startswith("uncom")
    assert len(said.err.strip().splitlines()) == 1


@pytest.mark.parametrize("name", ["text", "png"])
def test_bad_input_in_a_process_of_its_own_is_one_line_too(files, name):
    result = uncom("point", files[name], "--json")
    assert (result.returncode, result.stdout) == (2, "")
    assert len(result.stderr.strip().splitlines()) == 1


def test_a_picture_that_is_damaged_but_can_be_read_is_used_and_told_of(tmp_path, capfd):
    """What the JPEG library says of it becomes one line in our words."""
    picture = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
    data = bytearray(cv2.imencode(".jpg", picture)[1].tobytes())
    data[len(data) // 2 : len(data) // 2 + 60] = bytes(60)
    path = tmp_path / "damaged.jpg"
    path.write_bytes(data)
    assert read_picture(path).shape == picture.shape
    assert capfd.readouterr().err.splitlines() == [f"uncom: {path} is damaged; what could be read of it is used"]


def test_no_command_shows_the_help_and_is_bad_use():
    result = uncom()
    assert result.returncode == 2
    assert "demo" in result.stderr


def test_parse_answers_one_json_object_a_line():
    result = uncom("parse", "--json", stdin="take the lemon and put it in this bowl\n\nhello there\n")
    assert result.returncode == 0
    first, second = (json.loads(line) for line in result.stdout.splitlines())
    assert first["commands"][0]["object"]["text"] == "lemon"
    assert first["commands"][0]["relation"] == "in"
    assert second["act"].lower() == "refused"
    assert second["reason"]


def test_bare_words_are_one_sentence():
    words = uncom("parse", "--json", "take", "the", "lemon")
    quoted = uncom("parse", "--json", "take the lemon")
    assert words.stdout == quoted.stdout


def test_doctor_answers_json_and_finds_what_this_environment_has():
    result = uncom("doctor", "--json")
    findings = json.loads(result.stdout)
    assert findings["findings"]["rclpy"]["good"]
    assert result.returncode == (0 if findings["ready"] else 1)
