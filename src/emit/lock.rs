//! The lock: all that decides the emitted shader, as a TOML file that a person can read and commit.
//!
//! ```text
//! search --> Lock --to_toml--> rock.lod.toml --parse--> Lock --replay--> [EmitLevel] --emit--> files
//! ```
//!
//! Numbers that a recipe bakes are there twice: as decimals for people, and as the bits of an f32 in
//! hexadecimal. The bits decide.

use super::{EmitLevel, Output, Transition};
use crate::front::{Definition, read_text};
use crate::{Diagnostic, Result};
use lodc_passes::autolod::BoundReading;
use lodc_passes::{Candidate, Goal, Recipe, ReplayError, Shader};
use serde::Deserialize;
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;

/// The format that this lodc writes, and the newest that it reads.
pub const FORMAT: u32 = 1;

/// A result that can be made again without searching.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Lock {
    /// The shader that it was made from.
    pub source: LockedSource,
    /// What it was composed with.
    pub modules: LockedModules,
    /// The scene file that errors were measured over; `None` when there was none, and all was inferred.
    pub scene: Option<LockedFile>,
    /// The full-screen shader that lit the material in a deferred scene.
    pub lighting: Option<LockedFile>,
    /// Every texture whose texels went into a number of a recipe.
    pub textures: Vec<LockedTexture>,
    /// Every texture that was made for levels.
    pub generated: Vec<LockedGenerated>,
    /// The file of the meshes that were made for levels; `None` where all have the scene's own.
    pub meshes: Option<LockedFile>,
    /// From where on each of its meshes is used, nearest first; the first is the original.
    pub mesh: Vec<LockedMesh>,
    /// What is emitted.
    pub output: Output,
    /// How errors were held against the bound.
    pub bound: BoundReading,
    /// What the levels were to use less of.
    pub goal: Goal,
    /// The seed of everything that was drawn at random, below 2^63 (TOML has no larger integers).
    pub seed: u64,
    /// Pixels on screen per object unit at the nearest distance, where autoLOD is 0.
    pub rho0: f64,
    /// The adapters that the levels were timed on; none where times are estimated.
    pub timed_on: Vec<String>,
    /// What costs no error: done to the original before the recipe of every level.
    pub exact: Recipe,
    /// The levels, nearest first: those below the original, and one at autoLOD 0 where something takes its place.
    pub levels: Vec<LockedLevel>,
}

/// The shader of a lock.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct LockedSource {
    /// The file, relative to the lock.
    pub file: String,
    /// The fingerprint of its normal form ([`lodc_passes::Fingerprint`]); the lock is stale when it differs.
    pub normal_form: String,
    /// The vertex entry point, by its name in its file; `None` when there is none, or no need to choose one.
    pub vertex: Option<String>,
    /// The file of the vertex entry point, relative to the lock, where it is another one.
    pub vertex_file: Option<String>,
    /// The fragment entry point.
    pub fragment: String,
}

/// The module folders and shader defs of a lock.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LockedModules {
    /// The folders, relative to the lock.
    pub folders: Vec<String>,
    /// The shader defs, in order.
    pub definitions: Vec<Definition>,
}

/// A file of a lock.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct LockedFile {
    /// The file, relative to the lock.
    pub file: String,
    /// Its contents, as [`crate::front::hash`] gives them.
    pub hash: String,
}

/// A texture of a lock.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct LockedTexture {
    /// The variable in the shader.
    pub name: String,
    /// The file, relative to the lock.
    pub file: String,
    /// Its contents, as [`crate::front::hash`] gives them.
    pub hash: String,
    /// Texels per pixel where autoLOD is 0, when it is known.
    pub texels_per_pixel: Option<f64>,
}

/// A texture of a lock that was made for levels.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LockedGenerated {
    /// The variable in the shader.
    pub name: String,
    /// The file, in the folder that has the lock's name.
    pub file: String,
    /// Its contents, as [`crate::front::hash`] gives them.
    pub hash: String,
    /// How its texels are stored, as WebGPU calls it.
    pub format: String,
    /// Width and height in texels.
    pub size: [u32; 2],
    /// How many layers it has, of an array.
    #[serde(default)]
    pub layers: Option<u32>,
    /// How many MIP levels it has.
    pub levels: u32,
}

/// A mesh of a lock.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct LockedMesh {
    /// Which level of the file it is, from 0.
    pub level: usize,
    /// The autoLOD from which it is used.
    pub autolod: f32,
    /// The distance at which that is reached, in world units.
    pub distance: f64,
    /// How many triangles it has.
    pub triangles: usize,
}

