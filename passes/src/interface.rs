//! What the vertex stage hands over to the fragment stage, and what passes have added to that.
//!
//! The author's inputs and outputs stay as they are. What was added stands behind them, in the order of the names, at the
//! first locations that are free; what no fragment reads any more goes, with what computed it.

use crate::edit::Edit;
use crate::operands::User;
use crate::shader::{Shader, Stage};
use naga::{
    Binding, BuiltIn, Expression, Function, FunctionResult, Handle, Interpolation, Module, Span,
    Statement, StructMember, Type, TypeInner,
};
use std::collections::{BTreeMap, BTreeSet};

/// How many inputs a fragment stage may have, built-in ones that are not the position among them: WebGPU's default
/// `maxInterStageShaderVariables`. Locations are below it.
pub(crate) const MOST_VARIABLES: u32 = 16;

/// What is put behind the name of the author's result, for the one that more is returned in.
const SUFFIX: &str = "OfLevel";

/// How much of the interface is the author's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Authors {
    /// The first so many arguments of the fragment stage.
    pub(crate) arguments: usize,
    /// The first so many members of what the vertex stage returns; `None` when that is one value and no structure.
    pub(crate) members: Option<usize>,
}

impl Authors {
    /// All of it.
    pub(crate) fn of(module: &Module) -> Self {
        let mut all = Self::default();
        for point in &module.entry_points {
            match point.stage {
                naga::ShaderStage::Fragment => all.arguments = point.function.arguments.len(),
                naga::ShaderStage::Vertex => {
                    let result = point.function.result.as_ref();
                    all.members = parts(module, result).map(|count| count as usize);
                }
                _ => {}
            }
        }
        all
    }
}

/// A value that is handed over at a location.
#[derive(Clone, Debug)]
pub(crate) struct Output {
    /// Its name for people.
    pub(crate) name: String,
    /// A float, or a vector of them.
    pub(crate) ty: Handle<Type>,
    /// Where, and how it is interpolated.
    pub(crate) binding: Binding,
}

/// A binding at a location that is interpolated in a certain way, at the centre of the pixel.
pub(crate) fn at(location: u32, interpolation: Interpolation) -> Binding {
    Binding::Location {
        location,
        interpolation: Some(interpolation),
        sampling: (interpolation != Interpolation::Flat).then_some(naga::Sampling::Center),
        blend_src: None,
        per_primitive: false,
    }
}

/// How many members a result has; `None` when it is no structure.
pub(crate) fn parts(module: &Module, result: Option<&FunctionResult>) -> Option<u32> {
    match &module.types[result?.ty].inner {
        TypeInner::Struct { members, .. } => Some(members.len() as u32),
        _ => None,
    }
}

/// For each member of a result, whether something else is returned at its location.
pub(crate) fn replaced(
    module: &Module,
    result: Option<&FunctionResult>,
    outputs: &[Output],
) -> Vec<bool> {
    let Some(TypeInner::Struct { members, .. }) =
        result.map(|result| &module.types[result.ty].inner)
    else {
        return Vec::new();
    };
    let is_replaced = |member: &StructMember| {
        let at = location(member.binding.as_ref());
        let mut others = outputs.iter().map(|output| location(Some(&output.binding)));
        at.is_some() && others.any(|other| other == at)
    };
    members.iter().map(is_replaced).collect()
}

/// The type of a result with more in it, in the place of what it has at the same locations.
pub(crate) fn result(
    module: &mut Module,
    result: Option<&FunctionResult>,
    outputs: &[Output],
) -> Handle<Type> {
    let (mut members, name) = match result {
        None => (Vec::new(), None),
        Some(result) => match &module.types[result.ty] {
            Type {
                name,
                inner: TypeInner::Struct { members, .. },
            } => (members.clone(), name.clone()),
            _ => {
                let first = StructMember {
                    name: Some("position".into()),
                    ty: result.ty,
                    binding: result.binding.clone(),
                    offset: 0,
                };
                (vec![first], None)
            }
        },
    };
    let mut replaced = replaced(module, result, outputs).into_iter();
    members.retain(|_| !replaced.next().unwrap_or(false));
    members.extend(outputs.iter().map(|output| StructMember {
        name: Some(output.name.clone()),
        ty: output.ty,
        binding: Some(output.binding.clone()),
        offset: 0,
    }));
    structure(module, name.as_deref(), members)
}

