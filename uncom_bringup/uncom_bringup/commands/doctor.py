# SPDX-License-Identifier: Apache-2.0
"""`uncom doctor`: what this machine can and cannot do."""

from __future__ import annotations

import argparse

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers, add_json


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("doctor", help="say what this machine can and cannot do")
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Examine; 1 if something that the default system needs is missing."""
    from uncom_bringup import doctor  # noqa: PLC0415  (only when it runs)

    findings = doctor.examine()
    if options.json:
        output.emit_json(doctor.findings_to_json(findings))
    else:
        for finding in findings:
            output.emit(f"{finding.mark:5} {finding.name:22} {finding.detail}")
    return 1 if any(finding.needed and not finding.good for finding in findings) else 0
