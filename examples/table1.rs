//! Prints a material as table 1 of Olano, Kuehne and Simmons 2003 has theirs: for each level the active textures, the
//! texture accesses of a fragment, how many of those are gone, and what it costs; for the levels of a search, and for
//! the steps of the paper's own loop at the farthest distance, which no bound ends.
//!
//! ```sh
//! cargo run --release --example table1 -- testdata/materials/leather.wgsl
//! cargo run --release --example table1 -- testdata/materials/leather.wgsl --time target/release/lodc
//! ```
//!
//! With `--time` and the file of lodc itself, which draws in a process of its own, it has the measured speed-up beside them: the
//! original's time at the same distance by the level's, on the best adapter.

use lodc::compile::{self, Measuring, Request, RunTime};
use lodc::time::clock::worst_ratio;
use lodc_passes::goal::{Goal, Resource};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let Some(shader) = arguments.next() else {
        eprintln!("usage: table1 SHADER [GOAL] [PASS...] [--time LODC]");
        std::process::exit(2);
    };
    let (mut goal, mut only) = (Goal::only(Resource::Accesses), Vec::new());
    let mut time = RunTime::Estimated;
    while let Some(argument) = arguments.next() {
        if argument == "--time" {
            time = RunTime::Measured(Measuring {
                program: arguments.next().unwrap_or_default().into(),
                ..Measuring::default()
            });
            continue;
        }
        match argument.parse() {
            Ok(named) => goal = named,
            Err(_) => only.push(argument),
        }
    }
    let request = Request {
        shader: shader.into(),
        goal: Some(goal),
        only,
        time,
        ..Request::default()
    };
    if let Err(error) = print(&request) {
        eprint!("{error}");
        std::process::exit(2);
    }
}

fn print(request: &Request) -> lodc::Result<()> {
    let compiled = compile::compile(request, &|_| {})?;
    for warning in &compiled.warnings {
        eprint!("{warning}");
    }
    let report = &compiled.report;
    let whole = report.levels[0].cost.texture_samples;
    println!("  level  autoLOD  active  accesses  reduction  cost  speed-up");
    for (number, level) in report.levels.iter().enumerate() {
        let accesses = level.cost.texture_samples;
        println!(
            "  {number:<5}  {:7.2}  {:6}  {accesses:8.1}  {:>9}  {:4.2}  {:>8}",
            level.autolod,
            level.cost.active_textures,
            reduction(accesses, whole),
            level.cost.estimated_time,
            speed_up(Some(level.time.ratio).filter(|_| level.time.kind == "measured")),
        );
    }
    let steps = compile::trajectory(request)?;
    let whole = steps[0].used.work;
    println!("\n  step   excess   bound  active  accesses  reduction  cost  speed-up  removed");
    for (number, step) in steps.iter().enumerate() {
        let work = step.used.work;
        let removed = step.recipe.0.last();
        let line = format!(
            "  {number:<5}  {:6.3}  {:>6}  {:6}  {:8.1}  {:>9}  {:4.2}  {:>8}  {}",
            step.excess,
            if step.strain <= 1.0 { "within" } else { "over" },
            step.used.textures,
            work.samples,
            reduction(work.samples, whole.samples),
            work.total() / whole.total(),
            speed_up(worst_ratio(&step.timed)),
            removed.map_or("", |step| step.site.path()),
        );
        println!("{}", line.trim_end());
    }
    Ok(())
}

/// How many times as fast as the original it was.
fn speed_up(ratio: Option<f64>) -> String {
    ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{:.2}", 1.0 / ratio))
}

/// The share of the accesses that is gone.
fn reduction(left: f64, whole: f64) -> String {
    match whole > 0.0 {
        true => format!("{:.2}", 1.0 - left / whole),
        false => "-".to_owned(),
    }
}
