//! The parameter block of a variant: what is computed once a draw, and read by its stages as a uniform.
//!
//! ```text
//! struct LodParameters { radiance: vec3f, .. }          the members, by name
//! var<storage, read_write> parameters_stored            the parameter stage stores them here, all at once, at its end
//! var<uniform> parameters                               the other stages read them here
//! ```
//!
//! The parameter stage is a compute entry point of one invocation without inputs. A host runs it when uniforms change, or
//! does what it does by itself. Both variables are one buffer's; they have the bindings behind the author's last one.
//! A member that no stage reads any more goes, with what computed it, and with the last member the block.

use crate::edit::{Edit, append};
use crate::fingerprint::{Declared, of_function};
use crate::interface::laid_out;
use crate::live::keep_needed;
use crate::operands;
use crate::shader::{Fingerprint, Shader, Stage, ValueId};
use naga::{
    AddressSpace, Arena, Binding, Block, EntryPoint, Expression, Function, FunctionResult,
    GlobalVariable, Handle, Module, ResourceBinding, ShaderStage, Span, Statement, StorageAccess,
    StructMember, Type, TypeInner,
};
use std::collections::{BTreeMap, BTreeSet};

/// The name of the parameter stage's entry point, unless the author has that name.
const ENTRY: &str = "lod_parameters";
/// The name of the block's type.
const TYPE: &str = "LodParameters";
/// The name of the variable that is read.
const READ: &str = "parameters";
/// The name of the variable that is stored to.
const STORED: &str = "parameters_stored";
/// What is put behind a name that the author has.
const SUFFIX: &str = "_of_lod";

/// The parameter block of a variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterBlock {
    /// Its type: a structure of scalars and vectors of 32 bits.
    pub ty: Handle<Type>,
    /// The uniform variable that the fragment and the vertex stage read.
    pub read: Handle<GlobalVariable>,
    /// The storage variable that the parameter stage stores to.
    pub stored: Handle<GlobalVariable>,
}

impl Shader {
    /// The parameter block, of a variant that has one.
    pub fn parameter_block(&self) -> Option<ParameterBlock> {
        let function = self.function(Stage::Parameter)?;
        let Stored { variable, .. } = stored(&function.body, &function.expressions)?;
        Some(block_of(&self.module, variable))
    }

    /// The members of the parameter block, in the order of their offsets; none without one.
    pub fn parameters(&self) -> &[StructMember] {
        match self.parameter_block() {
            Some(block) => members(&self.module, block.ty),
            None => &[],
        }
    }

    /// Whether a stage reads the parameter block.
    pub fn reads_parameters(&self, stage: Stage) -> bool {
        let (Some(block), Some(function)) = (self.parameter_block(), self.function(stage)) else {
            return false;
        };
        let mut values = function.expressions.iter();
        values.any(|(_, e)| matches!(e, Expression::GlobalVariable(v) if *v == block.read))
    }

    /// The parameter stage as an entry point of a module that returns the block's members, each at the location that is
    /// its place in the block, and stores nothing; and its place among the module's entry points.
    pub fn parameters_returned(&self) -> Option<(Module, usize)> {
        let block = self.parameter_block()?;
        let entry = self.index(Stage::Parameter)?;
        Some((returned(&self.module, entry, block.stored)?, entry))
    }
}

