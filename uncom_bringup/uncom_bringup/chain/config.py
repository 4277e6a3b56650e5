# SPDX-License-Identifier: Apache-2.0
"""The parameters of the chained cores: those of the nodes, from the same parameter files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from uncom_language.config import LanguageConfig, SpeechConfig
from uncom_perception.config import DetectionConfig, GestureConfig
from uncom_reasoner.config import ReasonerConfig

from uncom_bringup.exceptions import BadInputError

_ANY_NODE = ("/**", "/*")


@dataclass(frozen=True)
class ChainConfig:
    """The configuration of each node whose core is part of the chain; the defaults are the nodes' own."""

    speech: SpeechConfig = field(default_factory=SpeechConfig)
    language: LanguageConfig = field(default_factory=LanguageConfig)
    gesture: GestureConfig = field(default_factory=GestureConfig)
    detection: DetectionConfig = field(default_factory=DetectionConfig)
    reasoner: ReasonerConfig = field(default_factory=ReasonerConfig)

    def as_dict(self) -> dict[str, Any]:
        """Return all parameters by node."""
        return {f"{f.name}_node": dataclasses.asdict(getattr(self, f.name)) for f in dataclasses.fields(self)}


def load_chain_config(parameter_files: Sequence[Path] = ()) -> ChainConfig:
    """Read ROS parameter files over the defaults, later files over earlier ones; parameters of other nodes are left.

    Raises:
        BadInputError: a file is missing, is not a parameter file, or has a parameter that a node does not know.
        UncomError: a node refuses a value.
    """
    config = ChainConfig()
    for path in parameter_files:
        entries = _read_entries(path)
        changed = {
            f.name: _override(getattr(config, f.name), _read_parameters(f"{f.name}_node", entries), path)
            for f in dataclasses.fields(ChainConfig)
        }
        config = ChainConfig(**changed)
    return config


def _read_entries(path: Path) -> Mapping[str, Any]:
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise BadInputError(f"cannot read the parameter file {path}: {error}") from error
    if not isinstance(data, Mapping):
        raise BadInputError(f"{path} is no ROS parameter file: node names with ros__parameters are expected")
    return data


def _read_parameters(node: str, entries: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name in (*_ANY_NODE, f"/{node}", node):
        entry = entries.get(name)
        if isinstance(entry, Mapping) and isinstance(entry.get("ros__parameters"), Mapping):
            found |= entry["ros__parameters"]
    return {key: value for key, value in found.items() if key != "use_sim_time"}


def _override(config: Any, values: Mapping[str, Any], path: Path) -> Any:
    known = {f.name for f in dataclasses.fields(config)}
    unknown = [key for key in values if key not in known]
    if unknown:
        raise BadInputError(f"{path}: {type(config).__name__} has no parameter {unknown[0]!r}")
    typed = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    return dataclasses.replace(config, **typed)
