"""Geometry of external involute gear pairs: rack, flank and fillet, gear, pair, contact lines."""
