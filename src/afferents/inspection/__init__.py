"""What is in recordings, and whether they are sound."""