/// A level of a lock.
#[derive(Clone, Debug, PartialEq)]
pub struct LockedLevel {
    /// The autoLOD from which it is used.
    pub autolod: f32,
    /// The distance at which that is reached, in world units.
    pub distance: f64,
    /// Root mean square error, of display values in 0..1.
    pub error: f64,
    /// The error of the original itself.
    pub floor: f64,
    /// How much more than the original's the error may be.
    pub bound: f64,
    /// Cost, as a share of the original's.
    pub cost: f64,
    /// Run time, as a share of the original's, on the adapter that the lock names, or where it is worst of several; `None`
    /// where it was not measured.
    pub time: Option<f64>,
    /// What is paid in the band behind `autolod`, where the level before is drawn too, as a share of the original's
    /// time; `None` without a band, or when it is not known.
    pub band_cost: Option<f64>,
    /// What changed, for people.
    pub says: String,
    /// What is done to the original, after what is exact.
    pub recipe: Recipe,
}

/// A figure for people, rounded to four significant digits. The figures of a lock are made with it, so that
/// they are short, and the same in every place that shows them.
pub fn figure(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

impl Lock {
    /// The lock as text. Reading it gives the same lock.
    pub fn to_toml(&self) -> String {
        let mut out = format!(
            "# Made by lodc. Commit it: the levels of {} are made from this file.\n",
            self.source.file.replace(['\n', '\r'], " ")
        );
        let mut line = |text: String| {
            out.push_str(&text);
            out.push('\n');
        };
        line(format!("format = {FORMAT}"));
        let source = &self.source;
        let optional = |key: &str, value: &Option<String>| {
            let value = value.as_ref();
            value.map_or_else(String::new, |v| format!(", {key} = {}", string(v)))
        };
        let vertex = optional("vertex", &source.vertex);
        let vertex_file = optional("vertex_file", &source.vertex_file);
        line(format!(
            "source = {{ file = {}, normal_form = {}{vertex}{vertex_file}, fragment = {} }}",
            string(&source.file),
            string(&source.normal_form),
            string(&source.fragment)
        ));
        let modules = &self.modules;
        if *modules != LockedModules::default() {
            let folders: Vec<String> = modules.folders.iter().map(|f| string(f)).collect();
            let definitions = modules.definitions.iter();
            let definitions: Vec<String> = definitions.map(|d| string(&d.to_string())).collect();
            line(format!(
                "modules = {{ folders = [{}], definitions = [{}] }}",
                folders.join(", "),
                definitions.join(", ")
            ));
        }
        for (key, file) in [
            ("scene", &self.scene),
            ("lighting", &self.lighting),
            ("meshes", &self.meshes),
        ] {
            if let Some(file) = file {
                line(format!(
                    "{key} = {{ file = {}, hash = {} }}",
                    string(&file.file),
                    string(&file.hash)
                ));
            }
        }
        let output = &self.output;
        let transition = match output.transition {
            Transition::Pop => String::new(),
            transition => format!(
                ", transition = {}, band = {:?}",
                string(transition.name()),
                output.band
            ),
        };
        let per_pixel = output.per_pixel;
        let per_pixel = per_pixel.map_or_else(String::new, |at| format!(", per_pixel = {at:?}"));
        line(format!(
            "output = {{ form = {}, target = {}{transition}{per_pixel} }}",
            string(output.form.name()),
            string(output.target.name())
        ));
        // The usual one is not said.
        if self.bound != BoundReading::default() {
            line(format!("bound = {}", string(self.bound.name())));
        }
        if self.goal != Goal::default() {
            line(format!("goal = {}", string(&self.goal.to_string())));
        }
        line(format!("seed = {}", self.seed));
        line(format!("rho0 = {}", number(self.rho0)));
        if !self.timed_on.is_empty() {
            let adapters: Vec<String> = self.timed_on.iter().map(|name| string(name)).collect();
            line(format!("timed_on = [{}]", adapters.join(", ")));
        }
        if !self.textures.is_empty() {
            line("textures = [".to_owned());
            for texture in &self.textures {
                let scale = texture.texels_per_pixel.map_or(String::new(), |x| {
                    format!(", texels_per_pixel = {}", number(x))
                });
                line(format!(
                    "  {{ name = {}, file = {}, hash = {}{scale} }},",
                    string(&texture.name),
                    string(&texture.file),
                    string(&texture.hash)
                ));
            }
            line("]".to_owned());
        }
        if !self.generated.is_empty() {
            line("generated = [".to_owned());
            for texture in &self.generated {
                let [width, height] = texture.size;
                let layers = texture.layers.map(|count| format!(" layers = {count},"));
                let layers = layers.unwrap_or_default();
                line(format!(
                    "  {{ name = {}, file = {}, hash = {}, format = {}, size = [{width}, {height}],{layers} levels = {} }},",
                    string(&texture.name),
                    string(&texture.file),
                    string(&texture.hash),
                    string(&texture.format),
                    texture.levels
                ));
            }
            line("]".to_owned());
        }
        if !self.exact.0.is_empty() {
            line("exact = [".to_owned());
            for candidate in &self.exact.0 {
                line(format!("  {},", step(candidate)));
            }
            line("]".to_owned());
        }
        for mesh in &self.mesh {
            line(String::new());
            line("[[mesh]]".to_owned());
            line(format!("level = {}", mesh.level));
            line(format!("autolod = {:?}", mesh.autolod));
            line(format!("distance = {}", number(mesh.distance)));
            line(format!("triangles = {}", mesh.triangles));
        }
        for level in &self.levels {
            line(String::new());
            line("[[level]]".to_owned());
            line(format!("autolod = {:?}", level.autolod));
            for (key, value) in [
                ("distance", level.distance),
                ("error", level.error),
                ("floor", level.floor),
                ("bound", level.bound),
                ("cost", level.cost),
            ] {
                line(format!("{key} = {}", number(value)));
            }
            for (key, value) in [("time", level.time), ("band_cost", level.band_cost)] {
                if let Some(value) = value {
                    line(format!("{key} = {}", number(value)));
                }
            }
            line(format!("says = {}", string(&level.says)));
            line("recipe = [".to_owned());
            for candidate in &level.recipe.0 {
                line(format!("  {},", step(candidate)));
            }
            line("]".to_owned());
        }
        out
    }

    /// Reads a lock.
    ///
    /// # Errors
    /// When the file cannot be read, and as [`Lock::parse`].
    pub fn read(path: &Path) -> Result<(Self, String)> {
        if !path.exists() {
            return Err(Self::missing(path));
        }
        let text = read_text(path, "lock")?;
        Ok((Self::parse(&path.display().to_string(), &text)?, text))
    }

    /// Says that a lock is not there.
    pub(crate) fn missing(path: &Path) -> Box<Diagnostic> {
        Diagnostic::error(format!("there is no lock `{}`", path.display()))
            .with_note("make it first: run lodc on the shader, without `--locked`")
    }

    /// Reads a lock from text; `name` is what messages call the file.
    ///
    /// # Errors
    /// At its place, when it is not TOML, has an unknown or missing key, is of a newer format, bakes a number that is no f32, or has thresholds that do not rise.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let at = |message: String, span: Range<usize>, remark: &str| {
            Diagnostic::error(message)
                .with_source(name, text)
                .with_label(span, remark)
        };
        let format = read::<Format>(name, text)?.format;
        if *format.get_ref() != i64::from(FORMAT) {
            let wrong = format!("the lock has format {}", format.get_ref());
            let error = at(
                wrong,
                format.span(),
                &format!("this lodc reads format {FORMAT}"),
            );
            return Err(if *format.get_ref() > i64::from(FORMAT) {
                error.with_note("it was made by a newer lodc: update lodc, or make the lock again without `--locked`")
            } else {
                error.with_note("make the lock again without `--locked`")
            });
        }
        let raw: RawLock = read(name, text)?;
        let mut levels: Vec<LockedLevel> = Vec::new();
        for level in raw.level {
            let before = levels
                .last()
                .map_or(0.0, |level: &LockedLevel| level.autolod);
            let start = *level.autolod.get_ref();
            let is_zero = start == 0.0 && levels.is_empty();
            if !((start > before || is_zero) && start.is_finite()) {
                return Err(at(
                    format!("a level starts at autoLOD {start}"),
                    level.autolod.span(),
                    &format!("has to be above {before}"),
                )
                .with_note("thresholds rise from level to level"));
            }
            let recipe = recipe(level.recipe, &at)?;
            levels.push(LockedLevel {
                autolod: level.autolod.into_inner(),
                distance: level.distance,
                error: level.error,
                floor: level.floor,
                bound: level.bound,
                cost: level.cost,
                time: level.time,
                band_cost: level.band_cost,
                says: level.says,
                recipe,
            });
        }
        Ok(Self {
            source: LockedSource {
                file: raw.source.file,
                normal_form: raw.source.normal_form,
                vertex: raw.source.vertex,
                vertex_file: raw.source.vertex_file,
                fragment: raw.source.fragment,
            },
            modules: LockedModules {
                folders: raw.modules.folders,
                definitions: raw
                    .modules
                    .definitions
                    .iter()
                    .map(|text| {
                        let read = Definition::of_text(text.get_ref());
                        read.map_err(|error| at(error.message, text.span(), "here"))
                    })
                    .collect::<Result<_>>()?,
            },
            scene: raw.scene,
            lighting: raw.lighting,
            textures: raw.textures,
            generated: raw.generated,
            meshes: raw.meshes,
            mesh: raw.mesh,
            output: raw.output,
            bound: raw.bound,
            goal: match raw.goal {
                None => Goal::default(),
                Some(goal) => (goal.get_ref().parse())
                    .map_err(|wrong: String| at(wrong, goal.span(), "here"))?,
            },
            seed: raw.seed,
            rho0: raw.rho0,
            timed_on: raw.timed_on,
            exact: recipe(raw.exact, &at)?,
            levels,
        })
    }

    /// Makes every level again from the source's normal form. `name` and `text` are the lock as it was read,
    /// so that errors can point into it.
    ///
    /// # Errors
    /// When the source is no longer the one that the lock was made from, when a recipe names a pass that
    /// the base does not have, or a candidate no longer applies.
    pub fn replay(&self, base: &Shader, name: &str, text: &str) -> Result<Vec<EmitLevel>> {
        let now = base.fingerprint().to_string();
        if now != self.source.normal_form {
            let stale = Diagnostic::stale(format!(
                "{} has changed since it was made",
                self.source.file
            ))
            .with_source(name, text);
            let stale = match text.find(&self.source.normal_form) {
                Some(start) => stale.with_label(
                    start..start + self.source.normal_form.len(),
                    format!("the normal form is now {now}"),
                ),
                None => stale,
            };
            let stale = self.surviving(base).said(stale, name, text);
            return Err(stale.with_note(format!(
                "renew it: run `lodc {} --update`, which begins with what still applies, and commit what it writes",
                self.source.file
            )));
        }
        let fails = |failed: Box<ReplayError>, level: Option<usize>| {
            let (step, of) = (failed.step + 1, level.map(|at| self.number(at)));
            let of = of.map_or_else(|| "of what is exact".into(), |n| format!("of level {n}"));
            let pass = &failed.candidate.pass;
            if base.passes().of_name(pass).is_err() {
                let known: Vec<&str> = base.passes().all().map(|pass| pass.name()).collect();
                let error = Diagnostic::error(format!(
                    "there is no pass `{pass}`, which step {step} {of} names"
                ))
                .with_source(name, text);
                let error = match Places::of(text).place(level, failed.step) {
                    Some(span) => error.with_label(span, "here"),
                    None => error,
                };
                return error
                    .with_note(format!("the passes are {}", known.join(", ")))
                    .with_note(format!(
                        "a pass of a program's own has to be in `Request::passes`, as when the lock was made; without it, run lodc on {} again",
                        self.source.file
                    ));
            }
            let error = Diagnostic::error(format!(
                "step {step} {of} no longer applies: {}",
                failed.candidate
            ))
            .with_source(name, text);
            let error = match Places::of(text).place(level, failed.step) {
                Some(span) => error.with_label(span, failed.declined.0),
                None => error.with_reason(failed.declined.0),
            };
            let error = error.with_note(format!(
                "make the lock again: run lodc on {} without `--locked`",
                self.source.file
            ));
            Box::new(Diagnostic {
                is_stale: true,
                ..*error
            })
        };
        let start = self.exact.replay(base);
        let start = start.map_err(|failed| fails(failed, None))?;
        self.levels
            .iter()
            .enumerate()
            .map(|(at, level)| {
                let shader = level.recipe.replay_from(&start, base);
                let shader = shader.map_err(|failed| fails(failed, Some(at)))?;
                Ok(EmitLevel {
                    autolod: level.autolod,
                    shader,
                    distance: level.distance,
                    error: level.error,
                    cost: level.cost,
                    time: level.time,
                    says: level.says.clone(),
                })
            })
            .collect()
    }
}

