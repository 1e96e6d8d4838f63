"""Manipulation tasks: the robot moves or works on something in the environment in a given order."""
