"""Dynamic response over speed of a system that its meshes excite: linear, with loss of contact, scatter, sidebands."""
