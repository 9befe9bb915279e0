"""Drives that turn a drum; each passes the same tests (`tests/unit/devices/test_drives.py`)."""
