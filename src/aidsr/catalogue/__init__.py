"""What can be bought. Data with its sources, and the arithmetic that picks from it."""
