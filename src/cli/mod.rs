//! The command line: arguments in, messages and an exit code out. All work is the library's.

mod batch;
#[cfg(feature = "mesh")]
mod bench;
mod calibrate;
mod check;
#[cfg(feature = "gpu")]
mod child;
mod depfile;
mod difference;
mod manual;
#[cfg(feature = "mesh")]
mod mesh;
mod progress;

use crate::compile::{
    self, CompareRequest, DrawnBy, InitRequest, Measuring, Recorded, Request, RunTime,
    SnapshotRequest, StabilityRequest,
};
use crate::emit::{self, Form, Target, Transition};
use crate::front::{Definition, Modules, Stages};
use crate::search::Scope;
use crate::time::Effort;
use crate::{Diagnostic, Result, report};
use batch::Said;
use clap::{Args, Parser, Subcommand};
use depfile::Rule;
use lodc_passes::Goal;
use lodc_passes::autolod::BoundReading;
use progress::Bar;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Makes cheaper versions of a material shader for the distances at which nobody sees the difference
#[derive(Debug, Parser)]
#[command(
    name = "lodc",
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    compile: CompileArgs,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Lists every place that could be simplified, with its work and its candidates
    Inspect(InputArgs),
    /// Emits again from locks and compares with what is committed: a diff, and exit code 1 when something differs
    Check(check::CheckArgs),
    /// Says which values of a shader another computes otherwise, or not at all: exit code 1 when they differ
    Diff(difference::DiffArgs),
    /// Measures the error of one shader against another, over a scene
    Compare(CompareArgs),
    /// Writes the scene file, with everything that is inferred and why
    Init(InitArgs),
    /// Writes one level of a lock as a shader of its own, and says what it needs bound
    Snapshot(SnapshotArgs),
    /// Looks for inputs on which a shader, or a level of its lock, is not finite
    Stability(StabilityArgs),
    /// Times variants of shaders on a GPU, and fits the cost model to it
    Calibrate(calibrate::CalibrateArgs),
    /// Measures what levels come to, over several objects
    #[cfg(feature = "mesh")]
    Bench(bench::BenchArgs),
    /// Makes simpler levels of a model's mesh, and says how far each is from the original
    #[cfg(feature = "mesh")]
    Mesh(mesh::MeshArgs),
    /// Measures how far the mesh of one model is from that of another
    #[cfg(feature = "mesh")]
    MeshError(mesh::MeshErrorArgs),
    /// Prints what a shell completes the arguments of lodc by
    Completions(manual::CompletionsArgs),
    /// Prints a page of the manual, of lodc or of one of its commands
    Man(manual::ManArgs),
}

#[derive(Debug, Args)]
struct InitArgs {
    #[command(flatten)]
    shader: ShaderArgs,
    /// The model that it is put on, glTF or GLB; or sphere, plane, cube, torus-knot, terrain
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// The scene to write [default: the shader's name with .toml, which lodc reads by itself]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Writes over a scene that is there already
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Args)]
struct SnapshotArgs {
    #[command(flatten)]
    shader: ShaderArgs,
    /// The level of detail whose level it is: 0 is the original
    #[arg(long, visible_alias = "at", value_name = "VALUE")]
    autolod: f64,
    /// A run-time parameter that is known, and is folded in: a uniform's member and its number, or several with commas
    /// between them; as often as wanted
    #[arg(long, value_name = "NAME=VALUE", value_parser = known_value)]
    set: Vec<(String, Vec<f64>)>,
    /// The shader to write [default: beside the source, with .snapshot.wgsl]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// The lock [default: beside the source, with .lod.toml]
    #[arg(long, value_name = "FILE")]
    lock: Option<PathBuf>,
    /// The language to write [default: the lock's]
    #[arg(long, value_enum)]
    target: Option<Target>,
}

