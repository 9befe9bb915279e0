"""Drives that turn a drum; each passes the same tests (`tests/unit/lab/devices/test_drives.py`)."""
