"""Reproducible studies: one question a file."""
