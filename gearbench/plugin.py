"""Base classes and declarations for effects, metrics and gear types of other packages."""

from gearbench.effects.base import ComplianceEffect, Dense, Effect, GapEffect, LineLaw, LowRank
from gearbench.geometry.blank import Blank, RootCurve
from gearbench.geometry.blank import register as register_blank
from gearbench.results.cycle import MeshCycle, Phases
from gearbench.results.quantities import Quantity
from gearbench.results.responses import Metric
from gearbench.results.responses import register as register_metric
from gearbench.schema import STRICT

__all__ = [
    "STRICT",
    "Blank",
    "ComplianceEffect",
    "Dense",
    "Effect",
    "GapEffect",
    "LineLaw",
    "LowRank",
    "MeshCycle",
    "Metric",
    "Phases",
    "Quantity",
    "RootCurve",
    "register_blank",
    "register_metric",
]
