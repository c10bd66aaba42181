"""Names of two gears and of their one mesh."""

#: Driver and driven gear. A gear of a mesh is an index, 0 or 1, wherever the two stand in order, or one of these names.
GEARS = ("pinion", "wheel")
#: Mesh of a pair.
PAIR = "pair"
