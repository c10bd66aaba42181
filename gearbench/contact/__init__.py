"""The unilateral contact problem of a mesh cycle: assembly and solvers."""
