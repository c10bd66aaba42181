"""Strength of a pair as numbers to compare with limits: contact ratio, sliding, contact pressure, root stress."""

from gearbench.strength.limits import Limits, violations
from gearbench.strength.rating import Strength, contact_pressure, strength

__all__ = ["Limits", "Strength", "contact_pressure", "strength", "violations"]
