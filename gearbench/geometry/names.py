"""Names of two gears and of their one mesh."""

#: Driver and driven gear. A gear of a mesh is an index, 0 or 1, or one of these names.
GEARS = ("pinion", "wheel")
#: Name of the mesh of a pair.
PAIR = "pair"