/// A structure of these members, named after the author's.
fn structure(module: &mut Module, name: Option<&str>, members: Vec<StructMember>) -> Handle<Type> {
    let name = name.unwrap_or("Vertex");
    let name = match name.ends_with(SUFFIX) {
        true => name.to_owned(),
        false => format!("{name}{SUFFIX}"),
    };
    laid_out(module, name, members)
}

/// A structure of these members, one behind the other.
pub(crate) fn laid_out(
    module: &mut Module,
    name: String,
    mut members: Vec<StructMember>,
) -> Handle<Type> {
    let (mut end, mut widest) = (0, 4);
    for member in &mut members {
        let (size, alignment) = layout(&module.types[member.ty].inner);
        member.offset = u32::next_multiple_of(end, alignment);
        end = member.offset + size;
        widest = widest.max(alignment);
    }
    let inner = TypeInner::Struct {
        members,
        span: end.next_multiple_of(widest),
    };
    let ty = Type {
        name: Some(name),
        inner,
    };
    module.types.insert(ty, Span::UNDEFINED)
}

/// Size and alignment of what may be handed over, in bytes.
pub(crate) fn layout(inner: &TypeInner) -> (u32, u32) {
    match *inner {
        TypeInner::Vector { size, scalar } => {
            let count = size as u32;
            let width = u32::from(scalar.width);
            (width * count, width * if count == 3 { 4 } else { count })
        }
        // An array of clip distances.
        TypeInner::Array {
            size: naga::ArraySize::Constant(count),
            stride,
            ..
        } => (stride * count.get(), 4),
        _ => (4, 4),
    }
}

/// What a vertex stage returns, member by member: the binding, and the value where it is known apart from the others.
pub(crate) struct Returned {
    pub(crate) binding: Option<Binding>,
    pub(crate) ty: Handle<Type>,
    pub(crate) value: Option<Handle<Expression>>,
}

/// What the vertex stage of a shader returns; nothing without one.
pub(crate) fn returned(shader: &Shader) -> Vec<Returned> {
    let Some(function) = shader.function(Stage::Vertex) else {
        return Vec::new();
    };
    let Some(result) = &function.result else {
        return Vec::new();
    };
    let value = match function.body.last() {
        Some(Statement::Return { value }) => *value,
        _ => None,
    };
    match &shader.module().types[result.ty].inner {
        TypeInner::Struct { members, .. } => {
            let components = match value.map(|value| &function.expressions[value]) {
                Some(Expression::Compose { components, .. }) => components.as_slice(),
                _ => &[],
            };
            let members = members.iter().enumerate();
            let part = |(i, member): (usize, &StructMember)| Returned {
                binding: member.binding.clone(),
                ty: member.ty,
                value: components.get(i).copied(),
            };
            members.map(part).collect()
        }
        _ => vec![Returned {
            binding: result.binding.clone(),
            ty: result.ty,
            value,
        }],
    }
}

/// The location of a binding.
pub(crate) fn location(binding: Option<&Binding>) -> Option<u32> {
    match binding {
        Some(Binding::Location { location, .. }) => Some(*location),
        _ => None,
    }
}

/// The bindings of a function's arguments, those of structures' members among them.
fn bindings<'a>(module: &'a Module, function: &'a Function) -> Vec<&'a Binding> {
    let mut found = Vec::new();
    for argument in &function.arguments {
        match (&argument.binding, &module.types[argument.ty].inner) {
            (Some(binding), _) => found.push(binding),
            (None, TypeInner::Struct { members, .. }) => {
                found.extend(members.iter().filter_map(|member| member.binding.as_ref()));
            }
            _ => {}
        }
    }
    found
}

