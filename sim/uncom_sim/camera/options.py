# SPDX-License-Identifier: Apache-2.0
"""Numbers of the simulated camera and its renderer."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class RasteriserOptions:
    """What is drawn, and how shadows are found."""

    near_m: float = tunable(0.05, unit="m", meaning="nearest depth that is drawn")
    far_m: float = tunable(15.0, unit="m", meaning="farthest depth that is drawn")
    lamp_distance_m: float = tunable(6.0, unit="m", meaning="how far away the lamp is taken to be")
    lit_radius_m: float = tunable(
        1.7, unit="m", meaning="radius about the middle of the scene in which shadows are drawn"
    )
    shadow_map_px: int = tunable(900, unit="px", meaning="side of the square shadow map")
    shadow_bias_m: float = tunable(
        0.012, unit="m", meaning="depth by which a point must lie behind another one to be in its shadow"
    )
    shadow_step_px: int = tunable(2, unit="px", meaning="distance of the pixels at which shadows are looked up")


@dataclass(frozen=True, slots=True)
class RenderSceneOptions:
    """How the triangles of a scene are kept."""

    atlas_width_px: int = tunable(512, unit="px", meaning="width of the atlas of textures")
    motion_tolerance: float = tunable(
        2e-5, meaning="change of a pose [m, or of a rotation's entries] below which a body has not moved"
    )
    cell_m: float = tunable(0.5, unit="m", meaning="edge of the cells into which large surfaces are cut")


@dataclass(frozen=True, slots=True)
class SensorOptions:
    """Facts of the head camera's sensor."""

    depth_range_m: tuple[float, float] = tunable(
        (0.3, 8.0), unit="m", meaning="nearest and farthest depth that is measured"
    )
    spare_noise_px: int = tunable(256, unit="px", meaning="by how much the sheets of noise are larger than a picture")


RASTERISER = RasteriserOptions()
RENDER_SCENE = RenderSceneOptions()
SENSOR = SensorOptions()
