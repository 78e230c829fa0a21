//! lodc in a child process of its own, so that a driver that hangs or crashes takes nothing with it.
//!
//! The child is the same command. What it prints goes through; between, it prints a byte 0 whenever it goes on, which the
//! parent takes out. A child that has been silent for too long is ended.

use crate::Result;
use crate::gpu::worker::Failure;
use std::ffi::OsString;
use std::io::{Read, Write};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

/// What tells a child that it is one.
const CHILD: &str = "LODC_CHILD";

/// How long a child may be silent: a picture, with the compilation of its shader. Software takes its time.
const PATIENCE: Duration = Duration::from_secs(120);

/// What a child prints when it goes on.
const GOES_ON: u8 = 0;

/// Whether this process is a child.
pub(super) fn is_one() -> bool {
    std::env::var_os(CHILD).is_some()
}

/// Says that a child goes on; nothing in a process that is none.
pub(super) fn goes_on() {
    if is_one() {
        let mut out = std::io::stdout();
        // A parent that has gone away is no error here: whatever is printed next will find out.
        let _ = out.write_all(&[GOES_ON]).and_then(|()| out.flush());
    }
}

/// Runs this command, with all its arguments, in a child; its exit code. `adapter` is what was asked for.
///
/// # Errors
/// When the child crashes, or is silent for too long.
pub(super) fn run(arguments: &[OsString], adapter: Option<&str>) -> Result<ExitCode> {
    let code = std::env::current_exe()
        .map_err(|error| not_started(&error))
        .and_then(|program| {
            let mut command = Command::new(program);
            command.args(arguments.iter().skip(1)).env(CHILD, "1");
            watch(&mut command, PATIENCE, &mut std::io::stdout())
        });
    let code = code.map_err(|failure| failure.diagnostic(adapter))?;
    Ok(ExitCode::from(code))
}

fn not_started(error: &std::io::Error) -> Failure {
    Failure::NotStarted(error.to_string())
}

/// Runs a child and passes on to `out` what it prints; its exit code.
fn watch(
    command: &mut Command,
    patience: Duration,
    out: &mut dyn Write,
) -> std::result::Result<u8, Failure> {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| not_started(&error))?;
    let (send, printed) = mpsc::channel();
    if let Some(mut out) = child.stdout.take() {
        std::thread::spawn(move || {
            let mut part = [0; 4096];
            while let Ok(count @ 1..) = out.read(&mut part) {
                if send.send(part[..count].to_vec()).is_err() {
                    return;
                }
            }
        });
    }
    loop {
        match printed.recv_timeout(patience) {
            Ok(mut bytes) => {
                bytes.retain(|byte| *byte != GOES_ON);
                // A reader that has gone away is no error.
                let _ = out.write_all(&bytes);
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                end(&mut child);
                return Err(Failure::Hung(patience));
            }
        }
    }
    let status = child.wait().map_err(|error| not_started(&error))?;
    match status.code() {
        // It has said what is wrong.
        Some(code @ 0..=2) => Ok(code as u8),
        // What the driver printed has gone to standard error.
        _ => Err(Failure::Crashed {
            status: status.to_string(),
            said: String::new(),
        }),
    }
}

/// Ends a child, whatever it does.
fn end(child: &mut Child) {
    // It may have ended by itself.
    let _ = child.kill();
    let _ = child.wait();
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// What becomes of a child that runs a line of shell, and what is passed on of what it prints.
    fn watched(line: &str) -> (std::result::Result<u8, Failure>, Vec<u8>) {
        let mut out = Vec::new();
        let mut command = Command::new("sh");
        let patience = Duration::from_secs(3);
        (watch(command.args(["-c", line]), patience, &mut out), out)
    }

    #[test]
    fn what_a_child_prints_is_passed_on_without_its_signs_of_life() {
        let (code, out) = watched("printf 'a\\0b'; printf '\\0\\0c\\n'; exit 1");
        assert_eq!((code.unwrap(), &*out), (1, &b"abc\n"[..]));
    }

    #[test]
    fn a_child_that_goes_on_is_waited_for() {
        let (code, out) = watched("for i in 1 2 3 4; do sleep 1; printf '\\0'; done; printf d");
        assert_eq!((code.unwrap(), &*out), (0, &b"d"[..]));
    }

    #[test]
    fn a_crash_and_a_hang_are_errors() {
        let crashed = watched("kill -SEGV $$").0.unwrap_err();
        assert!(matches!(crashed, Failure::Crashed { .. }), "{crashed:?}");
        let hung = watched("exec sleep 60").0.unwrap_err();
        assert!(matches!(hung, Failure::Hung(_)), "{hung:?}");
    }
}
