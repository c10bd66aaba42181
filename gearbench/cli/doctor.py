"""``gearbench doctor``."""

from __future__ import annotations

from dataclasses import asdict

import typer

from gearbench.cli.output import answer


def doctor() -> None:
    """Check whether this machine has what each part of gearbench needs; exit code 1 if something is missing.

    Example: gearbench doctor
    """
    from gearbench.doctor import examine

    findings = examine()
    healthy = all(finding.fine or not finding.needed for finding in findings)
    lines = []
    for finding in findings:
        mark = "ok  " if finding.fine else "miss" if finding.needed else "none"
        lines.append(f"{mark} {finding.name}: {finding.found}")
        if not finding.fine and finding.remedy:
            lines.append(f"       {finding.remedy}")
    answer({"healthy": healthy, "findings": [asdict(finding) for finding in findings]}, lines)
    raise typer.Exit(0 if healthy else 1)
