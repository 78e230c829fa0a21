//! Timings that were taken before: on disk, so that an interrupted search goes on where it stopped, and as recordings,
//! which stand in for an adapter.
//!
//! ```text
//! Key = hash(what is drawn, the variant's text, distance, effort)      the same on every machine
//! Cache      folder/<adapter>/<key>.json                               one file a timing
//! Recording  { adapter, timings: key -> Timing }                       one file an adapter
//! ```
//!
//! A cached timing is written beside its place and renamed: whoever is killed in the middle leaves a file that nobody reads,
//! and of two that write the same, one wins. What cannot be read is timed again.

use super::Timing;
use crate::front::digest::digest;
use crate::{Diagnostic, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The format of what is written. It goes up when old timings mean something else.
const FORMAT: u32 = 1;

/// How many timings of one adapter are kept; beyond that the oldest go, a quarter at a time.
pub const MOST: usize = 20_000;

/// What a timing is found by: the hash of all that it depends on but the adapter.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Key(String);

impl Key {
    /// The key of parts, in their order. No two lists of parts have the same.
    pub fn of<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> Self {
        let mut all = Vec::new();
        for part in parts {
            all.extend_from_slice(&(part.len() as u64).to_le_bytes());
            all.extend_from_slice(part);
        }
        Self(digest(&all)[..40].to_owned())
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Timings of one adapter on disk.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// The timings that an adapter has in a folder, which is made when the first is written. `adapter` is all that is known of it: its name
    /// and its driver's.
    pub fn new(folder: &Path, adapter: &str) -> Self {
        let version = env!("CARGO_PKG_VERSION").as_bytes();
        let format = FORMAT.to_le_bytes();
        let name = Key::of([adapter.as_bytes(), version, &format]);
        Self {
            folder: folder.join("times").join(name.to_string()),
        }
    }

    /// Where they are.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn file(&self, key: &Key) -> PathBuf {
        self.folder.join(format!("{key}.json"))
    }

    /// The timing of a key, if there is one that can be read.
    pub fn get(&self, key: &Key) -> Option<Timing> {
        let text = std::fs::read(self.file(key)).ok()?;
        serde_json::from_slice(&text).ok()
    }

    /// Keeps a timing.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn put(&self, key: &Key, timing: &Timing) -> std::io::Result<()> {
        std::fs::create_dir_all(&self.folder)?;
        let text = serde_json::to_vec(timing)?;
        let process = std::process::id();
        let beside = self.folder.join(format!("{key}.{process}.part"));
        std::fs::write(&beside, text)?;
        std::fs::rename(&beside, self.file(key))
    }

    /// Drops the oldest timings where there are more than `most`, and what was left half written.
    pub fn sweep(&self, most: usize) {
        let Ok(entries) = std::fs::read_dir(&self.folder) else {
            return;
        };
        let mut kept = Vec::new();
        for entry in entries.flatten() {
            let path = entry.path();
            let written = entry.metadata().and_then(|data| data.modified());
            let written = written.unwrap_or(SystemTime::UNIX_EPOCH);
            if path
                .extension()
                .is_some_and(|extension| extension == "json")
            {
                kept.push((written, path));
            } else if written.elapsed().is_ok_and(|age| age.as_secs() > 3600) {
                // Another process may be writing a young one.
                let _ = std::fs::remove_file(path);
            }
        }
        if kept.len() <= most {
            return;
        }
        kept.sort();
        let over = kept.len() - most + most / 4;
        for (_, path) in kept.into_iter().take(over) {
            // Another process may have been faster.
            let _ = std::fs::remove_file(path);
        }
    }
}

/// Timings that were taken on one adapter, as data: they stand in for it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recording {
    format: u32,
    /// The lodc that wrote it.
    pub version: String,
    /// The adapter, as it calls itself.
    pub adapter: String,
    /// The timings by their keys.
    pub timings: BTreeMap<Key, Timing>,
    /// On which inputs variants are not finite there, by keys of both; those that are finite on all are not here.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub bad: BTreeMap<Key, Vec<u32>>,
}

