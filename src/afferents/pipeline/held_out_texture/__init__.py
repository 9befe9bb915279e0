"""Textures that a model never learnt: whether it calls them unknown, and its estimate in mm."""
