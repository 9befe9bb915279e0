"""Our numbers beside the authors' own arrays and networks, where a reader has them."""
