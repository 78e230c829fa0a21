//! What levels hand from the vertex stage to the fragment stage beside what the author's shader does, and the
//! locations that they share.
//!
//! A level's fragment function has the author's arguments and, behind them, its own. A shader that holds several
//! levels hands over the union of all of them: two levels share a location where type and interpolation allow.

use lodc_passes::Shader;
use lodc_passes::shader::Stage;
use naga::{Binding, BuiltIn, Function, FunctionArgument, Module, TypeInner};
use std::collections::BTreeSet;

/// A value that levels hand over.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Varying {
    /// What it is called: after the values that it carries.
    pub(crate) name: String,
    /// Its location, apart from the author's, and how it is interpolated.
    pub(crate) binding: Binding,
    /// Its type: a scalar or a vector.
    pub(crate) ty: TypeInner,
}

/// All of them, and who carries what in which.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Varyings {
    /// Those of the shader that holds all levels.
    pub(crate) shared: Vec<Varying>,
    /// For each level and each of its own inputs, in order: its location there, and its place in `shared`.
    pub(crate) of_levels: Vec<Vec<(u32, usize)>>,
}

impl Varyings {
    /// Finds locations for what levels hand over beside what their base does. Where `apart`, neighbours are drawn together,
    /// and share one only where their vertex stages are the same.
    pub(crate) fn of<'a>(
        base: &Shader,
        levels: impl IntoIterator<Item = &'a Shader>,
        apart: bool,
    ) -> Self {
        let mut varyings = Self::default();
        let mut names: Vec<Vec<&str>> = Vec::new();
        let mut before: Option<(&Shader, Vec<(u32, usize)>)> = None;
        for level in levels {
            let own = own_inputs(base, level);
            let mut places: Vec<Option<usize>> = vec![None; own.len()];
            let mut neighbours = BTreeSet::new();
            if let Some((shader, of_before)) = before.take().filter(|_| apart) {
                let [one, other] =
                    [shader, level].map(|shader| shader.stage_fingerprint(Stage::Vertex));
                for (at, input) in own
                    .iter()
                    .enumerate()
                    .filter(|_| one.is_some() && one == other)
                {
                    let same = of_before.iter().find(|(own, _)| *own == input.location);
                    places[at] = same.map(|(_, place)| *place);
                }
                neighbours.extend(of_before.iter().map(|(_, place)| *place));
            }
            // What is called alike is shared first, so that as many as can be keep their names.
            for alike in [true, false] {
                for (at, input) in own.iter().enumerate() {
                    if places[at].is_some() {
                        continue;
                    }
                    let mut shared = varyings.shared.iter().enumerate();
                    let found = shared.find(|(place, varying)| {
                        !places.contains(&Some(*place))
                            && !neighbours.contains(place)
                            && varying.ty == input.ty
                            && same_interpolation(&varying.binding, input.binding)
                            && (!alike || names[*place].contains(&input.name))
                    });
                    places[at] = found.map(|(place, _)| place);
                }
            }
            let mut of_level = Vec::new();
            for (input, place) in own.iter().zip(places) {
                let place = place.unwrap_or_else(|| {
                    varyings.shared.push(Varying {
                        name: String::new(),
                        binding: input.binding.clone(),
                        ty: input.ty.clone(),
                    });
                    names.push(Vec::new());
                    names.len() - 1
                });
                if !names[place].contains(&input.name) {
                    names[place].push(input.name);
                }
                of_level.push((input.location, place));
            }
            before = Some((level, of_level.clone()));
            varyings.of_levels.push(of_level);
        }
        let mut taken = locations(base);
        for (varying, names) in varyings.shared.iter_mut().zip(&names) {
            varying.name = match &names[..] {
                [one] => (*one).to_owned(),
                [one, other] => format!("{one}_or_{other}"),
                _ => "of_level".to_owned(),
            };
            let free = (0..).find(|location| taken.insert(*location));
            if let (Binding::Location { location, .. }, Some(free)) = (&mut varying.binding, free) {
                *location = free;
            }
        }
        varyings
    }
}

