"""Pages made from the code: effects, quantities, commands. ``python -m docs.generate [PAGE…]`` writes them."""

from __future__ import annotations

import csv
import inspect
import re
import sys
from collections import Counter
from collections.abc import Callable, Collection, Iterable
from io import StringIO
from pathlib import Path
from typing import Any, get_args, get_type_hints

from typer.models import OptionInfo

from gearbench.results.quantities import Quantity

FOLDER = Path(__file__).parent
#: An option of as many commands is described once.
COMMON = 3
#: Responses that differ from the first of their kind in the harmonic alone.
HIGHER = re.compile(r"_amplitude_([2-9]|\d\d)$")


def effects() -> str:
    """Every effect: what it adds, when to use it, its keys."""
    from docs.effects_page import page

    return page()


def system() -> str:
    """Every table of ``[system]`` with its keys."""
    from docs.keys import key_tables, prose
    from gearbench.geometry.material import Material
    from gearbench.system.schema import System

    return f"""# System

The table `[system]` is for `gearbench response`; its shafts also affect the contact in `gearbench simulate`. Example:
[From a gearbox to its whine](tutorial_response.md).

{prose(System)}
{key_tables(System, {Material: "[the pair](pair.md)"})}"""


def pair() -> str:
    """The table ``[pair]`` with its keys."""
    from docs.keys import key_tables
    from gearbench.geometry.pair import Pair

    return f"""# The pair

The table `[pair]` and the tables of both gears. Sizes and symbols follow ISO 21771, equations (G…) are in
[Theory](theory.md#geometry). An internal gear has a negative number of teeth, `teeth = -99`, and no root stress.

```toml
[pair]
normal_module = 3.0
helix_angle = 12.0
face_width = 24.0
centre_distance = 92.2
centre_distance_upper = 27.0      # µm
centre_distance_lower = -27.0
[pair.temperature]                # °C
pinion = 90.0
wheel = 80.0
housing = 70.0
housing_expansion = 23.0          # aluminium
[pair.pinion]
teeth = 24
face_width = 26.0                 # wider than its mate, 1 mm on either side
protuberance = 0.12
grinding_stock = 0.10
tip_chamfer = 0.3
[pair.pinion.thickness]           # deviations of the thickness; x = 0.03 is derived
upper = -60.0                     # A_sne, µm
lower = -90.0
[pair.wheel]
teeth = 36
[pair.wheel.thickness]
span = 41.53                      # W_5, and with it x
span_teeth = 5
upper = -50.0
lower = -80.0
```

`gearbench simulate` prints x, the generating shift x_E, diameters, backlash and its limits.

![Keys of a gear on its teeth, its faces and its body](figures/pair.png)

{key_tables(Pair)}"""


