# SPDX-License-Identifier: Apache-2.0
"""Figures and colours of the reports."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ReportOptions:
    """What reports compare with and how pictures are marked."""

    paper_right: int = tunable(131, meaning="takes that the paper's system understood", source="paper, section V")
    paper_takes: int = tunable(159, meaning="takes of the paper", source="paper, section V")
    meant_colour: tuple[int, int, int] = tunable(
        (40, 110, 255), meaning="red, green and blue of the cross on what is meant"
    )


REPORTS = ReportOptions()
