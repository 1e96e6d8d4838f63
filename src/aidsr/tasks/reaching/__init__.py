"""Reaching tasks: the functional part moves to a place and acts there."""
