"""From design to parts: what to print, to buy and to assemble, and what cannot be built.

Needs the extra "fabrication". Start reading in `making.py`; `anatomy.py` is what all the rest is computed from.
"""
