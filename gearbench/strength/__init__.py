"""Strength of a pair as numbers to compare with limits: contact ratio, sliding, contact pressure, root stress."""
