"""Markers found in the picture, followed, and named by their layout."""
