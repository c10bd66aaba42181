"""The unilateral contact problem of a mesh cycle.

The problem: ``assemble`` builds it from ``gaps``, ``lines``, the compliance (``smooth``) and the contact ``law``;
``problem`` holds its arrays, ``scaling`` makes them dimensionless, ``size`` checks the memory. ``loads`` is for several
loads, ``bearings`` for pairs on shafts, ``equilibrium`` and ``bodies`` for whole trains.

Quadrature over the mesh cycle: ``coarse_solution`` solves the contact coarsely, ``load_transfer`` and ``transitions``
find the phases at which it changes, ``panels`` and ``phases`` place Gauss points between them. Cells contact lines
``patches`` and ``interpolation`` do so.

Solvers: ``solver`` for one problem, ``batch`` for many samples, ``dense`` by active set, ``reference`` for the problem
linearised at the mean errors.
"""
