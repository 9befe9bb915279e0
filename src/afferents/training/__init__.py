"""One training loop and its configuration."""
