//! Reading shaders: a WGSL or GLSL file becomes a validated naga module with its two entry points chosen.
//!
//! ```text
//! path --read--> text --parse--> Module --validate--> ModuleInfo --choose--> Source
//!        vertex file: text --parse--> Module --link--> Module of both
//! ```
//!
//! Whatever is wrong is said at its place in the user's file.

mod entry;
mod feed;
mod files;
mod glsl;
pub(crate) mod identifiers;
mod link;
mod lower;
pub(crate) mod names;
mod parse;
mod settle;
mod vertex_stage;

pub use entry::{Input, Stages, inputs};
pub use feed::Feed;
pub use files::{File, OtherFile, Place};
pub use parse::{CAPABILITIES, validate};
pub use vertex_stage::VertexStage;

use crate::{Diagnostic, Result};
use naga::valid::ModuleInfo;
use naga::{EntryPoint, GlobalVariable, Handle, Module, ShaderStage, Span};
use std::path::{Path, PathBuf};

/// A shader as the user wrote it, parsed and validated, with the entry points that lodc works on.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file's name as the user gave it.
    pub name: String,
    /// Where it was read from; `None` for a text that came from no file.
    pub path: Option<PathBuf>,
    /// Its text, which spans point into before they point into those of `others`.
    pub text: String,
    /// The other files that the module is made from.
    pub others: Vec<OtherFile>,
    /// Whether `text` is WGSL that says all of the module, so that emission keeps it as it is.
    pub verbatim: bool,
    /// The module, with everything that the file declares; of several files, what their entry points need.
    pub module: Module,
    /// What the validator found out about it.
    pub info: ModuleInfo,
    /// The name of the vertex entry point; `None` when the file has none, and lodc supplies the stage
    /// ([`VertexStage`]).
    pub vertex: Option<String>,
    /// The name of the fragment entry point.
    pub fragment: String,
}

