//! `lodc calibrate`: times variants of shaders on a GPU, and fits the cost model to it.

use super::{MeasuringArgs, print, write};
use crate::compile::{self, CalibrateRequest, Request, RunTime};
use crate::{Result, report};
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct CalibrateArgs {
    /// The material shaders, each with the scene beside it: the more unlike each other, the better
    #[arg(required = true, value_name = "SHADER")]
    shaders: Vec<PathBuf>,
    /// How many variants of each shader are timed, at three distances each
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..))]
    variants: u16,
    #[command(flatten)]
    measuring: MeasuringArgs,
    /// Writes the model to a file, with what was measured
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(super) fn run(arguments: CalibrateArgs) -> Result<()> {
    let measuring = arguments.measuring.measuring(None)?;
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
