"""Simulation of a scene over ranges of its keys, loads in particular."""
