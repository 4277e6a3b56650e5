# SPDX-License-Identifier: Apache-2.0
"""Lighter copies of the robot's visual meshes, made once and kept in the temporary folder.

The robot's own meshes have 100 000 triangles, most of them smaller than a pixel; the software renderer pays for
each. Vertices that share a cell of a grid become one, with the mean normal of the surface there.
"""

from __future__ import annotations

import getpass
import hashlib
import os
import tempfile
from pathlib import Path
from typing import cast
from xml.etree import ElementTree as ET

import numpy as np
import numpy.typing as npt
import trimesh

from uncom_sim.robot.description import package_directory
from uncom_sim.robot.options import VISUAL_MESHES

_VERSION = "3"
_SCHEME = "package://"

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


def cluster(
    vertices: FloatArray, faces: IntArray, normals: FloatArray, cell: float
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Merge vertices (N, 3) that share a grid cell [m].

    Returns:
        vertices (M, 3), unit normals (M, 3), faces (K, 3) without those that vanished.
    """
    keys = np.floor(vertices / cell).astype(np.int64)
    # The two sides of a thin wall fall into one cell; their normals tell them apart.
    side = (normals > 0.0).astype(np.int64) @ np.array([1, 2, 4])
    _, index = np.unique(np.column_stack([keys, side]), axis=0, return_inverse=True)
    index = index.reshape(-1)
    count = np.bincount(index).astype(float)[:, None]
    merged = np.column_stack([np.bincount(index, vertices[:, i]) for i in range(3)]) / count
    mean_normals = np.column_stack([np.bincount(index, normals[:, i]) for i in range(3)])
    mean_normals = mean_normals / np.maximum(np.linalg.norm(mean_normals, axis=1, keepdims=True), 1e-9)
    new = index[faces]
    kept = (new[:, 0] != new[:, 1]) & (new[:, 1] != new[:, 2]) & (new[:, 0] != new[:, 2])
    _, first = np.unique(np.sort(new[kept], axis=1), axis=0, return_index=True)
    return merged, mean_normals, np.asarray(new[kept][np.sort(first)])


def _cache() -> Path:
    folder = Path(tempfile.gettempdir()) / f"uncom-sim-{getpass.getuser()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def _light_copy(source: Path) -> Path:
    """Return the light copy of a mesh file, making it if it is not there."""
    state = source.stat()
    mark = hashlib.sha256(f"{_VERSION} {source} {state.st_size} {state.st_mtime_ns}".encode()).hexdigest()[:12]
    target = _cache() / f"{source.stem}-{mark}.obj"
    if target.exists():
        return target
    mesh = cast("trimesh.Trimesh", trimesh.load(source, force="mesh"))
    cell = next((size for part, size in VISUAL_MESHES.cells_m if part in source.parts), VISUAL_MESHES.cell_m)
    vertices, normals, faces = cluster(
        np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64), np.asarray(mesh.vertex_normals), cell
    )
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in vertices]
    lines += [f"vn {x:.3f} {y:.3f} {z:.3f}" for x, y, z in normals]
    lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in (faces.astype(int) + 1)]
    handle, partial = tempfile.mkstemp(dir=target.parent, suffix=".part")
    with os.fdopen(handle, "w") as file:
        file.write("\n".join(lines) + "\n")
    Path(partial).replace(target)  # several simulators may make it at once
    return target


def read_light_mesh(path: Path) -> tuple[FloatArray, FloatArray, IntArray]:
    """Read vertices (N, 3), normals (N, 3) and faces (M, 3) of a mesh file that `with_file_paths` named."""
    rows: dict[str, list[list[str]]] = {"v": [], "vn": [], "f": []}
    for line in path.read_text().splitlines():
        key, *words = line.split()
        rows[key].append(words)
    faces = [[int(word.split("/")[0]) - 1 for word in words] for words in rows["f"]]
    return np.array(rows["v"], dtype=float), np.array(rows["vn"], dtype=float), np.array(faces, dtype=np.int64)


def with_file_paths(urdf: str) -> str:
    """Return a URDF whose meshes are named by file, the visual ones by their light copies."""
    robot = ET.fromstring(urdf)  # noqa: S314  (our own text)
    for link in robot.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            mesh = shape.find("geometry/mesh")
            if mesh is None:
                continue
            path = package_directory() / mesh.get("filename", "").removeprefix(_SCHEME)
            light = shape.tag == "visual" and path.suffix == ".stl"
            mesh.set("filename", str(_light_copy(path) if light else path))
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode")