/// What is left of a lock's recipes on another version of its source.
#[derive(Clone, Debug)]
pub struct Survivors {
    /// How many steps still apply, of what is exact and of all levels.
    pub kept: usize,
    /// How many there are in the lock.
    pub of: usize,
    /// Those of each level that do, after what is exact; the lock's order.
    pub levels: Vec<Recipe>,
    /// The others: of the level at this place in the lock, or of what is exact.
    pub lost: Vec<(Option<usize>, ReplayError)>,
    /// What each level is called: its number.
    numbers: Vec<usize>,
}

/// How many steps that no longer apply are told one by one.
const TOLD: usize = 6;

impl Survivors {
    /// Adds to a message what still applies, and where what does not is in the lock.
    fn said(&self, message: Box<Diagnostic>, name: &str, text: &str) -> Box<Diagnostic> {
        let Self { kept, of, lost, .. } = self;
        if *of == 0 {
            return message;
        }
        if lost.is_empty() {
            return message.with_reason(format!("all of its {of} steps still apply"));
        }
        let message = message.with_reason(format!(
            "{kept} of its {of} steps still apply; these do not:"
        ));
        let places = Places::of(text);
        let told = lost
            .iter()
            .take(TOLD)
            .fold(message, |message, (level, lost)| {
                let of = match level {
                    Some(level) => format!("level {}", self.numbers[*level]),
                    None => "what is exact".to_owned(),
                };
                let line = places.place(*level, lost.step);
                let line = line.map_or_else(String::new, |span| {
                    let before = &text.as_bytes()[..span.start.min(text.len())];
                    let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
                    format!(":{line}")
                });
                message.with_reason(format!("{name}{line}: {of}, {lost}"))
            });
        match lost.len().checked_sub(TOLD) {
            None | Some(0) => told,
            Some(more) => told.with_reason(format!("and {more} more")),
        }
    }
}

