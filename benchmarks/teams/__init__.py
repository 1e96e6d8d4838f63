"""Designs of teams that a language model plays, trained and judged side by side."""
