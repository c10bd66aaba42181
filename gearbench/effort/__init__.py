"""Cost of accuracy in time and memory: one clock, work–precision curves, the plan of a run."""
