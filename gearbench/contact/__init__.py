"""The unilateral contact problem of a mesh cycle, in three subjects.

The problem: ``gaps`` and ``lines``, ``assemble`` of both with the compliance, ``problem`` (the arrays), ``scaling``,
``smooth``, ``law``, ``size``; under several loads ``loads``, on shafts ``bearings``, of whole trains ``equilibrium``.

The quadrature over a cycle: ``look`` solves it coarsely, ``births`` and ``transitions`` say at which phases the contact
changes, ``panels`` and ``phases`` make Gauss points between them; along the lines ``patches`` and ``pieces`` do.

The solvers: ``solver`` (one problem), ``batch`` (many samples), ``dense`` (active set), ``reference`` (linearised at
the mean errors).
"""
