"""How well a trial without learning predicts which designs fail when they are trained."""
