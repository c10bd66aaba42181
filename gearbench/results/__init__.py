"""Results: answers of a solved scene, their names, units, provenance and files."""
