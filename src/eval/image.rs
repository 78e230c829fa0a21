//! Pictures: sRGB encoding, box filter, PNG files.
