"""The rules: each file holds checks and, beside each, the record of its rule. `registry` finds them."""
