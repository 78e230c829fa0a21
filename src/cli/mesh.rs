//! `lodc mesh` and `lodc mesh-error`: a model's mesh by itself.

use super::progress::Bar;
use super::{print, print_diagnostic, write};
use crate::compile::{self, Length, MeshGoals, MeshRequest};
use crate::{Result, report};
use clap::Args;
use lodc_mesh::write::Sight;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct MeshArgs {
    /// The model: glTF, GLB, OBJ or PLY
    model: PathBuf,
    #[command(flatten)]
    goals: GoalArgs,
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

/// How far levels go.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct GoalArgs {
    /// How far any point of a level may be from the original, and any of the original from the level, proved: in units of the
    /// model, or in per cent of the diagonal of its box; a level for each
    #[arg(long, value_delimiter = ',', value_name = "LENGTHS", value_parser = length)]
    error: Vec<Length>,
    /// How far the vertices of either may be from the other in the mean, by Pan's equation 1
    #[arg(long, value_delimiter = ',', value_name = "LENGTHS", value_parser = length)]
    mean_error: Vec<Length>,
    /// How many triangles levels may have
    #[arg(long, value_delimiter = ',', value_name = "COUNTS")]
    triangles: Vec<usize>,
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

fn degrees(text: &str) -> std::result::Result<f64, String> {
    let degrees: Option<f64> = text.parse().ok();
    degrees
        .filter(|fov| *fov > 0.0 && *fov < 180.0)
        .ok_or_else(|| "it is an angle between 0 and 180".to_owned())
}

/// Simplifies a mesh, prints the table of its levels, and writes them.
pub(super) fn run(arguments: MeshArgs) -> Result<()> {
    let GoalArgs {
        error,
        mean_error,
        triangles,
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
    if !made.files.is_empty() {
        write(&made.files, arguments.quiet)?;
    } else if !arguments.quiet {
        let output = request.model.with_extension("lod.glb");
        print(&format!(
            "  {:<16}add `-o {}` to write the levels\n",
            "next",
            output.display()
        ));
    }
    Ok(())
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