/// A module in which an entry point that fills a block returns the block's members, each at the location that is its place,
/// and stores nothing. `stored` is the buffer that it stores to. `None` when the entry point may end early, or what it stores
/// to is no structure of scalars and vectors of 32 bits.
pub fn returned(module: &Module, entry: usize, stored: Handle<GlobalVariable>) -> Option<Module> {
    let mut module = module.clone();
    let ty = module.global_variables[stored].ty;
    let TypeInner::Struct { members, span } = &module.types[ty].inner else {
        return None;
    };
    let (mut members, span) = (members.clone(), *span);
    for (location, member) in (0..).zip(&mut members) {
        let inner = &module.types[member.ty].inner;
        let is_plain = matches!(inner, TypeInner::Scalar(_) | TypeInner::Vector { .. });
        if !is_plain || inner.scalar_width() != Some(4) {
            return None;
        }
        member.binding = Some(Binding::Location {
            location,
            interpolation: None,
            sampling: None,
            blend_src: None,
            per_primitive: false,
        });
    }
    let count = members.len() as u32;
    let ty = Type {
        name: Some("Returned".into()),
        inner: TypeInner::Struct { members, span },
    };
    let ty = module.types.insert(ty, Span::UNDEFINED);
    // What was a buffer is a variable, that functions may store to as well.
    let variable = &mut module.global_variables[stored];
    variable.space = AddressSpace::Private;
    variable.binding = None;
    let point = module.entry_points.get_mut(entry)?;
    let function = &mut point.function;
    if let Some(Statement::Return { .. }) = function.body.last() {
        let last = function.body.len() - 1;
        function.body.cull(last..);
    }
    let mut ends = true;
    operands::walk(&function.body, &mut |statement| {
        ends &= !matches!(statement, Statement::Return { .. });
    });
    if !ends {
        return None;
    }
    let base = append(function, Expression::GlobalVariable(stored));
    let mut components = Vec::new();
    for index in 0..count {
        let pointer = append(function, Expression::AccessIndex { base, index });
        components.push(append(function, Expression::Load { pointer }));
    }
    let value = Some(append(function, Expression::Compose { ty, components }));
    let end = Statement::Return { value };
    function.body.push(end, Span::UNDEFINED);
    function.result = Some(FunctionResult { ty, binding: None });
    // Without an interface it is like a vertex stage.
    point.stage = ShaderStage::Vertex;
    point.workgroup_size = [0; 3];
    Some(module)
}

/// The store of a parameter stage.
pub(crate) struct Stored<'e> {
    /// Its place in the body.
    pub(crate) at: usize,
    /// The variable.
    pub(crate) variable: Handle<GlobalVariable>,
    /// The values of the members.
    pub(crate) values: &'e [Handle<Expression>],
}

/// Finds the store of a parameter stage.
pub(crate) fn stored<'e>(body: &Block, expressions: &'e Arena<Expression>) -> Option<Stored<'e>> {
    let at = body
        .iter()
        .rposition(|statement| matches!(statement, Statement::Store { .. }))?;
    let Statement::Store { pointer, value } = body[at] else {
        return None;
    };
    match (&expressions[pointer], &expressions[value]) {
        (Expression::GlobalVariable(variable), Expression::Compose { components, .. }) => {
            Some(Stored {
                at,
                variable: *variable,
                values: components,
            })
        }
        _ => None,
    }
}

/// The block that a variable is of, which the parameter stage stores to.
fn block_of(module: &Module, stored: Handle<GlobalVariable>) -> ParameterBlock {
    let ty = module.global_variables[stored].ty;
    let mut variables = module.global_variables.iter();
    let read = variables.find(|(_, v)| v.ty == ty && matches!(v.space, AddressSpace::Uniform));
    let (read, _) = read.expect("what is stored is read");
    ParameterBlock { ty, read, stored }
}

fn members(module: &Module, ty: Handle<Type>) -> &[StructMember] {
    match &module.types[ty].inner {
        TypeInner::Struct { members, .. } => members,
        other => unreachable!("{other:?} is no block"),
    }
}

/// Gives a block other members.
fn change(module: &mut Module, block: ParameterBlock, members: Vec<StructMember>) -> Handle<Type> {
    let name = module.types[block.ty].name.clone().unwrap_or_default();
    let ty = laid_out(module, name, members);
    for variable in [block.read, block.stored] {
        module.global_variables[variable].ty = ty;
    }
    ty
}

