"""Learning: gymnasium, stable-baselines3 and torch live here only.

    vector_env, single_env        batched episodes as a VecEnv of Stable-Baselines3 and as an environment of Gymnasium
    recipe, training, policy      soft actor-critic or PPO, the same for every task, and what it leaves behind
    evaluation                    held-out episodes, and whether their motion can be believed

Importing this package makes the tasks known to `gymnasium.make`; torch is loaded when a policy is.
"""

from aidsr.learn.rl.single_env import register_environments

register_environments()
