"""From design to parts: what to print, to buy and to assemble, and what cannot be built.

Needs the extra "fabrication". Start reading in `build.py`; everything is computed from the `Anatomy` in `anatomy.py`.
"""
