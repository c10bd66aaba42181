"""Application: its commands, and how errors end it."""

from __future__ import annotations

import inspect
import logging
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from gearbench.cli import log
from gearbench.cli.options import COMMON, MEMORY
from gearbench.cli.output import printing, shows_progress
from gearbench.doctor import is_first_run
from gearbench.errors import GearbenchError, InputError, install_extra, plain

#: Exit codes: 0 done, 1 failed, 2 bad input; 130 and 143 after a signal, see ``gearbench.interruption``.
FAILED, BAD_INPUT = 1, 2

#: Module → extra that installs it.
EXTRAS = {"skfem": "fem", "gmsh": "fem", "meshio": "fem", "platformdirs": "fem"}
EXTRAS |= {"pymoo": "optimise", "distributed": "optimise", "dask": "optimise", "bokeh": "explore"}

#: Commands in the order of the help; a command is a function in the module of the same name.
COMMANDS = (
    "simulate",
    "sweep",
    "relieve",
    "hunting",
    "response",
    "robust",
    "optimise",
    "select",
    "explore",
    "polish",
    "verify",
)
COMMANDS += ("validate", "plan", "cost", "rexs", "doctor")
#: Commands that solve no contact problem; they take no ``--memory``.
_QUICK = ("select", "rexs", "doctor")
#: Kind of value of an option, as typer names it → as a message names it.
_KINDS = {"integer": "a whole number", "number": "a number", "boolean": "true or false"}


def application(names: Sequence[str] = COMMANDS) -> typer.Typer:
    """Make the application with the commands ``names``."""
    app = typer.Typer(
        name="gearbench",
        context_settings={"help_option_names": ["-h", "--help"]},
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        help="Static transmission error and mesh stiffness of involute gears, and their scatter under errors.",
    )
    app.callback()(_options)
    for name in names:
        app.command()(_command(name, getattr(import_module(f"gearbench.cli.{name}"), name)))
    return app


def _command(name: str, function: Callable[..., None]) -> Callable[..., None]:
    """Wrap a command: add the common options; announce the compilation; add the file to its input errors."""

    @wraps(function)
    def run(*, quiet: bool, json: bool, **options: Any) -> None:
        """Run the command; its docstring is the help text."""
        with printing("json" if json else "nothing" if quiet else "tables"):
            if shows_progress() and name not in _QUICK and is_first_run():
                print("first run: the solver is compiled, once after an installation; about a minute", file=sys.stderr)
            try:
                function(**{key: value for key, value in options.items() if key not in common})
            except InputError as error:
                raise _in_its_file(error, options) from None
            except KeyboardInterrupt:
                raise Interrupted from None

    own, common = inspect.signature(function, eval_str=True), COMMON if name in _QUICK else MEMORY | COMMON
    more = [inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, **how) for key, how in common.items()]
    whole = own.replace(parameters=[*own.parameters.values(), *more])
    run.__signature__ = whole  # type: ignore[attr-defined]
    run.__annotations__ = {key: each.annotation for key, each in whole.parameters.items()}
    return run


def _in_its_file(error: InputError, options: Mapping[str, Any]) -> InputError:
    """Add the file that the command reads to an error, unless the error names a file or concerns an option."""
    read = (options.get(name) for name in ("scene", "study", "stored", "file"))
    file = next((path for path in read if isinstance(path, Path)), None)
    of_option = error.key.lstrip("-").partition(".")[0].replace("-", "_") in {*options, ""}
    return error if error.file or file is None or of_option else error.in_file(str(file))


class Interrupted(BaseException):
    """Interruption that no command has handled; typer would handle a ``KeyboardInterrupt`` itself."""


def _version(requested: bool) -> None:
    if requested:
        from gearbench import __version__

        print(f"gearbench {__version__}")
        raise typer.Exit


def _options(
    _: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line; an error is one line on stderr, an unexpected one a traceback."""
    # import only the command that is called
    called = [name for name in sys.argv[1:2] if name in COMMANDS]
    try:
        app = application(called or COMMANDS)
        sys.exit(app(sys.argv[1:] or ["--help"], prog_name="gearbench", standalone_mode=False))
    except InputError as error:
        _end(error, BAD_INPUT)
    except ModuleNotFoundError as error:
        module = (error.name or "").partition(".")[0]
        extra = EXTRAS.get(module)
        _end(f"{module} is not installed: {install_extra(extra)}" if extra else error, FAILED)
    except BrokenPipeError:  # the reader of the output has gone
        sys.exit(FAILED)
    except (GearbenchError, OSError, ImportError) as error:
        _end(error, FAILED)
    except MemoryError:
        _end("out of memory", FAILED)
    except Interrupted:
        raise KeyboardInterrupt from None
    except Exception as error:
        if (message := getattr(error, "format_message", None)) is not None:  # from typer, e.g. an unknown option
            text = re.sub(
                r"Input should be a valid (\w+).*", lambda match: f"must be {_KINDS.get(match[1], match[1])}", message()
            )
            text = text.replace("Input should", "must").replace("greater than or equal to", "at least")
            _end(f"{text.rstrip('.')}; see gearbench {' '.join([*called, '--help'])}", BAD_INPUT)
        raise
    finally:
        log.end()


def _end(error: object, code: int) -> NoReturn:
    if code == FAILED:
        logging.getLogger("gearbench").debug("where it happened:", exc_info=True)
    print(f"gearbench: {plain(error)}", file=sys.stderr)
    sys.exit(code)
