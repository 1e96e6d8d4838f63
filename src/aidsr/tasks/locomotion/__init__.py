"""Locomotion tasks: the whole robot travels to a goal."""
