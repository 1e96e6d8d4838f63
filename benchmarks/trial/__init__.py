"""How well a trial without learning tells which designs fail when they are trained."""
