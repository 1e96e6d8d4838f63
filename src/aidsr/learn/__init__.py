"""How well a body does its task: episodes in batch, open-loop search, reinforcement learning."""
