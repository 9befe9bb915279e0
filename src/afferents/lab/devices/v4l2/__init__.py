"""A camera of Linux, by its own interface."""
