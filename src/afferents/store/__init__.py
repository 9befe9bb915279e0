"""What a recording and its responses are, on disk and in memory."""
