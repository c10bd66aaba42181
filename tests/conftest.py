from __future__ import annotations

import sys

import pytest

import gearbench.threads

#: A worker process takes seconds to start: tests have none unless they ask for threads.
gearbench.threads.default_threads = lambda: 1


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command line in this process: exit code, stdout, stderr."""
    from gearbench.cli import main

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["gearbench", *map(str, arguments)])
        monkeypatch.setenv("NO_COLOR", "1")
        with pytest.raises(SystemExit) as end:
            main()
        out = capsys.readouterr()
        return int(end.value.code or 0), out.out, out.err

    return call


@pytest.fixture
def refused(run):
    """Run a command that must be refused: the one line that it says, exit code 2."""

    def line(*arguments: object) -> str:
        code, out, err = run(*arguments)
        assert (code, out, err.count("\n")) == (2, "", 1), err
        return err

    return line
