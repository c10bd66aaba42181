"""The response against a multibody program, exudyn, which integrates the same oscillator over time."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.dynamics.balance import solve
from gearbench.dynamics.modes import modes
from tests.support.systems import excitation, series, wheels

exudyn = pytest.importorskip("exudyn")
ONE = np.array([0])


def integrated(mass, force, damping, mesh_force, start, times):
    """Motion of one mass against ground under a constant force and a connector's force(t, u) [mm, N, s], at times."""
    import exudyn.itemInterface as items

    mbs = exudyn.SystemContainer().AddSystem()
    ground = mbs.AddNode(items.NodePointGround())
    x, v = ([float(value)] for value in start)
    node = mbs.AddNode(items.Node1D(referenceCoordinates=[0.0], initialCoordinates=x, initialVelocities=v))
    mbs.AddObject(items.Mass1D(mass=float(mass), nodeNumber=node))
    ends = [mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=n, coordinate=0)) for n in (ground, node)]
    mbs.AddObject(
        items.CoordinateSpringDamperExt(
            markerNumbers=ends,
            stiffness=1.0,
            damping=float(damping),
            springForceUserFunction=lambda mbs, t, number, u, v, *rest: float(mesh_force(t, u) + damping * v),
        )
    )
    mbs.AddLoad(items.LoadCoordinate(markerNumber=ends[1], load=force))
    sensor = mbs.AddSensor(
        items.SensorNode(
            nodeNumber=node,
            storeInternal=True,
            outputVariableType=exudyn.OutputVariableType.Coordinates,
            writeToFile=False,
        )
    )
    mbs.Assemble()
    settings, steps = exudyn.SimulationSettings(), 4000
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = times[-1], steps
    settings.solution.sensors.writePeriod = times[-1] / steps
    settings.solution.file.write = False
    mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.DOPRI5)
    data = mbs.GetSensorStoredData(sensor)
    return np.interp(times, data[:, 0], data[:, 1])


def test_parametric_oscillator():
    """One period from the answer itself leads back to it, curve and all."""
    m, k, F, zeta, H = 1e-3, 4e5, 2000.0, 0.05, 20
    drive = excitation(k, [0.08 * k, 0.03j * k, -0.02 * k], [F / k, 4e-4, 2e-4j, 1e-4], F, H)
    omega = 0.7 * np.sqrt(k / m)
    h = modes(wheels(m), np.array([[k]]), zeta).mesh_receptance(omega * np.arange(H + 1)[None], ONE)
    x, _ = solve(drive, h, np.array([[k]]))
    start = [series(x[0, 0], omega, 0.0), series(1j * omega * np.arange(H + 1) * x[0, 0], omega, 0.0)]
    stiffness, error = drive.stiffness[0, 0], drive.motion[0]

    def mesh(t, u):
        # f = F + k(t)(u − e(t)) against the load F
        return F + float(series(stiffness, omega, t)) * (u - float(series(error, omega, t)))

    t = np.linspace(0, 2 * np.pi / omega, 60)
    found = integrated(m, F, 2 * zeta * np.sqrt(k * m), mesh, start, t)
    own = series(x[0, 0], omega, t)
    assert_allclose(found, own, atol=2e-5 * np.ptp(own))
