"""How long a reproduction will take: rates measured on a few frames and batches, multiplied."""
