//! `lodc calibrate`: times variants of shaders on a GPU, and fits the cost model to it.

use super::{cache_folder, print, seconds, write};
use crate::compile::{self, CalibrateRequest, Measuring, Request, RunTime};
use crate::time::Effort;
use crate::{Diagnostic, Result, report};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Debug, Args)]
pub(super) struct CalibrateArgs {
    /// The material shaders, each with the scene beside it: the more unlike each other, the better
    #[arg(required = true, value_name = "SHADER")]
    shaders: Vec<PathBuf>,
    /// How many variants of each shader are timed, at three distances each
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..))]
    variants: u16,
    /// The GPU: words of its name [default: the best]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// How long the timing of a variant may take; it ends sooner when it is exact to 1 % [default: 2]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    time_budget: Option<Duration>,
    /// Times everything anew, and keeps nothing
    #[arg(long)]
    no_cache: bool,
    /// Writes the model to a file, with what was measured
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(super) fn run(arguments: CalibrateArgs) -> Result<()> {
    let program = std::env::current_exe().map_err(|error| {
        Diagnostic::error("lodc cannot find its own file, which draws in a process of its own")
            .with_reason(error)
    })?;
    let effort = Effort::default();
    let measuring = Measuring {
        program,
        adapter: arguments.adapter,
        cache: cache_folder().filter(|_| !arguments.no_cache),
        record: None,
        effort: Effort {
            budget: arguments.time_budget.unwrap_or(effort.budget),
            ..effort
        },
    };
    let shaders = arguments.shaders.into_iter();
    let asked = CalibrateRequest {
        shaders: shaders
            .map(|shader| Request {
                shader,
                time: RunTime::Measured(measuring.clone()),
                ..Request::default()
            })
            .collect(),
        variants: arguments.variants.into(),
        output: arguments.output,
    };
    let calibrated = compile::calibrate(&asked, &|progress| {
        if progress.done == 0 {
            let compile::Calibrating { shader, all, .. } = progress;
            eprintln!("  {:<16}{shader}: {all} timings", "timing");
        }
    })?;
    print(&report::calibration(&calibrated));
    write(&calibrated.files, calibrated.files.is_empty())
}
