"""Meshes of scikit-fem for the elements of ``fem_reference.elasticity``, with straight and with quadratic edges."""

import skfem

STRAIGHT = {"hex20": skfem.MeshHex1, "quad9": skfem.MeshQuad1, "tri6": skfem.MeshTri1}
CURVED = {"hex20": skfem.MeshHex2, "quad9": skfem.MeshQuad2, "tri6": skfem.MeshTri2}
