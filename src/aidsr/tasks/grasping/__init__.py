"""Grasping tasks: the robot grasps an object and holds it."""
