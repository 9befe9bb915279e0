"""A page that shows what is felt, served by this machine to itself."""
