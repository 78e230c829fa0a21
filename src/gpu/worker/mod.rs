//! The renderer in a child process: a driver that hangs or crashes takes nothing with it.
//!
//! ```text
//! Worker --Request, as JSON--> child: `lodc gpu-worker`, which draws
//! Worker <--Answer, as JSON, and a picture's bytes-- child
//! ```
//!
//! Each message is a length of four bytes, little-endian, and so many bytes of JSON; behind an answer come a length
//! of eight bytes and as many bytes of numbers. A request says all that there is to know, so that a child that was
//! killed is replaced by the next request; what a child has read and compiled it keeps for requests that are alike.

mod parent;
mod serve;

pub use parent::{Failure, Worker};
pub use serve::serve;

use crate::Diagnostic;
use crate::diagnostic::Severity;
use crate::front::{Definition, Modules, Stages};
use crate::stability::Asked;
use crate::time::{Effort, Timing};
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};
use std::ops::Range;
use std::path::PathBuf;

/// The only argument of the child.
pub const ARGUMENT: &str = "gpu-worker";

/// A shader and its scene, by the files that they are read from: what the child draws in.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Subject {
    /// The shader's file.
    pub shader: PathBuf,
    /// The scene's file; `None` for the one beside the shader, or none.
    pub scene: Option<PathBuf>,
    /// The vertex entry point, where there are several.
    pub vertex: Option<String>,
    /// The fragment entry point, where there are several.
    pub fragment: Option<String>,
    /// The file of the vertex stage, where it is another one.
    pub vertex_file: Option<PathBuf>,
    /// Where modules that it imports are searched.
    pub folders: Vec<PathBuf>,
    /// Shader defs, as the command line has them: `NAME=VALUE`.
    definitions: Vec<String>,
}

impl Subject {
    /// A shader as the command line names it.
    pub fn new(
        shader: PathBuf,
        scene: Option<PathBuf>,
        stages: &Stages,
        modules: &Modules,
    ) -> Self {
        let definitions = modules.definitions.iter().map(ToString::to_string);
        Self {
            shader,
            scene,
            vertex: stages.vertex.clone(),
            fragment: stages.fragment.clone(),
            vertex_file: stages.vertex_file.clone(),
            folders: modules.folders.clone(),
            definitions: definitions.collect(),
        }
    }

    fn stages(&self) -> Stages {
        Stages {
            vertex: self.vertex.clone(),
            fragment: self.fragment.clone(),
            vertex_file: self.vertex_file.clone(),
        }
    }

    fn modules(&self) -> crate::Result<Modules> {
        let definitions = self.definitions.iter();
        Ok(Modules {
            folders: self.folders.clone(),
            definitions: definitions
                .map(|text| Definition::of_text(text))
                .collect::<crate::Result<_>>()?,
        })
    }
}

/// What is drawn in a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    /// WGSL with the shader's bindings, such as a level or the normal form; `None` for the shader as it is written.
    pub text: Option<String>,
    /// What `autoLOD` is, where the text has such an override constant.
    pub auto_lod: Option<f64>,
    /// The textures that were made for the text: the names of their variables, and their files. They are bound where it is
    /// timed or fed; a picture is drawn without them.
    pub made: Vec<(String, PathBuf)>,
    /// The file of the mesh that it is timed on, where that is not the scene's own.
    pub mesh: Option<PathBuf>,
}

/// Which picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// From the eye to the centre of the object's bounding sphere, world units.
    pub distance: f64,
    /// Its place among the scene's frames at that distance.
    pub frame: usize,
    /// Where in a pixel it is sampled, from the centre, in pixels.
    pub offset: [f32; 2],
    /// Fine pixels to a pixel, along each axis.
    pub grid: u32,
}

/// What a child is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Request {
    /// A part of the adapter's name; `None` for the best.
    adapter: Option<String>,
    subject: Subject,
    task: Task,
}

/// What is to be done with a subject.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Task {
    /// The adapter says what it is called; the subject is not read.
    Name,
    /// A picture is drawn.
    Draw { variant: Variant, wanted: Wanted },
    /// Variants are timed against the original.
    Time {
        variants: Vec<Variant>,
        /// As [`Wanted::distance`].
        distance: f64,
        effort: Effort,
    },
    /// Variants are given single inputs.
    Feed {
        variants: Vec<Variant>,
        asked: Asked,
    },
}