/// How many locations there may be.
pub(crate) fn most_locations(shader: &Shader) -> usize {
    let function = shader.function(Stage::Fragment);
    let inputs = function.map_or(Vec::new(), |function| bindings(shader.module(), function));
    let built_in = inputs.iter().filter(|binding| match binding {
        Binding::BuiltIn(built_in) => !matches!(built_in, BuiltIn::Position { .. }),
        Binding::Location { .. } => false,
    });
    (MOST_VARIABLES as usize).saturating_sub(built_in.count())
}

/// The first location that nothing is handed over at; `None` when there is no room for another variable.
pub(crate) fn free_location(shader: &Shader) -> Option<u32> {
    let taken = locations(shader);
    let free = (0..MOST_VARIABLES).find(|location| !taken.contains(location))?;
    (taken.len() < most_locations(shader)).then_some(free)
}

/// What has been added to the interface and has room for more.
pub(crate) struct Roomy {
    /// Which argument of the fragment stage it is.
    pub(crate) argument: u32,
    pub(crate) name: String,
    pub(crate) location: u32,
    /// How many components it has.
    pub(crate) components: usize,
    /// What the vertex stage returns there.
    pub(crate) value: Handle<Expression>,
}

/// What has been added to the interface, is interpolated so, and has room for so many components more.
pub(crate) fn roomy(shader: &Shader, interpolation: Interpolation, more: usize) -> Option<Roomy> {
    let function = shader.function(Stage::Fragment)?;
    let added = function.arguments.iter().enumerate();
    let returned = returned(shader);
    added
        .skip(shader.authors.arguments)
        .find_map(|(at, argument)| {
            let location = location(argument.binding.as_ref())?;
            let components = match shader.module().types[argument.ty].inner {
                TypeInner::Vector { size, .. } => size as usize,
                _ => 1,
            };
            if argument.binding != Some(self::at(location, interpolation)) || components + more > 4
            {
                return None;
            }
            let is_it = |part: &&Returned| self::location(part.binding.as_ref()) == Some(location);
            Some(Roomy {
                argument: at as u32,
                name: argument.name.clone()?,
                location,
                components,
                value: returned.iter().find(is_it)?.value?,
            })
        })
}

/// The locations of either stage's side of the interface.
fn locations(shader: &Shader) -> BTreeSet<u32> {
    let mut taken: BTreeSet<u32> = BTreeSet::new();
    if let Some(function) = shader.function(Stage::Fragment) {
        let inputs = bindings(shader.module(), function);
        taken.extend(inputs.into_iter().filter_map(|input| location(Some(input))));
    }
    let outputs = returned(shader);
    taken.extend(outputs.iter().filter_map(|o| location(o.binding.as_ref())));
    taken
}

/// A shader as it stands alone, with its own stages and no others: the vertex stage returns what is built in and what the
/// fragment stage reads, with what computes that, and each stage takes what it reads. Locations stay what they are.
pub(crate) fn alone(shader: &Shader) -> Shader {
    let Some(fragment) = shader.index(Stage::Fragment) else {
        return shader.clone();
    };
    let mut module = shader.module.clone();
    let mut ids = shader.ids.clone();
    let read = inputs_read(&module, fragment);
    let mut handed = None;
    if let Some(vertex) = shader.index(Stage::Vertex) {
        let locations = locations_read(&module, fragment, &read);
        handed = return_only(&mut module, vertex, &locations);
        let (generated, passes) = (shader.generated.clone(), shader.passes.clone());
        let shader = Shader::changed(module, ids, shader.authors, generated, passes);
        let shader = match handed {
            // What computed the others goes.
            Some(_) => Edit::new(&shader, Stage::Vertex).finish(),
            None => shader,
        };
        (module, ids) = (shader.module, shader.ids);
        let read = inputs_read(&module, vertex);
        take_only(&mut module, vertex, &read, None);
    }
    take_only(&mut module, fragment, &read, handed);
    Shader::changed(
        module,
        ids,
        shader.authors,
        shader.generated.clone(),
        shader.passes.clone(),
    )
}