impl Source {
    /// Reads a shader, in the language that the file's name says, with one fragment entry point and at most one
    /// vertex entry point. Of GLSL, which has a file a stage, the vertex stage is that of the file beside it that is
    /// called alike, `rock.vert` beside `rock.frag`, when there is one.
    ///
    /// # Errors
    /// When the file cannot be read, is in no language that lodc reads, is not valid, or has another number of
    /// entry points.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_stages(path, &Stages::default())
    }

    /// As [`Source::read`], with entry points chosen by name.
    ///
    /// # Errors
    /// As [`Source::read`], and when a name is not there.
    pub fn read_stages(path: &Path, stages: &Stages) -> Result<Self> {
        let name = path.display().to_string();
        // Before the extension: a folder has none, and that is not what is wrong with it.
        let text = read_text(path, "shader");
        parse::expect_known(path, &name, text.is_ok())?;
        let beside = parse::vertex_beside(path);
        let mut source = match stages.vertex_file.as_ref().or(beside.as_ref()) {
            None => Self::parse_stages(&name, text?, stages)?,
            Some(vertex) => Self::parsed(&name, text?)?.with_vertex(vertex, stages)?,
        };
        source.path = Some(path.to_owned());
        Ok(source)
    }

    /// Parses a text; `name` is what messages call it, and its extension says what language it is in: WGSL,
    /// unless it is one of GLSL.
    ///
    /// # Errors
    /// When it is not valid, or has not one fragment and at most one vertex entry point.
    pub fn parse(name: &str, text: impl Into<String>) -> Result<Self> {
        Self::parse_stages(name, text, &Stages::default())
    }

    /// As [`Source::parse`], with entry points chosen by name.
    ///
    /// # Errors
    /// As [`Source::parse`], and when a name is not there.
    pub fn parse_stages(name: &str, text: impl Into<String>, stages: &Stages) -> Result<Self> {
        let mut source = Self::parsed(name, text.into())?;
        (source.vertex, source.fragment) = entry::choose(&source, stages)?;
        Ok(source)
    }

    /// A text with no entry point chosen yet.
    fn parsed(name: &str, text: String) -> Result<Self> {
        let language = parse::language(Path::new(name)).unwrap_or_default();
        let (module, info) = parse::parse(name, &text, language)?;
        Ok(Self {
            name: name.to_owned(),
            path: None,
            text,
            others: Vec::new(),
            verbatim: language == parse::Language::Wgsl,
            module,
            info,
            vertex: None,
            fragment: String::new(),
        })
    }

    /// This source with the vertex stage of another file linked to it.
    fn with_vertex(mut self, path: &Path, stages: &Stages) -> Result<Self> {
        let name = path.display().to_string();
        let text = read_text(path, "shader");
        parse::expect_vertex(path, &name, text.is_ok())?;
        let text = text?;
        let written_in = parse::language(path).unwrap_or_default();
        let (module, _) = parse::parse(&name, &text, written_in)?;
        let wanted = stages.vertex.as_deref();
        let Some(vertex) = entry::pick(&name, &text, &module, ShaderStage::Vertex, wanted)? else {
            return Err(
                Diagnostic::error(format!("`{name}` has no vertex entry point"))
                    .with_note("name the file that has one with `--vertex-file`"),
            );
        };
        let start = self.end();
        self.others.push(OtherFile {
            name,
            path: Some(path.to_owned()),
            text,
            start,
        });
        let behind = |span: Span| match span.to_range() {
            Some(range) => Span::from(range.start + start..range.end + start),
            None => span,
        };
        let linked = link::link(&[
            link::Part {
                module: &self.module,
                wanted: &|_| true,
                place: &|span| span,
            },
            link::Part {
                module: &module,
                wanted: &|e| e.stage == ShaderStage::Vertex && e.name == vertex,
                place: &behind,
            },
        ]);
        let module = linked.map_err(|clash| self.clash(&clash))?;
        self.with_module(module, stages)
    }

    /// What two files declare differently, at the second one's place.
    fn clash(&self, clash: &link::Clash) -> Box<Diagnostic> {
        let error = self.error(
            format!("{} is declared differently in two files", clash.what),
            clash.second,
            "here",
        );
        let error = match self.place(clash.first) {
            Some(first) => error.with_reason(format!(
                "the other declaration is in {}:{}",
                first.file.name,
                first.line()
            )),
            None => error,
        };
        error.with_note("the stages are drawn together: declare it alike in both files")
    }

    /// This source with a module that was linked of several, whose vertex entry point is the last one.
    fn with_module(mut self, module: Module, stages: &Stages) -> Result<Self> {
        self.info = validate(&module).map_err(|error| {
            let spans: Vec<_> = error.spans().cloned().collect();
            let message = format!("the stages do not fit together: {}", error.as_inner());
            spans
                .iter()
                .fold(Diagnostic::error(message), |d, (span, _)| {
                    self.locate(d, *span, "here")
                })
        })?;
        self.module = module;
        self.verbatim = false;
        let last = self.module.entry_points.last();
        let vertex = last.filter(|e| e.stage == ShaderStage::Vertex);
        let chosen = Stages {
            vertex: vertex.map(|e| e.name.clone()),
            fragment: stages.fragment.clone(),
            vertex_file: None,
        };
        (self.vertex, self.fragment) = entry::choose(&self, &chosen)?;
        Ok(self)
    }

    /// The place of the fragment entry point in the module, and the entry point.
    pub fn fragment_entry(&self) -> (usize, &EntryPoint) {
        self.entry(ShaderStage::Fragment, &self.fragment)
            .expect("the fragment entry point was chosen from this module")
    }

    /// The place of the vertex entry point in the module, and the entry point, when the file has one.
    pub fn vertex_entry(&self) -> Option<(usize, &EntryPoint)> {
        self.entry(ShaderStage::Vertex, self.vertex.as_deref()?)
    }

    /// Where a variable of the module is declared: its name in the declaration.
    pub fn variable(&self, variable: Handle<GlobalVariable>) -> Span {
        let declared = self.module.global_variables.get_span(variable);
        let name = self.module.global_variables[variable].name.as_deref();
        let found = self.place(declared).and_then(|place| {
            let name = names::whole_word(place.file.text, place.range, name?)?;
            Some(place.file.span(name))
        });
        found.unwrap_or(declared)
    }

    fn entry(&self, stage: ShaderStage, name: &str) -> Option<(usize, &EntryPoint)> {
        let mut entries = self.module.entry_points.iter().enumerate();
        entries.find(|(_, e)| e.stage == stage && e.name == name)
    }

    /// An error at a place in this file.
    pub fn error(
        &self,
        message: impl Into<String>,
        span: Span,
        remark: impl Into<String>,
    ) -> Box<Diagnostic> {
        self.locate(Diagnostic::error(message), span, remark)
    }

    /// Puts a diagnostic at a place in a file of this source; without a defined span, at the main file
    /// alone. A further place goes into the same file, or is named in a note.
    pub fn locate(
        &self,
        diagnostic: Box<Diagnostic>,
        span: Span,
        remark: impl Into<String>,
    ) -> Box<Diagnostic> {
        let remark = remark.into();
        let Some(place) = self.place(span) else {
            return match diagnostic.source {
                Some(_) => diagnostic,
                None => diagnostic.with_source(&self.name, &self.text),
            };
        };
        let elsewhere = match &diagnostic.source {
            Some((name, _)) if !diagnostic.labels.is_empty() => name != place.file.name,
            _ => false,
        };
        if elsewhere {
            let line = place.line();
            return diagnostic.with_reason(format!("{remark}: {}:{line}", place.file.name));
        }
        diagnostic
            .with_source(place.file.name, place.file.text)
            .with_label(place.range, remark)
    }
}

