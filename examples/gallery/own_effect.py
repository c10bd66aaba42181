"""An effect of your own: waves across the face from grinding, as a class.

It adds gap where it says so, and everything else follows: contact, transmission error, its orders.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from matplotlib import pyplot as plt

from gearbench import read_scene, simulate
from gearbench.plot import order_spectrum
from gearbench.plugin import GapEffect


@dataclass(frozen=True, kw_only=True)
class Undulation(GapEffect):
    """e = A (1 − cos(2π n y/b))."""

    amplitude: float
    waves: int

    name: ClassVar[str] = "undulation"
    summary: ClassVar[str] = "gap: cosine over the face width"
    source: ClassVar[str] = "the gallery"

    def gap(self, lines):
        """Gap [mm], (position, pair, segment)."""
        wave = np.cos(2 * np.pi * self.waves * lines.face / lines.pair.face_width)
        return 1e-3 * self.amplitude * (1 - wave)


smooth = read_scene(Path(__file__).parents[1] / "gears/e_drive_output.toml")
waved = replace(smooth, effects=(*smooth.effects, Undulation(amplitude=1.0, waves=4)))

figure, axes = plt.subplots(1, 3, figsize=(13, 3.6), layout="constrained")
result = simulate(waved, outputs=("transmission_error", "line_load"))
present = (result["segment_length"] > 0).values
y, load = result["face_position"].values[present], result["line_load"].values[present]
axes[0].plot(y, load, ".", ms=2, color="#0072B2")
axes[0].set(xlabel="position along the face width y [mm]", ylabel="line load q [N/mm]", title="4 waves of 1 µm")
for axis, scene, title in ((axes[1], smooth, "without"), (axes[2], waved, "with undulation")):
    one = simulate(scene)
    order_spectrum(one, axes=axis)
    axis.set_title(f"{title}: {float(one['transmission_error_peak_to_peak']):.3f} µm peak to peak")
    axis.set_ylim(1e-4, 1)
figure.savefig("own_effect.png", dpi=80)
