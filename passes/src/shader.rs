//! A [`Shader`]: a valid naga module in normal form, with a stable [`ValueId`] for every value.
//!
//! Normal form is made by [`mod@crate::normalize`] and changed only by [`crate::edit`].
//! The module holds the chosen entry points and no other function.

use crate::cost::{FLAT_WEIGHT, INTERPOLATION_WEIGHT};
use crate::flow::Findings;
use crate::generated::Generated;
use crate::interface::{self, Authors};
use crate::operands::User;
use crate::passes::Passes;
use crate::places::Places;
use naga::proc::{ResolveContext, TypeResolution};
use naga::valid::{Capabilities, ModuleInfo, ValidationError, ValidationFlags, Validator};
use naga::{EntryPoint, Expression, Function, Handle, Module, ShaderStage, TypeInner, WithSpan};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::{Arc, OnceLock};

/// The stages whose values a [`Shader`] names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// The vertex entry point.
    Vertex,
    /// The fragment entry point.
    Fragment,
    /// The compute entry point that fills the parameter block, once a draw. Only variants have it; see
    /// [`crate::parameters`].
    Parameter,
}

impl From<Stage> for ShaderStage {
    fn from(stage: Stage) -> Self {
        match stage {
            Stage::Vertex => Self::Vertex,
            Stage::Fragment => Self::Fragment,
            Stage::Parameter => Self::Compute,
        }
    }
}

/// The stable name of a value: a path from the nearest named value, such as
/// `fs_main.specular.pow`, and a hash of how the value is computed as second key.
///
/// It is the same on every run, and survives edits of unrelated lines and most renames.
/// The text form is `path` alone, or `path#hash` with the hash as 16 hexadecimal digits.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ValueId {
    path: Arc<str>,
    hash: u64,
}

impl ValueId {
    /// An id from its path and structural hash. A hash of 0 means that it is not known.
    pub fn new(path: impl Into<Arc<str>>, hash: u64) -> Self {
        Self {
            path: path.into(),
            hash,
        }
    }

    /// The readable part, `fs_main.specular.pow`.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The structural hash, 0 when it is not known.
    pub fn hash(&self) -> u64 {
        self.hash
    }
}

impl fmt::Display for ValueId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.hash == 0 {
            write!(f, "{}", self.path)
        } else {
            write!(f, "{}#{:016x}", self.path, self.hash)
        }
    }
}

impl From<&str> for ValueId {
    fn from(text: &str) -> Self {
        match text.rsplit_once('#') {
            Some((path, hash)) if hash.len() == 16 => match u64::from_str_radix(hash, 16) {
                Ok(hash) => Self::new(path, hash),
                Err(_) => Self::new(text, 0),
            },
            _ => Self::new(text, 0),
        }
    }
}

impl Serialize for ValueId {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for ValueId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = std::borrow::Cow::<str>::deserialize(deserializer)?;
        Ok(Self::from(&*text))
    }
}

/// The identity of a shader: a hash of its normal form. Names, spans and the order of unused
/// arena entries do not enter it, so two orders of the same edits count once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fingerprint(pub [u8; 16]);

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// A valid naga module in normal form, with a [`ValueId`] for every expression of its entry points.
#[derive(Clone, Debug)]
pub struct Shader {
    pub(crate) module: Module,
    /// For each entry point of `module`, the id of each expression, in arena order.
    pub(crate) ids: Vec<Vec<ValueId>>,
    /// How much of what the stages hand over is the author's.
    pub(crate) authors: Authors,
    /// The textures that passes have made, in the order in which they were made.
    pub(crate) generated: Vec<Generated>,
    /// The passes that may change it.
    pub(crate) passes: Passes,
    /// For each entry point, what was found out about its function when first asked for.
    known: Arc<Vec<Known>>,
}

/// What can be computed from a function alone.
#[derive(Debug, Default)]
struct Known {
    types: OnceLock<Vec<TypeResolution>>,
    places: OnceLock<Places>,
    findings: OnceLock<Findings>,
}

impl Shader {
    /// An author's shader from its parts: a valid module in normal form, and for each of its entry points the
    /// id of each expression.
    pub(crate) fn new(module: Module, ids: Vec<Vec<ValueId>>) -> Self {
        let authors = Authors::of(&module);
        Self::changed(module, ids, authors, Vec::new(), Passes::default())
    }

