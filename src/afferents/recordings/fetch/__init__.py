"""Public data sets on servers: which files they have, and how these come here."""
