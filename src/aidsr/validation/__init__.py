"""Load check, actuator tests and rules: what is physically wrong with a robot or a scene."""

from aidsr.validation.validating import validate

__all__ = ["validate"]
