"""The gears' relative motion between the limit stops of Exudyn, a multibody code of others: springs and dampers."""

from __future__ import annotations

from math import sqrt

import numpy as np

from gears3d.verification.validation.twin import Case, ratio_for


def displacement(numbers: Case, duration: float, stiffness: float) -> np.ndarray:
    """Return Exudyn's relative displacement at the ends of its steps [m], after a settling period of its springs."""
    import exudyn as exu
    from exudyn.itemInterface import (
        LoadCoordinate,
        MarkerNodeCoordinate,
        Mass1D,
        Node1D,
        NodeGenericData,
        NodePointGround,
        ObjectConnectorCoordinateSpringDamperExt,
        SensorNode,
    )

    system = exu.SystemContainer()
    mbs = system.AddSystem()
    ground = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
    node = mbs.AddNode(Node1D(referenceCoordinates=[0.0], initialCoordinates=[0.0], initialVelocities=[0.0]))
    mbs.AddObject(Mass1D(mass=numbers.mass, nodeNumber=node))
    gear = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    data = mbs.AddNode(NodeGenericData(initialCoordinates=[0.0, 0.0, 0.0], numberOfDataCoordinates=3))
    damping = 2.0 * ratio_for(numbers.restitution, pulls=False) * sqrt(stiffness * numbers.mass)
    mbs.AddObject(
        ObjectConnectorCoordinateSpringDamperExt(
            markerNumbers=[ground, gear], nodeNumber=data, useLimitStops=True, limitStopsLower=0.0,
            limitStopsUpper=numbers.backlash, limitStopsStiffness=stiffness, limitStopsDamping=damping,
        )
    )  # fmt: skip

    def load(_, time: float, __) -> float:  # type: ignore[no-untyped-def]
        return numbers.mass * numbers.push(time)

    mbs.AddLoad(LoadCoordinate(markerNumber=gear, load=1.0, loadUserFunction=load))
    steps = int(duration * 20.0 * sqrt(stiffness / numbers.mass))
    sensor = mbs.AddSensor(
        SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=exu.OutputVariableType.Coordinates)
    )
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = duration / steps
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    return np.asarray(mbs.GetSensorStoredData(sensor))
