"""Findings: gains by phasing, and K_γ compared with the tables of standards."""

from __future__ import annotations

from gearbench.lazy import xr
from studies.s13_planetary_phasing.data import ARRANGEMENTS, HARMONICS, LOADED, SUNS

#: Standard → number of planets → K_γ.
NORMS = {
    "IEC 61400-4": {3: 1.10, 4: 1.25, 5: 1.35},
    "classification societies": {3: 1.00, 4: 1.20, 5: 1.30},
}
#: Largest remainder of a harmonic that cancels, over the greatest harmonic that adds up.
_NOTHING = 1e-10


def value(dataset: xr.Dataset, arrangement: str, sun: str, response: str, statistic: str = "mean") -> float:
    """Value of a statistic of a response of a set."""
    at = {"arrangement": arrangement, "sun": sun, "response": response, "statistic": statistic}
    return float(dataset["value"].sel(at))


def bought(dataset: xr.Dataset, arrangement: str, sun: str, statistic: str) -> float:
    """Ratio of the RMS transmission error of the set in phase to that of another arrangement."""
    rms = (value(dataset, each, sun, "train_transmission_error_rms", statistic) for each in ("in phase", arrangement))
    return next(rms) / next(rms)


def factor(dataset: xr.Dataset, planets: int, support: float, statistic: str, iso_class: int = 6) -> float:
    """Value of a statistic of K_γ of a set."""
    at = {"planets": planets, "support": support, "iso_class": iso_class, "statistic": statistic}
    return float(dataset["mesh_load_factor"].sel(at))


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check that harmonics cancel without errors, that phasing still helps with errors, and the magnitude of K_γ."""
    found = []
    for arrangement, (sun, _) in ARRANGEMENTS.items():
        for name, adds in (("train_transmission_error", {0}), ("sun_force", {1, 3})):
            orders = [n for n in range(1, HARMONICS + 1) if n * sun % 4 not in adds]
            most = max(value(dataset, each, "held", f"{name}_amplitude_1", "nominal") for each in ARRANGEMENTS)
            rest = [value(dataset, arrangement, "held", f"{name}_amplitude_{n}", "nominal") for n in orders]
            left = max(rest, default=0.0)
            found.append((f"{arrangement}: orders {orders} of {name} cancel without errors", left < _NOTHING * most))
    if dataset.attrs["quick"]:
        return found
    for arrangement in list(ARRANGEMENTS)[1:]:
        for sun in SUNS:
            gain = bought(dataset, arrangement, sun, "mean")
            found.append((f"{arrangement}, {sun} sun, class 6: transmission error {gain:.2f} times lower", gain > 1))
    ideal, real = (bought(dataset, "sequential", "held", each) for each in ("nominal", "mean"))
    found.append((f"sequential, held sun: {ideal:.2f} times lower without errors, {real:.2f} with", real < ideal / 2))
    worst = factor(dataset, 3, 0.0, "q99")
    found.append((f"three planets and a floating sun share equally: K_γ {worst:.6f}", abs(worst - 1) < 1e-6))
    for planets in list(LOADED)[1:]:
        mean, most = (factor(dataset, planets, 0.0, each) for each in ("mean", "q99"))
        norms = [norm[planets] for norm in NORMS.values()]
        text = f"{planets} planets, class 6: K_γ {mean:.2f} on average, {most:.2f} for 99 of 100; norms {norms}"
        found.append((text, all(0.9 * mean < each < 1.1 * most for each in norms)))
    return found
