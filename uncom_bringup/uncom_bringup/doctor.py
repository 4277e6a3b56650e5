# SPDX-License-Identifier: Apache-2.0
"""What this machine can and cannot do, by looking rather than by assuming."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from uncom_bringup.options import MACHINE

_DISTRIBUTIONS = {
    "rclpy": "ros-jazzy-rclpy",
    "pinocchio": "pin",
    "cv2": "opencv-python-headless",
}


@dataclass(frozen=True, slots=True)
class Finding:
    """One object examined; `needed` objects are needed by `uncom demo`."""

    name: str
    good: bool
    detail: str
    needed: bool = True

    @property
    def mark(self) -> str:
        """ok, MISS (needed and missing) or "-" (not needed and missing)."""
        return "ok" if self.good else ("MISS" if self.needed else "-")


def _module(name: str, use: str, needed: bool = True) -> Finding:
    """Look for a module without importing it (an import of some takes seconds)."""
    try:
        found = importlib.util.find_spec(name) is not None
    except (ImportError, ValueError):
        found = False
    version = ""
    if found:
        try:
            version = " " + metadata.version(_DISTRIBUTIONS.get(name, name))
        except metadata.PackageNotFoundError:
            version = ""
    return Finding(name, found, f"{use}{version}" if found else f"{use}: not installed", needed)


def _python() -> Finding:
    version = platform.python_version()
    return Finding("python", sys.version_info >= (3, 11), f"{version} on {platform.system()} {platform.machine()}")


def _cores() -> Finding:
    count = len(os.sched_getaffinity(0))
    detail = f"{count} for this process" + (
        "" if count >= MACHINE.min_cores else f"; the demo is slow with less than {MACHINE.min_cores}"
    )
    return Finding("cores", count >= MACHINE.min_cores, detail, needed=False)


def _memory() -> Finding:
    memory_gib = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30
    return Finding("memory", memory_gib >= MACHINE.min_memory_gib, f"{memory_gib:.1f} GiB", needed=False)


def _shared_memory() -> Finding:
    path = Path("/dev/shm")  # noqa: S108  (where Fast DDS keeps its segments)
    if not path.is_dir():
        return Finding("shared memory", False, "no /dev/shm: images go through UDP and some are lost", needed=False)
    free = shutil.disk_usage(path).free / 2**20
    why = "" if free >= MACHINE.image_segment_mib else f"; {MACHINE.image_segment_mib} MiB are wanted for camera images"
    return Finding(
        "shared memory", free >= MACHINE.image_segment_mib, f"{free:.0f} MiB free in /dev/shm{why}", needed=False
    )


def _ros_environment() -> list[Finding]:
    domain = os.environ.get("ROS_DOMAIN_ID")
    discovery = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    distro = os.environ.get("ROS_DISTRO")
    source = f"sourced {distro}" if distro else "wheels in this environment (no ROS is sourced)"
    return [
        Finding("ROS", True, source, needed=False),
        Finding("middleware", True, os.environ.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp (default)"), needed=False),
        _image_profile(),
        Finding("domain id", True, domain or "chosen free for each demo; 0 for `uncom up`", needed=False),
        Finding("discovery", True, discovery, needed=False),
    ]


def _image_profile() -> Finding:
    path = os.environ.get("FASTRTPS_DEFAULT_PROFILES_FILE", "")
    detail = path or "no profile (FASTRTPS_DEFAULT_PROFILES_FILE): sound and words may wait for seconds behind images"
    return Finding("image profile", bool(path), detail, needed=False)


def _weights() -> list[Finding]:
    """Say which full back ends could run: they need Transformers and weights in the cache of the model hub."""
    hub = Path(os.environ.get("HF_HOME", Path.home() / ".cache" / "huggingface")) / "hub"
    models = {
        "whisper": "openai/whisper-large-v3-turbo",
        "phi-4-mini": "microsoft/Phi-4-mini-instruct",
        "grounding dino": "IDEA-Research/grounding-dino-tiny",
        "sam": "facebook/sam-vit-base",
    }
    found = []
    for name, model in models.items():
        folder = hub / ("models--" + model.replace("/", "--"))
        good = folder.is_dir()
        found.append(Finding(name, good, f"weights of {model}" + ("" if good else " are not here"), needed=False))
    return found


def _microphone() -> Finding:
    cards = Path("/proc/asound/cards")
    text = cards.read_text(encoding="utf-8") if cards.exists() else ""
    good = bool(text.strip()) and "no soundcards" not in text
    return Finding(
        "microphone", good, "a sound card" if good else "no sound card: sound comes from /audio", needed=False
    )


def examine() -> tuple[Finding, ...]:
    """Examine this machine; takes well under a second."""
    modules = [
        _module("rclpy", "ROS 2 client library"),
        _module("uncom_interfaces", "our messages, built"),
        _module("pocketsphinx", "speech, default back end"),
        _module("mediapipe", "hands"),
        _module("cv2", "images"),
        _module("pinocchio", "kinematics"),
        _module("ompl", "motion planning"),
        _module("ruckig", "timing of motions"),
        _module("rosbags", "bags"),
        _module("av", "video and sound files"),
        _module("pybullet", "simulation", needed=False),
        _module("espeakng_loader", "the simulated person's voice", needed=False),
        _module("torch", "full back ends", needed=False),
        _module("transformers", "full back ends", needed=False),
        _module("sounddevice", "microphone input", needed=False),
    ]
    return (
        _python(),
        *_ros_environment(),
        *modules,
        *_weights(),
        _microphone(),
        _cores(),
        _memory(),
        _shared_memory(),
    )


def findings_to_json(findings: Sequence[Finding]) -> dict[str, Any]:
    """Return what `uncom doctor --json` prints."""
    return {
        "ready": all(finding.good for finding in findings if finding.needed),
        "findings": {
            finding.name: {"good": finding.good, "needed": finding.needed, "detail": finding.detail}
            for finding in findings
        },
    }
