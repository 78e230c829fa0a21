//! How often the instrument that times shaders is right, while other processes load all cores.
//!
//! In each of 100 trials a shader is timed against itself, and against one with 20 % more work: a loop of 2,400
//! rounds in place of 2,000, which is nearly all that a draw does. `cargo bench --bench timing` prints how often the first was
//! called "no difference" and the second "slower", and how the ratios spread.

use lodc::front::{Modules, Stages};
use lodc::gpu::worker::{Subject, Variant, Worker};
use lodc::gpu::{AdapterLabel, list};
use lodc::time::statistics::median;
use lodc::time::{Effort, Timing, TimingWarning, Verdict};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::{Duration, Instant};

const TRIALS: usize = 100;

/// What a child is started with that does nothing but load a core.
const SPIN: &str = "--spin";

/// A fragment stage whose loop has so many rounds.
fn shader(rounds: u32) -> String {
    format!(
        "@fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {{
    var x = uv.x;
    for (var i = 0u; i < {rounds}u; i++) {{
        x = fract(x * 1.7 + uv.y) + 0.1 * x * x;
    }}
    return vec4f(x, uv, 1.0);
}}
"
    )
}

const SCENE: &str = "object = \"plane\"\nresolution = [64, 64]\n[views]\ncount = 2\n";

/// Children that load all cores for as long as this lives.
struct Load(Vec<Child>);

impl Load {
    fn new() -> Self {
        let own = std::env::current_exe().expect("a benchmark is a file");
        let cores = std::thread::available_parallelism().map_or(1, Into::into);
        let child = |_| {
            let mut command = Command::new(&own);
            command.arg(SPIN).spawn().expect("it starts as it did")
        };
        Self((0..cores).map(child).collect())
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        for child in &mut self.0 {
            // It may be gone.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn spin() {
    let (start, mut x) = (Instant::now(), 0u64);
    // Not for ever, should nobody end it.
    while start.elapsed() < Duration::from_secs(1200) {
        for _ in 0..1_000_000 {
            x = std::hint::black_box(x.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1);
        }
    }
}

fn subject() -> Subject {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("timing");
    std::fs::create_dir_all(&folder).expect("the target folder can be written");
    let path = folder.join("loop.wgsl");
    std::fs::write(&path, shader(2000)).expect("it can be written");
    std::fs::write(folder.join("loop.toml"), SCENE).expect("it can be written");
    Subject::new(path, None, &Stages::default(), &Modules::default())
}

fn printed(what: &str, wanted: Verdict, timings: &[Timing]) {
    let said = |verdict| timings.iter().filter(|t| t.verdict() == verdict).count();
    let all = |of: fn(&Timing) -> f64| {
        let mut all: Vec<f64> = timings.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let ratios = all(|t| t.ratio);
    let [first, last] = [ratios[0], ratios[ratios.len() - 1]];
    println!("{what}:");
    println!("  {wanted}: {} of {}", said(wanted), timings.len());
    for other in [Verdict::NoDifference, Verdict::Faster, Verdict::Slower] {
        if other != wanted && said(other) > 0 {
            println!("  {other}: {}", said(other));
        }
    }
    println!("  ratio {:.3}, {first:.3} to {last:.3}", median(&ratios));
    let width = median(&all(|t| (t.high - t.low) / (2.0 * t.ratio)));
    let floor = median(&all(|t| t.floor));
    let rounds = median(&all(|t| f64::from(t.rounds)));
    println!(
        "  half of the interval {:.1} %, noise floor {:.1} %, {rounds:.0} rounds",
        100.0 * width,
        100.0 * floor
    );
    for warning in [
        TimingWarning::ClockDrift,
        TimingWarning::FewSamples,
        TimingWarning::SoftwareAdapter,
        TimingWarning::TimerTooCoarse,
        TimingWarning::Throttled,
    ] {
        let count = timings
            .iter()
            .filter(|t| t.warnings.contains(&warning))
            .count();
        if count > 0 {
            println!("  {warning}: {count}");
        }
    }
}

fn main() {
    if std::env::args().any(|argument| argument == SPIN) {
        return spin();
    }
    let name = std::env::var("LODC_ADAPTER").ok();
    let adapters = list();
    let known = |label: &&AdapterLabel| {
        let label = label.to_string().to_lowercase();
        name.as_ref()
            .is_none_or(|name| label.contains(&name.to_lowercase()))
    };
    let Some(label) = adapters.iter().find(known) else {
        eprintln!("SKIPPED: there is no adapter");
        return;
    };
    println!("{label}, {}", label.driver);
    let subject = subject();
    let program = PathBuf::from(env!("CARGO_BIN_EXE_lodc"));
    let mut worker = Worker::new(program, Some(label.to_string()), Duration::from_secs(120));
    let variants = [2000, 2400].map(|rounds| Variant {
        text: Some(shader(rounds)),
        ..Variant::default()
    });
    let effort = Effort {
        half_width: 0.02,
        budget: Duration::from_secs(1),
        ..Effort::default()
    };
    let mut time = || {
        let timed = worker.time(&subject, &variants, 4.0, &effort);
        let timed = timed.unwrap_or_else(|failure| panic!("{failure:?}"));
        let each = timed
            .into_iter()
            .map(|t| t.unwrap_or_else(|failure| panic!("{failure:?}")));
        <[Timing; 2]>::try_from(each.collect::<Vec<_>>()).expect("one for each")
    };
    let quiet = time();
    println!(
        "without load: {:.3} and {:.3} times as long",
        quiet[0].ratio, quiet[1].ratio
    );
    let start = Instant::now();
    let load = Load::new();
    let trials: Vec<[Timing; 2]> = (0..TRIALS).map(|_| time()).collect();
    drop(load);
    println!(
        "with every core loaded by another process, {} trials in {:.0} s, batches of {} instances",
        TRIALS,
        start.elapsed().as_secs_f64(),
        trials[0][0].draws
    );
    let [same, more] = [0, 1].map(|at| trials.iter().map(|t| t[at].clone()).collect::<Vec<_>>());
    printed("the same shader", Verdict::NoDifference, &same);
    printed("20 % more work", Verdict::Slower, &more);
}
