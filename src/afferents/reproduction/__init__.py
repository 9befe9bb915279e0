"""The whole way in one command: from a session to its report."""
