"""``gearbench doctor``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from gearbench.cli.options import Json, Quiet, Verbose, say

if TYPE_CHECKING:
    from gearbench.doctor import Finding


def doctor(quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Check whether this machine has what each part of gearbench needs; exit code 1 if something is missing.

    Example: gearbench doctor
    """
    from dataclasses import asdict

    from gearbench.cli.summary import print_mapping
    from gearbench.doctor import examine

    findings = examine()
    healthy = all(finding.fine or not finding.needed for finding in findings)
    if json:
        print_mapping({"healthy": healthy, "findings": [asdict(finding) for finding in findings]})
    elif not quiet:
        _print_findings(findings)
    raise typer.Exit(0 if healthy else 1)


def _print_findings(findings: list[Finding]) -> None:
    for finding in findings:
        mark = "ok  " if finding.fine else "miss" if finding.needed else "none"
        say(f"{mark} {finding.name}: {finding.found}")
        if not finding.fine and finding.remedy:
            say(f"       {finding.remedy}")
