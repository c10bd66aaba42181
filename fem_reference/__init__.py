"""3D finite element reference for tooth compliance and contact (gmsh, scikit-fem)."""
