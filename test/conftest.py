# SPDX-License-Identifier: Apache-2.0
"""A ROS domain id of its own for each test that starts nodes."""

from __future__ import annotations

import pytest
from uncom_bringup.graph.ros_domain import DomainClaim


@pytest.fixture
def domain() -> int:
    with DomainClaim() as claim:
        yield claim.domain
