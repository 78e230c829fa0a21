//! The command-line tool: a thin shell around the library.

fn main() {}
