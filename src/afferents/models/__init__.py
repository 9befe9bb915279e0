"""The paper's networks and other models: what they are, how they learn, what is kept."""
