//! Emission: the author's shader and its levels become files.
//!
//! ```text
//! text + module + [EmitLevel] --splice--> one WGSL text that chooses by autoLOD
//!                             --files---> one WGSL text a level
//! WGSL text --targets--> SPIR-V, GLSL, HLSL, MSL
//! base + Lock --replay--> [EmitLevel]
//! ```
//!
//! The author's WGSL text stays as it is; level 0 is that text. A source of several files is written as one first. Everything here is a function of its arguments,
//! and [`write_atomically`] is the only thing that touches the disk.

mod alone;
mod body;
mod composed;
pub(crate) mod control;
mod generated;
mod level;
mod lines;
mod lock;
mod parameters;
mod per_pixel;
mod print;
pub(crate) mod rust;
mod says;
mod source;
mod splice;
pub(crate) mod targets;
mod tidy;
pub(crate) mod tokens;
mod transition;
mod varyings;
mod vertex;
mod write;

#[cfg(test)]
mod tests;

use generated::Settled;
pub(crate) use generated::settled;
pub use generated::{GeneratedTexture, generated_textures};
pub use lock::{
    FORMAT, Lock, LockedFile, LockedGenerated, LockedLevel, LockedMesh, LockedModules,
    LockedSource, LockedTexture, Survivors, figure,
};
pub use says::says;
#[cfg(feature = "search")]
pub(crate) use transition::band_end;
pub use varyings::shared_locations;
pub use write::{writable, write_atomically};

use crate::front::{Source, Stages};
use crate::{Diagnostic, Result};
use lodc_passes::Shader;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// How a level is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Form {
    /// By a pipeline constant. Asks nothing of the host; WGSL alone carries it.
    #[default]
    Override,
    /// By a uniform buffer, which costs a binding.
    Uniform,
    /// By the host, which loads one file a level.
    Files,
}

/// The language that is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Target {
    /// WGSL.
    #[default]
    Wgsl,
    /// SPIR-V 1.0, coordinates as in the source.
    Spirv,
    /// GLSL 4.50, a file a stage.
    Glsl,
    /// HLSL, shader model 6.0.
    Hlsl,
    /// The Metal shading language, 2.1.
    Msl,
}

impl Form {
    /// Its name on the command line and in the lock.
    pub fn name(self) -> &'static str {
        match self {
            Self::Override => "override",
            Self::Uniform => "uniform",
            Self::Files => "files",
        }
    }
}

impl Target {
    /// Its name on the command line and in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wgsl => "wgsl",
            Self::Spirv => "spirv",
            Self::Glsl => "glsl",
            Self::Hlsl => "hlsl",
            Self::Msl => "msl",
        }
    }
}

/// What is drawn where a level begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Transition {
    /// The level, all at once.
    #[default]
    Pop,
    /// The level before and the level, mixed.
    Blend,
    /// One of the two for each pixel, by a mask on the screen.
    Dither,
}

impl Transition {
    /// Its name on the command line, in the lock and in the report.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pop => "pop",
            Self::Blend => "blend",
            Self::Dither => "dither",
        }
    }
}

/// How wide a band is when nothing is said, in halvings of scale.
pub const BAND: f32 = 0.25;

/// What is emitted: the form, the language, and the transitions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// How a level is chosen.
    pub form: Form,
    /// The language.
    pub target: Target,
    /// What is drawn where a level begins.
    pub transition: Transition,
    /// How wide the band behind a threshold is in which two levels are drawn, in halvings of scale, above 0; a band ends
    /// where the next level begins. It means nothing where transitions pop.
    pub band: f32,
    /// How far texture coordinates go from pixel to pixel where autoLOD is 0, where each pixel chooses its level; `None`
    /// where the host does.
    pub per_pixel: Option<f32>,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            form: Form::default(),
            target: Target::default(),
            transition: Transition::default(),
            band: BAND,
            per_pixel: None,
        }
    }
}

/// A level: a variant, and from where it is used. The figures are for people.
#[derive(Clone, Debug)]
pub struct EmitLevel {
    /// The autoLOD from which it is used, above that of the level before; 0 for one that takes the place of the original.
    pub autolod: f32,
    /// The variant, in normal form.
    pub shader: Shader,
    /// The distance from the eye to the object's centre, in world units, at which `autolod` is reached.
    pub distance: f64,
    /// Root mean square error, of display values in 0..1.
    pub error: f64,
    /// Cost, as a share of the original's.
    pub cost: f64,
    /// Run time, as a share of the original's; `None` where it was not measured.
    pub time: Option<f64>,
    /// What changed, for people: lower case, without a full stop.
    pub says: String,
}

impl EmitLevel {
    /// The original, from its normal form or from something that draws the same.
    pub(crate) fn original(shader: Shader) -> Self {
        Self {
            autolod: 0.0,
            shader,
            distance: 0.0,
            error: 0.0,
            cost: 1.0,
            time: None,
            says: "the original".to_owned(),
        }
    }
}

