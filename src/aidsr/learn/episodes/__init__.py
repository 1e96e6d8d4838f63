"""Many simulations of a task at once, observed and scored as arrays; what training, evaluation and the probe share.

scene           a scene and its task, ready to be simulated
actions         what one action drives: single actuators or groups that act together
proprioception  what is observed of the robot's own body, the same for every design
batch           the running episodes
rollout         whole episodes from reset to end
episode_stats   motion, energy and joint limits of episodes
plausibility    whether their motion can be believed
"""
