"""Condensed sector and levels: both solvers, the circulant system, the error bar, the second route, refusals."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from fem_reference import circulant, refinement, waves
from fem_reference.axis import FaceFunctions
from fem_reference.circulant import circulant_compliance, tensor_stiffness
from fem_reference.refinement import AccuracyError, Level, levels, refined_compliance
from fem_reference.section import Body
from fem_reference.solver import available_solver, schur_complement
from gearbench import budget
from tests.support.gears import standard_gear

SPUR = Body(gear=standard_gear(24, 3.0), bore_radius=0.8 * standard_gear(24).root_radius, teeth=5)
HELICAL = Body(
    gear=standard_gear(18, 4.0, helix=20.0), bore_radius=0.6 * standard_gear(18, helix=20.0).root_radius, teeth=5
)
ORDER = (4, 5)


def definite(n: int, seed: int = 3) -> np.ndarray:
    A = np.random.default_rng(seed).standard_normal((n, n))
    return A @ A.T + n * np.eye(n)


@pytest.mark.parametrize("solver", ["pardiso", "splu"])
def test_schur_complement(solver):
    if solver == "pardiso" and available_solver() != "pardiso":
        pytest.skip("no MKL")
    K, F = definite(30), np.random.default_rng(1).standard_normal((30, 4))
    kept = np.array([7, 3, 29])
    found = schur_complement(sp.csr_matrix(np.triu(K)), sp.csr_matrix(F), kept, solver)
    whole = np.block([[K, F], [F.T, np.zeros((4, 4))]])
    chosen, inner = np.append(kept, np.arange(30, 34)), np.setdiff1d(np.arange(30), kept)
    coupling = whole[np.ix_(inner, chosen)]
    exact = whole[np.ix_(chosen, chosen)] - coupling.T @ np.linalg.solve(K[np.ix_(inner, inner)], coupling)
    assert_allclose(found, exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("z", [7, 8])
def test_circulant_system_is_that_of_all_sectors(z):
    """z sectors joined face to face, loads on the first one, by one dense system."""
    face, loads = 3, 2
    S = definite(2 * face + loads)
    S[-loads:, -loads:] = 0.0
    whole = np.zeros((z * face, z * face))
    force = np.zeros((z * face, z * loads))
    for j in range(z):
        at = np.concatenate([j * face + np.arange(face), (j + 1) % z * face + np.arange(face)])
        whole[np.ix_(at, at)] += S[: 2 * face, : 2 * face]
        force[np.ix_(at, j * loads + np.arange(loads))] += S[: 2 * face, 2 * face :]
    exact = force.T @ np.linalg.solve(whole, force[:, :loads])
    found = circulant_compliance(S, face, z, 2)
    for d in range(-2, 3):
        assert_allclose(found[d + 2], exact[d % z * loads :][:loads], atol=1e-12 * np.abs(exact).max())


def test_tensor_stiffness_is_the_energy_of_its_products(steel):
    """Against the Kronecker products written out, the functions that a node does not have taken out."""
    from gearbench.compliance.solid import axis_integrals

    section, count = Level(body=HELICAL, number=2, waves=1).section, 4
    there = np.random.default_rng(2).random((int(np.count_nonzero(section.free)), count)) < 0.6
    b = HELICAL.gear.face_width
    (M, G), (_, S) = axis_integrals(count) * np.array([[b, 1.0], [1.0, 1 / b]])[:, :, None, None]
    A00, A01, A11 = (A[section.free][:, section.free] for A in section.stiffness(steel, ~section.of_web))
    exact = sp.kron(A00, M) + sp.kron(A01, G) + sp.kron(A01.T, G.T) + sp.kron(A11, S)
    found = tensor_stiffness(section, FaceFunctions(breaks=(0.0, b), counts=(count,)), there, steel)
    kept = np.flatnonzero(there)
    assert abs(found - sp.triu(exact.tocsr()[kept][:, kept])).max() < 1e-12 * abs(exact).max()


@pytest.mark.parametrize("number", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_waves_left_out_below_the_teeth_are_not_missed(number, steel, monkeypatch):
    gear = standard_gear(20, 20.0, helix=25.0)
    body = Body(gear=gear, bore_radius=0.3 * gear.root_radius, teeth=5)
    some, order = Level(body=body, number=number, waves=18), (3, 18)
    found = refinement.solved(some, steel, order).blocks
    monkeypatch.setitem(refinement.FADED, number, 1e9)
    everyone = Level(body=body, number=number, waves=18)
    assert some.unknowns < 0.9 * everyone.unknowns
    step = np.linalg.norm(refinement.solved(everyone, steel, order).blocks - found)
    # a tenth of the error that the level is chosen for
    assert 0 < step < 0.1 * {2: 0.03, **refinement.USUAL}[number] * np.linalg.norm(found)


def test_waves_left_out_are_interpolated(steel, monkeypatch):
    body = Body(gear=standard_gear(90, 2.0), bore_radius=30.0, teeth=5)
    level = Level(body=body, number=2, waves=2)
    assert len(waves.wave_numbers(90)) < 30
    some = circulant.flank_blocks(level.section, level.axis, level.there, steel, (2, 2), 3)[0]
    for module in (circulant, waves):
        monkeypatch.setattr(module, "wave_numbers", lambda z: np.arange(z // 2 + 1))
    everyone = circulant.flank_blocks(level.section, level.axis, level.there, steel, (2, 2), 3)[0]
    # a tenth of the finest accuracy offered
    assert np.linalg.norm(some - everyone) < 1e-5 * np.linalg.norm(everyone)


@pytest.mark.slow
@pytest.mark.parametrize("body", [SPUR, HELICAL])
def test_levels_grow_and_the_error_bar_bounds_the_error(body, steel):
    fine = refined_compliance(body, steel, 3e-4, ORDER)
    last = refined_compliance(body, steel, 0.01, ORDER)
    n = len(fine.blocks) // 2
    blocks = [refinement.solved(Level(body=body, number=k, waves=ORDER[1]), steel, ORDER).blocks[n] for k in (2, 3)]
    assert np.linalg.eigvalsh(blocks[1] - blocks[0]).min() > -1e-10 * np.abs(fine.blocks).max()
    assert np.linalg.norm(last.blocks - fine.blocks) < (last.error + fine.error) * np.linalg.norm(fine.blocks)
    assert fine.error <= 3e-4 < last.error <= 0.01


def test_what_does_not_fit_is_refused_with_what_does(monkeypatch):
    with pytest.raises(AccuracyError, match="accuracy = 1e-06: must be at least 4e-05"):
        levels(SPUR, 1e-6)
    small = Level(body=SPUR, number=3, waves=5).memory
    monkeypatch.setattr(refinement, "memory_limit", lambda: 1.01 * small)
    assert [level.number for level in levels(SPUR, 0.01, ORDER)] == [2, 3]
    monkeypatch.setattr(budget, "memory_limit", lambda: 1.01 * small)
    monkeypatch.setattr(budget, "SMALL", 0.0)
    with pytest.raises(budget.MemoryBudgetError, match=r"needs about .* MB .*; accuracy = 0.008 would fit"):
        levels(SPUR, 0.001, ORDER)


def test_memory_is_bounded_by_the_entries_of_the_matrix(steel):
    for body in (SPUR, HELICAL):
        for number in (2, 3, 4):
            level = Level(body=body, number=number, waves=5)
            matrix = tensor_stiffness(level.section, level.axis, level.there, steel)
            entries = matrix.nnz
            assert level.unknowns == matrix.shape[0]
            # 120 bytes an entry, measured; spur gears have about half of the entries of helical ones
            assert 1.0 < (level.memory - 150e6) / (120 * entries) < 3.5
