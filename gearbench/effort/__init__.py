"""Cost in time and memory: measurement, work–precision curves, and the plan of a run."""
