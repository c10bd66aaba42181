"""Trains whose meshes are one contact problem: parallel paths, floating gears, yielding pins."""
