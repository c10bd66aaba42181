"""3D finite element reference for tooth compliance (gmsh, scikit-fem)."""
