"""Validation of the fast models against finite elements of the same scene."""