/// Files to be written: names and contents.
pub type Files = Vec<(PathBuf, Vec<u8>)>;

/// Emits a shader with its levels, which were made from its normal form, `base`. The files come back as names, to be put
/// beside the source, and contents.
///
/// # Errors
/// As [`emit_as`].
pub fn emit(source: &Source, base: &Shader, levels: &[EmitLevel], output: Output) -> Result<Files> {
    emit_as(source, base, levels, output, &stem(source))
}

/// As [`emit`], with names that begin with `stem` in the place of the source's: that of the lock too, which
/// the text names.
///
/// # Errors
/// When the form cannot be carried by the target, the thresholds do not rise, the source declares an `autoLOD`
/// that cannot be used, or a writer has no form for something in the shader.
pub fn emit_as(
    source: &Source,
    base: &Shader,
    levels: &[EmitLevel],
    output: Output,
    stem: &str,
) -> Result<Files> {
    Ok(emitted(source, base, levels, output, stem)?.files)
}

/// What was emitted, and what a host binds to it.
pub(crate) struct Emitted {
    pub(crate) files: Files,
    /// The texts as they are read back: one, or in the form of files one a level, the nearest first.
    pub(crate) texts: Vec<Source>,
    /// The levels with their generated textures as they are in the texts.
    pub(crate) levels: Vec<EmitLevel>,
}

/// As [`emit_as`], with what it was made of.
///
/// # Errors
/// As [`emit_as`].
pub(crate) fn emitted(
    source: &Source,
    base: &Shader,
    levels: &[EmitLevel],
    output: Output,
    stem: &str,
) -> Result<Emitted> {
    check_thresholds(levels)?;
    check_band(output)?;
    let source = &*composed::composed(source)?;
    let levels = Settled::new(source, levels, output.form).levels;
    let mut files = Files::new();
    let mut texts = Vec::new();
    let mut write = |stem: String, text: String| -> Result<()> {
        let read = read_back(&text, source)?;
        files.extend(written(source, &read, &text, output.target, &stem)?);
        texts.push(read);
        Ok(())
    };
    match output.form {
        Form::Override | Form::Uniform => {
            let spliced = splice::splice(source, base, &levels, output, stem)?;
            if output.target != Target::Wgsl && spliced.by_override {
                return Err(no_override(output.target));
            }
            write(format!("{stem}.lod"), spliced.text)?;
        }
        Form::Files => {
            for at in usize::from(at_zero(&levels).0.is_some())..=levels.len() {
                let text = level_alone(source, &levels, at, stem)?;
                let number = number(&levels, at);
                write(format!("{stem}.lod{number}"), text)?;
            }
        }
    }
    Ok(Emitted {
        files,
        texts,
        levels,
    })
}

/// The shader of all levels in WGSL, as it is read back.
///
/// # Errors
/// As [`emit_as`].
#[cfg(feature = "search")]
pub(crate) fn read(
    source: &Source,
    base: &Shader,
    levels: &[EmitLevel],
    output: Output,
    stem: &str,
) -> Result<Source> {
    let source = &*composed::composed(source)?;
    let levels = &*Settled::new(source, levels, output.form).levels;
    let spliced = splice::splice(source, base, levels, output, stem)?;
    read_back(&spliced.text, source)
}

/// A text that has been read back, in a language: the names of the files begin with `stem`.
fn written(
    source: &Source,
    read: &Source,
    text: &str,
    target: Target,
    stem: &str,
) -> Result<Files> {
    let mut files = match target {
        Target::Wgsl => vec![(format!("{stem}.wgsl").into(), text.as_bytes().to_vec())],
        target => targets::write(source, read, target, stem)?,
    };
    if let Some(entry) = targets::parameter_stage(source, read) {
        let text = rust::written(source, &read.module, entry, stem)?;
        files.push((format!("{stem}.rs").into(), text.into_bytes()));
    }
    Ok(files)
}

/// One level as a shader of its own, the original being at 0 and `levels[0]` at 1: as it is read back, and the files that it is.
/// The levels are settled (see [`settled`]).
/// `stem` begins the name of the lock, and `name` those of the files.
///
/// # Errors
/// As [`emit_as`], and when there is no such level.
pub(crate) fn one_level(
    source: &Source,
    levels: &[EmitLevel],
    at: usize,
    target: Target,
    (stem, name): (&str, &str),
) -> Result<(Source, Files)> {
    let source = &*composed::composed(source)?;
    let text = level_alone(source, levels, at, stem)?;
    let read = read_back(&text, source)?;
    let files = written(source, &read, &text, target, name)?;
    Ok((read, files))
}

/// A variant as a text of its own, to be drawn and timed, and the textures that were made for it.
///
/// # Errors
/// As [`emit_as`].
#[cfg(feature = "search")]
pub(crate) fn variant(source: &Source, shader: &Shader) -> Result<(String, Vec<GeneratedTexture>)> {
    let source = &*composed::composed(source)?;
    let level = EmitLevel {
        autolod: 1.0,
        says: "a variant".to_owned(),
        ..EmitLevel::original(shader.clone())
    };
    let Settled { levels, textures } = Settled::new(source, &[level], Form::Override);
    Ok((level_alone(source, &levels, 1, "variant")?, textures))
}

