"""The paper's networks and models beyond it: what they are, how they learn, what is kept."""
