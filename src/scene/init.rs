//! `lodc init`: the scene of a shader written down, every inference with its reason, for a person to read and change.
//!
//! The file reads back to the scene that it was written from. What nothing tells stands in it as a commented line,
//! to be filled in.

use super::attributes::unfed;
use super::objects::Object;
use super::{Files, Instead, Missing, Output, Scene, textures};
use crate::eval::draw::Blend;
use crate::front::Source;
use crate::{Diagnostic, Result};
use std::fmt::Write;
use std::path::Path;

/// A scene file that was made from a shader and perhaps a model.
#[derive(Clone, Debug)]
pub struct Initial {
    /// The file.
    pub text: String,
    /// What is to be filled in: its name and its WGSL type. Uniforms and vertex inputs must be, textures may.
    pub missing: Vec<(String, String)>,
    /// What should be known besides.
    pub warnings: Vec<Diagnostic>,
}

/// Columns before the comment of a line.
const COMMENT: usize = 46;

/// Writes the scene of a shader down, to be put at `path`, which names in it are relative to. `object` is what a scene
/// calls it; without one it is what is drawn when nothing is said. `reading` are the tables that say how the shader is
/// read.
///
/// # Errors
/// When the object cannot be read, and as [`Scene::resolve`] for all that is not missing.
pub fn initial(
    source: &Source,
    path: &Path,
    object: Option<&str>,
    reading: &str,
) -> Result<Initial> {
    let head = match object {
        Some(name) => format!("object = {}\n", quoted(name)),
        None => String::new(),
    };
    let unfed = unfed(source);
    let mut fed = String::from("\n[attributes]\n");
    for (_, line, _) in &unfed {
        let _ = writeln!(fed, "{line}");
    }
    let attempt = |text: &str| {
        Scene::attempt(source, Some((path, text)), Instead::default(), &Files)
            .map_err(|error| unplaced(error, path))
    };
    // What is missing gets some value for a while: the rest is known then.
    let (scene, missing) = match attempt(&(head.clone() + &fed))? {
        Ok(scene) => (scene, Vec::new()),
        Err(missing) => {
            let filled: String = ["uniforms", "storage"]
                .iter()
                .map(|table| {
                    let lines = missing.iter().filter(|m| m.table == *table);
                    let lines: Vec<&str> = lines.map(|m| m.line.as_str()).collect();
                    format!("\n[{table}]\n{}\n", lines.join("\n"))
                })
                .collect();
            let name = path.display().to_string();
            let place = format!("`{name}`");
            let failed = |left: Vec<Missing>| super::buffers::missing_error(source, &place, &left);
            let scene = attempt(&(head + &filled + &fed))?.map_err(failed)?;
            (scene, missing)
        }
    };
    Ok(Writer {
        source,
        scene: &scene,
        object,
        reading,
        missing: &missing,
        unfed: &unfed,
        text: String::new(),
        open: Vec::new(),
    }
    .write())
}

/// A text as TOML has it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// An error without its place in a file that is not there yet.
fn unplaced(mut error: Box<Diagnostic>, path: &Path) -> Box<Diagnostic> {
    let name = path.display().to_string();
    if error.source.as_ref().is_some_and(|(file, _)| *file == name) {
        error.source = None;
        error.labels.clear();
    }
    error
}

struct Writer<'w> {
    source: &'w Source,
    scene: &'w Scene,
    object: Option<&'w str>,
    reading: &'w str,
    missing: &'w [Missing],
    /// Names of inputs that nothing feeds, a line for each, and its type.
    unfed: &'w [(String, String, String)],
    text: String,
    /// What is to be filled in.
    open: Vec<(String, String)>,
}