#[derive(Debug, Args)]
struct StabilityArgs {
    #[command(flatten)]
    input: InputArgs,
    /// The lock whose levels are looked at [default: beside the source, with .lod.toml, if it is there]
    #[arg(long, value_name = "FILE")]
    lock: Option<PathBuf>,
    /// Looks at the inputs of a file, too, which --record has written
    #[arg(long, value_name = "FILE")]
    replay: Option<PathBuf>,
    /// Writes the inputs that something fails on to a file
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Hands inputs near trouble to a GPU, too: words of its name
    #[cfg(feature = "gpu")]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

#[derive(Debug, Args)]
struct CompareArgs {
    #[command(flatten)]
    input: InputArgs,
    /// The shader whose error it is; the one before it is the original
    #[arg(required = true)]
    other: Option<PathBuf>,
    /// A distance to compare at, from the eye to the object's centre; as often as wanted [default: those of the scene]
    #[arg(long, value_name = "DISTANCE")]
    at: Vec<f64>,
    /// The level of detail that the second shader is drawn with, if it has an autoLOD; without --at, where it is reached
    /// [default: that of each distance]
    #[arg(long, value_name = "VALUE")]
    autolod: Option<f64>,
    /// How errors are held against the bound [default: the scene's, else excess]
    #[arg(long, value_name = "excess|paper", value_parser = reading)]
    bound: Option<BoundReading>,
    /// Ends with exit code 1 when the second shader is over the scene's bound at one of the distances
    #[arg(long)]
    check: bool,
    /// A folder for pictures of every view: of both shaders, and of what differs
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Prints the comparison as JSON
    #[arg(long)]
    json: bool,
    #[cfg(feature = "gpu")]
    #[command(flatten)]
    drawn_by: DrawnByArgs,
}

/// What draws pictures.
#[cfg(feature = "gpu")]
#[derive(Debug, Args)]
struct DrawnByArgs {
    /// What draws the pictures [default: gpu with --adapter, else evaluator]
    #[arg(long, value_enum)]
    renderer: Option<Renderer>,
    /// The GPU that draws: words of its name [default: the best]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

#[cfg(feature = "gpu")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Renderer {
    /// On the CPU, the same everywhere
    Evaluator,
    /// With wgpu, in a process of its own
    Gpu,
}

#[cfg(feature = "gpu")]
impl DrawnByArgs {
    fn drawn_by(self) -> Result<DrawnBy> {
        match (self.renderer, self.adapter) {
            (Some(Renderer::Evaluator), Some(_)) => Err(Diagnostic::error(
                "`--adapter` names a GPU, and the evaluator draws without one",
            )
            .with_note("leave one of `--adapter` and `--renderer evaluator` out")),
            (None | Some(Renderer::Evaluator), None) => Ok(DrawnBy::Evaluator),
            (_, adapter) => Ok(DrawnBy::Gpu { adapter }),
        }
    }
}

/// What the commands read that look at a shader in its scene.
#[derive(Debug, Args)]
struct InputArgs {
    #[command(flatten)]
    shader: ShaderArgs,
    /// The scene that errors are measured over [default: the shader's name with .toml, if it is there]
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
}

/// What every command reads.
#[derive(Debug, Args)]
struct ShaderArgs {
    /// The material shader: WGSL, or a GLSL fragment shader
    #[arg(required = true)]
    shader: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// How a shader is read.
#[derive(Debug, Args)]
struct ReadingArgs {
    /// The vertex entry point, where there are several
    #[arg(long, value_name = "NAME")]
    vertex: Option<String>,
    /// The fragment entry point, where there are several
    #[arg(long, value_name = "NAME")]
    fragment: Option<String>,
    /// The file with the vertex stage, where it is another one
    #[arg(long, value_name = "FILE")]
    vertex_file: Option<PathBuf>,
    /// A folder with modules that the shader imports, searched with all its folders [default: the shader's own]
    #[arg(short = 'I', long = "include", value_name = "FOLDER")]
    folders: Vec<PathBuf>,
    /// A shader def for `#ifdef`, `#if` and `#{NAME}`: true, false or a whole number [default: true]
    #[arg(short = 'D', long = "define", value_name = "NAME[=VALUE]")]
    definitions: Vec<String>,
}

#[derive(Debug, Args)]
struct CompileArgs {
    /// The material shader: WGSL, or a GLSL fragment shader; as many as wanted
    #[arg(required = true, value_name = "SHADER")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    /// The scene that errors are measured over [default: the shader's name with .toml, if it is there]
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// The shader to write; lock and report go beside it; of several shaders the folder of all [default: beside the source, with
    /// .lod.wgsl]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// How the host chooses a level [default: the lock's with --locked, else override]
    #[arg(long, value_enum)]
    form: Option<Form>,
    /// The language to write [default: the lock's with --locked, else wgsl]
    #[arg(long, value_enum)]
    target: Option<Target>,
    /// What is drawn where a level begins; all but pop chooses by a uniform [default: the lock's with --locked, else pop]
    #[arg(long, value_enum)]
    transition: Option<Transition>,
    /// How wide the band behind a threshold is in which two levels are drawn, in halvings of scale [default: the lock's with
    /// --locked, else 0.25]
    #[arg(long, value_name = "WIDTH")]
    band: Option<f32>,
    /// Each pixel chooses its level, by how far texture coordinates go from it to the next
    #[arg(long)]
    per_pixel: bool,
    /// How errors are held against the bound: what a level adds to the original's own error, or all of it, as Liang's
    /// paper reads it [default: the scene's, else excess]
    #[arg(long, value_name = "excess|paper", value_parser = reading)]
    bound: Option<BoundReading>,
    /// What levels are to use less of: time, accesses, textures, memory, operations, or several with their weights, such as
    /// time=1,memory=0.2 [default: the scene's, else time]
    #[arg(long, value_name = "GOAL")]
    goal: Option<Goal>,
    /// How levels are searched: shaders alone, or meshes with shaders, of which separate looks at pairs along the boundary of what is
    /// within the bound, exhaustive at all, and interleaved also at meshes that are made for one shader each [default: greedy]
    #[cfg(feature = "mesh")]
    #[arg(long, value_enum)]
    search: Option<compile::Strategy>,
    #[cfg(feature = "mesh")]
    #[command(flatten)]
    joint: JointArgs,
    /// The passes that may cost error, such as texture-removal [default: all]; with a search of meshes and shaders also mesh, for
    /// simpler meshes alone, and shader
    #[arg(long, value_delimiter = ',', value_name = "PASSES")]
    only: Vec<String>,
    /// Leaves out of the levels what the scene does not need, before anything that costs error
    #[arg(
        long,
        value_name = "BOOL",
        action = clap::ArgAction::Set,
        default_value_t = true,
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "true"
    )]
    exact: bool,
    /// Leaves it out of level 0 too
    #[arg(long)]
    specialize: bool,
    /// A uniform, texture, value or function that is never folded, simplified or left out; as often as wanted
    #[arg(long, value_name = "NAME")]
    keep: Vec<String>,
    /// What the host does for levels beyond drawing them: with parameters, it fills a block of them once a draw; with
    /// textures, it binds those that are made for levels [default: nothing but what the scene says]
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "parameters,textures"
    )]
    host: Vec<HostWord>,
    /// How much memory the textures that are made for a level may take together, with their MIP levels
    #[arg(long, value_name = "MIB")]
    max_texture_memory: Option<u32>,
    /// Writes levels that fail on inputs that no picture shows, though the original holds them
    #[arg(long)]
    allow_unstable: bool,
    #[command(flatten)]
    time: TimeArgs,
    /// Writes the shader from the committed lock, without a search
    #[arg(long)]
    locked: bool,
    /// Searches again, beginning with what still applies of the committed lock
    #[arg(long, conflicts_with = "locked")]
    update: bool,
    /// The lock to write it from [default: beside the output, and where there is none, beside the source]
    #[arg(long, value_name = "FILE", requires = "locked")]
    lock: Option<PathBuf>,
    /// Writes which files the outputs depend on, as Make and Ninja read it
    #[arg(long, value_name = "FILE", requires = "locked")]
    depfile: Option<PathBuf>,
    #[command(flatten)]
    jobs: batch::Jobs,
    /// Prints nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// How much a search of meshes and shaders looks at.
