"""Designs over generations: each is told what the bodies before it measured."""

from aidsr.evolution.generations import Evolution, Plan, begin, evolve

__all__ = ["Evolution", "Plan", "begin", "evolve"]
