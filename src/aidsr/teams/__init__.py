"""Who plays the four roles: language models, built-in rules, and the baselines they are measured against."""
