//! Draws a frame: rasterises once, shades as often as there are variants.
