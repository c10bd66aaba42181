"""Names of two gears, of their one mesh, and of the members of a planetary set."""

#: Driver and driven gear. A gear of a mesh is an index, 0 or 1, or one of these names.
GEARS = ("pinion", "wheel")
#: Name of the mesh of a pair.
PAIR = "pair"
#: Members of a planetary set.
SUN, PLANET, AT_RING, RING, CARRIER = "sun", "planet", "planet_at_ring", "ring", "carrier"
#: Names of the gear tables below ``[planetary]``; ``AT_RING`` is for stepped planets.
MEMBERS = (SUN, PLANET, AT_RING, RING)
#: Keys that the gears of a mesh share, as both gears of a pair do.
SHARED = ("normal_module", "pressure_angle", "helix_angle")
