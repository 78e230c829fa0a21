//! The command-line tool: a thin shell around the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    lodc::cli::run(std::env::args_os())
}
