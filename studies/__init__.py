"""Reproducible studies, one question a package: its scene(), compute(), checks() and figures()."""
