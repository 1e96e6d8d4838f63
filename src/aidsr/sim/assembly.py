"""Scene assembly: the robot placed in the environment, as the Scene Integrator decided."""

from __future__ import annotations

from aidsr.sim.task_sensors import TaskSensor

__all__ = ["TaskSensor"]
