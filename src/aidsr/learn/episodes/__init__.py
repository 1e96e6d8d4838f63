"""Parallel simulations of a task, observed and scored as arrays; shared by training, evaluation and the probe.

scene           a scene and its task, ready to be simulated
actions         what one action drives: single actuators or groups that act together
proprioception  what is observed of the robot itself, the same for every design
batch           the running episodes
rollout         whole episodes from reset to end
episode_stats   motion, energy and joint limits of episodes
plausibility    checks whether their motion is plausible
"""