/// Reads a text file that the user named. `kind` says what it should be: `shader`, `scene`.
///
/// # Errors
/// When it is not there, a folder, not readable, or not text.
pub fn read_text(path: &Path, kind: &str) -> Result<String> {
    let name = path.display();
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(_) if path.is_dir() => {
            return Err(
                Diagnostic::error(format!("`{name}` is a folder, not a {kind} file"))
                    .with_note(format!("name a {kind} file in it")),
            );
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let missing = Diagnostic::error(format!("there is no {kind} file `{name}`"));
            return Err(match similar_file(path) {
                Some(near) => missing.with_note(format!("there is a `{near}` beside it")),
                None => {
                    missing.with_note("check the path, which is relative to the current folder")
                }
            });
        }
        Err(error) => {
            return Err(Diagnostic::error(format!(
                "cannot read the {kind} file `{name}`: {error}"
            )));
        }
    };
    if bytes.starts_with(&[3, 2, 35, 7]) || bytes.starts_with(&[7, 35, 2, 3]) {
        return Err(Diagnostic::error(format!("`{name}` is a SPIR-V binary"))
            .with_note("this build reads WGSL and GLSL text"));
    }
    match String::from_utf8(bytes) {
        Ok(text) if text.contains('\0') => Err(Diagnostic::error(format!(
            "`{name}` is a binary file, not a {kind}: it has a zero byte at {}",
            text.find('\0').unwrap_or_default()
        ))),
        Ok(text) => Ok(match text.strip_prefix('\u{feff}') {
            Some(rest) => rest.to_owned(),
            None => text,
        }),
        Err(error) => Err(Diagnostic::error(format!(
            "`{name}` is not text: byte {} is not UTF-8",
            error.utf8_error().valid_up_to()
        ))
        .with_note(format!("a {kind} is a text file in UTF-8"))),
    }
}

