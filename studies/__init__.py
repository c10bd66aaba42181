"""Reproducible studies: one package per question, with scene(), compute(), checks() and figures()."""
