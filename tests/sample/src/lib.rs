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

/// The board with a file for each level.
pub mod files {
    include!(concat!(env!("OUT_DIR"), "/files/board.rs"));
}

/// The wall as SPIR-V.
pub mod spirv {
    include!(concat!(env!("OUT_DIR"), "/spirv/wall.rs"));
}

/// The wall without its lock: the original alone.
pub mod original {
    include!(concat!(env!("OUT_DIR"), "/original/missing.rs"));
}
