"""Tooth compliance by the Ritz method: bases, energies, and their symbolic twins."""
