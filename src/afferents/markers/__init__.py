"""Finding the markers in the picture, following them, and naming them by their layout."""