/// Puts members behind those of a block, or makes one. Returns the variable that is stored to, and its type.
pub(crate) fn extended(
    module: &mut Module,
    stored: Option<Handle<GlobalVariable>>,
    added: Vec<(String, Handle<Type>)>,
) -> (Handle<GlobalVariable>, Handle<Type>) {
    let member = |(name, ty): (String, Handle<Type>)| StructMember {
        name: Some(name),
        ty,
        binding: None,
        offset: 0,
    };
    let added = added.into_iter().map(member);
    if let Some(stored) = stored {
        let block = block_of(module, stored);
        let mut all = members(module, block.ty).to_vec();
        all.extend(added);
        return (stored, change(module, block, all));
    }
    let taken = names(module);
    let [name, read, stored] = [TYPE, READ, STORED].map(|name| free(name, &taken));
    let ty = laid_out(module, name, added.collect());
    let bindings = module.global_variables.iter();
    let last = bindings
        .filter_map(|(_, variable)| variable.binding)
        .map(|binding| (binding.group, binding.binding))
        .max();
    let (group, first) = last.map_or((0, 0), |(group, binding)| (group, binding + 1));
    let mut variable = |name, binding, space| {
        let variable = GlobalVariable {
            name: Some(name),
            space,
            binding: Some(ResourceBinding { group, binding }),
            ty,
            init: None,
            memory_decorations: naga::MemoryDecorations::empty(),
        };
        module.global_variables.append(variable, Span::UNDEFINED)
    };
    variable(read, first, AddressSpace::Uniform);
    let access = StorageAccess::LOAD | StorageAccess::STORE;
    let stored = variable(stored, first + 1, AddressSpace::Storage { access });
    (stored, ty)
}

/// The names of a module, of its entry points' values and variables among them.
pub(crate) fn names(module: &Module) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    found.extend(module.types.iter().filter_map(|(_, ty)| ty.name.clone()));
    let constants = module.constants.iter();
    found.extend(constants.filter_map(|(_, constant)| constant.name.clone()));
    let overrides = module.overrides.iter();
    found.extend(overrides.filter_map(|(_, value)| value.name.clone()));
    let variables = module.global_variables.iter();
    found.extend(variables.filter_map(|(_, variable)| variable.name.clone()));
    for point in &module.entry_points {
        found.insert(point.name.clone());
        let arguments = point.function.arguments.iter();
        found.extend(arguments.filter_map(|argument| argument.name.clone()));
        let locals = point.function.local_variables.iter();
        found.extend(locals.filter_map(|(_, local)| local.name.clone()));
        found.extend(point.function.named_expressions.values().cloned());
    }
    found
}

fn free(name: &str, taken: &BTreeSet<String>) -> String {
    let mut name = name.to_owned();
    while taken.contains(&name) {
        name.push_str(SUFFIX);
    }
    name
}

/// The shader with a parameter stage: an empty one where it has none.
pub(crate) fn with_stage(shader: &Shader) -> Shader {
    let mut shader = shader.clone();
    if shader.index(Stage::Parameter).is_some() {
        return shader;
    }
    let name = free(ENTRY, &names(&shader.module));
    let mut function = Function::default();
    function
        .body
        .push(Statement::Return { value: None }, Span::UNDEFINED);
    shader.module.entry_points.push(EntryPoint {
        name,
        stage: ShaderStage::Compute,
        early_depth_test: None,
        workgroup_size: [1, 1, 1],
        workgroup_size_overrides: None,
        function,
        mesh_info: None,
        task_payload: None,
        incoming_ray_payload: None,
    });
    shader.ids.push(Vec::new());
    Shader::changed(
        shader.module,
        shader.ids,
        shader.authors,
        shader.generated,
        shader.passes,
    )
}

/// A name for a member that no member has.
pub(crate) fn member_name(shader: &Shader, wish: &str) -> String {
    let taken = |name: &str| {
        let mut members = shader.parameters().iter();
        members.any(|member| member.name.as_deref() == Some(name))
    };
    let mut name = wish.to_owned();
    let mut ordinal = 1;
    while taken(&name) {
        ordinal += 1;
        name = format!("{wish}_{ordinal}");
    }
    name
}

