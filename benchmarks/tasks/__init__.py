"""Whether the tasks are good tasks: what wins them without a designed policy."""
