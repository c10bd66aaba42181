"""Robustness of a design under random manufacturing errors: ``run.robust`` draws, solves and evaluates the samples."""
