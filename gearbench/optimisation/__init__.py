"""Optimisation of macro- and micro-geometry: study files, NSGA-II, a resumable store, selection, verification."""
