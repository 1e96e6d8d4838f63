"""Baselines: reference robots designed by hand, and a search without design knowledge.

reference    one robot for each benchmark task, designed by hand; robots/ has them and their placements
search       CMA-ES over the parameters of a built-in family, with the probe as its objective
generations  the record of a search

Both are teams like any other, so that they go through the same validation, training and evaluation.
"""
