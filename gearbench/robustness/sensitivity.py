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
        β (term,), and the influence of each sample on β, (term, sample).
    terms, scaled
        Values of the terms (term, sample), and those of terms of a single variable at the scaled errors.
    residual
        Residuals (sample,).
    """

    variables: NDArray
    coefficients: NDArray
    influence: NDArray
    terms: NDArray
    scaled: NDArray
    residual: NDArray

    def contains(self, count: int, *, total: bool) -> NDArray:
        """Whether each of ``count`` variables is in a term: alone or, if ``total``, also in a product.

        Shape (variable, term).
        """
        first, second = (self.variables[:, i] == np.arange(count)[:, None] for i in (0, 1))
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
        Values of all terms (term, sample), and of the terms of a single variable at the scaled errors.
    low, basis
        Indices of the terms that every expansion contains, so that each index has an error estimate, and orthonormal
        rows (1 + low, sample) that span the constant and these terms.
    """

    variables: NDArray
    values: NDArray
    scaled: NDArray
    low: NDArray
    basis: NDArray


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
    candidates = None if few or not len(varied) else _candidates(np.ascontiguousarray(x[:, varied].T), scale)
    by_response = []
    for values in responses:
        y = np.asarray(values, dtype=float)
        if y.shape != (n,):
            raise ValueError(f"values must be of shape ({n},), one for each sample of errors, not {y.shape}")
        shares = np.zeros((3, 2, d))
        if few or np.ptp(y) <= 1e-12 * np.abs(y).max():
            shares[:] = math.nan
        elif candidates is not None:
            fit = _fit(candidates, y)
            shares[:2, :, varied] = _indices(fit, len(varied))
            shares[2][:, varied] = _change(fit, len(varied))
        first, total, tightened = ((value, error) for value, error in shares)
        by_response.append(Sensitivity(first_order=first, total=total, tightened=tightened))
    return by_response


def _indices(fit: Fit, count: int) -> NDArray:
    """First-order and total indices of ``count`` variables, corrected for bias, and their standard errors.

    An index is S = A/V, with the variance A of the effects of a variable, and the variance V of the response. Shape
    (first-order or total, index or error, variable).
    """
    p, n = fit.influence.shape
    β, ψ = fit.coefficients, fit.influence
    correction = n / (n - p)
    var_β = correction * (ψ**2).mean(axis=1) / n
    constant = fit.variables[:, 0] < 0
    alone, together = (fit.contains(count, total=total) for total in (False, True))
    σ2 = correction * (fit.residual**2).mean()
    V = (β**2 - var_β)[~constant].sum() + σ2

    def on(of_index: NDArray) -> NDArray:
        """Influence of each sample on A: through β, and through the variance of the effect over the samples."""
        effect = (of_index * β) @ fit.terms
        return 2 * ((of_index * β) @ ψ) + effect**2 - (effect**2).mean(axis=1)[:, None]

    on_alone = on(alone)
    products = ~alone.any(axis=0) & ~constant
    on_V = on_alone.sum(axis=0) + 2 * β[products] @ ψ[products] + correction * fit.residual**2 - σ2
    indices = []
    for of_index, on_A in ((alone, on_alone), (together, on(together))):
        S = of_index @ (β**2 - var_β) / V
        on_S = (on_A - S[:, None] * on_V) / V
        # With v = Var β̂: Var β̂² = 4 β² v + 2 v². The estimate 4 β̂² v − 2 v² is unbiased; it must be at least 2 v².
        second_order = 2 * (of_index @ var_β**2) / V**2
        variance = np.maximum(correction * (on_S**2).mean(axis=1) / n - second_order, second_order)
        indices.append((S, np.sqrt(variance)))
    return np.array(indices)


def _change(fit: Fit, count: int) -> tuple[NDArray, NDArray]:
    """E f_i(s x_i) − E f_i(x_i) of ``count`` variables, and its standard error, both (variable,)."""
    p, n = fit.influence.shape
    alone, change = fit.contains(count, total=False), fit.scaled - fit.terms
    step = (alone * fit.coefficients) @ change  # f_i(s x_i) − f_i(x_i), (variable, sample)
    mean = step.mean(axis=1)
    influence = (alone * change.mean(axis=1)) @ fit.influence + step - mean[:, None]
    return mean, np.sqrt(n / (n - p) * (influence**2).mean(axis=1) / n)