/// The text of one level alone.
fn level_alone(source: &Source, levels: &[EmitLevel], at: usize, stem: &str) -> Result<String> {
    let level = at.checked_sub(1).and_then(|at| levels.get(at));
    match level {
        Some(level) => {
            let level = EmitLevel {
                shader: level.shader.alone(),
                ..level.clone()
            };
            alone::alone(source, number(levels, at), &level, stem)
        }
        None => Ok(source.text.clone()),
    }
}

/// The number of a level, the original being at 0 and `levels[0]` at 1: that is 0 when it takes the place of the original.
pub(crate) fn number(levels: &[EmitLevel], at: usize) -> usize {
    at.saturating_sub(usize::from(at_zero(levels).0.is_some()))
}

/// The level that takes the place of the original, if one does, and the others.
fn at_zero(levels: &[EmitLevel]) -> (Option<&EmitLevel>, &[EmitLevel]) {
    match levels {
        [first, rest @ ..] if first.autolod == 0.0 => (Some(first), rest),
        _ => (None, levels),
    }
}

/// Thresholds rise from above 0, so that no level hides another and NaN chooses level 0.
fn check_thresholds(levels: &[EmitLevel]) -> Result<()> {
    let mut before = 0.0;
    for (at, level) in at_zero(levels).1.iter().enumerate() {
        if !(level.autolod > before && level.autolod.is_finite()) {
            return Err(Diagnostic::error(format!(
                "level {} starts at autoLOD {}, which is not above {before}",
                at + 1,
                level.autolod
            ))
            .with_note("thresholds rise from level to level, and the first is above 0"));
        }
        before = level.autolod;
    }
    Ok(())
}

/// A band has a width, and a text in which autoLOD changes from draw to draw; what each pixel chooses is in one text.
fn check_band(output: Output) -> Result<()> {
    if let Some(scale) = output.per_pixel {
        if output.form == Form::Files {
            return Err(Diagnostic::error(
                "a file of its own has one level alone, and its pixels no choice",
            )
            .with_note("leave `--form files` out"));
        }
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(Diagnostic::error(format!(
                "texture coordinates do not go {scale} from pixel to pixel"
            ))
            .with_note("it is a number above 0"));
        }
    }
    if output.transition == Transition::Pop {
        return Ok(());
    }
    if !(output.band > 0.0 && output.band.is_finite()) {
        let error = format!("a band of {} is none", output.band);
        return Err(Diagnostic::error(error)
            .with_note("it is a width in halvings of scale, above 0, such as 0.25"));
    }
    match output.form {
        Form::Files => Err(no_band("a file of its own has one level alone")),
        Form::Override | Form::Uniform => Ok(()),
    }
}

/// Says why a text can have no bands.
pub(crate) fn no_band(reason: &str) -> Box<Diagnostic> {
    Diagnostic::error(format!("levels cannot pass into each other: {reason}")).with_note(
        "`--form uniform` chooses by a value that may change from draw to draw, as it has to; `--transition pop` asks for nothing",
    )
}

fn no_override(target: Target) -> Box<Diagnostic> {
    Diagnostic::error(format!(
        "the override form cannot be written as {}: only WGSL has pipeline constants that lodc can write",
        target.name()
    ))
    .with_note("`--form uniform` chooses a level by a uniform buffer, `--form files` writes one file a level")
}

/// Reads an emitted text as any shader is read. What fails here is a flaw of lodc's.
fn read_back(text: &str, source: &Source) -> Result<Source> {
    let stages = Stages {
        vertex: source.vertex.clone(),
        fragment: Some(source.fragment.clone()),
        vertex_file: None,
    };
    let name = format!("{} (as emitted)", source.name);
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    Source::parse_stages(&name, text, &stages).map_err(|mut error| {
        error.message = format!(
            "internal error: the emitted shader is not valid: {}",
            error.message
        );
        flaw(error, source)
    })
}

/// Says of an error that it is lodc's own.
fn flaw(error: Box<Diagnostic>, source: &Source) -> Box<Diagnostic> {
    error.with_note(format!(
        "this is a flaw of lodc: please report it with {} and its lock; nothing was written",
        file_name(source)
    ))
}

/// The file's name without folders, `brick.wgsl`.
fn file_name(source: &Source) -> String {
    Path::new(&source.name).file_name().map_or_else(
        || source.name.clone(),
        |name| name.to_string_lossy().into_owned(),
    )
}

/// The file's name without folders and extension, `brick`.
fn stem(source: &Source) -> String {
    Path::new(&source.name).file_stem().map_or_else(
        || source.name.clone(),
        |name| name.to_string_lossy().into_owned(),
    )
}
