"""Teams that play the four roles: language models, built-in rules, and baselines for comparison."""
