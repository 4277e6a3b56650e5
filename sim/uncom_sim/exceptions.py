# SPDX-License-Identifier: Apache-2.0
"""Errors of uncom_sim."""

from __future__ import annotations

from uncom_common.exceptions import UncomError


class SimError(UncomError):
    """The simulated world or robot cannot be made or driven as asked."""
