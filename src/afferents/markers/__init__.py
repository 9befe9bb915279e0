"""Finding the markers in the picture, following them, and placing them in the sensor's grid."""
