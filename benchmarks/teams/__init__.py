"""Comparison of teams played by a language model: their designs are trained and evaluated."""
