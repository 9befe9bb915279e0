"""From a session to its report in one command."""
