"""Reinforcement learning: the only package that uses gymnasium, stable-baselines3 and torch.

    vector_env, single_env        parallel episodes as a VecEnv of Stable-Baselines3 and as an environment of Gymnasium
    recipe, training, policy      soft actor-critic or PPO, the same for every task, and the resulting policy
    evaluation                    held-out episodes, and checks whether their motion is plausible

Importing this package registers the tasks with `gymnasium.make`; torch is imported only when a policy is loaded.
"""

from aidsr.learn.rl.single_env import register_environments

register_environments()
