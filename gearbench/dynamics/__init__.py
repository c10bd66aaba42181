"""Dynamic response over speed of a system that its meshes excite."""
