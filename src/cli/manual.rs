//! `lodc completions` and `lodc man`: the command line as shells and `man` read it.

use super::Cli;
use crate::{Diagnostic, Result};
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use std::io::Write;

#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell that completes
    shell: Shell,
}

#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// A command, such as compare [default: lodc itself]
    command: Option<String>,
}

/// Prints the script that a shell completes lodc's arguments by.
pub(super) fn completions(arguments: &CompletionsArgs) {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "lodc", &mut script);
    // A reader that has gone away is no error.
    let _ = std::io::stdout().write_all(&script);
}

/// Prints a page of the manual.
pub(super) fn man(arguments: ManArgs) -> Result<()> {
    let mut all = Cli::command();
    all.build();
    let page = match &arguments.command {
        None => all,
        Some(name) => {
            let commands = all
                .get_subcommands()
                .filter(|command| !command.is_hide_set());
            let known: Vec<&str> = commands.map(clap::Command::get_name).collect();
            let found = all
                .find_subcommand(name)
                .filter(|_| known.contains(&&**name));
            let Some(found) = found.cloned() else {
                return Err(Diagnostic::error(format!("there is no command `{name}`"))
                    .with_note(format!("there are {}", known.join(", "))));
            };
            found
        }
    };
    let mut text = Vec::new();
    let title = page.get_display_name().unwrap_or("lodc").to_owned();
    clap_mangen::Man::new(page)
        .title(title)
        .render(&mut text)
        .map_err(|error| Diagnostic::error("the page cannot be written").with_reason(error))?;
    let _ = std::io::stdout().write_all(&text);
    Ok(())
}
