"""Robots that win tasks without being cable-driven soft bodies ("cheats"), and how each of them is refused."""
