"""Comparison of training protocols on a fixed suite of scenes."""
