"""Trains whose meshes form one contact problem: parallel paths, floating gears, flexible pins."""
