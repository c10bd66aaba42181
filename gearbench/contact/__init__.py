"""The unilateral contact problem of a mesh cycle, in three subjects.

The problem: ``gaps`` and ``lines``, ``assemble`` of both with the compliance, ``problem`` (what is solved),
``scaling``, ``smooth``, ``law``, ``size``; under several loads ``loads``, on shafts
``bearings``, of whole trains ``equilibrium``.

The quadrature over a cycle: ``look`` solves it coarsely, ``births`` and ``transitions`` say at which phases the contact
changes, ``panels`` and ``phases`` make Gauss points between them; along the lines ``patches`` and ``pieces`` do.

The solvers: ``solver`` (one problem), ``batch`` (many samples), ``dense`` and ``reference`` (to compare with).
"""
