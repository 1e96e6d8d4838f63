"""Robots known to be good, and robots known to be bad in one way each.

specimen    what a robot of the corpus is
physique    the physics of a limb in a few numbers, from which every writer takes stiffness and force
writers     good robots, each writer in a style and with conventions of its own
faults      changes that make a good robot bad in one way, by a chosen amount
making      both put together and confirmed by the oracle
plans       how many of each are made
keeping     the whole corpus, made by several processes and kept in files
"""
