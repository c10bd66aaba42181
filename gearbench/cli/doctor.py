"""``gearbench doctor``."""

from __future__ import annotations

import typer


def doctor() -> None:
    """Whether this machine has what each part of gearbench needs; exit code 1 where something is missing."""
    from rich.console import Console

    from gearbench.doctor import examine

    console = Console(soft_wrap=True)
    healthy = True
    for finding in examine():
        mark = "[green]ok  [/]" if finding.fine else "[red]miss[/]" if finding.needed else "[yellow]none[/]"
        console.print(f"{mark} {finding.what}: {finding.found}", highlight=False)
        if not finding.fine and finding.remedy:
            console.print(f"       {finding.remedy}", highlight=False)
        healthy &= finding.fine or not finding.needed
    raise typer.Exit(0 if healthy else 1)
