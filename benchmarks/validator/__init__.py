"""Quality of the validator: its findings in a corpus of good and bad robots, its speed, and what breaks it."""
