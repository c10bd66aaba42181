"""Contact of two gears by finite elements: no contact line and no contact law assumed. CalculiX solves it."""
