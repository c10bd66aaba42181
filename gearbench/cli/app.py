"""The application: its commands, and how errors end it."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from functools import wraps
from typing import Annotated

import typer

from gearbench.cli import log
from gearbench.cli.check import check
from gearbench.cli.cost import cost
from gearbench.cli.doctor import doctor
from gearbench.cli.explore import explore
from gearbench.cli.hunting import hunting
from gearbench.cli.optimise import optimise
from gearbench.cli.options import shows_progress
from gearbench.cli.plan import plan
from gearbench.cli.polish import polish
from gearbench.cli.relieve import relieve
from gearbench.cli.response import response
from gearbench.cli.rexs import rexs
from gearbench.cli.robust import robust
from gearbench.cli.select import select
from gearbench.cli.simulate import simulate
from gearbench.cli.sweep import sweep
from gearbench.cli.validate import validate
from gearbench.cli.verify import verify
from gearbench.errors import GearbenchError, InputError, plain, shortened
from gearbench.files import together
from gearbench.interruption import pending

#: 0 done, 1 failed, 2 bad input; 130 and 143 where a signal ended it, see ``gearbench.interruption``.
FAILED, BAD_INPUT = 1, 2

#: Modules that an extra brings.
EXTRAS = {"skfem": "fem", "gmsh": "fem", "meshio": "fem", "platformdirs": "fem"}
EXTRAS |= {"pymoo": "optimise", "distributed": "optimise", "dask": "optimise", "bokeh": "explore"}

app = typer.Typer(
    name="gearbench",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    help="Static transmission error and mesh stiffness of involute gear pairs, and how robust they are.",
)


def _whole(command: Callable[..., None]) -> Callable[..., None]:
    """The command; its files take their places as it ends, and none where it fails."""

    @wraps(command)
    def run(*args: object, **options: object) -> None:
        """The command, its files together."""
        with together():
            try:
                command(*args, **options)
                return
            except typer.Exit as end:  # an interruption that keeps what is done
                code = end.exit_code
        raise typer.Exit(code)

    return run


def _announced(command: Callable[..., None]) -> Callable[..., None]:
    """The command; before its first run it says why that takes longer."""

    @wraps(command)
    def run(*args: object, **options: object) -> None:
        """The command, after a line where the solver was never compiled."""
        from gearbench.doctor import is_first_run

        if shows_progress(quiet=bool(options.get("quiet")), json=bool(options.get("json"))) and is_first_run():
            print("first run: the solver is compiled, once after an installation; half a minute", file=sys.stderr)
        command(*args, **options)

    return run


#: Commands that solve contact problems.
_SOLVING = (simulate, sweep, relieve, hunting, response, robust, optimise, explore, polish, verify, validate, cost)
#: Commands that commit their files one by one.
_STEPWISE = (optimise, sweep)
for command in (
    simulate,
    sweep,
    relieve,
    hunting,
    response,
    robust,
    optimise,
    select,
    explore,
    polish,
    verify,
    validate,
    plan,
    cost,
    rexs,
    check,
    doctor,
):
    solving = _announced(command) if command in _SOLVING else command
    app.command()(solving if command in _STEPWISE else _whole(solving))


def _version(wanted: bool) -> None:
    if wanted:
        from gearbench import __version__

        print(f"gearbench {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line; every fault is one line on stderr, one that nobody expected leaves a report, too."""
    try:
        _run()
    except InputError as error:
        _end(error, BAD_INPUT)
    except ModuleNotFoundError as error:
        module = (error.name or "").partition(".")[0]
        extra = EXTRAS.get(module)
        _end(f"{module} is not installed: pip install 'gearbench[{extra}]'" if extra else error, FAILED)
    except (GearbenchError, OSError, ImportError) as error:
        _end(error, FAILED)
    except MemoryError:
        _end("out of memory", FAILED)
    except Exception as error:  # a fault of the program
        from gearbench.cli.report import write_report

        _end(
            f"unexpected {type(error).__name__}: {shortened(error)}; please report it with {write_report(error)}",
            FAILED,
        )
    finally:
        log.end()


def _run() -> None:
    try:
        app()
    except Exception as error:
        if pending():  # Ctrl-C in the midst of an import comes out as another error
            raise KeyboardInterrupt from error
        raise


def _end(error: object, code: int) -> None:
    if code == FAILED:
        logging.getLogger("gearbench").debug("where it happened:", exc_info=True)
    print(f"gearbench: {plain(error)}", file=sys.stderr)
    sys.exit(code)