impl Lock {
    /// What is left of the recipes on another version of the source, whose normal form is `base`.
    pub fn surviving(&self, base: &Shader) -> Survivors {
        let exact = self.exact.surviving(base, base);
        let mut found = Survivors {
            kept: exact.recipe.0.len(),
            of: self.exact.0.len(),
            levels: Vec::new(),
            lost: exact.lost.into_iter().map(|lost| (None, lost)).collect(),
            numbers: (0..self.levels.len()).map(|at| self.number(at)).collect(),
        };
        for (at, level) in self.levels.iter().enumerate() {
            let left = level.recipe.surviving(&exact.shader, base);
            found.kept += left.recipe.0.len();
            found.of += level.recipe.0.len();
            found.levels.push(left.recipe);
            let lost = left.lost.into_iter().map(|lost| (Some(at), lost));
            found.lost.extend(lost);
        }
        found
    }

    /// The number of a level: the first is 0 when it takes the place of the original.
    fn number(&self, at: usize) -> usize {
        let first = self.levels.first();
        at + usize::from(first.is_none_or(|level| level.autolod > 0.0))
    }
}

/// A recipe as it was read.
fn recipe(steps: Vec<Spanned<RawStep>>, at: &Located<'_>) -> Result<Recipe> {
    let steps = steps.into_iter();
    let steps = steps.map(|step| step.into_inner().candidate(at));
    Ok(Recipe(steps.collect::<Result<_>>()?))
}