/// What it says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Answer {
    /// A picture in fine pixels; its colours and then its coverage are the numbers behind it.
    Picture { width: u32, height: u32 },
    /// What the adapter and its driver are called; no numbers are behind it.
    Name(String),
    /// What was found of each variant; no numbers are behind it.
    Timed(Vec<Result<Timing, Said>>),
    /// Whether variants can be given single inputs; for each of them and each input a number is behind it, which is not 0 where what comes
    /// out is not finite.
    Fed(bool),
    /// The device cannot, or the input is bad.
    Refused(Said),
}

/// A diagnostic on its way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Said {
    message: String,
    source: Option<(String, String)>,
    labels: Vec<(Range<usize>, String)>,
    notes: Vec<String>,
}

impl Said {
    fn of(error: Diagnostic) -> Self {
        Self {
            message: error.message,
            source: error.source,
            labels: error.labels,
            notes: error.notes,
        }
    }

    fn error(self) -> Box<Diagnostic> {
        Box::new(Diagnostic {
            severity: Severity::Error,
            message: self.message,
            source: self.source,
            labels: self.labels,
            notes: self.notes,
            is_stale: false,
        })
    }
}

/// The most bytes of a message's JSON: a shader's text is the longest thing in one.
const MOST: u32 = 1 << 28;

fn write_message(to: &mut impl Write, message: &impl Serialize) -> std::io::Result<()> {
    let json = serde_json::to_vec(message)?;
    let length = u32::try_from(json.len()).map_err(std::io::Error::other)?;
    to.write_all(&length.to_le_bytes())?;
    to.write_all(&json)
}

fn read_message<T: for<'a> Deserialize<'a>>(from: &mut impl Read) -> std::io::Result<T> {
    let mut length = [0; 4];
    from.read_exact(&mut length)?;
    let length = u32::from_le_bytes(length);
    if length > MOST {
        return Err(std::io::Error::other("a message is too long"));
    }
    let mut json = vec![0; length as usize];
    from.read_exact(&mut json)?;
    Ok(serde_json::from_slice(&json)?)
}

fn write_numbers(to: &mut impl Write, numbers: &[f32]) -> std::io::Result<()> {
    to.write_all(&(4 * numbers.len() as u64).to_le_bytes())?;
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    to.write_all(&bytes)
}

fn read_numbers(from: &mut impl Read) -> std::io::Result<Vec<f32>> {
    let mut length = [0; 8];
    from.read_exact(&mut length)?;
    let mut bytes = Vec::new();
    let length = u64::from_le_bytes(length);
    // No more is allocated than arrives.
    let read = from.take(length).read_to_end(&mut bytes)?;
    if read as u64 != length {
        return Err(std::io::ErrorKind::UnexpectedEof.into());
    }
    let words = bytes.as_chunks::<4>().0.iter();
    Ok(words.map(|word| f32::from_le_bytes(*word)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_arrive_as_they_were_sent() {
        let request = Request {
            adapter: Some("llvmpipe".to_owned()),
            subject: Subject::new(
                "a.wgsl".into(),
                None,
                &Stages::default(),
                &Modules::default(),
            ),
            task: Task::Draw {
                variant: Variant {
                    text: Some("fn é() {}".to_owned()),
                    auto_lod: Some(0.1),
                    made: vec![("loctx_0".to_owned(), "a.png".into())],
                    mesh: Some("mesh".into()),
                },
                wanted: Wanted {
                    distance: 2.5,
                    frame: 3,
                    offset: [0.1, -0.3],
                    grid: 4,
                },
            },
        };
        let mut bytes = Vec::new();
        write_message(&mut bytes, &request).unwrap();
        write_numbers(&mut bytes, &[1.0, f32::MIN_POSITIVE]).unwrap();
        let mut from = &bytes[..];
        assert_eq!(read_message::<Request>(&mut from).unwrap(), request);
        assert_eq!(read_numbers(&mut from).unwrap(), [1.0, f32::MIN_POSITIVE]);
        assert!(read_message::<Request>(&mut from).is_err());
        let mut cut = &bytes[..bytes.len() - 1];
        read_message::<Request>(&mut cut).unwrap();
        assert!(read_numbers(&mut cut).is_err());
        assert!(read_message::<Request>(&mut &[255; 8][..]).is_err());
    }
}
