"""Tasks of reaching: the functional part gets to a place and does something there."""
