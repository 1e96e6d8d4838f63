"""Trials of designs made with a memory, without one, and in generations."""
