"""What is held out, and how; recordings corrupted on purpose."""
