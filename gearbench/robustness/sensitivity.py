"""Contribution of each error to the variance: first-order and total Sobol indices from given samples.

The first-order index of an independent variable x_i is S_i = Var(E[y | x_i]) / Var(y). The response is expanded in
polynomials of each x_i, orthonormal over its samples (Oladyshkin & Nowak 2012) so that any distribution will do, and in
products of two of them. Orthogonal matching pursuit adds terms as long as they reduce the residual significantly; the
coefficients β follow by least squares. Then S_i = Σ_k β_ik² / Var(y), with the bias Σ_k Var(β_ik) from noise of β
subtracted from the sum. The total index S_Ti also includes the products with x_i. The rest of the variance
is higher interaction or noise of the fit.

The effect of a smaller error on the mean response follows from the same main effects. With f_i(x_i) = E[y | x_i], the
mean over all errors with x_i scaled by s is exactly E[f_i(s x_i)], whatever the interactions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

#: Highest degree of one variable, and of each variable in a product of two.
DEGREE, PRODUCT_DEGREE = 10, 2

#: Unexplained share of the variance at which the expansion ends.
NEGLIGIBLE = 1e-6

#: Maximum number of variables for which products of two are tried.
MOST_WITH_PRODUCTS = 60


@dataclass(frozen=True)
class Fit:
    """Least-squares fit on the chosen terms.

    Parameters
    ----------
    variables
        Variables of each term, (term, 2): the same variable twice, or the two of a product; −1 for the constant.
    coefficients, influence
        β (term,), and the influence of each sample on β, (sample, term).
    terms
        Values of the terms, (sample, term).
    residual
        Residuals (sample,).
    """

    variables: NDArray
    coefficients: NDArray
    influence: NDArray
    terms: NDArray
    residual: NDArray

    def contains(self, count: int, *, total: bool) -> NDArray:
        """Whether a term contains each of ``count`` variables: alone or, if ``total``, also in a product.

        Shape (term, variable).
        """
        first, second = (self.variables[:, [i]] == np.arange(count) for i in (0, 1))
        return first | second if total else first & second


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivity of a response to the errors, as pairs (value, standard error) of arrays (error,).

    Parameters
    ----------
    first_order, total
        First-order and total shares in the variance.
    tightened
        Change of the mean if only this error is scaled.
    """

    first_order: tuple[NDArray, NDArray]
    total: tuple[NDArray, NDArray]
    tightened: tuple[NDArray, NDArray]


@dataclass(frozen=True)
class Candidates:
    """Candidate terms for the expansion of a response, first those of a single variable, then products of two.

    Parameters
    ----------
    variables
        Variables of each term, (term, 2).
    values, scaled
        Values of all terms (sample, term), and of the terms of a single variable at the scaled errors.
    low
        Indices of the terms that every expansion contains, so that each index has an error estimate.
    """

    variables: NDArray
    values: NDArray
    scaled: NDArray
    low: NDArray


def sensitivities(errors: NDArray, responses: Sequence[NDArray], scale: float = 1.0) -> list[Sensitivity]:
    """First-order and total Sobol indices, and the change of the mean with each error scaled by ``scale``.

    Indices are unbiased as long as polynomials describe the effects (up to degree 10 alone, 2 in products). An index
    near 0 may therefore be slightly negative. Standard errors are those of independent samples, by the infinitesimal
    jackknife; for Sobol points and Latin hypercubes they are on the safe side. Constant errors have the index 0.

    Parameters
    ----------
    errors
        Independent random variables (sample, error) of any continuous distribution.
    responses
        Values (sample,) of each response.
    scale
        Factor from 0 to 1; scaled errors must lie within the range of the errors, so this range must contain 0.

    Returns
    -------
    Values and standard errors for each response. They are NaN if there are too few samples (less than twice the terms
    of a linear fit) or the response is constant.
    """
    x = np.asarray(errors, dtype=float)
    n, d = x.shape
    varied = np.flatnonzero(np.ptp(x, axis=0) > 0) if n else np.arange(0)
    few = n < max(8, 2 * (len(varied) + 1))
    candidates = None if few or not len(varied) else _candidates(x[:, varied], scale)
    by_response = []
    for values in responses:
        y = np.asarray(values, dtype=float)
        if y.shape != (n,):
            raise ValueError(f"values must be of shape ({n},), one for each sample of errors, not {y.shape}")
        shares = np.zeros((3, 2, d))
        if few or np.ptp(y) <= 1e-12 * np.abs(y).max():
            shares[:] = math.nan
        elif candidates is not None:
            fit, scaled = _fit(candidates, y)
            shares[0][:, varied] = _indices(fit, len(varied), total=False)
            shares[1][:, varied] = _indices(fit, len(varied), total=True)
            shares[2][:, varied] = _change(fit, scaled, len(varied))
        first, total, tightened = ((value, error) for value, error in shares)
        by_response.append(Sensitivity(first_order=first, total=total, tightened=tightened))
    return by_response


