"""Ratings of a pair to compare with limits: contact ratios, sliding, contact pressure, root stress."""