/// How many locations the vertex stage hands to the fragment stage in a shader that holds all of these levels of
/// `base`: what the limit on inter-stage variables is held against, beside the built-in inputs of the fragment
/// stage. `apart` says that neighbouring levels are drawn together, in a band.
pub fn shared_locations<'a>(
    base: &Shader,
    levels: impl IntoIterator<Item = &'a Shader>,
    apart: bool,
) -> usize {
    locations(base).len() + Varyings::of(base, levels, apart).shared.len()
}

/// The locations that a shader's own stages have between them.
fn locations(base: &Shader) -> BTreeSet<u32> {
    let of_vertex = base.function(Stage::Vertex).map_or(Vec::new(), |function| {
        outputs(base.module(), function)
            .into_iter()
            .map(|output| output.binding)
            .collect()
    });
    let inputs = base
        .function(Stage::Fragment)
        .into_iter()
        .flat_map(|function| &function.arguments)
        .flat_map(|argument| bindings(base.module(), argument));
    let all = of_vertex.into_iter().chain(inputs);
    all.filter_map(|binding| location(&binding)).collect()
}

/// An input of a level's own.
struct Input<'a> {
    name: &'a str,
    binding: &'a Binding,
    location: u32,
    ty: TypeInner,
}

/// The inputs that a level's fragment stage has behind those of its base.
fn own_inputs<'a>(base: &Shader, level: &'a Shader) -> Vec<Input<'a>> {
    let authors = base
        .function(Stage::Fragment)
        .map_or(0, |function| function.arguments.len());
    let function = level.function(Stage::Fragment);
    let arguments = function.map_or(&[][..], |function| &function.arguments[..]);
    let own = arguments.iter().skip(authors);
    own.filter_map(|argument| {
        let binding = argument.binding.as_ref()?;
        Some(Input {
            name: argument.name.as_deref().unwrap_or("of_level"),
            binding,
            location: location(binding)?,
            ty: level.module().types[argument.ty].inner.clone(),
        })
    })
    .collect()
}

/// An output of a vertex function.
pub(crate) struct Output {
    /// The name of the member; `None` for a result that is no struct.
    pub(crate) member: Option<String>,
    pub(crate) binding: Binding,
    pub(crate) ty: naga::Handle<naga::Type>,
}

/// What a vertex function returns: the members of its struct, or the one value.
pub(crate) fn outputs(module: &Module, function: &Function) -> Vec<Output> {
    let Some(result) = &function.result else {
        return Vec::new();
    };
    match (&module.types[result.ty].inner, &result.binding) {
        (TypeInner::Struct { members, .. }, _) => members
            .iter()
            .filter_map(|member| {
                Some(Output {
                    member: Some(member.name.clone().unwrap_or_default()),
                    binding: member.binding.clone()?,
                    ty: member.ty,
                })
            })
            .collect(),
        (_, Some(binding)) => vec![Output {
            member: None,
            binding: binding.clone(),
            ty: result.ty,
        }],
        (_, None) => Vec::new(),
    }
}

fn bindings(module: &Module, argument: &FunctionArgument) -> Vec<Binding> {
    match &module.types[argument.ty].inner {
        TypeInner::Struct { members, .. } => {
            let bindings = members.iter().filter_map(|member| member.binding.clone());
            bindings.collect()
        }
        _ => argument.binding.iter().cloned().collect(),
    }
}

pub(crate) fn location(binding: &Binding) -> Option<u32> {
    match binding {
        Binding::Location { location, .. } => Some(*location),
        Binding::BuiltIn(_) => None,
    }
}

/// Whether two bindings are the same built-in value or the same location.
pub(crate) fn same_place(one: &Binding, other: &Binding) -> bool {
    match (one, other) {
        (
            Binding::BuiltIn(BuiltIn::Position { .. }),
            Binding::BuiltIn(BuiltIn::Position { .. }),
        ) => true,
        (Binding::BuiltIn(one), Binding::BuiltIn(other)) => one == other,
        _ => location(one).is_some() && location(one) == location(other),
    }
}

fn same_interpolation(one: &Binding, other: &Binding) -> bool {
    let how = |binding: &Binding| match binding {
        Binding::Location {
            interpolation,
            sampling,
            ..
        } => (*interpolation, *sampling),
        Binding::BuiltIn(_) => (None, None),
    };
    how(one) == how(other)
}
