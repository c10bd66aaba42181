"""Shafts, bearings and inertias around a gear pair; imported only for scenes with ``[system]``."""