/// What a stage reads of one of its arguments.
enum Read {
    /// It, all of it or none.
    Whole(bool),
    /// These members of a structure.
    Members(BTreeSet<u32>),
}

/// What an entry point reads of each argument.
fn inputs_read(module: &Module, entry: usize) -> Vec<Read> {
    let function = &module.entry_points[entry].function;
    let arguments = function.arguments.iter();
    let mut read: Vec<Read> = arguments
        .map(
            |argument| match (&argument.binding, &module.types[argument.ty].inner) {
                (None, TypeInner::Struct { .. }) => Read::Members(BTreeSet::new()),
                _ => Read::Whole(false),
            },
        )
        .collect();
    let users = crate::operands::users(function);
    for (value, expression) in function.expressions.iter() {
        let Expression::FunctionArgument(at) = *expression else {
            continue;
        };
        let read = &mut read[at as usize];
        let mut members = users[value.index()].iter().map(|user| match *user {
            User::Value(user) => match function.expressions[user] {
                Expression::AccessIndex { index, .. } => Some(index),
                _ => None,
            },
            User::Statement(_) => None,
        });
        match read {
            Read::Members(found) if !users[value.index()].is_empty() => {
                match members.by_ref().collect::<Option<Vec<u32>>>() {
                    Some(members) => found.extend(members),
                    None => *read = Read::Whole(true),
                }
            }
            _ => *read = Read::Whole(true),
        }
    }
    read
}

/// The locations of what an entry point reads.
fn locations_read(module: &Module, entry: usize, read: &[Read]) -> BTreeSet<u32> {
    let arguments = &module.entry_points[entry].function.arguments;
    let mut locations = BTreeSet::new();
    for (argument, read) in arguments.iter().zip(read) {
        match (read, &module.types[argument.ty].inner) {
            (Read::Whole(false), _) => {}
            (_, TypeInner::Struct { members, .. }) => {
                let members = members.iter().enumerate().filter(|(at, _)| match read {
                    Read::Members(read) => read.contains(&(*at as u32)),
                    Read::Whole(_) => true,
                });
                locations.extend(members.filter_map(|(_, m)| location(m.binding.as_ref())));
            }
            _ => locations.extend(location(argument.binding.as_ref())),
        }
    }
    locations
}

/// Has an entry point return what is built in and what goes to these locations. Returns the structure of that; nothing where it is
/// all that was returned, or where what is returned is not known member by member.
fn return_only(
    module: &mut Module,
    entry: usize,
    locations: &BTreeSet<u32>,
) -> Option<Handle<Type>> {
    let function = &module.entry_points[entry].function;
    let before = function.result.as_ref()?.ty;
    let Some(Statement::Return { value: Some(value) }) = function.body.last() else {
        return None;
    };
    let value = *value;
    let Type {
        name,
        inner: TypeInner::Struct { members, .. },
    } = module.types[before].clone()
    else {
        return None;
    };
    let Expression::Compose { components, .. } = &function.expressions[value] else {
        return None;
    };
    if crate::operands::users(function)[value.index()].len() > 1 {
        return None;
    }
    let is_left = |member: &StructMember| {
        location(member.binding.as_ref()).is_none_or(|location| locations.contains(&location))
    };
    let (left, components): (Vec<_>, Vec<_>) = members
        .iter()
        .zip(components)
        .filter(|(member, _)| is_left(member))
        .map(|(member, component)| (member.clone(), *component))
        .unzip();
    if left.len() == members.len() || left.is_empty() {
        return None;
    }
    let ty = structure(module, name.as_deref(), left);
    // One that had been made for the level is nobody's any more, and its name is free.
    if let Some(Type {
        name: Some(taken),
        inner,
    }) = module.types.get_handle(before).ok().cloned()
        && taken.ends_with(SUFFIX)
    {
        let name = Some(format!("{taken}Before"));
        module.types.replace(before, Type { name, inner });
    }
    let function = &mut module.entry_points[entry].function;
    function.result = Some(FunctionResult { ty, binding: None });
    function.expressions[value] = Expression::Compose { ty, components };
    Some(ty)
}