    /// A variant of an author's shader.
    pub(crate) fn changed(
        module: Module,
        ids: Vec<Vec<ValueId>>,
        authors: Authors,
        generated: Vec<Generated>,
        passes: Passes,
    ) -> Self {
        let lengths = module
            .entry_points
            .iter()
            .map(|e| e.function.expressions.len());
        assert!(
            lengths.eq(ids.iter().map(Vec::len)),
            "one id per expression"
        );
        let known = module.entry_points.iter().map(|_| Known::default());
        Self {
            known: Arc::new(known.collect()),
            module,
            ids,
            authors,
            generated,
            passes,
        }
    }

    /// The passes that may change it, and that a recipe for it may name: [`crate::PASSES`], and what a program adds.
    pub fn passes(&self) -> &Passes {
        &self.passes
    }

    /// The same shader, which these passes may change; and so may they every variant of it.
    #[must_use]
    pub fn with_passes(mut self, passes: Passes) -> Self {
        self.passes = passes;
        self
    }

    /// The module. It holds a fragment entry point, a vertex entry point or not, in a variant one that fills the parameter
    /// block, and no functions.
    pub fn module(&self) -> &Module {
        &self.module
    }

    /// The entry point of a stage; the fragment stage is always there.
    pub fn entry_point(&self, stage: Stage) -> Option<&EntryPoint> {
        self.index(stage).map(|i| &self.module.entry_points[i])
    }

    /// The function of a stage's entry point.
    pub fn function(&self, stage: Stage) -> Option<&Function> {
        self.entry_point(stage).map(|e| &e.function)
    }

    /// The place of a stage's entry point in `module().entry_points`.
    pub fn index(&self, stage: Stage) -> Option<usize> {
        let wanted = ShaderStage::from(stage);
        self.module
            .entry_points
            .iter()
            .position(|e| e.stage == wanted)
    }

    fn entry(&self, stage: Stage) -> usize {
        self.index(stage).expect("the shader has this stage")
    }

    /// The id of an expression of a stage's entry point.
    ///
    /// # Panics
    /// When the shader lacks the stage or the handle is not of its function.
    pub fn id(&self, stage: Stage, value: Handle<Expression>) -> &ValueId {
        &self.ids[self.entry(stage)][value.index()]
    }

    /// The type of an expression of a stage's entry point.
    ///
    /// # Panics
    /// When the shader lacks the stage or the handle is not of its function.
    pub fn type_of(&self, stage: Stage, value: Handle<Expression>) -> &TypeInner {
        self.types(stage)[value.index()].inner_with(&self.module.types)
    }

    /// The type of each expression of a stage's entry point, in arena order.
    ///
    /// # Panics
    /// When the shader lacks the stage.
    pub fn types(&self, stage: Stage) -> &[TypeResolution] {
        let entry = self.entry(stage);
        self.known[entry]
            .types
            .get_or_init(|| resolve(&self.module, &self.module.entry_points[entry].function))
    }

    /// Where the values of a stage's entry point are computed and read.
    pub(crate) fn places(&self, stage: Stage) -> &Places {
        let entry = self.entry(stage);
        self.known[entry]
            .places
            .get_or_init(|| Places::of(&self.module.entry_points[entry].function))
    }

    /// What was found out about what flows where in a stage's entry point.
    pub(crate) fn findings(&self, stage: Stage) -> &Findings {
        let known = &self.known[self.entry(stage)];
        known.findings.get_or_init(|| Findings::of(self, stage))
    }

    /// What reads a value of a stage's entry point: expressions in arena order, then statements.
    ///
    /// # Panics
    /// When the shader lacks the stage or the handle is not of its function.
    pub fn users(&self, stage: Stage, value: Handle<Expression>) -> &[User] {
        self.places(stage).users(value)
    }

    /// Where a value is, by its path.
    pub fn find(&self, id: &ValueId) -> Option<(Stage, Handle<Expression>)> {
        // Paths are unique, so the first is the only one. Ids are passed around by reference count:
        // most often the very same text is met.
        let same = |have: &Arc<str>| Arc::ptr_eq(have, &id.path) || **have == *id.path;
        self.values()
            .find(|(_, _, have)| same(&have.path))
            .map(|(stage, value, _)| (stage, value))
    }

