"""The networks, one file for each of the paper's."""
