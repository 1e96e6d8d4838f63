"""Evolution of designs over generations: each generation gets the measurements of the earlier ones."""

from aidsr.evolution.generations import Evolution, Plan, begin, evolve

__all__ = ["Evolution", "Plan", "begin", "evolve"]
