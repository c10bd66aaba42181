"""What settles the numerical error of a run, and how to choose it for an accuracy that is asked for."""
