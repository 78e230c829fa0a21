//! `lodc mesh` and `lodc mesh-error`: a model's mesh by itself.

use super::progress::Bar;
use super::{ReadingArgs, print, print_diagnostic, write};
use crate::compile::{self, Length, MeshGoals, MeshRequest, PictureGoals, PictureRequest, Request};
use crate::mesh::{EdgeRule, Settings};
use crate::{Diagnostic, Result, report};
use clap::Args;
use lodc_mesh::write::Sight;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct MeshArgs {
    /// The model: glTF, GLB, OBJ or PLY
    model: PathBuf,
    #[command(flatten)]
    goals: GoalArgs,
    #[command(flatten)]
    look: LookArgs,
    /// The GLB to write the levels to; a table of their distances goes beside it [default: nothing is written]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Writes a GLB for each level instead of one for all
    #[arg(long, requires = "output")]
    apart: bool,
    /// How many pixels high the screen is that levels are seen on, for the distances at which they begin
    #[arg(long, value_name = "PIXELS", default_value_t = 1080, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    screen_height: u32,
    /// Its vertical field of view, for the same
    #[arg(long, value_name = "DEGREES", default_value_t = 45.0, value_parser = degrees)]
    fov: f64,
    /// Prints nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// How far levels go: by the geometry alone, or, with a shader, by pictures.
#[derive(Debug, Args)]
#[group(required = true, multiple = true)]
struct GoalArgs {
    /// How far any point of a level may be from the original, and any of the original from the level, proved: in units of the
    /// model, or in per cent of the diagonal of its box; a level for each
    #[arg(long, value_delimiter = ',', value_name = "LENGTHS", value_parser = length,
        conflicts_with_all = ["mean_error", "triangles", "image_error", "shader"])]
    error: Vec<Length>,
    /// How far the vertices of either may be from the other in the mean, by Pan's equation 1
    #[arg(long, value_delimiter = ',', value_name = "LENGTHS", value_parser = length,
        conflicts_with_all = ["triangles", "image_error", "shader"])]
    mean_error: Vec<Length>,
    /// How many triangles levels may have
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "COUNTS",
        conflicts_with = "image_error"
    )]
    triangles: Vec<usize>,
    /// How much levels may add to the error of the original's pictures, as the shader draws them: excess of the RMSE, 0 to 1; a level
    /// for each
    #[arg(long, value_delimiter = ',', value_name = "ERRORS", value_parser = excess, requires = "shader")]
    image_error: Vec<f64>,
    /// The shader that the model is drawn with: levels are then made by pictures; without another goal one for each distance of
    /// the scene, within its bound
    #[arg(long, value_name = "FILE")]
    shader: Option<PathBuf>,
}

/// How levels are made by pictures.
#[derive(Debug, Args)]
struct LookArgs {
    /// The scene that the model is drawn in, in place of its object [default: the shader's name with .toml, if it is there]
    #[arg(long, value_name = "FILE", requires = "shader")]
    scene: Option<PathBuf>,
    /// The distance of the pictures, from the eye to the object's centre [default: where the whole object is in the picture]
    #[arg(long, value_name = "DISTANCE", requires = "shader")]
    at: Option<f64>,
    /// From how many sides pictures are taken, where the scene does not list them [default: 60]
    #[arg(long, value_name = "COUNT", requires = "shader", value_parser = clap::value_parser!(u16).range(1..=200))]
    views: Option<u16>,
    /// What refuses an edge whatever pictures say: what has gone would be farther from the surface than --pixels, or the edge is longer
    /// than that, as Liang's paper has it [default: deviation]
    #[arg(long, value_enum, requires = "shader")]
    edge_rule: Option<EdgeRule>,
    /// How many pixels that is, at the nearest point of the object [default: 1]
    #[arg(long, value_name = "PIXELS", requires = "shader")]
    pixels: Option<f64>,
    #[command(flatten)]
    reading: ReadingArgs,
}

#[derive(Debug, Args)]
pub(super) struct MeshErrorArgs {
    /// The original: glTF, GLB, OBJ or PLY
    original: PathBuf,
    /// The model that is held against it
    other: PathBuf,
    /// Prints the distances as JSON
    #[arg(long)]
    json: bool,
}

fn length(text: &str) -> std::result::Result<Length, String> {
    Length::of_text(text).ok_or_else(|| {
        "it is a length above 0, such as 0.02% of the diagonal, or 0.5 units".to_owned()
    })
}

fn excess(text: &str) -> std::result::Result<f64, String> {
    let number: Option<f64> = text.trim().parse().ok();
    number
        .filter(|error| *error > 0.0 && *error <= 1.0)
        .ok_or_else(|| "it is an error above 0 and up to 1, such as 0.02".to_owned())
}

