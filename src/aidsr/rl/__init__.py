"""Learning: gymnasium, stable-baselines3 and torch live here only.

    actions, proprioception       what a policy does and what it knows of its body
    episodes                      many simulations of a task at once, observed and scored as arrays
    vector_env, single_env        the same as a VecEnv of Stable-Baselines3 and as an environment of Gymnasium

Importing this package makes the tasks known to `gymnasium.make`; torch is loaded when a policy is.
"""

from aidsr.rl.single_env import register_environments

register_environments()
