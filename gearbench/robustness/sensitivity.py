"""Which error contributes how much: first-order Sobol indices from the samples at hand.

S_i = Var(E[y | x_i]) / Var(y) of independent x_i. The response is expanded in polynomials orthonormal over the samples
of each x_i (Oladyshkin & Nowak 2012), so that any distribution will do, and in products of two of them. Terms enter by
orthogonal matching pursuit as long as they reduce the residual significantly; the coefficients are those of least
squares. The main effects give S_i = Σ_k β_ik² / Var(y), less the bias Σ_k Var(β_ik) that noise in β adds to its square.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

#: Highest degree of one variable, and of each variable in a product of two.
DEGREE, PRODUCT_DEGREE = 10, 2

#: Share of the variance that is not worth explaining.
NEGLIGIBLE = 1e-6

#: Products of two variables are looked for up to as many variables.
MOST_WITH_PRODUCTS = 60


@dataclass(frozen=True)
class Fit:
    """Least squares on the chosen terms.

    Parameters
    ----------
    owner
        Variable of each term; −1 for products and the constant, (term,).
    coefficients, influence
        β, (term,), and the contribution of each sample, (sample, term).
    main
        Main effect of each variable at the samples, (sample, variable).
    residual
        (sample,)
    """

    owner: NDArray
    coefficients: NDArray
    influence: NDArray
    main: NDArray
    residual: NDArray


def first_order_indices(errors: NDArray, values: NDArray) -> tuple[NDArray, NDArray]:
    """First-order Sobol indices and their standard errors, each (error,).

    Without bias as long as polynomials describe the main effects (degree 10 and less); therefore an index near 0 may
    come out slightly negative. Standard errors are those of independent samples, by the infinitesimal jackknife; for
    Sobol points and Latin hypercubes they err on the safe side. Constant errors have index 0.

    Parameters
    ----------
    errors
        Independent random variables, (sample, error), each of any continuous distribution.
    values
        Response, (sample,).

    Returns
    -------
    (index, standard error); NaN where the samples are too few (less than twice the terms of a linear fit) or the
    response is constant.
    """
    x, y = np.asarray(errors, dtype=float), np.asarray(values, dtype=float)
    n, d = x.shape
    if y.shape != (n,):
        raise ValueError(f"values must be of shape ({n},), one for each sample of errors, not {y.shape}")
    varied = np.flatnonzero(np.ptp(x, axis=0) > 0) if n else np.arange(0)
    index, error = np.zeros(d), np.zeros(d)
    if n < max(8, 2 * (len(varied) + 1)) or np.ptp(y) <= 1e-12 * np.abs(y).max():
        return np.full(d, math.nan), np.full(d, math.nan)
    if len(varied):
        index[varied], error[varied] = _indices(_fit(x[:, varied], y))
    return index, error


def _indices(fit: Fit) -> tuple[NDArray, NDArray]:
    """Indices and their standard errors, bias corrected, from the influence of each sample."""
    (n, p), d = fit.influence.shape, fit.main.shape[1]
    β, ψ, of = fit.coefficients, fit.influence, fit.owner
    correction = n / (n - p)
    var_β = correction * (ψ**2).mean(axis=0) / n
    constant = np.zeros(p, dtype=bool)
    constant[0] = True
    mine = of[:, None] == np.arange(d)  # (term, variable)
    σ2 = correction * (fit.residual**2).mean()
    A = (β**2 - var_β) @ mine
    V = (β**2 - var_β)[~constant].sum() + σ2
    # influence of a sample on A: through β, and through the variance of the main effect over the samples
    on_A = 2 * (ψ * β) @ mine + (fit.main**2 - (fit.main**2).mean(axis=0))
    products = (of < 0) & ~constant
    on_V = on_A.sum(axis=1) + 2 * ψ[:, products] @ β[products] + correction * fit.residual**2 - σ2
    S = A / V
    on_S = (on_A - S * on_V[:, None]) / V
    # Var β̂² = 4 β² v + 2 v², estimated without bias by 4 β̂² v − 2 v², and 2 v² at least; v = Var β̂
    second_order = 2 * (var_β**2 @ mine) / V**2
    variance = np.maximum(correction * (on_S**2).mean(axis=0) / n - second_order, second_order)
    return S, np.sqrt(variance)


def _fit(x: NDArray, y: NDArray) -> Fit:
    """Least squares on the terms that matching pursuit chooses."""
    n, d = x.shape
    owner, terms, degree = _candidates(x)
    # always there: low orders of every variable, so that each index has an error estimate
    low = 2 if n >= 8 * d else 1
    chosen = _pursue(terms, y, np.flatnonzero((owner >= 0) & (degree <= low)))
    X = np.column_stack([np.ones(n), terms[:, chosen]])
    of = np.concatenate([[-1], owner[chosen]])
    Q, R = np.linalg.qr(X)
    β = np.linalg.solve(R, Q.T @ y)
    e = y - X @ β
    influence = n * e[:, None] * np.linalg.solve(R, Q.T).T
    return Fit(owner=of, coefficients=β, influence=influence, main=(X * β) @ (of[:, None] == np.arange(d)), residual=e)


def _pursue(terms: NDArray, y: NDArray, first: NDArray) -> list[int]:
    """Orthogonal matching pursuit: the terms ``first``, and those that then explain y significantly."""
    n = len(y)
    chosen = list(first)
    most = max(min(n // 4, terms.shape[1]), len(chosen))
    Q = np.empty((n, most + 1), order="F")
    p = len(chosen) + 1
    Q[:, :p] = np.linalg.qr(np.column_stack([np.ones(n), terms[:, first]]))[0]
    r = y - Q[:, :p] @ (Q[:, :p].T @ y)
    floor = NEGLIGIBLE * float(((y - y.mean()) ** 2).sum())
    # n log(ratio of residuals) that is worth a term: extended information criterion (Chen & Chen 2008)
    worth = math.log(n) + 2 * math.log(terms.shape[1] or 1)
    while p <= most and r @ r > floor:
        score = np.abs(r @ terms)
        score[chosen] = 0.0
        best = int(score.argmax())
        q = terms[:, best] - Q[:, :p] @ (Q[:, :p].T @ terms[:, best])
        norm = math.sqrt(q @ q)
        after = r - q * (q @ r) / norm**2 if norm > 1e-6 * math.sqrt(n) else r
        if n * math.log((r @ r) / max(after @ after, 1e-3 * floor)) < worth:
            break
        chosen.append(best)
        Q[:, p], r, p = q / norm, after, p + 1
    return chosen


def _candidates(x: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Variable (−1: two) and degree of each candidate, (term,), and its values, (sample, term)."""
    single = [_orthonormal(column) for column in x.T]
    owner = [i for i, basis in enumerate(single) for _ in range(basis.shape[1])]
    degree = [k + 1 for basis in single for k in range(basis.shape[1])]
    terms = single
    if len(single) <= MOST_WITH_PRODUCTS:
        pairs = [
            (a[:, :PRODUCT_DEGREE, None] * b[:, None, :PRODUCT_DEGREE]).reshape(len(x), -1)
            for a, b in combinations(single, 2)
        ]
        terms = [*single, *pairs]
    values = np.concatenate(terms, axis=1)
    products = values.shape[1] - len(owner)
    return np.array(owner + [-1] * products), values, np.array(degree + [0] * products)


def _orthonormal(x: NDArray) -> NDArray:
    """Polynomials of degree 1 … orthonormal over the samples and free of mean, (sample, degree)."""
    low, high = x.min(), x.max()
    degree = min(DEGREE, len(np.unique(x)) - 1)
    powers = np.polynomial.legendre.legvander((2 * x - low - high) / (high - low), degree)
    return math.sqrt(len(x)) * np.linalg.qr(powers)[0][:, 1:]