    /// What a value of another version of this shader's source is called here: the same, when that path
    /// is there, else what the only value with its hash is called. To be asked of a shader that no pass
    /// has changed: after a change, another value may be the only one left with that hash.
    pub fn known_as(&self, id: &ValueId) -> Option<&ValueId> {
        let mut with_path = self.values().map(|(_, _, have)| have);
        let by_path = with_path.find(|have| have.path == id.path);
        by_path.or_else(|| {
            let values = self.values().map(|(_, _, have)| have);
            let mut with_hash = values.filter(|have| id.hash != 0 && have.hash == id.hash);
            match (with_hash.next(), with_hash.next()) {
                (Some(only), None) => Some(only),
                _ => None,
            }
        })
    }

    /// The values of all stages, with their ids.
    fn values(&self) -> impl Iterator<Item = (Stage, Handle<Expression>, &ValueId)> {
        [Stage::Vertex, Stage::Fragment, Stage::Parameter]
            .into_iter()
            .filter_map(|stage| Some((stage, self.index(stage)?)))
            .flat_map(|(stage, entry)| {
                let values = self.module.entry_points[entry].function.expressions.iter();
                let ids = self.ids[entry].iter();
                ids.zip(values)
                    .map(move |(have, (value, _))| (stage, value, have))
            })
    }

    /// Checks the module with naga's validator, every capability allowed.
    ///
    /// # Errors
    /// When the module is not valid, which is a bug in what made it.
    pub fn validate(&self) -> Result<ModuleInfo, Box<WithSpan<ValidationError>>> {
        Validator::new(ValidationFlags::all(), Capabilities::all())
            .validate(&self.module)
            .map_err(Box::new)
    }

    /// How many locations there may be between the stages: WebGPU's default limit, less the built-in inputs of the
    /// fragment stage that count as well.
    pub fn most_locations(&self) -> usize {
        interface::most_locations(self)
    }

    /// The shader as it stands alone, with no stages but its own: the vertex stage returns nothing that the fragment stage
    /// does not read, with nothing that computes it, and neither stage takes what it does not read. Locations, attributes' among
    /// them, stay what they are.
    #[must_use]
    pub fn alone(&self) -> Self {
        interface::alone(self)
    }

    /// What handing over the values costs that passes have moved to the vertex stage, for a fragment, in full-rate scalar
    /// operations; `None` when none has been moved, and the vertex stage reads no parameters: then it is the author's.
    pub fn handing_over(&self) -> Option<f64> {
        let function = self.function(Stage::Fragment)?;
        let added = function.arguments.get(self.authors.arguments..)?;
        let costs = added.iter().map(|argument| {
            let components = match self.module.types[argument.ty].inner {
                TypeInner::Vector { size, .. } => size as u32,
                _ => 1,
            };
            let each = match argument.binding {
                Some(naga::Binding::Location {
                    interpolation: Some(naga::Interpolation::Flat),
                    ..
                }) => FLAT_WEIGHT,
                _ => INTERPOLATION_WEIGHT,
            };
            each * f64::from(components)
        });
        let own = !added.is_empty() || self.reads_parameters(Stage::Vertex);
        own.then(|| costs.fold(0.0, |sum, cost| sum + cost))
    }

    /// The identity of the shader: a hash of what its entry points do.
    pub fn fingerprint(&self) -> Fingerprint {
        crate::generated::told_apart(self, crate::fingerprint::of(&self.module))
    }

    /// The same of one stage's entry point; `None` when the shader lacks the stage.
    pub fn stage_fingerprint(&self, stage: Stage) -> Option<Fingerprint> {
        let function = self.function(stage)?;
        let declared = crate::fingerprint::Declared::of(&self.module);
        let of_function = crate::fingerprint::of_function(&declared, function);
        Some(crate::generated::told_apart(self, of_function))
    }
}

/// The types of a function's expressions.
///
/// # Panics
/// When the function is not valid.
pub(crate) fn resolve(module: &Module, function: &Function) -> Vec<TypeResolution> {
    let context =
        ResolveContext::with_locals(module, &function.local_variables, &function.arguments);
    let mut types: Vec<TypeResolution> = Vec::with_capacity(function.expressions.len());
    for (_, expression) in function.expressions.iter() {
        let resolved = context.resolve(expression, |operand| Ok(&types[operand.index()]));
        let resolved = resolved.expect("a valid function has types");
        types.push(resolved);
    }
    types
}
