//! The bytes of a model: its file, the buffers and images beside it, data in URIs, the chunk of a GLB.
//!
//! Nothing is read before its size is known, and nothing larger than [`MOST_BYTES`].

use crate::Diagnostic;
use crate::front::similar_file;
use base64::Engine;
use base64::engine::general_purpose::STANDARD_PAD_INDIFFERENT;
use std::borrow::Cow;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// The most bytes that one file of a model, or an image, may have.
pub(in crate::scene) const MOST_BYTES: u64 = 1 << 30;

/// Where a model is, and what it is called in messages.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// As the scene names it.
    pub(super) name: String,
    /// The file.
    pub(super) path: PathBuf,
}

impl Place {
    /// A file in the model's folder, from its path there. The scene names it by the same way from its own folder.
    ///
    /// Models come from strangers, and what they name is read, and copied into what is written: so a path that leads
    /// out of the folder is not followed. A scene may name any file.
    ///
    /// # Errors
    /// What is wrong with such a path.
    pub(super) fn beside(&self, path: &str) -> Result<Self, String> {
        let mut depth = 0;
        for part in Path::new(path).components() {
            depth += match part {
                Component::Normal(_) => 1,
                Component::CurDir => 0,
                Component::ParentDir => -1,
                Component::RootDir | Component::Prefix(_) => i32::MIN,
            };
            if depth < 0 {
                return Err(format!("`{path}` leads out of the model's folder"));
            }
        }
        let parent = |path: &Path| path.parent().unwrap_or(Path::new("")).to_owned();
        let name = parent(Path::new(&self.name)).join(path);
        Ok(Self {
            name: name.to_string_lossy().into_owned(),
            path: parent(&self.path).join(path),
        })
    }

    /// Reads the file; `kind` says what it is: `model`, `buffer`, `image`.
    pub(super) fn read(&self, kind: &str) -> crate::Result<Vec<u8>> {
        let name = &self.name;
        let failed = |error: std::io::Error| {
            if error.kind() != std::io::ErrorKind::NotFound {
                return Diagnostic::error(format!("cannot read the {kind} `{name}`: {error}"))
                    .with_note("check that the file may be read");
            }
            let missing = Diagnostic::error(format!("there is no {kind} `{name}`"));
            match similar_file(&self.path) {
                Some(near) => missing.with_note(format!("there is a `{near}` in that folder")),
                None => missing.with_note("paths are relative to the file that names them"),
            }
        };
        let data = std::fs::metadata(&self.path).map_err(failed)?;
        if data.is_dir() {
            return Err(
                Diagnostic::error(format!("the {kind} `{name}` is a folder"))
                    .with_note("name a file in it"),
            );
        }
        if !data.is_file() || data.len() > MOST_BYTES {
            return Err(self.too_large(kind));
        }
        let file = std::fs::File::open(&self.path).map_err(failed)?;
        let mut bytes = Vec::new();
        let read = file.take(MOST_BYTES + 1).read_to_end(&mut bytes);
        read.map_err(failed)?;
        if bytes.len() as u64 > MOST_BYTES {
            return Err(self.too_large(kind));
        }
        Ok(bytes)
    }

    fn too_large(&self, kind: &str) -> Box<Diagnostic> {
        Diagnostic::error(format!(
            "the {kind} `{}` is no plain file of at most {} MiB",
            self.name,
            MOST_BYTES >> 20
        ))
        .with_note("export a smaller one: one object, without animations")
    }
}

/// The bytes of a data URI; nothing when the URI is of another kind.
pub(super) fn of_data_uri(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let (kind, data) = uri.strip_prefix("data:")?.split_once(',')?;
    Some(match kind.ends_with(";base64") {
        true => STANDARD_PAD_INDIFFERENT
            .decode(data)
            .map_err(|error| format!("its data URI is no base64: {error}")),
        false => Err("its data URI is not written as base64".to_owned()),
    })
}

/// A path with its `%20` and such as bytes; one that is no text then is left alone.
pub(super) fn decoded(uri: &str) -> Cow<'_, str> {
    if !uri.contains('%') {
        return uri.into();
    }
    let mut bytes = Vec::new();
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let hex = |i: usize| after.get(i).and_then(|b| char::from(*b).to_digit(16));
        match (byte, hex(0), hex(1)) {
            (b'%', Some(high), Some(low)) => {
                bytes.push((high * 16 + low) as u8);
                rest = &after[2..];
            }
            _ => {
                bytes.push(byte);
                rest = after;
            }
        }
    }
    String::from_utf8(bytes).map_or(uri.into(), Cow::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_files_beside_the_model_or_data() {
        let model = Place {
            name: "models/helmet.gltf".to_owned(),
            path: "/scenes/models/helmet.gltf".into(),
        };
        let beside = |uri: &str| model.beside(&decoded(uri));
        let image = beside("maps/base%20colour.png").unwrap();
        assert_eq!(image.name, "models/maps/base colour.png");
        assert_eq!(image.path, Path::new("/scenes/models/maps/base colour.png"));
        assert!(beside("./maps/../a.png").is_ok());
        for out in ["../a.png", "maps/../../a.png", "/a.png", "%2e%2e/a.png"] {
            let error = beside(out).unwrap_err();
            assert!(
                error.ends_with("leads out of the model's folder"),
                "{error}"
            );
        }
        assert_eq!(decoded("100%.png"), "100%.png");
        assert_eq!(decoded("%ff.png"), "%ff.png");
        let data = |uri: &str| of_data_uri(uri);
        assert_eq!(
            data("data:application/octet-stream;base64,AAEC").unwrap(),
            Ok(vec![0, 1, 2])
        );
        assert_eq!(data("data:;base64,AAE").unwrap(), Ok(vec![0, 1]));
        assert!(data("data:;base64,!").unwrap().is_err());
        assert!(data("data:text/plain,abc").unwrap().is_err());
        assert!(data("helmet.bin").is_none());
    }

    #[test]
    fn files_that_cannot_be_read_are_named() {
        let place = |path: &str| Place {
            name: path.to_owned(),
            path: path.into(),
        };
        let error = place("/no/such/file.glb").read("model").unwrap_err();
        assert_eq!(error.message, "there is no model `/no/such/file.glb`");
        let error = place("/").read("model").unwrap_err();
        assert_eq!(error.message, "the model `/` is a folder");
        #[cfg(unix)]
        {
            let error = place("/dev/zero").read("model").unwrap_err();
            assert!(error.message.contains("no plain file"), "{error}");
        }
    }
}
