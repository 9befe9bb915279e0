"""A page that shows what is recognised, served by this machine to itself."""
