"""``gearbench doctor``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from gearbench.cli.options import Json, Quiet, Verbose

if TYPE_CHECKING:
    from gearbench.doctor import Finding


def doctor(quiet: Quiet = False, verbose: Verbose = False, json: Json = False) -> None:
    """Whether this machine meets the needs of each part of gearbench; exit code 1 where something is missing.

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
    from rich.text import Text

    from gearbench.cli.summary import console

    out = console()
    for finding in findings:
        mark, colour = ("ok  ", "green") if finding.fine else ("miss", "red") if finding.needed else ("none", "yellow")
        out.print(Text(mark, colour), f"{finding.name}: {finding.found}", highlight=False)
        if not finding.fine and finding.remedy:
            out.print(f"       {finding.remedy}", highlight=False)
