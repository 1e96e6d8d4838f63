"""What designs by agents are measured against: robots designed by hand, and search without any insight.

reference  one robot a benchmark task, designed by hand; robots/ holds them and says where they are mounted
generations  how a search went
searching  CMA-ES over the numbers of a built-in family, with the probe as its objective

Both are teams like any other, so that they go through the same validation, training and evaluation.
"""