#[cfg(feature = "mesh")]
#[derive(Debug, Args)]
struct JointArgs {
    /// How many meshes a search of meshes and shaders chooses from, with the original [default: 16]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=500))]
    meshes: Option<u32>,
    /// How many shaders it chooses from, with the original [default: 24]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=500))]
    shaders: Option<u32>,
    /// From how many sides meshes are seen while they are simplified [default: 60]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=256))]
    mesh_views: Option<u32>,
}

#[cfg(feature = "mesh")]
impl JointArgs {
    /// Adds to a request what was asked.
    fn ask(self, search: Option<compile::Strategy>, request: &mut Request) -> Result<()> {
        request.search = search.unwrap_or_default();
        let given = [
            ("--meshes", self.meshes),
            ("--shaders", self.shaders),
            ("--mesh-views", self.mesh_views),
        ];
        let given = given.into_iter().find(|(_, given)| given.is_some());
        if let (compile::Strategy::Greedy, Some((flag, _))) = (request.search, given) {
            return Err(Diagnostic::error(format!(
                "`{flag}` is about a search of meshes and shaders"
            ))
            .with_note("add `--search separate`"));
        }
        let count = |count: Option<u32>| count.map(|count| count as usize);
        request.meshes = count(self.meshes);
        request.shaders = count(self.shaders);
        request.mesh_views = count(self.mesh_views);
        Ok(())
    }
}

