"""Reading recordings: sessions, videos, sound, tables and other data sets."""
