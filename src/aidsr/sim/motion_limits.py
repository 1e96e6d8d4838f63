"""Limits of a robot's motion that the validator and the verdict on a policy share."""

from __future__ import annotations

OVERRUN_DEG = 30.0
"""Largest allowed angle of a joint beyond its range. Source: our choice: limits are soft in MuJoCo, and softer for
light links."""
ENERGY_OF_WEIGHT = 0.05
"""Largest allowed rise of mechanical energy that no actuator supplied / (m g L). Source: our choice."""
