"""Evolution of designs over generations: each generation gets the measurements of the earlier ones."""

from aidsr.evolution.generations import Evolution, Plan, begin, run_generations
from aidsr.evolution.run import evolve

__all__ = ["Evolution", "Plan", "begin", "evolve", "run_generations"]
