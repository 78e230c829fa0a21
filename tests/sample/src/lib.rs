//! The materials of the sample, as its build script made them.
#![no_std]
#![deny(warnings)]

/// A painted wall: a pipeline constant chooses its level.
pub mod wall {
    include!(concat!(env!("OUT_DIR"), "/wall.rs"));
}

/// A lacquered board: a uniform chooses its level, and the host fills a block of parameters.
pub mod board {
    include!(concat!(env!("OUT_DIR"), "/board.rs"));
}
