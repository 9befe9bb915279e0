"""What can be wrong with pictures, sound and clocks."""
