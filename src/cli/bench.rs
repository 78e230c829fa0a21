//! `lodc bench`: measures what levels come to over several objects, and writes nothing.

use super::progress::Bar;
use super::{JointArgs, TimeArgs, command_line, print, print_diagnostic};
use crate::compile::{self, Request, Strategy};
use crate::{Result, report};
use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    #[command(subcommand)]
    command: BenchCommand,
}

#[derive(Debug, Subcommand)]
enum BenchCommand {
    /// Says for each object how long levels of simpler meshes take, of simpler shaders, and of both
    Table2(Table2Args),
}

#[derive(Debug, Args)]
struct Table2Args {
    /// The objects: material shaders, each with the scene beside it or after `=`, such as pbr.wgsl=rock.toml
    #[arg(required = true, value_name = "SHADER[=SCENE]", value_parser = object)]
    objects: Vec<(PathBuf, Option<PathBuf>)>,
    /// How pairs of a mesh and a shader are looked for; exhaustive also says what separate would have come to
    #[arg(long, value_enum, default_value = "separate")]
    search: Strategy,
    #[command(flatten)]
    joint: JointArgs,
    #[command(flatten)]
    time: TimeArgs,
    /// Prints the table as JSON
    #[arg(long)]
    json: bool,
}

/// Reads `pbr.wgsl` or `pbr.wgsl=rock.toml`.
fn object(text: &str) -> std::result::Result<(PathBuf, Option<PathBuf>), String> {
    match text.split_once('=') {
        None => Ok((text.into(), None)),
        Some((shader, scene)) if !shader.is_empty() && !scene.is_empty() => {
            Ok((shader.into(), Some(scene.into())))
        }
        Some(_) => Err("it reads `material.wgsl` or `material.wgsl=scene.toml`".to_owned()),
    }
}

pub(super) fn run(arguments: BenchArgs) -> Result<()> {
    let BenchCommand::Table2(arguments) = arguments.command;
    let mut asked = Request {
        command: command_line(),
        model: arguments.time.model.clone(),
        time: arguments.time.run_time()?,
        ..Request::default()
    };
    arguments.joint.ask(Some(arguments.search), &mut asked)?;
    let requests = arguments
        .objects
        .into_iter()
        .map(|(shader, scene)| Request {
            shader,
            scene,
            ..asked.clone()
        });
    let requests: Vec<Request> = requests.collect();
    let is_table = !arguments.json;
    if is_table {
        print(&report::table2_head());
    }
    let bar = Bar::new("searching", false);
    let table = compile::table2(&requests, &|progress| bar.show(progress), &|row| {
        if is_table {
            print(&report::table2_row(row));
        }
    });
    bar.finish();
    let table = table?;
    for warning in &table.warnings {
        print_diagnostic(warning);
    }
    print(&match is_table {
        true => report::table2_means(&table),
        false => report::table2_json(&table),
    });
    Ok(())
}
