"""Tasks of manipulation: something in the environment is moved or worked on in a given order."""