/// Where run times come from.
#[derive(Debug, Args)]
struct TimeArgs {
    /// Where run times come from, by which levels are chosen [default: estimated]
    #[arg(long, value_enum)]
    time: Option<TimeWord>,
    #[command(flatten)]
    measuring: MeasuringArgs,
    /// Writes all timings to a file, which stands in for the adapter with --recordings
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Ranks what is to be timed by the model that `lodc calibrate` wrote to a file [default: by the estimate]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Takes times from files that --record has written, instead of an adapter; of several, for the adapter where a level does
    /// worst
    #[arg(long, value_name = "FILES", num_args = 1.., conflicts_with_all = ["time_budget", "no_cache", "record"])]
    recordings: Vec<PathBuf>,
}

/// How variants are timed on a device.
#[derive(Debug, Args)]
struct MeasuringArgs {
    /// The GPU that variants are timed on: words of its name [default: the best]
    #[cfg(feature = "gpu")]
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// How long the timing of a variant may take; it ends sooner when it is exact to 1 % [default: 2]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    time_budget: Option<Duration>,
    /// Times everything anew, and keeps nothing
    #[arg(long)]
    no_cache: bool,
}

impl MeasuringArgs {
    fn measuring(self, record: Option<PathBuf>) -> Result<Measuring> {
        let effort = Effort::default();
        Ok(Measuring {
            program: program()?,
            #[cfg(feature = "gpu")]
            adapter: self.adapter,
            #[cfg(not(feature = "gpu"))]
            adapter: None,
            cache: cache_folder().filter(|_| !self.no_cache),
            record,
            effort: Effort {
                budget: self.time_budget.unwrap_or(effort.budget),
                ..effort
            },
        })
    }
}

/// The file of lodc itself.
fn program() -> Result<PathBuf> {
    std::env::current_exe().map_err(|error| {
        Diagnostic::error("lodc cannot find its own file, which draws in a process of its own")
            .with_reason(error)
    })
}

/// Where run times come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum TimeWord {
    /// From the cost model
    Estimated,
    /// From draws on a GPU
    Measured,
}

/// The variable that names the folder of what is kept from run to run.
const CACHE: &str = "LODC_CACHE";