impl Writer<'_> {
    fn write(mut self) -> Initial {
        let name = Path::new(&self.source.name);
        let name = name.file_name().unwrap_or(name.as_os_str());
        let _ = writeln!(
            self.text,
            "# The scene that levels of {} are made and measured in, as `lodc init` inferred it.\n\
             # Every line may be changed, or left out: it is what is inferred then.",
            name.to_string_lossy()
        );
        self.settings();
        self.table("uniforms");
        self.table("storage");
        self.textures();
        self.samplers();
        self.attributes();
        Initial {
            text: self.text,
            missing: self.open,
            warnings: self.scene.warnings.clone(),
        }
    }

    fn line(&mut self, line: &str, comment: &str) {
        let _ = match comment {
            "" => writeln!(self.text, "{line}"),
            _ => writeln!(self.text, "{line:<COMMENT$} # {comment}"),
        };
    }

    /// A line to be filled in: it is commented.
    fn open(&mut self, what: &str, line: &str, ty: &str, why: &str) {
        self.line(&format!("# {line}"), &format!("{ty}: {why}"));
        self.open.push((what.to_owned(), ty.to_owned()));
    }

    fn title(&mut self, title: &str) {
        let _ = writeln!(self.text, "\n[{title}]");
    }

    fn settings(&mut self) {
        let scene = self.scene;
        let triangles = scene.mesh.indices.len() / 3;
        let draws = match scene.mesh.draws().len() {
            1 => "one material".to_owned(),
            n => format!("{n} materials, a draw for each"),
        };
        self.text.push('\n');
        match (self.object, scene.object) {
            (None, Object::Screen) => self.line(
                "# object",
                "none: the vertex stage reads no attributes, and makes a picture of 6 vertices",
            ),
            (Some(name), Object::Model) => self.line(
                &format!("object = {}", quoted(name)),
                &format!("{triangles} triangles, {draws}"),
            ),
            (_, object) => {
                let names: Vec<&str> = Object::ALL.iter().map(|(name, _)| *name).collect();
                self.line(
                    &format!("object = {}", quoted(object.name())),
                    &format!(
                        "or a model, .gltf, .glb, .obj or .ply; {}",
                        names.join(", ")
                    ),
                );
            }
        }
        let [width, height] = scene.resolution;
        self.line(
            &format!("resolution = [{width}, {height}]"),
            "pixels of a picture",
        );
        self.line(&format!("fov = {:?}", scene.fov), "vertical, degrees");
        self.line(
            &format!("seed = {}", scene.seed),
            "what everything random comes from",
        );
        self.line(
            &format!("e_max = {:?}", scene.e_max),
            "error that is allowed at the farthest distance, 0..1",
        );
        self.line(
            &format!("Q = {:?}", scene.q),
            "how that grows with distance: its exponent",
        );
        self.line(
            &format!("levels = {}", scene.distances.len()),
            "distances that levels are made for",
        );
        self.line(
            &format!("offsets = {}", scene.offsets),
            "places within a pixel that errors are measured at",
        );
        self.line(
            &format!("bound = \"{}\"", scene.reading.name()),
            "how the bound is read; paper: as Liang's paper does",
        );
        self.line(
            &format!(
                "host = {{ parameters = {}, textures = {} }}",
                scene.host.parameters, scene.host.textures
            ),
            "whether it fills a block of parameters once a draw, and binds textures made for levels",
        );
        self.line(
            &format!("pixels_per_degree = {:?}", scene.pixels_per_degree),
            "of the display, for FLIP",
        );
        let output = match scene.output {
            Output::Display => ("display", "linear 0..1, written to an sRGB target"),
            Output::Encoded => ("encoded", "sRGB already"),
            Output::Linear { .. } => ("linear", "light without a limit"),
        };
        self.line(&format!("output = \"{}\"", output.0), output.1);
        if let Output::Display = scene.output {
            self.line(
                "# output = \"linear\"",
                "if the shader returns light without a limit: see exposure, tone_mapping",
            );
        }

        self.blend();

        self.text.push_str(self.reading);
        self.title("distance");
        let radii = |distance: f64| {
            format!(
                "{:.1} times the radius of the object, {:.4}",
                distance / scene.sphere.radius,
                scene.sphere.radius
            )
        };
        self.line(
            &format!("nearest = {:?}", scene.nearest),
            &format!("{}: where the original is used", radii(scene.nearest)),
        );
        self.line(
            &format!("farthest = {:?}", scene.farthest),
            &format!(
                "{:.1} times: where the error may be e_max",
                scene.farthest / scene.sphere.radius
            ),
        );
        self.title("views");
        let how = match scene.object {
            Object::Plane | Object::Terrain => "spread over the side that is seen",
            Object::Screen => "all show the same",
            _ => "spread over the sphere",
        };
        self.line(&format!("count = {}", scene.views.len()), how);
    }

    /// The line that says how draws get into the picture; what a model's materials say is left to them.
    fn blend(&mut self) {
        let blended = self.scene.states.iter();
        let blended = blended.filter(|state| state.blend != Blend::Opaque).count();
        match (blended, self.scene.mesh.draws().len()) {
            (0, _) => self.line(
                "blend = \"opaque\"",
                "or alpha, premultiplied, additive: what becomes of the shader's alpha",
            ),
            (n, all) if n == all => {
                self.line("blend = \"alpha\"", "as the model's materials say");
            }
            (n, all) => self.line(
                "# blend = \"alpha\"",
                &format!("of {n} of {all} materials, as the model says; write it to say otherwise for all"),
            ),
        }
    }

    /// Uniforms or storage buffers.
    fn table(&mut self, table: &'static str) {
        let told: Vec<_> = self
            .scene
            .inferences
            .iter()
            .filter(|i| i.table == table)
            .collect();
        let missing: Vec<_> = self.missing.iter().filter(|m| m.table == table).collect();
        if told.is_empty() && missing.is_empty() {
            return;
        }
        self.title(table);
        for inference in told {
            self.line(&inference.line_to_add, &inference.reason);
        }
        for one in missing {
            self.open(&one.what, &one.line, &one.type_name, "fill in");
        }
    }

    fn textures(&mut self) {
        if self.scene.textures.is_empty() {
            return;
        }
        self.title("textures");
        for texture in &self.scene.textures {
            let mut told = self.scene.inferences.iter();
            let told = told.find(|i| i.table == "textures" && i.what == texture.name);
            if let Some(inference) = told {
                self.line(&inference.line_to_add, &inference.reason);
            } else if let Some((line, ty)) = textures::to_fill_in(self.source, &texture.name) {
                let why = "its image; dynamic without one, never averaged or removed";
                self.open(&texture.name, &line, &ty, why);
            }
        }
    }

    fn samplers(&mut self) {
        if self.scene.samplers.is_empty() {
            return;
        }
        self.title("samplers");
        for sampler in &self.scene.samplers {
            let line = format!(
                "# {} = {{ wrap = \"repeat\", filter = \"linear\" }}",
                sampler.name
            );
            let comment = match sampler.of_model {
                true => "as the model's samplers say; write it to say otherwise",
                false => "as it is when nothing is said; or clamp, mirror; nearest",
            };
            self.line(&line, comment);
        }
    }

    fn attributes(&mut self) {
        let told: Vec<_> = self
            .scene
            .inferences
            .iter()
            .filter(|i| i.table == "attributes")
            .collect();
        if told.is_empty() && self.unfed.is_empty() {
            return;
        }
        self.title("attributes");
        for inference in told {
            self.line(&inference.line_to_add, &inference.reason);
        }
        for (what, line, ty) in self.unfed {
            self.open(what, line, ty, "what feeds it");
        }
    }
}
