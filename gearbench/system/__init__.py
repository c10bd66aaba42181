"""Shafts, bearings and inertias around a gear pair. Nothing of this is imported by a scene without ``[system]``."""
