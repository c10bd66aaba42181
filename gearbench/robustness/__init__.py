"""Robustness of a design under random manufacturing errors."""