def scene() -> str:
    """The tables of a scene beside pair, effects and system."""
    from docs.keys import key_tables, prose
    from gearbench.geometry.planetary import Planetary
    from gearbench.geometry.train_tables import TrainGear, TrainMesh
    from gearbench.loads import DrivingScene, Load, WeightedLoad

    return f"""# The scene

A scene is a TOML file. Only the gears (`[pair]`, or tables that replace it), a load and one effect that adds
compliance are required.

| table | holds |
|---|---|
| `name` | free text, in titles and summaries |
| `[pair]` | both gears: [The pair](pair.md) |
| `[gears.NAME]`, `[[meshes]]` | instead of a pair: gears by name, and which gear drives which |
| `[planetary]` | instead of a pair: sun, planets and ring |
| `[load]`, or `[[loads]]` | one torque, or several with weights |
| `[effects.…]` | simulated effects: [Effects](effects.md) |
| `[coast.…]` | shapes of the coast flanks |
| `[operation]` | speed and lubrication |
| `[resolution]` | numbers of phases and segments |
| `[system]` | shafts, bearings, inertias: [System](system.md) |

## Load

{key_tables(Load)}
{prose(DrivingScene)}

```toml
[load]
scene = "planetary.toml"
member = "carrier"
```

{key_tables(DrivingScene)}
## Gears and meshes

`[gears.NAME]` and `[[meshes]]` describe a train of any number of gears, for `simulate`, `sweep` and, with `[system]`,
`response`. Every mesh is simulated under its torque, and Datasets have the dimensions `mesh` and `gear`. Parallel paths
with one mesh frequency are solved together and give `load_sharing` of each mesh, `mesh_load_factor`, and the
`train_transmission_error` over the phase of the first mesh; `hunting` computes all mesh cycles. Tooth 0 of a
gear enters contact as the cycle of its first mesh begins; the phases of its `waviness` count from there.

Gears that are not in mesh must not overlap. Meshes align the faces of their gears; `axial_offset` puts gears side by
side.

```toml
[gears.motor]
normal_module = 2.0
face_width = 20.0
teeth = 19
[gears.motor.tip_relief]
amount = 5.0
length = 0.5
[gears.idler]
normal_module = 2.0
face_width = 20.0
teeth = 31
[gears.idler.coast]               # flanks with which the idler drives
profile_slope = 4.0
[gears.output]
normal_module = 2.0
face_width = 18.0
teeth = 26
[[meshes]]
driver = "motor"
driven = "idler"
centre_distance = 50.2
[[meshes]]
driver = "idler"
driven = "output"
centre_distance = 57.2
direction = 70.0
```

{prose(TrainGear)}

A gear has `normal_module`, `face_width` (both required), `pressure_angle`, `helix_angle`, the `shaft` that it shares
with other gears, and the keys of a gear of [the pair](pair.md).

{prose(TrainMesh)}

{key_tables(TrainMesh)}
## Planetary sets

{prose(Planetary)}

```toml
[planetary]
normal_module = 2.0
face_width = 25.0
centre_distance = 66.0
planets = 4
floating = ["sun"]
pin_stiffness = 300.0
pin_tangential = [10.0, 0.0, 0.0, 0.0]
[planetary.sun]
teeth = 36
[planetary.planet]
teeth = 30
[planetary.planet.tip_relief]
amount = 8.0
length = 0.6
[planetary.ring]
teeth = -96
[planetary.scatter]
pin_tangential = 15.0
sun_run_out = 10.0
[planetary.dynamics]
damping_ratio = 0.03
[planetary.dynamics.carrier]
mass = 4.5
inertia = 0.011
```

All meshes are one contact problem, which elastic bodies (`[effects.gear_body]`) couple. `simulate` computes
`load_sharing` of each mesh, `mesh_load_factor` K_γ, `train_transmission_error`, motions of floating members, and forces
and torques on every member with their harmonics; `robust` their scatter under `[planetary.scatter]` and errors of the
flanks; `response` all of these over speed.

With stepped planets (`examples/stepped_planets.toml`) results run over the cycle after which the phases of both meshes
repeat: `mesh_phase` counts mesh periods of the sun, and `harmonic` holds the orders of both meshes as multiples of the
sun's mesh frequency. A sample of random errors has the same `single_pitch` errors in every mesh period of this cycle.

Planets that mesh in pairs are given by `[gears.NAME]` and `[[meshes]]`, in the frame of the carrier.

{key_tables(Planetary)}
## Several loads

`simulate`, `sweep`, `robust` and `optimise` compute every load, and weighted mean (`…_load_mean`) and maximum
(`…_load_max`) of each metric.

```toml
[[loads]]
torque = 40.0
weight = 3.0
[[loads]]
torque = 120.0
[[loads]]
torque = -60.0                    # coast
```
{key_tables(WeightedLoad)}
## Coast flanks

A negative torque loads the coast flanks (G10 of [Theory](theory.md)). On these flanks, a table below `[coast]` replaces
the shape of the same name below `[effects]`; other shapes are the same on both flanks.

```toml
[effects.tip_relief]              # drive flanks
amount = 10.0
length = 0.8
[coast.tip_relief]
amount = 4.0
length = 0.8
```
{_operation()}"""


def _operation() -> str:
    """Speed and lubrication, and how finely."""
    from docs.keys import key_tables, prose
    from gearbench.scene import Operation, Resolution

    return f"""
## Operation

{prose(Operation)}

```toml
[operation]
speed = 3000.0
viscosity = 20.0
```
{key_tables(Operation)}
Friction: (F1) to (F3) of [Theory](theory.md), ISO/TR 14179-2; flash temperature: (F5), ISO/TR 13989-1.

## Resolution

{key_tables(Resolution)}"""


def quantities() -> str:
    """Every name a Dataset may hold, in the groups of ``gearbench.results.quantities``, as CSV."""
    from gearbench.results.outputs import DEFAULT_OUTPUTS, OUTPUTS
    from gearbench.results.quantities import GROUPS
    from gearbench.results.responses import responses

    known = {name: each.quantity for name, each in responses().items() if not HIGHER.search(name)}
    rows = [("group", "name", "symbol [unit]", "meaning", "output", "over")]
    for group, table in {**GROUPS, "metrics": known}.items():
        for name, q in table.items():
            asked = "on request" if name in OUTPUTS or group == "metrics" else ""
            output = "default" if name in DEFAULT_OUTPUTS else asked
            over = ", ".join(OUTPUTS[name][0]) if name in OUTPUTS else ""
            rows.append((group.capitalize(), f"`{name}`", symbol_and_unit(q), q.long_name, output, over))
    file = StringIO()
    csv.writer(file, lineterminator="\n").writerows(rows)
    return file.getvalue()