/// The folder of what is kept from run to run: `LODC_CACHE`, else lodc's folder where the system keeps such things.
fn cache_folder() -> Option<PathBuf> {
    let of_variable = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    if let Some(folder) = of_variable(CACHE) {
        return Some(folder.into());
    }
    let home = std::env::home_dir();
    let folder = match std::env::consts::OS {
        "windows" => of_variable("LOCALAPPDATA").map(PathBuf::from),
        "macos" => home.map(|home| home.join("Library").join("Caches")),
        _ => of_variable("XDG_CACHE_HOME")
            .map(PathBuf::from)
            .or_else(|| home.map(|home| home.join(".cache"))),
    };
    folder.map(|folder| folder.join("lodc"))
}

fn seconds(text: &str) -> std::result::Result<Duration, String> {
    let wrong = || "it is a number of seconds above 0, such as 0.5".to_owned();
    let seconds: f64 = text.parse().map_err(|_| wrong())?;
    match seconds > 0.0 && seconds <= 3600.0 {
        true => Ok(Duration::from_secs_f64(seconds)),
        false => Err(wrong()),
    }
}

impl TimeArgs {
    fn run_time(self) -> Result<RunTime> {
        if !self.recordings.is_empty() {
            if self.time == Some(TimeWord::Estimated) {
                return Err(Diagnostic::error(
                    "`--recordings` are measured times, and `--time estimated` asks for none",
                )
                .with_note("leave one of them out"));
            }
            let files = self.recordings;
            return Ok(RunTime::Recorded(Recorded { files }));
        }
        if self.time != Some(TimeWord::Measured) {
            let given = [
                ("--time-budget", self.measuring.time_budget.is_some()),
                ("--no-cache", self.measuring.no_cache),
                ("--record", self.record.is_some()),
                ("--model", self.model.is_some()),
                #[cfg(feature = "gpu")]
                ("--adapter", self.measuring.adapter.is_some()),
            ];
            return match given.into_iter().find(|(_, given)| *given) {
                None => Ok(RunTime::Estimated),
                Some((flag, _)) => Err(Diagnostic::error(format!(
                    "`{flag}` is about measured times, and times are estimated"
                ))
                .with_note("add `--time measured`")),
            };
        }
        Ok(RunTime::Measured(self.measuring.measuring(self.record)?))
    }
}

/// What a host may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum HostWord {
    /// It fills the parameter block
    Parameters,
    /// It binds the textures that are made for levels
    Textures,
}

/// Runs the tool. Exit code 0: done; 1: a check failed; 2: bad input or usage.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    // No command for people, so that neither help nor completions know it.
    #[cfg(feature = "gpu")]
    if matches!(&arguments[..], [_, only] if only == crate::gpu::worker::ARGUMENT) {
        return ended(gpu_worker().map(|()| ExitCode::SUCCESS));
    }
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => {
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    let success = |()| ExitCode::SUCCESS;
    let done = match cli.command {
        Some(Command::Inspect(input)) => inspect(input).map(success),
        Some(Command::Check(arguments)) => check::run(arguments),
        Some(Command::Diff(arguments)) => difference::run(arguments),
        Some(Command::Init(arguments)) => init(arguments).map(success),
        Some(Command::Snapshot(arguments)) => snapshot(arguments).map(success),
        Some(Command::Compare(compared)) => compare(compared, &arguments),
        Some(Command::Stability(arguments)) => stability(arguments),
        Some(Command::Calibrate(arguments)) => calibrate::run(arguments).map(success),
        #[cfg(feature = "mesh")]
        Some(Command::Bench(arguments)) => bench::run(arguments).map(success),
        #[cfg(feature = "mesh")]
        Some(Command::Mesh(arguments)) => mesh::run(arguments).map(success),
        #[cfg(feature = "mesh")]
        Some(Command::MeshError(arguments)) => mesh::error(arguments).map(success),
        Some(Command::Completions(arguments)) => {
            manual::completions(&arguments);
            Ok(ExitCode::SUCCESS)
        }
        Some(Command::Man(arguments)) => manual::man(arguments).map(success),
        None => compile_command(cli.compile),
    };
    ended(done)
}

/// The exit code of what was done, once what went wrong has been said.
fn ended(done: Result<ExitCode>) -> ExitCode {
    done.unwrap_or_else(|error| {
        print_diagnostic(&error);
        ExitCode::from(2)
    })
}

