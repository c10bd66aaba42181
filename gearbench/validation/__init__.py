"""Validation of fast models: a scene against the same scene on finite elements."""