/// The name of a file in the same folder that the user may have meant.
pub(crate) fn similar_file(path: &Path) -> Option<String> {
    let wanted = path.file_name()?.to_str()?;
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .ok()?
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    names.sort();
    let near = names::nearest(wanted, names.iter().map(String::as_str), 1);
    near.first().map(|name| (*name).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder of its own for a test, removed at the end.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path =
                std::env::temp_dir().join(format!("lodc-front-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
            let path = self.0.join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    const PLAIN: &[u8] = b"@fragment fn fs() -> @location(0) vec4f { return vec4f(1.0); }";

    #[test]
    fn a_file_is_read() {
        let folder = Folder::new("read");
        let path = folder.write("a.wgsl", PLAIN);
        let source = Source::read(&path).unwrap();
        assert_eq!(source.path.as_deref(), Some(path.as_path()));
        assert_eq!(source.fragment, "fs");
        // An editor's byte order mark is no part of the text.
        let marked = [b"\xef\xbb\xbf".as_slice(), PLAIN].concat();
        assert_eq!(
            Source::read(&folder.write("b.wgsl", &marked))
                .unwrap()
                .text
                .as_bytes(),
            PLAIN
        );
    }

    #[test]
    fn what_is_no_shader_file_is_said() {
        let folder = Folder::new("bad");
        let bad = |name: &str, bytes: &[u8]| Source::read(&folder.write(name, bytes)).unwrap_err();
        for (error, part) in [
            (
                Source::read(&folder.0).unwrap_err(),
                "is a folder, not a shader file",
            ),
            (
                Source::read(&folder.0.join("x.wgsl")).unwrap_err(),
                "there is no shader file",
            ),
            (bad("empty.wgsl", b""), "is empty"),
            (bad("zero.wgsl", b"fn a\0"), "is a binary file"),
            (
                bad("latin.wgsl", b"fn a \xff\xfe"),
                "is not text: byte 5 is not UTF-8",
            ),
            (
                bad("a.spv.wgsl", &[3, 2, 35, 7, 0, 0]),
                "is a SPIR-V binary",
            ),
            (
                bad("a.hlsl", PLAIN),
                "is HLSL, which this build does not read",
            ),
            (bad("a.txt", PLAIN), "is not a shader that lodc reads"),
        ] {
            assert!(error.message.contains(part), "{error}");
        }
    }

    const VERTEX: &[u8] = b"struct V { @builtin(position) p: vec4f, @location(0) uv: vec2f }
        @group(0) @binding(0) var<uniform> camera: mat4x4f;
        @vertex fn main(@location(0) at: vec3f) -> V { return V(camera * vec4f(at, 1.0), at.xy); }";

    fn two_files(folder: &Folder, fragment: &[u8]) -> Result<Source> {
        let stages = Stages {
            vertex_file: Some(folder.write("v.wgsl", VERTEX)),
            ..Stages::default()
        };
        Source::read_stages(&folder.write("f.wgsl", fragment), &stages)
    }

    #[test]
    fn a_vertex_file_is_linked_and_its_places_are_in_it() {
        let folder = Folder::new("vertex");
        let source = two_files(
            &folder,
            b"@fragment fn main(@location(0) uv: vec2f) -> @location(0) vec4f { return uv.xyxy; }",
        )
        .unwrap();
        assert_eq!(source.vertex.as_deref(), Some("main_vertex"));
        assert_eq!(source.fragment, "main");
        assert!(!source.verbatim);
        let (camera, _) = source.module.global_variables.iter().next().unwrap();
        let place = source.place(source.variable(camera)).unwrap();
        assert!(place.file.name.ends_with("v.wgsl"));
        assert_eq!(&place.file.text[place.range.clone()], "camera");
        assert_eq!(place.line(), 2);
        let (entry, _) = source.vertex_entry().unwrap();
        let at = source.place(inputs(&source, entry)[0].span);
        // Its entry point is called otherwise in its file, so that its arguments are not found there.
        assert!(at.is_none());
    }

    #[test]
    fn stages_in_two_files_must_fit() {
        let folder = Folder::new("unfit");
        let error = two_files(
            &folder,
            b"@group(0) @binding(0) var<uniform> tint: vec4f;
            @fragment fn fs() -> @location(0) vec4f { return tint; }",
        )
        .unwrap_err();
        assert!(
            error
                .message
                .contains("`@group(0) @binding(0)` is declared differently"),
            "{error}"
        );
        let shown = error.to_string();
        assert!(
            shown.contains("v.wgsl:2:") && shown.contains("f.wgsl:1"),
            "{shown}"
        );
        let error = two_files(
            &folder,
            b"@fragment fn fs(@location(3) n: vec3f) -> @location(0) vec4f { return n.xyzz; }",
        )
        .unwrap_err();
        assert!(
            error
                .message
                .contains("at location 3, which `main` does not write"),
            "{error}"
        );
        let missing = Stages {
            vertex: Some("vs".to_owned()),
            vertex_file: Some(folder.0.join("v.wgsl")),
            ..Stages::default()
        };
        let error = Source::read_stages(&folder.0.join("f.wgsl"), &missing).unwrap_err();
        assert!(
            error.message.contains("no vertex entry point `vs`"),
            "{error}"
        );
    }

    #[test]
    fn a_misspelt_file_name_is_found() {
        let folder = Folder::new("near");
        folder.write("brick.wgsl", PLAIN);
        let error = Source::read(&folder.0.join("brik.wgsl")).unwrap_err();
        assert_eq!(error.notes, ["there is a `brick.wgsl` beside it"]);
    }
}
