"""Conversion of a robot design into parts to print, items to buy, assembly instructions, and what cannot be built.

Needs the extra "fabrication". Start reading in `build.py`; everything is computed from the `Anatomy` in `anatomy.py`.
"""
