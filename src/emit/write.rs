//! Writes files so that none is ever half written: beside the old one first, then renamed over it. What is there already is not
//! touched.

use crate::{Diagnostic, Result};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Writes files, all or none, and says which: a file that has its contents already is left alone, so that whoever looks at times of
/// modification has nothing to do. Missing folders are made. Every file is written under another name beside its
/// place first; only when all are on the disk are they renamed.
///
/// # Errors
/// At the first file that cannot be written, with its path and the reason; then nothing has changed, unless it
/// is a rename that failed, and even then every file is whole.
pub fn write_atomically(files: &[(PathBuf, Vec<u8>)]) -> Result<Vec<&Path>> {
    writable(files)?;
    let changed = files.iter().filter(|(path, bytes)| !is_there(path, bytes));
    let changed: Vec<(&Path, &[u8])> = changed.map(|(path, bytes)| (&**path, &**bytes)).collect();
    let mut written = Written(Vec::new());
    for (path, bytes) in &changed {
        make_folder(path)?;
        let beside = beside(path);
        written.0.push(beside.clone());
        fs::write(&beside, bytes).map_err(|e| failed(path, &e))?;
    }
    for (beside, (path, _)) in written.0.iter().zip(&changed) {
        fs::rename(beside, path).map_err(|e| failed(path, &e))?;
    }
    Ok(changed.into_iter().map(|(path, _)| path).collect())
}

/// Whether a file has these contents.
fn is_there(path: &Path, bytes: &[u8]) -> bool {
    let length = fs::metadata(path).map(|known| known.len());
    length.is_ok_and(|length| length == bytes.len() as u64)
        && fs::read(path).is_ok_and(|have| have == bytes)
}

/// Files that are taken away again if they are still there at the end.
struct Written(Vec<PathBuf>);

impl Drop for Written {
    fn drop(&mut self) {
        for path in &self.0 {
            // Renamed ones are gone, and what cannot be removed is no reason to hide the first error.
            let _ = fs::remove_file(path);
        }
    }
}

/// Whether files can have their places, as far as can be known without writing.
///
/// # Errors
/// When one is a folder, or below a file.
pub fn writable(files: &[(PathBuf, Vec<u8>)]) -> Result<()> {
    for (path, _) in files {
        if path.is_dir() {
            return Err(
                Diagnostic::error(format!("`{}` is a folder", path.display()))
                    .with_note("give the name of a file to write"),
            );
        }
        if let Some(file) = path.ancestors().skip(1).find(|above| above.is_file()) {
            return Err(Diagnostic::error(format!(
                "cannot write `{}`: `{}` is a file, not a folder",
                path.display(),
                file.display()
            ))
            .with_note("choose another place with `-o`"));
        }
    }
    Ok(())
}

fn make_folder(path: &Path) -> Result<()> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => {
            fs::create_dir_all(folder).map_err(|e| failed(path, &e))
        }
        _ => Ok(()),
    }
}

/// The name under which a file is written first. The process is in it, so that two runs do not meet.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}

fn failed(path: &Path, error: &io::Error) -> Box<Diagnostic> {
    Diagnostic::error(format!("cannot write `{}`: {error}", path.display()))
        .with_note("nothing is half written: what was there before is still there")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("lodc-write-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("a folder for the test");
        folder
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .expect("the folder is there")
            .map(|entry| {
                entry
                    .expect("it can be read")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    }

    #[test]
    fn writes_and_replaces() {
        let folder = folder("replaces");
        fs::write(folder.join("a"), "old").expect("it is written");
        write_atomically(&[
            (folder.join("a"), b"new".to_vec()),
            (folder.join("deep/er/b"), b"too".to_vec()),
        ])
        .expect("it is written");
        assert_eq!(fs::read(folder.join("a")).expect("it is there"), b"new");
        assert_eq!(
            fs::read(folder.join("deep/er/b")).expect("it is there"),
            b"too"
        );
        assert_eq!(names(&folder), ["a", "deep"]);
        fs::remove_dir_all(folder).expect("it goes");
    }

    #[test]
    fn what_is_there_is_not_touched() {
        let folder = folder("untouched");
        let [same, other] = ["same", "other"].map(|name| folder.join(name));
        for path in [&same, &other] {
            fs::write(path, "old").expect("it is written");
            let file = fs::File::options().write(true).open(path);
            let long_ago = std::time::SystemTime::UNIX_EPOCH;
            let set = file.expect("it is there").set_modified(long_ago);
            set.expect("a time can be set");
        }
        let files = [(same.clone(), b"old".to_vec()), (other, b"new".to_vec())];
        let written = write_atomically(&files).expect("it is written");
        assert_eq!(written, [folder.join("other")]);
        let modified = |name: &str| {
            let known = fs::metadata(folder.join(name)).expect("it is there");
            known.modified().expect("it has a time")
        };
        assert_eq!(modified("same"), std::time::SystemTime::UNIX_EPOCH);
        assert!(modified("other") > std::time::SystemTime::UNIX_EPOCH);
        fs::remove_dir_all(folder).expect("it goes");
    }

    #[test]
    fn a_failure_changes_nothing() {
        let folder = folder("fails");
        fs::write(folder.join("a"), "old").expect("it is written");
        for (bad, reason) in [
            ("a/b", "`, not a folder"),
            ("a/b/c", "not a folder"),
            ("d", "is a folder"),
        ] {
            fs::create_dir_all(folder.join("d")).expect("it is made");
            let error = write_atomically(&[
                (folder.join("a"), b"new".to_vec()),
                (folder.join(bad), b"too".to_vec()),
            ])
            .expect_err("it cannot be written");
            assert!(
                error.message.contains(reason.trim_start_matches("`, ")),
                "{}",
                error.message
            );
            assert!(error.message.contains(bad), "{}", error.message);
            assert_eq!(fs::read(folder.join("a")).expect("it is there"), b"old");
            assert_eq!(names(&folder), ["a", "d"]);
        }
        fs::remove_dir_all(folder).expect("it goes");
    }
}