def _fit(candidates: Candidates, y: NDArray) -> Fit:
    """Least-squares fit on the terms that matching pursuit chooses."""
    chosen, Q = _pursue(candidates, y)
    variables, terms = candidates.variables[chosen], candidates.values[chosen]
    # products do not change the mean if one variable is scaled
    scaled = terms.copy()
    alone = variables[:, 0] == variables[:, 1]
    scaled[alone] = candidates.scaled[np.array(chosen)[alone]]
    one = np.ones((1, len(y)))
    X = np.concatenate([one, terms])
    # X = (X Qᵀ) Q, because the rows of Q are orthonormal and span those of X; so the pseudo-inverse of Xᵀ is (X Qᵀ)⁻ᵀ Q
    inverse = np.linalg.inv(X @ Q.T).T @ Q
    β = inverse @ y
    e = y - β @ X
    return Fit(
        variables=np.concatenate([[[-1, -1]], variables]),
        coefficients=β,
        influence=len(y) * e * inverse,
        terms=X,
        scaled=np.concatenate([one, scaled]),
        residual=e,
    )


def _pursue(candidates: Candidates, y: NDArray) -> tuple[list[int], NDArray]:
    """Orthogonal matching pursuit: terms ``low`` and further terms that explain y significantly.

    Returns the indices of these terms, and orthonormal rows (1 + term, sample) that span the constant and the terms.
    """
    terms, chosen = candidates.values, list(candidates.low)
    n, p = len(y), len(chosen) + 1
    most = max(min(n // 4, len(terms)), len(chosen))
    Q = np.empty((most + 1, n))
    Q[:p] = candidates.basis
    r = y - (Q[:p] @ y) @ Q[:p]
    floor = NEGLIGIBLE * float(((y - y.mean()) ** 2).sum())
    # a term must reduce n log(residual) by this much: extended Bayesian information criterion (Chen & Chen 2008)
    worth = math.log(n) + 2 * math.log(len(terms) or 1)
    while p <= most and r @ r > floor:
        score = np.abs(terms @ r)
        score[chosen] = 0.0
        best = int(score.argmax())
        q = terms[best] - (Q[:p] @ terms[best]) @ Q[:p]
        norm = math.sqrt(q @ q)
        after = r - q * (q @ r) / norm**2 if norm > 1e-6 * math.sqrt(n) else r
        if n * math.log((r @ r) / max(after @ after, 1e-3 * floor)) < worth:
            break
        chosen.append(best)
        Q[p], r, p = q / norm, after, p + 1
    return chosen, Q[:p]


def _candidates(x: NDArray, scale: float) -> Candidates:
    """Polynomials of each variable of x (variable, sample), also at scale · x, and products of two variables."""
    d, n = x.shape
    polynomials, scaled = _orthonormal(x, scale)
    distinct = 1 + np.count_nonzero(np.diff(np.sort(x)), axis=1)
    degree = 1 + np.arange(DEGREE)
    exists = degree[:, None] < distinct
    variables, values = np.stack(2 * [np.nonzero(exists)[1]], axis=1), polynomials[exists]
    if d <= MOST_WITH_PRODUCTS:
        couples = np.stack(np.triu_indices(d, 1))
        a, b = (polynomials[:PRODUCT_DEGREE, each] for each in couples)
        products = (a[:, None] * b).reshape(-1, n)
        both = exists[:PRODUCT_DEGREE, None, couples[0]] & exists[:PRODUCT_DEGREE, couples[1]]
        variables = np.concatenate([variables, np.tile(couples.T, (PRODUCT_DEGREE**2, 1))[both.ravel()]])
        values = np.concatenate([values, products if both.all() else products[both.ravel()]])
    low = np.flatnonzero(np.nonzero(exists)[0] < (2 if n >= 8 * d else 1))
    # QR of columns: the factor R is not needed
    basis = np.linalg.qr(np.concatenate([np.ones((1, n)), values[low]]).T)[0].T
    return Candidates(variables=variables, values=values, scaled=scaled[exists], low=low, basis=basis)


def _orthonormal(x: NDArray, scale: float) -> tuple[NDArray, NDArray]:
    """Polynomials of each variable of x (variable, sample), at x and at scale · x, both (degree, variable, sample).

    They are orthonormal over the samples and without mean: degrees 1 to ``DEGREE``, of which only those below the
    number of distinct values are meaningful. The three-term recurrence follows from sums over the samples (Stieltjes;
    Gautschi, Orthogonal Polynomials, 2004, 2.2.3).
    """
    low, high = x.min(axis=1), x.max(axis=1)
    at = (2 * np.stack([x, scale * x]) - (low + high)[:, None]) / (high - low)[:, None]
    polynomials = np.empty((DEGREE, *at.shape))
    before, now, β = np.zeros(at.shape), np.ones(at.shape), np.ones(len(x))
    for k in range(DEGREE):
        α = np.einsum("in,in,in->i", at[0], now[0], now[0]) / x.shape[1]
        after = (at - α[:, None]) * now - β[:, None] * before
        β = np.sqrt(np.einsum("in,in->i", after[0], after[0]) / x.shape[1])
        # without further distinct values the next polynomial is zero
        polynomials[k] = after / np.where(β > 0, β, 1.0)[:, None]
        before, now = now, polynomials[k]
    return polynomials[:, 0], polynomials[:, 1]
