"""Provenance of a result: scene, versions, revision, seed, wall time, host."""

from __future__ import annotations

import platform
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from gearbench.effects.base import ComplianceEffect
from gearbench.scene import Scene, digest

#: Strain at the tooth root above which results carry a warning: twice what hardened steel bears, and above plastics.
LARGEST_STRAIN = 0.02
_PACKAGES = ("gearbench", "numpy", "scipy", "numba", "xarray")


def provenance(scene: Scene, *, wall_time: float, seed: int | None = None) -> dict[str, Any]:
    """Attributes of a Dataset: scene as TOML, its hash, support, versions, git revision, seed, wall time [s], host.

    The attribute ``warning`` has one line per warning: strain beyond linear elasticity, and doubts about the system.
    """
    text = scene.to_toml()
    of_scene = {"scene": text, "scene_sha256": digest(text), "support": support(scene)}
    if lines := [*filter(None, [beyond_elasticity(scene)]), *doubts(scene)]:
        of_scene["warning"] = "\n".join(lines)
    attrs = {**of_scene, **run_provenance(wall_time=wall_time)}
    return attrs if seed is None else {**attrs, "seed": seed}


def beyond_elasticity(scene: Scene) -> str | None:
    """Warning if the teeth are strained beyond the range of linear elasticity, else None.

    The strain at the root is about 3 F_bn / (b m_n E), with a product of form and stress factor of 3 as in ISO 6336-3.
    """
    strain = 3 * scene.relative_load
    if strain <= LARGEST_STRAIN:
        return None
    return f"teeth strained by about {100 * strain:.2g} %: linear elasticity, which all results assume, ends far below"


def doubts(scene: Scene) -> tuple[str, ...]:
    """Doubts about the system of a scene, one line per doubt."""
    if scene.system is None:
        return ()
    one = scene.under(scene.load).one_mesh  # the greatest of several loads
    from gearbench.system.doubts import doubts_of_shafts, doubts_of_wheels

    return tuple(doubts_of_shafts(one.gearbox) if one.has_shafts else doubts_of_wheels(scene.system, one.pair))


def support(scene: Scene) -> str:
    """Body that supports the teeth: "ring", "sainsot_velex", "finite_elements"; "clamped" or "rigid" without a body."""
    names = [effect.name for effect in scene.effects if isinstance(effect, ComplianceEffect) and effect.name != "hertz"]
    body, tooth = scene.effect("gear_body"), scene.effect("tooth_bending")
    if body is None:
        return "clamped" if names else "rigid"
    return "finite_elements" if getattr(tooth, "model", "") == "finite_elements" else str(getattr(body, "model", ""))


def run_provenance(*, wall_time: float) -> dict[str, Any]:
    """Attributes of every Dataset: package versions, git revision, wall time [s], creation time, host."""
    return {
        "versions": versions(),
        "git_revision": git_revision(),
        "wall_time_s": wall_time,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "host": platform.node(),
        "Conventions": "CF-1.8",
    }


@cache
def versions() -> str:
    """Versions of Python and of the packages that computed the result."""
    lines = [f"python {platform.python_version()}"]
    for package in _PACKAGES:
        try:
            lines.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return ", ".join(lines)


@cache
def git_revision() -> str:
    """Git revision of the checkout from which the package is imported; "unknown" outside a checkout."""
    folder = Path(__file__).resolve().parent
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=5, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return done.stdout.strip() or "unknown"
