//! Reading shaders: a WGSL or GLSL file becomes a validated naga module with its two entry points chosen.
//!
//! ```text
//! path --read--> text --parse--> Module --validate--> ModuleInfo --choose--> Source
//!        vertex file: text --parse--> Module --link--> Module of both
//!        with #import: text --compose--> Module --link, demangle--> Module
//! ```
//!
//! Whatever is wrong is said at its place in the user's file.

pub(crate) mod digest;
mod entry;
mod feed;
mod files;
pub(crate) mod filled;
mod glsl;
pub(crate) mod identifiers;
#[cfg(feature = "imports")]
mod imports;
mod link;
mod lower;
mod modules;
pub(crate) mod names;
mod parse;
pub(crate) mod settle;
pub(crate) mod used;
mod vertex_stage;

pub use entry::{Input, Stages, inputs};
pub use feed::Feed;
pub use files::{File, OtherFile, Place};
pub use modules::{Definition, Modules, Value};
pub use parse::{CAPABILITIES, validate};
pub use vertex_stage::VertexStage;

use crate::{Diagnostic, Result};
use naga::valid::ModuleInfo;
use naga::{EntryPoint, GlobalVariable, Handle, Module, ShaderStage, Span};
use parse::Language;
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

    /// As [`Source::read`], with entry points chosen by name, and the vertex stage from another file.
    ///
    /// # Errors
    /// As [`Source::read`], and when a name is not there.
    pub fn read_stages(path: &Path, stages: &Stages) -> Result<Self> {
        Self::read_with(path, stages, &Modules::default())
    }

    /// As [`Source::read_stages`], with modules that the files may import.
    ///
    /// # Errors
    /// As [`Source::read_stages`], and when a module is not found or is wrong.
    pub fn read_with(path: &Path, stages: &Stages, modules: &Modules) -> Result<Self> {
        let main = Text::read(path, parse::expect_known)?;
        let beside = parse::vertex_beside(path);
        let vertex = stages.vertex_file.as_ref().or(beside.as_ref());
        let vertex = vertex.map(|path| Text::read(path, parse::expect_vertex));
        let vertex = vertex.transpose()?;
        Self::of_texts(main, vertex, stages, modules)
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
        let main = Text {
            name: name.to_owned(),
            path: None,
            text: text.into(),
        };
        Self::of_texts(main, None, stages, &Modules::default())
    }

    fn of_texts(
        main: Text,
        vertex: Option<Text>,
        stages: &Stages,
        modules: &Modules,
    ) -> Result<Self> {
        let parsed = main.parse()?;
        let mut source = Self {
            verbatim: main.language() == Language::Wgsl,
            name: main.name,
            path: main.path,
            text: main.text,
            others: Vec::new(),
            module: Module::default(),
            info: ModuleInfo::default(),
            vertex: None,
            fragment: String::new(),
        };
        let vertex = match vertex {
            Some(text) => {
                let parsed = text.parse()?;
                let start = source.end();
                source.others.push(OtherFile {
                    name: text.name,
                    path: text.path,
                    text: text.text,
                    start,
                });
                Some(parsed)
            }
            None => None,
        };
        match (parsed, vertex) {
            (Some((module, info)), None) => {
                (source.module, source.info) = (module, info);
                (source.vertex, source.fragment) = entry::choose(&source, stages)?;
                Ok(source)
            }
            (main, vertex) => source.linked(main, vertex, stages, modules),
        }
    }

    /// This source with its module linked of what its files were parsed to; what is `None` within is composed.
    fn linked(
        mut self,
        main: Parsed,
        vertex: Option<Parsed>,
        stages: &Stages,
        modules: &Modules,
    ) -> Result<Self> {
        self.verbatim = false;
        let has_vertex = vertex.is_some();
        let parsed = std::iter::once(main).chain(vertex);
        let parsed: Vec<Option<Module>> = parsed.map(|p| Some(p?.0)).collect();
        let parts = self.parts(parsed, modules)?;
        let wanted = match parts.get(1) {
            Some((module, _)) if has_vertex => {
                let file = &self.others[0];
                let wanted = stages.vertex.as_deref();
                let stage = ShaderStage::Vertex;
                let found = entry::pick(&file.name, &file.text, module, stage, wanted)?;
                Some(found.ok_or_else(|| {
                    Diagnostic::error(format!("`{}` has no vertex entry point", file.name))
                        .with_note("name the file that has one with `--vertex-file`")
                })?)
            }
            _ => None,
        };
        let is_wanted =
            |e: &EntryPoint| e.stage == ShaderStage::Vertex && Some(&e.name) == wanted.as_ref();
        let linked: Vec<link::Part<'_>> = parts
            .iter()
            .enumerate()
            .map(|(at, (module, place))| link::Part {
                module,
                wanted: if at == 0 { &|_| true } else { &is_wanted },
                place,
            })
            .collect();
        let module = link::link(&linked).map_err(|clash| self.clash(&clash))?;
        #[cfg(feature = "imports")]
        let module = imports::demangled(module);
        self.info = validate(&module).map_err(|error| parse::invalid(&self, &error))?;
        self.module = module;
        let mut stages = stages.clone();
        if has_vertex {
            // The linked one comes last, whatever it is called by now.
            stages.vertex = self.module.entry_points.last().map(|e| e.name.clone());
        }
        (self.vertex, self.fragment) = entry::choose(&self, &stages)?;
        Ok(self)
    }

    /// The modules of this source's files, each with where its spans lie.
    fn parts(&mut self, parsed: Vec<Option<Module>>, modules: &Modules) -> Result<Vec<Part>> {
        #[cfg(feature = "imports")]
        let mut composed = self.composed(&parsed, modules)?.into_iter();
        #[cfg(not(feature = "imports"))]
        let _ = modules;
        let starts: Vec<usize> = self.files().map(|file| file.start).collect();
        let parts = parsed.into_iter().zip(starts).map(|(module, start)| {
            if let Some(module) = module {
                let place = move |span: Span| match span.to_range() {
                    Some(range) => Span::from(range.start + start..range.end + start),
                    None => span,
                };
                return Some((module, Box::new(place) as Box<dyn Fn(Span) -> Span>));
            }
            #[cfg(feature = "imports")]
            {
                let composed = composed.next()?;
                let (module, spans) = (composed.module, composed.spans);
                Some((module, Box::new(move |span| spans.place(span)) as _))
            }
            #[cfg(not(feature = "imports"))]
            None
        });
        Ok(parts.flatten().collect())
    }

    /// Composes those of this source's files that naga did not parse as they are.
    #[cfg(feature = "imports")]
    fn composed(
        &mut self,
        parsed: &[Option<Module>],
        modules: &Modules,
    ) -> Result<Vec<imports::Composed>> {
        let paths = std::iter::once(self.path.as_deref())
            .chain(self.others.iter().map(|other| other.path.as_deref()));
        let mains: Vec<imports::Main<'_>> = self
            .files()
            .zip(paths)
            .zip(parsed)
            .filter(|(_, module)| module.is_none())
            .map(|((file, path), _)| imports::Main {
                name: file.name,
                path,
                text: file.text,
                start: file.start,
            })
            .collect();
        let (composed, files) = match mains.is_empty() {
            true => return Ok(Vec::new()),
            false => imports::compose(&mains, modules, self.end())?,
        };
        self.others.extend(files);
        Ok(composed)
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

/// A module, and where its spans lie in a source.
type Part = (Module, Box<dyn Fn(Span) -> Span>);

/// A parsed text; `None` when it has to be composed.
type Parsed = Option<(Module, ModuleInfo)>;

/// A text of a shader.
struct Text {
    name: String,
    path: Option<PathBuf>,
    text: String,
}

impl Text {
    /// Reads a file of a shader; `expect` refuses those that are none by their names.
    fn read(path: &Path, expect: fn(&Path, &str, bool) -> Result<()>) -> Result<Self> {
        let name = path.display().to_string();
        // Before the extension: a folder has none, and that is not what is wrong with it.
        let text = read_text(path, "shader");
        expect(path, &name, text.is_ok())?;
        Ok(Self {
            name,
            path: Some(path.to_owned()),
            text: text?,
        })
    }

    fn language(&self) -> Language {
        parse::language(Path::new(&self.name)).unwrap_or_default()
    }

    fn parse(&self) -> Result<Parsed> {
        match parse::parse(&self.name, &self.text, self.language()) {
            Ok(parsed) => Ok(Some(parsed)),
            // A directive in a comment is none: only what naga refuses is composed.
            Err(_)
                if cfg!(feature = "imports")
                    && self.language() == Language::Wgsl
                    && modules::directive(&self.text).is_some() =>
            {
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

/// The hash of a file's contents, as locks and reports hold it: `blake3:` and 64 hexadecimal digits.
pub fn hash(bytes: &[u8]) -> String {
    format!("blake3:{}", digest::digest(bytes))
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