/// One step of a recipe as an inline table.
fn step(candidate: &Candidate) -> String {
    let mut out = format!(
        "{{ pass = {}, site = {}, choice = {}",
        string(&candidate.pass),
        string(&candidate.site.to_string()),
        string(&candidate.choice)
    );
    if !candidate.value.is_empty() {
        let decimals: Vec<String> = candidate.numbers().map(decimal).collect();
        let bits: Vec<String> = candidate
            .value
            .iter()
            .map(|bits| format!("\"{bits:08x}\""))
            .collect();
        write!(
            out,
            ", value = [{}], hex = [{}]",
            decimals.join(", "),
            bits.join(", ")
        )
        .ok();
    }
    out.push_str(" }");
    out
}

/// As [`number`], with the digits that tell an f32 from its neighbours.
fn decimal(x: f32) -> String {
    if x.is_nan() {
        "nan".to_owned()
    } else {
        format!("{x:?}")
    }
}

/// A number as TOML writes it: the shortest that reads back as the same.
fn number(x: f64) -> String {
    if x.is_nan() {
        "nan".to_owned()
    } else {
        format!("{x:?}")
    }
}

/// A text as TOML writes it.
fn string(text: &str) -> String {
    toml::Value::String(text.replace(['\n', '\r'], " ")).to_string()
}

/// Where the steps of a lock are in its text.
struct Places(Option<RawLock>);

impl Places {
    fn of(text: &str) -> Self {
        Self(toml::from_str(text).ok())
    }

