//! `lodc diff`: one shader against another, by what they compute.

use super::{ReadingArgs, print};
use crate::Result;
use crate::compile::{self, Request};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, Args)]
pub(super) struct DiffArgs {
    /// The shader as it was
    before: PathBuf,
    /// The shader as it is
    after: PathBuf,
    #[command(flatten)]
    reading: ReadingArgs,
    /// Prints the difference as JSON
    #[arg(long)]
    json: bool,
}

/// Exit code 1 when the shaders differ.
pub(super) fn run(arguments: DiffArgs) -> Result<ExitCode> {
    let (stages, modules) = arguments.reading.read()?;
    let [before, after] = [arguments.before, arguments.after].map(|shader| Request {
        shader,
        stages: stages.clone(),
        modules: modules.clone(),
        ..Request::default()
    });
    let difference = compile::difference(&before, &after)?;
    print(&match arguments.json {
        true => difference.json(),
        false => difference.lines(),
    });
    Ok(ExitCode::from(u8::from(!difference.same)))
}