/// Takes away the arguments of an entry point, and the locations of structures among them, that it does not read. Where what is left
/// of a structure is what is handed over, it is that one.
fn take_only(module: &mut Module, entry: usize, read: &[Read], handed: Option<Handle<Type>>) {
    let mut function = std::mem::take(&mut module.entry_points[entry].function);
    // From an old argument to the new one, and of each old one from an old member to the new one.
    let mut arguments: BTreeMap<u32, u32> = BTreeMap::new();
    let mut members_of: BTreeMap<u32, BTreeMap<u32, u32>> = BTreeMap::new();
    let mut left = Vec::new();
    for ((old, mut argument), read) in (0..).zip(function.arguments).zip(read) {
        match read {
            Read::Whole(true) => {}
            Read::Whole(false) => continue,
            Read::Members(read) if read.is_empty() => continue,
            Read::Members(read) => {
                let Type {
                    name,
                    inner: TypeInner::Struct { members, .. },
                } = module.types[argument.ty].clone()
                else {
                    unreachable!("members are a structure's");
                };
                let is_kept = |(at, member): &(u32, &StructMember)| {
                    read.contains(at) || location(member.binding.as_ref()).is_none()
                };
                let (kept, left): (Vec<u32>, Vec<StructMember>) = (0..)
                    .zip(&members)
                    .filter(is_kept)
                    .map(|(at, member)| (at, member.clone()))
                    .unzip();
                if left.len() < members.len() {
                    argument.ty = taken(module, name.as_deref(), left, handed);
                    members_of.insert(old, kept.into_iter().zip(0..).collect());
                }
            }
        }
        arguments.insert(old, left.len() as u32);
        left.push(argument);
    }
    function.arguments = left;
    let inputs: BTreeMap<Handle<Expression>, u32> = function
        .expressions
        .iter()
        .filter_map(|(value, expression)| match *expression {
            Expression::FunctionArgument(at) => Some((value, at)),
            _ => None,
        })
        .collect();
    for (_, expression) in function.expressions.iter_mut() {
        match expression {
            Expression::FunctionArgument(at) => *at = arguments[at],
            Expression::AccessIndex { base, index } => {
                let members = inputs
                    .get(base)
                    .and_then(|argument| members_of.get(argument));
                if let Some(members) = members {
                    *index = members[index];
                }
            }
            _ => {}
        }
    }
    module.entry_points[entry].function = function;
}

/// The structure of what is left of one that a stage takes: the one that is handed over, where that has the same members.
fn taken(
    module: &mut Module,
    name: Option<&str>,
    left: Vec<StructMember>,
    handed: Option<Handle<Type>>,
) -> Handle<Type> {
    let is_alike = |one: &StructMember, other: &StructMember| {
        (&one.name, one.ty, &one.binding) == (&other.name, other.ty, &other.binding)
    };
    if let Some(handed) = handed
        && let TypeInner::Struct { members, .. } = &module.types[handed].inner
        && members.len() == left.len()
        && members
            .iter()
            .zip(&left)
            .all(|(one, other)| is_alike(one, other))
    {
        return handed;
    }
    let name = format!("{}Read", name.unwrap_or("Inputs"));
    structure(module, Some(&name), left)
}

