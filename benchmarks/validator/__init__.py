"""How good the validator is: a corpus of good and bad robots, what it finds in them, how fast, and what breaks it."""
