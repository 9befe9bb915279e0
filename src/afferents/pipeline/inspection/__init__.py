"""What `inspect` finds: in a video, in sound, in a data set."""