/// Brings the block in order: without what no stage reads, by name.
pub(crate) fn settle(shader: Shader) -> Shader {
    let Some(block) = shader.parameter_block() else {
        return shader;
    };
    let all = shader.parameters();
    let mut read = vec![false; all.len()];
    for point in &shader.module.entry_points {
        let values = &point.function.expressions;
        for (_, expression) in values.iter() {
            if let Expression::AccessIndex { base, index } = *expression
                && matches!(values[base], Expression::GlobalVariable(v) if v == block.read)
            {
                read[index as usize] = true;
            }
        }
    }
    let mut order: Vec<usize> = (0..all.len()).filter(|at| read[*at]).collect();
    order.sort_by(|a, b| all[*a].name.cmp(&all[*b].name));
    if order.iter().copied().eq(0..all.len()) {
        return shader;
    }
    let members: Vec<StructMember> = order.iter().map(|at| all[*at].clone()).collect();
    let dropped = members.len() < all.len();
    let Shader {
        mut module,
        mut ids,
        authors,
        generated,
        passes,
        ..
    } = shader;
    let mut entries = module.entry_points.iter();
    let entry = entries.position(|point| point.stage == ShaderStage::Compute);
    let entry = entry.expect("the block has a stage");
    if members.is_empty() {
        module.entry_points.remove(entry);
        ids.remove(entry);
        // Textures that were made after the block are behind its variables.
        let mut variables = Arena::new();
        let mut renumbered = BTreeMap::new();
        for (variable, declared) in module.global_variables.iter() {
            if variable != block.read && variable != block.stored {
                let span = module.global_variables.get_span(variable);
                renumbered.insert(variable, variables.append(declared.clone(), span));
            }
        }
        module.global_variables = variables;
        for point in &mut module.entry_points {
            for (_, expression) in point.function.expressions.iter_mut() {
                if let Expression::GlobalVariable(variable) = expression
                    && let Some(now) = renumbered.get(variable)
                {
                    *variable = *now;
                }
            }
        }
        return Shader::changed(module, ids, authors, generated, passes);
    }
    let ty = change(&mut module, block, members);
    for point in &mut module.entry_points {
        let values = &mut point.function.expressions;
        let of_block: Vec<Handle<Expression>> = values
            .iter()
            .filter(|(_, e)| matches!(e, Expression::GlobalVariable(v) if *v == block.read))
            .map(|(value, _)| value)
            .collect();
        for (_, expression) in values.iter_mut() {
            if let Expression::AccessIndex { base, index } = expression
                && of_block.contains(base)
            {
                let new = order.iter().position(|old| *old == *index as usize);
                *index = new.map_or(*index, |new| new as u32);
            }
        }
    }
    let function = &mut module.entry_points[entry].function;
    if let Some(stored) = stored(&function.body, &function.expressions)
        && let Statement::Store { value, .. } = function.body[stored.at]
    {
        let components = order.iter().map(|old| stored.values[*old]).collect();
        function.expressions[value] = Expression::Compose { ty, components };
    }
    let shader = Shader::changed(module, ids, authors, generated, passes);
    match dropped {
        // What computed it goes.
        true => Edit::new(&shader, Stage::Parameter).finish(),
        false => shader,
    }
}

/// What a parameter stage does for some members of its block alone.
#[derive(Clone, Debug)]
pub struct ParameterPart {
    /// A function that stores each of them by itself, and nothing else.
    pub function: Function,
    /// The id of each value; `None` for those that are made here.
    pub ids: Vec<Option<ValueId>>,
}

impl Shader {
    /// What the parameter stage does for the members at these places of the block; `None` without a block.
    pub fn parameter_part(&self, places: &[usize]) -> Option<ParameterPart> {
        let old = self.function(Stage::Parameter)?;
        let Stored {
            at,
            variable,
            values: components,
        } = stored(&old.body, &old.expressions)?;
        let mut function = old.clone();
        let last = function.body.len();
        function.body.cull(at..last);
        let base = append(&mut function, Expression::GlobalVariable(variable));
        for place in places {
            let index = *place as u32;
            let pointer = append(&mut function, Expression::AccessIndex { base, index });
            let value = *components.get(*place)?;
            let store = Statement::Store { pointer, value };
            function.body.push(store, Span::UNDEFINED);
        }
        let kept = keep_needed(&function);
        let ids = kept.origins.iter().map(|origin| {
            let is_old = origin.index() < old.expressions.len();
            is_old.then(|| self.id(Stage::Parameter, *origin).clone())
        });
        Some(ParameterPart {
            ids: ids.collect(),
            function: kept.function,
        })
    }

