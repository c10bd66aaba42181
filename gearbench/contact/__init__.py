"""The contact of all tooth pairs at each position of a mesh cycle: loads, approach and stiffness; flanks only push.

The problem: ``assemble`` builds it from ``gaps``, ``lines``, the compliance (``smooth``) and the contact ``law``;
``problem`` holds its arrays, ``scaling`` makes them dimensionless, ``size`` checks the memory. ``loads`` is for several
loads, ``bearings`` and ``mesh_loads`` for gears on shafts, ``equilibrium`` and ``bodies`` for whole trains.

Quadrature over the mesh cycle: ``coarse_solution`` solves the contact coarsely, ``load_transfer`` and ``transitions``
find the phases at which it changes, ``panels`` and ``phases`` place Gauss points between them. On contact lines,
``patches`` places points where the flanks touch, and ``interpolation`` carries values between the points.

Solvers: ``solver`` for one problem, ``batch`` for many samples, ``dense`` by active set, ``reference`` for the problem
linearised at the mean errors.
"""