impl Recording {
    /// A recording of an adapter without timings.
    pub fn new(adapter: &str) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            adapter: adapter.to_owned(),
            timings: BTreeMap::new(),
            bad: BTreeMap::new(),
        }
    }

    /// Reads one.
    ///
    /// # Errors
    /// When the file cannot be read, or is no recording that this lodc can read.
    pub fn read(path: &Path) -> Result<Self> {
        let name = path.display();
        let text = std::fs::read_to_string(path).map_err(|error| {
            Diagnostic::error(format!("cannot read the recording `{name}`"))
                .with_reason(error)
                .with_note("`lodc X --time measured --record FILE` writes one")
        })?;
        let read: Self = serde_json::from_str(&text).map_err(|error| {
            Diagnostic::error(format!("`{name}` is no recording of times"))
                .with_reason(error)
                .with_note("`lodc X --time measured --record FILE` writes one")
        })?;
        if read.format != FORMAT {
            let format = read.format;
            return Err(Diagnostic::error(format!(
                "the recording `{name}` has format {format}, and this lodc reads {FORMAT}"
            ))
            .with_note("record it again, with `--time measured --record FILE`"));
        }
        Ok(read)
    }

    /// As JSON, with a line end at the end.
    pub fn json(&self) -> String {
        // Serialising plain data to a string cannot fail: its keys are strings.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn timing(ratio: f64) -> Timing {
        Timing::made_up(ratio, 0.01, 0.005)
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir()
            .join(format!("lodc-store-{}", std::process::id()))
            .join(name);
        let _ = std::fs::remove_dir_all(&folder);
        folder
    }

    #[test]
    fn keys_differ_where_parts_do() {
        let key = |parts: &[&str]| Key::of(parts.iter().map(|part| part.as_bytes()));
        assert_eq!(key(&["ab", "c"]), key(&["ab", "c"]));
        assert_ne!(key(&["ab", "c"]), key(&["a", "bc"]));
        assert_ne!(key(&["ab"]), key(&["ab", ""]));
    }

    #[test]
    fn what_was_kept_is_found_by_the_same_adapter() {
        let folder = folder("kept");
        let cache = Cache::new(&folder, "one");
        let key = Key::of([&b"a"[..]]);
        assert_eq!(cache.get(&key), None);
        cache.put(&key, &timing(0.5)).unwrap();
        cache.put(&key, &timing(0.25)).unwrap();
        assert_eq!(cache.get(&key), Some(timing(0.25)));
        assert_eq!(Cache::new(&folder, "two").get(&key), None);
        // A file that is cut is not there, and is written over.
        std::fs::write(cache.file(&key), b"{\"ms\": 0.").unwrap();
        assert_eq!(cache.get(&key), None);
        cache.put(&key, &timing(0.75)).unwrap();
        assert_eq!(cache.get(&key), Some(timing(0.75)));
    }

    #[test]
    fn the_oldest_go_first() {
        let cache = Cache::new(&folder("swept"), "one");
        let keys: Vec<Key> = (0..12_u8).map(|i| Key::of([&[i][..]])).collect();
        for (age, key) in keys.iter().enumerate() {
            cache.put(key, &timing(0.5)).unwrap();
            let written = SystemTime::now() - Duration::from_secs(1000 - age as u64);
            let file = std::fs::File::options()
                .write(true)
                .open(cache.file(key))
                .unwrap();
            file.set_modified(written).unwrap();
        }
        cache.sweep(12);
        assert!(keys.iter().all(|key| cache.get(key).is_some()));
        cache.sweep(8);
        let left: Vec<bool> = keys.iter().map(|key| cache.get(key).is_some()).collect();
        assert_eq!(left, (0..12).map(|i| i >= 6).collect::<Vec<_>>());
    }

    #[test]
    fn several_threads_leave_whole_timings() {
        let cache = Cache::new(&folder("threads"), "one");
        let key = Key::of([&b"a"[..]]);
        cache.put(&key, &timing(0.0)).unwrap();
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| (0..50).for_each(|_| assert!(cache.get(&key).is_some())));
            }
            // As another process would: the name beside the place has the process in it.
            scope.spawn(|| (0..50).for_each(|i| cache.put(&key, &timing(f64::from(i))).unwrap()));
        });
    }

    #[test]
    fn a_recording_reads_as_it_was_written() {
        let folder = folder("recorded");
        std::fs::create_dir_all(&folder).unwrap();
        let mut recording = Recording::new("llvmpipe");
        recording.timings.insert(Key::of([&b"a"[..]]), timing(0.5));
        let file = folder.join("a.json");
        std::fs::write(&file, recording.json()).unwrap();
        assert_eq!(Recording::read(&file).unwrap(), recording);
        for (wrong, says) in [
            ("{", "is no recording of times"),
            ("{\"format\":1}", "is no recording of times"),
            (
                "{\"format\":7,\"version\":\"\",\"adapter\":\"\",\"timings\":{}}",
                "has format 7",
            ),
        ] {
            std::fs::write(&file, wrong).unwrap();
            let error = Recording::read(&file).unwrap_err();
            assert!(error.message.contains(says), "{error}");
            assert!(!error.notes.is_empty(), "{error}");
        }
        assert!(Recording::read(&folder.join("b.json")).is_err());
    }
}
