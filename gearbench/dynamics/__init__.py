"""Dynamic response of a scene with ``[system]``: what its meshes excite, over speed."""
