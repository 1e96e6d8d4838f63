"""Proof that the tasks can be won: cable-driven soft robots, each with a script that wins."""
