"""Results of a solved scene: outputs, names, units, provenance and files."""