fn print_diagnostic(diagnostic: &Diagnostic) {
    let colour = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    eprint!("{}", diagnostic.render(colour));
}

/// Prints to standard output; a reader that has gone away is no error.
fn print(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

impl InputArgs {
    fn request(self) -> Result<Request> {
        let request = self.shader.request()?;
        Ok(Request {
            scene: self.scene,
            ..request
        })
    }
}

impl ShaderArgs {
    fn request(self) -> Result<Request> {
        let (stages, modules) = self.reading.read()?;
        Ok(Request {
            modules,
            // The parser has asked for it.
            shader: self.shader.unwrap_or_default(),
            stages,
            ..Request::default()
        })
    }
}

impl ReadingArgs {
    fn read(self) -> Result<(Stages, Modules)> {
        let definitions = self.definitions.iter();
        let definitions = definitions.map(|text| Definition::of_text(text));
        let modules = Modules {
            folders: self.folders,
            definitions: definitions.collect::<Result<_>>()?,
        };
        let stages = Stages {
            vertex: self.vertex,
            fragment: self.fragment,
            vertex_file: self.vertex_file,
        };
        Ok((stages, modules))
    }
}

fn reading(name: &str) -> std::result::Result<BoundReading, String> {
    BoundReading::of_name(name).ok_or_else(|| "it is `excess` or `paper`".to_owned())
}

/// Reads `material.roughness=0.4` or `sun.direction=0,1,0`.
fn known_value(text: &str) -> std::result::Result<(String, Vec<f64>), String> {
    let wrong = || "it reads `material.roughness=0.4` or `sun.direction=0,1,0`".to_owned();
    let (name, numbers) = text.split_once('=').ok_or_else(wrong)?;
    let numbers = numbers
        .split(',')
        .map(|number| number.trim().parse::<f64>().ok());
    let numbers = numbers.collect::<Option<_>>().ok_or_else(wrong)?;
    Ok((name.trim().to_owned(), numbers))
}

fn inspect(input: InputArgs) -> Result<()> {
    print(&compile::inspect(&input.request()?)?);
    Ok(())
}

#[cfg(feature = "gpu")]
fn gpu_worker() -> Result<()> {
    crate::gpu::worker::serve(std::io::stdin(), std::io::stdout().lock()).map_err(|error| {
        Diagnostic::error("the process that asked for pictures has gone away").with_reason(error)
    })
}

fn init(arguments: InitArgs) -> Result<()> {
    let read = arguments.shader.request()?;
    let request = InitRequest {
        shader: read.shader,
        stages: read.stages,
        modules: read.modules,
        mesh: arguments.mesh,
        output: arguments.output,
        force: arguments.force,
    };
    let (files, made) = compile::init(&request)?;
    for warning in &made.warnings {
        print_diagnostic(warning);
    }
    write(&files, false)?;
    for (i, (what, ty)) in made.missing.iter().enumerate() {
        let title = if i == 0 { "to fill in" } else { "" };
        print(&format!("  {title:<16}{what} ({ty})\n"));
    }
    let shader = request.shader.display();
    let scene = request.scene();
    print(&match scene == request.shader.with_extension("toml") {
        true => format!("  next            lodc {shader}\n"),
        false => format!(
            "  next            lodc {shader} --scene {}\n",
            scene.display()
        ),
    });
    Ok(())
}

fn snapshot(arguments: SnapshotArgs) -> Result<()> {
    let asked = SnapshotRequest {
        request: Request {
            target: arguments.target,
            output: arguments.lock,
            ..arguments.shader.request()?
        },
        autolod: arguments.autolod,
        values: arguments.set,
        output: arguments.output,
    };
    let snapshot = compile::snapshot(&asked)?;
    for warning in &snapshot.warnings {
        print_diagnostic(warning);
    }
    print(&snapshot.summary());
    write(&snapshot.files, false)
}

/// The command that runs, for reports.
fn command_line() -> String {
    std::iter::once("lodc".to_owned())
        .chain(std::env::args().skip(1))
        .collect::<Vec<_>>()
        .join(" ")
}

/// Compares two shaders. Exit code 1 when the second is over its bound, and that was asked for. `all` are the arguments
/// of the process.
fn compare(arguments: CompareArgs, all: &[OsString]) -> Result<ExitCode> {
    let request = CompareRequest {
        original: Request {
            bound: arguments.bound,
            command: command_line(),
            ..arguments.input.request()?
        },
        // The parser has asked for it.
        other: arguments.other.unwrap_or_default(),
        at: arguments.at,
        autolod: arguments.autolod,
        images: arguments.output,
        #[cfg(feature = "gpu")]
        renderer: arguments.drawn_by.drawn_by()?,
        #[cfg(not(feature = "gpu"))]
        renderer: DrawnBy::Evaluator,
    };
    #[cfg(feature = "gpu")]
    if let DrawnBy::Gpu { adapter } = &request.renderer
        && !child::is_one()
    {
        return child::run(all, adapter.as_deref());
    }
    #[cfg(feature = "gpu")]
    let goes_on = child::goes_on;
    #[cfg(not(feature = "gpu"))]
    let (goes_on, _) = (|| {}, all);
    let compared = compile::compare(&request, &goes_on)?;
    for warning in &compared.warnings {
        print_diagnostic(warning);
    }
    emit::write_atomically(&compared.files)?;
    let comparison = &compared.comparison;
    if arguments.json {
        print(&comparison.json());
    } else {
        print(&comparison.table());
        if let Some(folder) = &request.images {
            let (count, folder) = (compared.files.len(), folder.display());
            print(&format!("  {:<16}{count} pictures to {folder}\n", "wrote"));
        }
    }
    Ok(match comparison.failed() {
        Some(failed) if arguments.check => {
            print_diagnostic(&failed);
            ExitCode::from(1)
        }
        _ => ExitCode::SUCCESS,
    })
}

/// Looks for inputs that break a shader or its levels. Exit code 1 when a level fails where the original holds.
fn stability(arguments: StabilityArgs) -> Result<ExitCode> {
    #[cfg(feature = "gpu")]
    let time = match arguments.adapter {
        Some(adapter) => RunTime::Measured(Measuring {
            program: program()?,
            adapter: Some(adapter),
            ..Measuring::default()
        }),
        None => RunTime::default(),
    };
    #[cfg(not(feature = "gpu"))]
    let time = RunTime::default();
    let asked = StabilityRequest {
        request: Request {
            output: arguments.lock,
            time,
            ..arguments.input.request()?
        },
        replay: arguments.replay,
        record: arguments.record,
    };
    let found = compile::stability(&asked)?;
    let findings = found.stiff.iter().chain(&found.findings);
    for diagnostic in found.warnings.iter().chain(findings) {
        print_diagnostic(diagnostic);
    }
    print(&found.table());
    if !found.files.is_empty() {
        write(&found.files, false)?;
    }
    Ok(match found.fails() {
        true => ExitCode::from(1),
        false => ExitCode::SUCCESS,
    })
}

fn compile_command(arguments: CompileArgs) -> Result<ExitCode> {
    let (stages, modules) = arguments.reading.read()?;
    let mut request = Request {
        stages,
        modules,
        scene: arguments.scene,
        lock: arguments.lock,
        ..Request::default()
    };
    request.bound = arguments.bound;
    request.parameters = arguments.host.contains(&HostWord::Parameters);
    request.textures = arguments.host.contains(&HostWord::Textures);
    request.max_texture_memory = arguments.max_texture_memory;
    request.form = arguments.form;
    request.target = arguments.target;
    request.transition = arguments.transition;
    request.band = arguments.band;
    request.per_pixel = arguments.per_pixel;
    request.exact = match (arguments.specialize, arguments.exact) {
        (true, true) => Scope::All,
        (false, true) => Scope::Levels,
        (false, false) => Scope::None,
        (true, false) => {
            return Err(
                Diagnostic::error("`--specialize` asks for what `--exact=false` forbids")
                    .with_note("leave one of them out"),
            );
        }
    };
    request.keep = arguments.keep;
    request.unstable = arguments.allow_unstable;
    request.update = arguments.update;
    request.goal = arguments.goal;
    request.only = arguments.only;
    #[cfg(feature = "mesh")]
    arguments.joint.ask(arguments.search, &mut request)?;
    request.command = command_line();
    request.model = arguments.time.model.clone();
    request.time = arguments.time.run_time()?;
    let of_one = [
        ("--lock", request.lock.is_some()),
        ("--vertex-file", request.stages.vertex_file.is_some()),
    ];
    if let (2.., Some((flag, _))) = (
        arguments.files.len(),
        of_one.into_iter().find(|(_, given)| *given),
    ) {
        let error = format!("`{flag}` is that of one shader, and there are several");
        return Err(Diagnostic::error(error).with_note("name one shader in a call"));
    }
    let requests = arguments.files.into_iter().map(|shader| Request {
        shader,
        ..request.clone()
    });
    let requests = batch::placed(requests.collect(), arguments.output)?;
    let quiet = arguments.quiet;
    let rules = Mutex::new(BTreeMap::new());
    let code = batch::each(arguments.jobs, &requests, |at, request| {
        let mut said = Said::default();
        let done = match arguments.locked {
            true => replay(request, quiet, &mut said).map(|rule| {
                let mut rules = rules.lock().unwrap_or_else(PoisonError::into_inner);
                rules.insert(at, rule);
            }),
            false => search(request, quiet, requests.len(), &mut said),
        };
        if let Err(error) = done {
            said.error = Some(error);
            said.code = 2;
        }
        said
    });
    if let Some(file) = arguments.depfile.filter(|_| code == 0) {
        let rules = rules.into_inner().unwrap_or_else(PoisonError::into_inner);
        let rules: Vec<Rule> = rules.into_values().collect();
        emit::write_atomically(&[(file, depfile::text(&rules)?.into_bytes())])?;
    }
    Ok(ExitCode::from(code))
}

/// Writes what a lock makes, and says what it depends on.
fn replay(request: &Request, quiet: bool, said: &mut Said) -> Result<Rule> {
    let made = compile::remade(request)?;
    said.warnings = made.warnings;
    said.text = written(&made.files, quiet)?;
    let outputs = made.files.into_iter().map(|(file, _)| file);
    Ok(Rule {
        outputs: outputs.collect(),
        inputs: made.inputs,
    })
}

/// Searches levels, one of `of` shaders.
fn search(request: &Request, quiet: bool, of: usize, said: &mut Said) -> Result<()> {
    let bar = Bar::new("searching", quiet || of > 1);
    let compiled = compile::compile(request, &|progress| bar.show(progress));
    bar.finish();
    let compiled = compiled?;
    said.warnings = compiled.warnings;
    if !quiet {
        said.text = report::summary(&compiled.report);
        if let Some(timings) = compiled.timings {
            let compile::Timings { taken, found, .. } = timings;
            said.text += &format!(
                "  {:<16}{taken} taken, {found} found in what was timed before\n",
                "timings"
            );
        }
    }
    said.text += &written(&compiled.files, quiet)?;
    if !quiet {
        said.text += &report::next(&compiled.report, compiled.output);
    }
    Ok(())
}

fn write(files: &compile::Files, quiet: bool) -> Result<()> {
    print(&written(files, quiet)?);
    Ok(())
}

/// Writes files, and says which.
fn written(files: &compile::Files, quiet: bool) -> Result<String> {
    let written = emit::write_atomically(files)?;
    let mut said = String::new();
    for (what, is_written) in [("wrote", true), ("unchanged", false)] {
        let names = files.iter().map(|(file, _)| file);
        let names = names.filter(|file| written.contains(&file.as_path()) == is_written);
        let names: Vec<String> = names.map(|file| file.display().to_string()).collect();
        if !quiet && !names.is_empty() {
            said += &format!("  {what:<16}{}\n", names.join("  "));
        }
    }
    Ok(said)
}
