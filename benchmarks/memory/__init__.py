"""Designs made with a memory and without, and in generations, as trials see them."""
