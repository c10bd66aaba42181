"""The application: its commands, and how errors end it."""

from __future__ import annotations

import logging
import sys
from typing import Annotated

import typer

from gearbench.cli import log
from gearbench.cli.cost import cost
from gearbench.cli.doctor import doctor
from gearbench.cli.explore import explore
from gearbench.cli.optimise import optimise
from gearbench.cli.plan import plan
from gearbench.cli.response import response
from gearbench.cli.rexs import rexs
from gearbench.cli.robust import robust
from gearbench.cli.select import select
from gearbench.cli.simulate import simulate
from gearbench.cli.sweep import sweep
from gearbench.cli.validate import validate
from gearbench.cli.verify import verify
from gearbench.errors import GearbenchError, InputError
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
for command in (
    simulate,
    sweep,
    response,
    robust,
    optimise,
    select,
    explore,
    verify,
    validate,
    plan,
    cost,
    rexs,
    doctor,
):
    app.command()(command)


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
    """Run the command line; every expected fault is one line on stderr."""
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
    print(f"gearbench: {' '.join(str(error).split())}", file=sys.stderr)
    sys.exit(code)
