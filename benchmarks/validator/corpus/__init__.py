"""Robots known to be good, and robots known to be bad in one way each.

specimen    definition of a robot of the corpus
physique    physics of a limb in a few numbers, from which every writer takes stiffness and force
writers     good robots; each writer has its own style and conventions
faults      changes that make a good robot bad in one way, by a chosen amount
making      robots made from writers and faults, and confirmed by the oracle
plans       how many robots of each kind are made
keeping     the whole corpus, made by several processes and kept in files
"""
