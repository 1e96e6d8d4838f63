"""The validator: load check, actuator tests and rules that find what is physically wrong with a robot or a scene."""

from aidsr.validation.validator import validate

__all__ = ["validate"]