fn degrees(text: &str) -> std::result::Result<f64, String> {
    let degrees: Option<f64> = text.parse().ok();
    degrees
        .filter(|fov| *fov > 0.0 && *fov < 180.0)
        .ok_or_else(|| "it is an angle between 0 and 180".to_owned())
}

/// Simplifies a mesh, prints the table of its levels, and writes them.
pub(super) fn run(arguments: MeshArgs) -> Result<()> {
    match arguments.goals.shader.clone() {
        Some(shader) => by_pictures(arguments, shader),
        None => by_geometry(arguments),
    }
}

/// By pictures, as a shader draws them.
fn by_pictures(arguments: MeshArgs, shader: PathBuf) -> Result<()> {
    let (goals, look) = (arguments.goals, arguments.look);
    let (stages, modules) = look.reading.read()?;
    let settings = Settings::default();
    let is_length = |number: f64| number > 0.0 && number.is_finite();
    for (flag, number) in [("--at", look.at), ("--pixels", look.pixels)] {
        if number.is_some_and(|number| !is_length(number)) {
            return Err(
                Diagnostic::error(format!("`{flag}` wants a number above 0"))
                    .with_note("leave it out for the default"),
            );
        }
    }
    let request = PictureRequest {
        model: arguments.model,
        request: Request {
            shader,
            stages,
            modules,
            scene: look.scene,
            ..Request::default()
        },
        goals: if !goals.image_error.is_empty() {
            PictureGoals::Errors(goals.image_error)
        } else if !goals.triangles.is_empty() {
            PictureGoals::Triangles(goals.triangles)
        } else {
            PictureGoals::Scene
        },
        at: look.at,
        settings: Settings {
            views: look.views.map_or(settings.views, usize::from),
            rule: look.edge_rule.unwrap_or_default(),
            most_pixels: look.pixels.unwrap_or(settings.most_pixels),
            ..settings
        },
        output: arguments.output,
        apart: arguments.apart,
    };
    let bar = Bar::new("simplifying", arguments.quiet);
    let made = compile::mesh_by_pictures(&request, &|now| {
        bar.advance((now.level as f64 - 1.0 + now.done) / now.of as f64, || {
            format!(
                "level {} of {}, {} triangles, excess {:.4}",
                now.level, now.of, now.triangles, now.excess
            )
        });
    });
    bar.finish();
    let made = made?;
    for warning in &made.warnings {
        print_diagnostic(warning);
    }
    if !arguments.quiet {
        print(&report::seen_mesh(&made));
    }
    written(&made.files, &request.model, arguments.quiet)
}

/// Writes what there is to write, or says how it would be.
fn written(files: &compile::Files, model: &std::path::Path, quiet: bool) -> Result<()> {
    if !files.is_empty() {
        write(files, quiet)?;
    } else if !quiet {
        let output = model.with_extension("lod.glb");
        let output = output.display();
        print(&format!(
            "  {:<16}add `-o {output}` to write the levels\n",
            "next"
        ));
    }
    Ok(())
}

/// By the geometry alone.
fn by_geometry(arguments: MeshArgs) -> Result<()> {
    let GoalArgs {
        error,
        mean_error,
        triangles,
        ..
    } = arguments.goals;
    let request = MeshRequest {
        model: arguments.model,
        goals: if !error.is_empty() {
            MeshGoals::Bounds(error)
        } else if !mean_error.is_empty() {
            MeshGoals::Means(mean_error)
        } else {
            MeshGoals::Triangles(triangles)
        },
        output: arguments.output,
        apart: arguments.apart,
        sight: Sight {
            fov: arguments.fov,
            ..Sight::default()
        },
        height: arguments.screen_height,
    };
    let bar = Bar::new("simplifying", arguments.quiet);
    let made = compile::mesh(&request, &|now| {
        let gone = 1.0 - now.triangles as f64 / now.original.max(1) as f64;
        bar.advance((now.level as f64 - 1.0 + gone) / now.of as f64, || {
            format!(
                "level {} of {}, {} triangles",
                now.level, now.of, now.triangles
            )
        });
    });
    bar.finish();
    let made = made?;
    for warning in &made.warnings {
        print_diagnostic(warning);
    }
    if !arguments.quiet {
        print(&report::mesh_levels(&made.levels));
    }
    written(&made.files, &request.model, arguments.quiet)
}

/// Measures how far two meshes are apart.
pub(super) fn error(arguments: MeshErrorArgs) -> Result<()> {
    let measured = compile::mesh_error(&arguments.original, &arguments.other)?;
    for warning in &measured.warnings {
        print_diagnostic(warning);
    }
    print(&match arguments.json {
        true => report::mesh_error_json(&measured),
        false => report::mesh_error(&measured),
    });
    Ok(())
}
