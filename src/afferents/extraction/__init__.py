"""From a session's videos and sound to a store of responses."""