    /// Where a step of a level's recipe is, or one of what is exact.
    fn place(&self, level: Option<usize>, step: usize) -> Option<Range<usize>> {
        let raw = self.0.as_ref()?;
        let recipe = match level {
            Some(level) => &raw.level.get(level)?.recipe,
            None => &raw.exact,
        };
        Some(recipe.get(step)?.span())
    }
}

fn read<T: serde::de::DeserializeOwned>(name: &str, text: &str) -> Result<T> {
    toml::from_str(text).map_err(|error| {
        let broken = Diagnostic::error(format!(
            "the lock cannot be read: {}",
            error.message().replace('\n', ", ")
        ))
        .with_source(name, text);
        let broken = match error.span() {
            Some(span) => broken.with_label(span, "here"),
            None => broken,
        };
        broken.with_note("restore it from version control, or make it again without `--locked`")
    })
}

#[derive(Deserialize)]
struct Format {
    format: Spanned<i64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLock {
    #[serde(rename = "format")]
    _format: i64,
    source: RawSource,
    #[serde(default)]
    modules: RawModules,
    scene: Option<LockedFile>,
    lighting: Option<LockedFile>,
    meshes: Option<LockedFile>,
    #[serde(default)]
    mesh: Vec<LockedMesh>,
    #[serde(default)]
    textures: Vec<LockedTexture>,
    #[serde(default)]
    generated: Vec<LockedGenerated>,
    #[serde(default)]
    output: Output,
    #[serde(default)]
    bound: BoundReading,
    goal: Option<Spanned<String>>,
    seed: u64,
    rho0: f64,
    #[serde(default)]
    timed_on: Vec<String>,
    #[serde(default)]
    exact: Vec<Spanned<RawStep>>,
    #[serde(default)]
    level: Vec<RawLevel>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSource {
    file: String,
    normal_form: String,
    vertex: Option<String>,
    vertex_file: Option<String>,
    fragment: String,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawModules {
    #[serde(default)]
    folders: Vec<String>,
    #[serde(default)]
    definitions: Vec<Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLevel {
    autolod: Spanned<f32>,
    distance: f64,
    error: f64,
    floor: f64,
    bound: f64,
    cost: f64,
    time: Option<f64>,
    band_cost: Option<f64>,
    says: String,
    recipe: Vec<Spanned<RawStep>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawStep {
    pass: String,
    site: String,
    choice: String,
    /// For people: not read.
    #[serde(default, rename = "value")]
    _value: Vec<f64>,
    #[serde(default)]
    hex: Vec<Spanned<String>>,
}

/// Makes an error at a place in the lock, with a remark.
type Located<'a> = dyn Fn(String, Range<usize>, &str) -> Box<Diagnostic> + 'a;

impl RawStep {
    fn candidate(self, at: &Located<'_>) -> Result<Candidate> {
        let value = self
            .hex
            .into_iter()
            .map(|hex| {
                let digits = hex.get_ref();
                let is_hex = digits.len() == 8 && digits.bytes().all(|b| b.is_ascii_hexdigit());
                u32::from_str_radix(digits, 16).ok().filter(|_| is_hex).ok_or_else(|| {
                    at(
                        format!("`{digits}` is not the bits of an f32"),
                        hex.span(),
                        "has to be 8 hexadecimal digits",
                    )
                    .with_note("restore the lock from version control, or make it again without `--locked`")
                })
            })
            .collect::<Result<Vec<u32>>>()?;
        Ok(Candidate {
            pass: self.pass,
            site: self.site.as_str().into(),
            choice: self.choice,
            value,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Form, Target};
    use super::*;
    use crate::front::hash;

    fn lock() -> Lock {
        let candidate = |pass: &str, site: &str, choice: &str, value: &[f32]| Candidate {
            pass: pass.into(),
            site: site.into(),
            choice: choice.into(),
            value: value.iter().map(|x| x.to_bits()).collect(),
        };
        Lock {
            source: LockedSource {
                file: "a \"quoted\" brick.wgsl".into(),
                normal_form: "00112233445566778899aabbccddeeff".into(),
                vertex: None,
                vertex_file: None,
                fragment: "fs_wall".into(),
            },
            modules: LockedModules {
                folders: vec!["../shared \"modules\"".into()],
                definitions: ["A", "B=8", "C=-1"]
                    .map(|text| Definition::of_text(text).expect("it is a shader def"))
                    .to_vec(),
            },
            scene: Some(LockedFile {
                file: "brick.toml".into(),
                hash: hash(b"scene"),
            }),
            lighting: Some(LockedFile {
                file: "lighting/deferred.wgsl".into(),
                hash: hash(b"lighting"),
            }),
            textures: vec![LockedTexture {
                name: "grime".into(),
                file: "textures/grime.png".into(),
                hash: hash(b"texture"),
                texels_per_pixel: Some(0.1),
            }],
            meshes: Some(LockedFile {
                file: "brick.lod/brick.glb".into(),
                hash: hash(b"meshes"),
            }),
            mesh: vec![LockedMesh {
                level: 1,
                autolod: 0.7,
                distance: 4.25,
                triangles: 1204,
            }],
            generated: vec![LockedGenerated {
                name: "loctx_0_grime".into(),
                file: "loctx_0_grime.ktx2".into(),
                hash: hash(b"made"),
                format: "rgba8unorm".into(),
                size: [256, 128],
                layers: Some(3),
                levels: 9,
            }],
            output: Output {
                form: Form::Uniform,
                target: Target::Spirv,
                transition: Transition::Dither,
                band: 0.3,
                per_pixel: Some(0.00123),
            },
            bound: BoundReading::Paper,
            goal: "time=1,memory=0.2".parse().expect("it is one"),
            seed: u64::from(u32::MAX) + 7,
            rho0: 211.34,
            timed_on: vec!["a \"GPU\", Vulkan".into()],
            exact: Recipe::default(),
            levels: vec![
                LockedLevel {
                    autolod: 0.1,
                    distance: 2.8,
                    error: 1.0 / 3.0,
                    floor: 1e-9,
                    bound: 0.02,
                    cost: 0.71,
                    time: Some(0.625),
                    band_cost: Some(1.68),
                    says: "größe, \"so\" it\\is".into(),
                    recipe: Recipe(vec![
                        candidate(
                            "op-removal",
                            "main.a.mul#0123456789abcdef",
                            "keep main.a.pow",
                            &[],
                        ),
                        candidate(
                            "texture-removal",
                            "main.b",
                            "seen-mean",
                            &[0.1, -0.0, 1e-40, f32::MAX],
                        ),
                    ]),
                },
                LockedLevel {
                    autolod: 4.25,
                    distance: 20.0,
                    error: 0.0,
                    floor: 0.0,
                    bound: 0.0,
                    cost: 1e300,
                    time: None,
                    band_cost: None,
                    says: String::new(),
                    recipe: Recipe::default(),
                },
            ],
        }
    }

    #[test]
    fn what_was_written_reads_the_same() {
        let mut lock = lock();
        lock.exact = Recipe(vec![lock.levels[0].recipe.0[1].clone()]);
        let text = lock.to_toml();
        assert_eq!(
            Lock::parse("brick.lod.toml", &text).expect("it reads"),
            lock,
            "{text}"
        );
        assert_eq!(Lock::parse("", &text).expect("it reads").to_toml(), text);
    }

    #[test]
    fn it_is_pleasant() {
        let text = lock().to_toml();
        for line in [
            "format = 1",
            "seed = 4294967302",
            "autolod = 0.1",
            "  { pass = \"op-removal\", site = \"main.a.mul#0123456789abcdef\", choice = \"keep main.a.pow\" },",
            "  { pass = \"texture-removal\", site = \"main.b\", choice = \"seen-mean\", \
             value = [0.1, -0.0, 1e-40, 3.4028235e38], hex = [\"3dcccccd\", \"80000000\", \"000116c2\", \"7f7fffff\"] },",
        ] {
            assert!(text.lines().any(|have| have == line), "{line}\n{text}");
        }
    }

    #[track_caller]
    fn fails(text: &str, message: &str, label: &str) {
        let error = Lock::parse("brick.lod.toml", text).expect_err("it is wrong");
        assert!(error.message.contains(message), "{error}");
        let span = error.labels.first().expect("it has a place").0.clone();
        assert!(text[span.clone()].contains(label), "{span:?} {error}");
        assert!(!error.notes.is_empty(), "{error}");
    }

    #[test]
    fn errors_have_places() {
        let good = lock().to_toml();
        fails("format = 1\nsource = { file = \n", "cannot be read", "");
        fails("format = 1000\nwhatever = true\n", "format 1000", "1000");
        fails("format = 0\n", "format 0", "0");
        fails(&good.replace("seed = ", "sead = "), "sead", "sead");
        fails(
            &good.replace("\"3dcccccd\"", "\"3dccccc\""),
            "`3dccccc` is not",
            "3dccccc",
        );
        fails(
            &good.replace("\"3dcccccd\"", "\"+dcccccd\""),
            "`+dcccccd` is not",
            "+dcccccd",
        );
        fails(
            &good.replace("autolod = 4.25", "autolod = 0.05"),
            "autoLOD 0.05",
            "0.05",
        );
        fails(
            &good.replace("autolod = 0.1", "autolod = nan"),
            "autoLOD NaN",
            "nan",
        );
        fails(
            &good.replace("\"uniform\"", "\"uniforms\""),
            "uniforms",
            "uniforms",
        );
    }

    /// The normal form of a small shader, and a lock that does nothing to it.
    fn small() -> (Shader, Lock) {
        let text = "@fragment fn main(@location(0) v: vec4f) -> @location(0) vec4f {
            let shine = pow(v.x, 3.0) * v.y;
            return vec4f(shine) + v;
        }";
        let module = naga::front::wgsl::parse_str(text).expect("it is WGSL");
        let base =
            lodc_passes::normalize(&module, None, "main", 1000).expect("it has a normal form");
        let mut lock = lock();
        lock.source.normal_form = base.fingerprint().to_string();
        lock.source.fragment = "main".into();
        for level in &mut lock.levels {
            level.recipe = Recipe::default();
        }
        (base, lock)
    }

    #[test]
    fn a_recipe_replays_as_it_was_applied() {
        let (base, mut lock) = small();
        let facts = lodc_passes::Facts::default();
        let candidate = lodc_passes::PASSES
            .iter()
            .flat_map(|pass| pass.candidates(&base, &facts))
            .next()
            .expect("there is something to simplify");
        let recipe = Recipe(vec![candidate]);
        let wanted = recipe.replay(&base).expect("it applies");
        lock.levels[1].recipe = recipe;
        let text = lock.to_toml();
        let read = Lock::parse("a.lod.toml", &text).expect("it reads");
        let levels = read
            .replay(&base, "a.lod.toml", &text)
            .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(levels[0].shader.fingerprint(), base.fingerprint());
        assert_eq!(levels[1].shader.fingerprint(), wanted.fingerprint());
        assert_ne!(levels[1].shader.fingerprint(), base.fingerprint());
        assert_eq!(
            (levels[1].autolod, &*levels[0].says),
            (4.25, "größe, \"so\" it\\is")
        );
    }

    #[test]
    fn a_stale_lock_says_how_to_renew_it() {
        let (base, mut lock) = small();
        lock.source.normal_form = "0123".into();
        let text = lock.to_toml();
        let error = lock
            .replay(&base, "a.lod.toml", &text)
            .expect_err("it is stale");
        assert!(error.message.contains("stale"), "{error}");
        assert_eq!(&text[error.labels[0].0.clone()], "0123");
        assert!(error.notes[0].contains("--update`"), "{error}");
    }

    #[test]
    fn a_step_that_no_longer_applies_is_shown() {
        let (base, mut lock) = small();
        lock.levels[1].recipe = Recipe(vec![Candidate {
            pass: "op-removal".into(),
            site: "main.gone.mul".into(),
            choice: "keep main.gone".into(),
            value: Vec::new(),
        }]);
        let text = lock.to_toml();
        let error = lock
            .replay(&base, "a.lod.toml", &text)
            .expect_err("there is no such value");
        assert!(
            error
                .message
                .contains("op-removal main.gone.mul keep main.gone"),
            "{error}"
        );
        assert!(
            text[error.labels[0].0.clone()].starts_with("{ pass"),
            "{error}"
        );
        assert!(error.render(false).contains("a.lod.toml:"), "{error}");
    }

    #[test]
    fn a_pass_that_is_not_there_is_named() {
        let (base, mut lock) = small();
        lock.levels[1].recipe = Recipe(vec![Candidate {
            pass: "no-such".into(),
            site: "main.shine".into(),
            choice: "away".into(),
            value: Vec::new(),
        }]);
        let text = lock.to_toml();
        let error = lock
            .replay(&base, "a.lod.toml", &text)
            .expect_err("there is no such pass");
        assert!(
            error.message.contains("there is no pass `no-such`"),
            "{error}"
        );
        assert!(
            text[error.labels[0].0.clone()].contains("no-such"),
            "{error}"
        );
        assert!(error.notes[1].contains("`Request::passes`"), "{error}");
    }

    #[test]
    fn figures_are_short() {
        assert_eq!(figure(0.019_023_847), 0.01902);
        assert_eq!(figure(12345.6), 12350.0);
        assert_eq!(figure(0.0), 0.0);
    }

    #[test]
    fn places_of_steps_are_found() {
        let text = lock().to_toml();
        let span = (Places::of(&text).place(Some(0), 1)).expect("it is there");
        assert!(text[span].contains("texture-removal"));
    }
}
