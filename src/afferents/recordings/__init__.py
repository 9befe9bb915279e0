"""Reading recordings: the published session layout and adapters for other data sets."""
