"""Tests of a robot on its task: parallel episodes, open-loop search, reinforcement learning."""
