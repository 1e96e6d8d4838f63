"""Robots that win tasks without being cable-driven soft bodies, and how each of them is refused."""
