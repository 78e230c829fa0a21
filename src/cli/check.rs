//! `lodc check`: what is committed, held against what locks make.

use super::batch::{self, Jobs, Said};
use super::{ReadingArgs, print};
use crate::Result;
use crate::compile::{self, Request};
use crate::emit::{self, Form, Target};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Shaders, locks, or folders with locks
    #[arg(required = true, value_name = "FILES")]
    files: Vec<PathBuf>,
    /// Writes what differs
    #[arg(long)]
    bless: bool,
    /// The shader that is committed, where that is not beside the source; of several, the folder of all [default: as the lock is
    /// called]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// The form that is committed [default: the lock's]
    #[arg(long, value_enum)]
    form: Option<Form>,
    /// The language that is committed [default: the lock's]
    #[arg(long, value_enum)]
    target: Option<Target>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    jobs: Jobs,
    /// Prints nothing but differences and errors
    #[arg(short, long)]
    quiet: bool,
}

/// Exit code 1 when something differs or a lock is stale.
pub(super) fn run(arguments: CheckArgs) -> Result<ExitCode> {
    let (stages, modules) = arguments.reading.read()?;
    let asked = |request: Request| Request {
        stages: stages.clone(),
        modules: modules.clone(),
        form: arguments.form,
        target: arguments.target,
        ..request
    };
    let mut requests = Vec::new();
    for file in &arguments.files {
        if file.is_dir() {
            for lock in compile::locks(file)? {
                requests.push(asked(Request::of_lock(&lock)?));
            }
        } else if Request::is_lock(file) {
            requests.push(asked(Request::of_lock(file)?));
        } else {
            requests.push(asked(Request {
                shader: file.clone(),
                ..Request::default()
            }));
        }
    }
    let requests = batch::placed(requests, arguments.output)?;
    let (files, written) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let code = batch::each(arguments.jobs, &requests, |_, request| {
        let check = match compile::check(request) {
            Ok(check) => check,
            Err(error) => {
                let code = if error.is_stale { 1 } else { 2 };
                let said = Said::failed(error);
                return Said { code, ..said };
            }
        };
        files.fetch_add(check.files.len(), Ordering::Relaxed);
        let mut said = Said::default();
        if arguments.bless {
            let blessed = check.blessed();
            match emit::write_atomically(&blessed) {
                Ok(_) => drop(written.fetch_add(blessed.len(), Ordering::Relaxed)),
                Err(error) => said = Said::failed(error),
            }
        }
        // What is blessed differs no more; what cannot be is shown.
        let left = check.differences.iter();
        let left = left.filter(|found| !arguments.bless || found.bytes.is_none());
        for difference in left {
            said.text += &difference.what;
            said.code = said.code.max(1);
        }
        Said {
            warnings: check.warnings,
            ..said
        }
    });
    let files = files.into_inner();
    if !arguments.quiet && code == 0 {
        let count = |count: usize, what: &str| match count {
            1 => format!("1 {what}"),
            count => format!("{count} {what}s"),
        };
        let (files, shaders) = (count(files, "file"), count(requests.len(), "shader"));
        print(&match arguments.bless {
            true => format!(
                "  {:<16}{} of {files}, of {shaders}\n",
                "wrote",
                written.into_inner()
            ),
            false => format!("  {:<16}{files} of {shaders}\n", "as committed"),
        });
    }
    Ok(ExitCode::from(code))
}