    /// For each member of the block, the identity of what computes it: equal in two variants of a shader when they compute
    /// it alike.
    pub fn parameter_fingerprints(&self) -> Vec<Fingerprint> {
        let Some(old) = self.function(Stage::Parameter) else {
            return Vec::new();
        };
        let Some(Stored {
            at,
            values: components,
            ..
        }) = stored(&old.body, &old.expressions)
        else {
            return Vec::new();
        };
        let declared = Declared::of(&self.module);
        let members = self.parameters().iter().zip(components);
        let alone = members.map(|(member, value)| {
            let mut function = old.clone();
            let last = function.body.len();
            let value = Some(*value);
            let end = Block::from_vec(vec![Statement::Return { value }]);
            function.body.splice(at..last, end);
            function.result = Some(FunctionResult {
                ty: member.ty,
                binding: None,
            });
            of_function(&declared, &keep_needed(&function).function)
        });
        alone.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::New;
    use crate::to_parameter::ToParameter;
    use crate::{Candidate, Facts, Pass, normalize};

    const LIT: &str = "
        struct Light { direction: vec3f, strength: f32 }
        @group(0) @binding(3) var<uniform> light: Light;
        @fragment fn fs_main(@location(0) normal: vec3f) -> @location(0) vec4f {
            let towards = normalize(light.direction);
            let bright = pow(light.strength, 1.5);
            let lambert = dot(normal, towards);
            let shown = lambert * bright;
            return vec4f(shown, normal);
        }";

    fn base() -> Shader {
        let module = naga::front::wgsl::parse_str(LIT).expect("it parses");
        normalize(&module, None, "fs_main", 1000).expect("it is small")
    }

    fn names(shader: &Shader) -> Vec<&str> {
        let members = shader.parameters().iter();
        members.filter_map(|m| m.name.as_deref()).collect()
    }

    /// The shader with a value of it made a number.
    fn baked(shader: &Shader, path: &str) -> Shader {
        let (stage, value) = shader.find(&path.into()).expect("the test names a value");
        let mut edit = Edit::new(shader, stage);
        edit.replace(value, New::Numbers(vec![0.5]));
        edit.finish()
    }

    #[test]
    fn members_are_in_the_order_of_their_names_and_go_with_their_last_reader() {
        let base = base();
        let exact = ToParameter.candidates(&base, &Facts::default());
        let [towards, bright] = &exact[..] else {
            panic!("{exact:?}");
        };
        let both = |order: [&Candidate; 2]| {
            let moved = order.iter().fold(base.clone(), |shader, candidate| {
                ToParameter.apply(&shader, candidate)
            });
            moved.validate().expect("it is valid");
            moved
        };
        let shader = both([towards, bright]);
        assert_eq!(names(&shader), ["bright", "towards"]);
        assert_eq!(shader.fingerprint(), both([bright, towards]).fingerprint());
        let block = shader.parameter_block().expect("it has one");
        let at = |variable| {
            let variable: &GlobalVariable = &shader.module().global_variables[variable];
            variable.binding.map(|at| (at.group, at.binding))
        };
        assert_eq!(
            (at(block.read), at(block.stored)),
            (Some((0, 4)), Some((0, 5)))
        );

        let less = baked(&shader, "fs_main.lambert");
        less.validate().expect("it is valid");
        assert_eq!(names(&less), ["bright"]);
        assert_eq!(less.parameters()[0].offset, 0);
        let none = baked(&shader, "fs_main.shown");
        none.validate().expect("it is valid");
        assert_eq!(none.index(Stage::Parameter), None);
        let variables = |shader: &Shader| shader.module().global_variables.len();
        assert_eq!(variables(&none), variables(&base));
    }

    #[test]
    fn the_stage_can_return_what_it_stores() {
        let base = base();
        let exact = ToParameter.candidates(&base, &Facts::default());
        let shader = exact.iter().fold(base, |shader, candidate| {
            ToParameter.apply(&shader, candidate)
        });
        let (module, entry) = shader.parameters_returned().expect("it has some");
        let function = &module.entry_points[entry].function;
        let ty = function.result.as_ref().map(|result| result.ty);
        let returned = members(&module, ty.expect("it returns them"));
        assert_eq!(returned.len(), 2);
        assert!(returned.iter().all(|member| member.binding.is_some()));
        let mut variables = module.global_variables.iter();
        assert!(variables.all(|(_, v)| !matches!(v.space, AddressSpace::Storage { .. })));
    }
}