def symbol_and_unit(quantity: Quantity) -> str:
    """The symbol of a quantity, and its unit in brackets; the unit 1 is left out."""
    return f"{quantity.symbol} [{quantity.unit}]".strip() if quantity.unit else quantity.symbol


def commands() -> str:
    """Every command with its arguments and options, as ``--help`` has them."""
    from gearbench.cli.app import application

    app = application()

    text = f"""# Commands

{app.info.help} Every command has `--help`.

- Exit codes: 0 done, 1 failed, 2 bad input (one line names file, key, value and what is allowed), 130 interrupted by
  Ctrl-C, 143 by SIGTERM.
- `gearbench --install-completion` sets up completion for bash, zsh, fish or PowerShell; `--show-completion` prints it.
- Progress is shown on terminals only, on the error stream, and not with `--quiet` or `--json`.
"""
    rows = {command.callback: _rows(command.callback) for command in app.registered_commands if command.callback}
    times = Counter(row for found in rows.values() for row in found)
    common = {row: None for found in rows.values() for row in found if times[row] >= COMMON}
    always = {row for row in common if times[row] == len(rows)}
    text += "\n## Common options\n\nEvery command takes "
    text += f"{_names(always)}; the sections below name the others.\n{_listed(common)}"
    return text + "".join(_command(command, found, common, always) for command, found in rows.items())


def _names(rows: Iterable[str]) -> str:
    return ", ".join(sorted(row.split()[1].rstrip(",:") for row in rows))


def _command(
    command: Callable[..., Any], rows: Collection[str], common: Collection[str], always: Collection[str]
) -> str:
    parts = (inspect.getdoc(command) or "").split("\n\n")
    shown = "\n\n".join(re.sub(r"^([^:]*): (gearbench .*)$", r"\1: `\2`", part, flags=re.DOTALL) for part in parts)
    also = ", ".join(row.split()[1].rstrip(",:") for row in rows if row in common and row not in always)
    own = [row for row in rows if row not in common]
    return f"\n## gearbench {command.__name__}\n\n{shown}\n" + _listed(own) + (f"\nAlso: {also}.\n" if also else "")


def _listed(rows: Collection[str]) -> str:
    return f"\n{''.join(rows)}" if rows else ""


def _rows(command: Callable[..., Any]) -> list[str]:
    """An item of the list for each argument and option of a command."""
    hints = get_type_hints(command, include_extras=True)
    return [_row(*_annotated(hints[p.name]), p) for p in inspect.signature(command).parameters.values()]


def _annotated(hint: Any) -> tuple[Any, Any]:
    """Type and typer's description of a parameter."""
    kind, described = get_args(hint)
    return kind, described


def _row(kind: Any, described: Any, parameter: inspect.Parameter) -> str:
    """An item of the list: how the parameter is written, its help, choices and default."""
    name, default = parameter.name.replace("_", "-"), parameter.default
    # typer takes the first of the names for the default
    first = (described.default,) if isinstance(described.default, str) else ()
    names = (*first, *(described.param_decls or ())) or ((f"--{name}",) if isinstance(described, OptionInfo) else ())
    value = "" if kind is bool else described.metavar or name.upper()
    choices = ", ".join(f"`{choice}`" for choice in get_args(kind) if isinstance(choice, str))
    given = isinstance(default, (int, float, str)) and not isinstance(default, bool)
    help_ = (described.help, choices and f"One of {choices}.", f"Default: {default}." if given else "")
    written = " ".join(filter(None, (", ".join(f"`{n}`" for n in names), value and f"`{value}`")))
    return f"- {written}: {' '.join(filter(None, help_))}\n".replace("*", r"\*")


PAGES: dict[str, Callable[[], str]] = {
    "scene.md": scene,
    "effects.md": effects,
    "pair.md": pair,
    "system.md": system,
    "data/quantities.csv": quantities,
    "commands.md": commands,
}


if __name__ == "__main__":
    for name in sys.argv[1:] or PAGES:
        (FOLDER / name).write_text(PAGES[name](), encoding="utf-8")