def _indices(fit: Fit, count: int, *, total: bool) -> tuple[NDArray, NDArray]:
    """Indices of ``count`` variables, corrected for bias, and their standard errors, both (variable,).

    An index is S = A/V, with the variance A of the effects of a variable, and the variance V of the response.
    """
    n, p = fit.influence.shape
    β, ψ = fit.coefficients, fit.influence
    correction = n / (n - p)
    var_β = correction * (ψ**2).mean(axis=0) / n
    constant = fit.variables[:, 0] < 0
    of_index, alone = fit.contains(count, total=total), fit.contains(count, total=False)
    σ2 = correction * (fit.residual**2).mean()
    A = (β**2 - var_β) @ of_index
    V = (β**2 - var_β)[~constant].sum() + σ2

    def on(terms: NDArray) -> NDArray:
        """Influence of each sample on A: through β, and through the variance of the effect over the samples."""
        effect = (fit.terms * β) @ terms
        return 2 * (ψ * β) @ terms + (effect**2 - (effect**2).mean(axis=0))

    on_A = on(of_index)
    products = ~alone.any(axis=1) & ~constant
    on_V = on(alone).sum(axis=1) + 2 * ψ[:, products] @ β[products] + correction * fit.residual**2 - σ2
    S = A / V
    on_S = (on_A - S * on_V[:, None]) / V
    # With v = Var β̂: Var β̂² = 4 β² v + 2 v². The estimate 4 β̂² v − 2 v² is unbiased; it must be at least 2 v².
    second_order = 2 * (var_β**2 @ of_index) / V**2
    variance = np.maximum(correction * (on_S**2).mean(axis=0) / n - second_order, second_order)
    return S, np.sqrt(variance)


def _change(fit: Fit, scaled: NDArray, count: int) -> tuple[NDArray, NDArray]:
    """E f_i(s x_i) − E f_i(x_i) of ``count`` variables, and its standard error, both (variable,).

    ``scaled`` holds the terms of single variables at s x_i.
    """
    n, p = fit.influence.shape
    alone = fit.contains(count, total=False)
    change = (scaled - fit.terms) * alone.any(axis=1)
    step = (change * fit.coefficients) @ alone  # f_i(s x_i) − f_i(x_i), (sample, variable)
    influence = (fit.influence * change.mean(axis=0)) @ alone + step - step.mean(axis=0)
    return step.mean(axis=0), np.sqrt(n / (n - p) * (influence**2).mean(axis=0) / n)


def _fit(candidates: Candidates, y: NDArray) -> tuple[Fit, NDArray]:
    """Least-squares fit on the terms that matching pursuit chooses, and these terms at the scaled x (sample, term)."""
    n, variables, terms = len(y), candidates.variables, candidates.values
    alone = variables[:, 0] == variables[:, 1]
    chosen = _pursue(terms, y, candidates.low)
    X = np.column_stack([np.ones(n), terms[:, chosen]])
    Q, R = np.linalg.qr(X)
    inverse = np.linalg.inv(R)
    β = inverse @ (Q.T @ y)
    e = y - X @ β
    influence = n * e[:, None] * (Q @ inverse.T)
    # products do not change the mean if one variable is scaled
    single = [candidates.scaled[:, i] if alone[i] else terms[:, i] for i in chosen]
    chosen_variables = np.concatenate([[[-1, -1]], variables[chosen]])
    at_scale = np.column_stack([np.ones(n), *single])
    return Fit(variables=chosen_variables, coefficients=β, influence=influence, terms=X, residual=e), at_scale


def _pursue(terms: NDArray, y: NDArray, low: NDArray) -> list[int]:
    """Orthogonal matching pursuit: indices of the terms ``low`` and of further terms that explain y significantly."""
    n = len(y)
    chosen = list(low)
    most = max(min(n // 4, terms.shape[1]), len(chosen))
    Q = np.empty((n, most + 1), order="F")
    p = len(chosen) + 1
    Q[:, :p] = np.linalg.qr(np.column_stack([np.ones(n), terms[:, low]]))[0]
    r = y - Q[:, :p] @ (Q[:, :p].T @ y)
    floor = NEGLIGIBLE * float(((y - y.mean()) ** 2).sum())
    # a term must reduce n log(residual) by this much: extended Bayesian information criterion (Chen & Chen 2008)
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


def _candidates(x: NDArray, scale: float) -> Candidates:
    """Polynomials of each variable of x (sample, variable), also at scale · x, and products of two variables."""
    n, d = x.shape
    both = [_orthonormal(column, scale) for column in x.T]
    single = [basis for basis, _ in both]
    variables = [(i, i) for i, basis in enumerate(single) for _ in range(basis.shape[1])]
    degree = [k + 1 for basis in single for k in range(basis.shape[1])]
    terms = single
    if d <= MOST_WITH_PRODUCTS:
        pairs = [
            (a[:, :PRODUCT_DEGREE, None] * b[:, None, :PRODUCT_DEGREE]).reshape(n, -1)
            for a, b in combinations(single, 2)
        ]
        terms = [*single, *pairs]
        couples = zip(combinations(range(d), 2), pairs, strict=True)
        variables += [couple for couple, products in couples for _ in range(products.shape[1])]
    low = np.flatnonzero(np.array(degree) <= (2 if n >= 8 * d else 1))
    return Candidates(
        variables=np.array(variables).reshape(-1, 2),
        values=np.concatenate(terms, axis=1),
        scaled=np.concatenate([at for _, at in both], axis=1),
        low=low,
    )


def _orthonormal(x: NDArray, scale: float) -> tuple[NDArray, NDArray]:
    """Polynomials (sample, degree) from degree 1, orthonormal over the samples and without mean, at x and scale · x."""
    low, high = x.min(), x.max()
    degree = min(DEGREE, len(np.unique(x)) - 1)
    at = (2 * np.concatenate([x, scale * x]) - low - high) / (high - low)
    powers, scaled = np.split(np.polynomial.legendre.legvander(at, degree), 2)
    basis = math.sqrt(len(x)) * np.linalg.inv(np.linalg.qr(powers, mode="r"))[:, 1:]
    return powers @ basis, scaled @ basis