/// Brings what was added to the interface in order: without what no fragment reads, by name, at the first free locations.
pub(crate) fn settle(shader: Shader) -> Shader {
    let Authors { arguments, members } = shader.authors;
    let (Some(fragment), Some(vertex)) =
        (shader.index(Stage::Fragment), shader.index(Stage::Vertex))
    else {
        return shader;
    };
    let function = &shader.module.entry_points[fragment].function;
    if function.arguments.len() <= arguments {
        return shader;
    }
    let mut read = vec![false; function.arguments.len()];
    for (_, expression) in function.expressions.iter() {
        if let Expression::FunctionArgument(at) = expression {
            read[*at as usize] = true;
        }
    }
    let mut order: Vec<usize> = (arguments..read.len()).filter(|at| read[*at]).collect();
    order.sort_by(|a, b| {
        function.arguments[*a]
            .name
            .cmp(&function.arguments[*b].name)
    });
    let added = |at: usize| location(function.arguments[at].binding.as_ref());
    let of_authors: BTreeSet<u32> = {
        let own: BTreeSet<u32> = (arguments..read.len()).filter_map(added).collect();
        locations(&shader).difference(&own).copied().collect()
    };
    let free = (0..MOST_VARIABLES).filter(|location| !of_authors.contains(location));
    // From an old location to the new one, and from an old argument to the new one.
    let mut moved: BTreeMap<u32, u32> = BTreeMap::new();
    let mut renumbered: BTreeMap<u32, u32> = BTreeMap::new();
    for ((new, old), location) in order.iter().enumerate().zip(free) {
        moved.extend(added(*old).map(|old| (old, location)));
        renumbered.insert(*old as u32, (arguments + new) as u32);
    }
    let settled = moved.len() == read.len() - arguments
        && moved.iter().all(|(old, new)| old == new)
        && renumbered.iter().all(|(old, new)| old == new);
    if settled {
        return shader;
    }

    let Shader {
        mut module,
        ids,
        authors,
        generated,
        passes,
        ..
    } = shader;
    let at_new = |binding: &Option<Binding>| -> Option<Binding> {
        let mut binding = binding.clone()?;
        if let Binding::Location { location, .. } = &mut binding {
            *location = *moved.get(location)?;
        }
        Some(binding)
    };
    let function = &mut module.entry_points[fragment].function;
    let of_levels = function.arguments.split_off(arguments);
    for old in &order {
        let mut argument = of_levels[old - arguments].clone();
        argument.binding = at_new(&argument.binding);
        function.arguments.push(argument);
    }
    for (_, expression) in function.expressions.iter_mut() {
        if let Expression::FunctionArgument(at) = expression {
            *at = renumbered.get(at).copied().unwrap_or(*at);
        }
    }

    let mut function = std::mem::take(&mut module.entry_points[vertex].function);
    let returned = match function.body.last() {
        Some(Statement::Return { value: Some(value) }) => *value,
        _ => unreachable!("what was added is returned"),
    };
    let (Some(result), Expression::Compose { components, .. }) =
        (&mut function.result, &mut function.expressions[returned])
    else {
        unreachable!("what was added is a part of what is returned");
    };
    let Type {
        name,
        inner: TypeInner::Struct {
            members: mut all, ..
        },
    } = module.types[result.ty].clone()
    else {
        unreachable!("what was added is a member of what is returned");
    };
    let mut behind: Vec<(StructMember, Handle<Expression>)> = all
        .split_off(members.unwrap_or(1))
        .into_iter()
        .zip(components.split_off(members.unwrap_or(1)))
        .filter_map(|(mut member, value)| {
            member.binding = at_new(&member.binding);
            member.binding.is_some().then_some((member, value))
        })
        .collect();
    behind.sort_by_key(|(member, _)| location(member.binding.as_ref()));
    let dropped = behind.len() < of_levels.len();
    for (member, value) in behind {
        all.push(member);
        components.push(value);
    }
    if let (None, [only]) = (members, &all[..]) {
        *result = FunctionResult {
            ty: only.ty,
            binding: only.binding.clone(),
        };
        let value = components[0];
        if let Some(Statement::Return { value: returned }) = function.body.iter_mut().last() {
            *returned = Some(value);
        }
    } else {
        result.ty = structure(&mut module, name.as_deref(), all);
        if let Expression::Compose { ty, .. } = &mut function.expressions[returned] {
            *ty = result.ty;
        }
    }
    module.entry_points[vertex].function = function;
    let shader = Shader::changed(module, ids, authors, generated, passes);
    match dropped {
        // What computed it goes.
        true => Edit::new(&shader, Stage::Vertex).finish(),
        false => shader,
    }
}
