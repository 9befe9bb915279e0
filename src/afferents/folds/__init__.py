"""What is held out, and how: groups, protocols, splits, and recordings corrupted on purpose."""
