//! A level's stages as ordinary functions, which the entry points of the spliced text call.

use super::body::{Body, renamed_module, unwritable};
use super::parameters::Block as ParameterBlock;
use super::print::{Owner, Printed, Wishes, path_name, print, value_name};
use super::varyings::{Varyings, location, outputs, same_place};
use super::{EmitLevel, flaw};
use crate::front::identifiers::Names;
use crate::{Diagnostic, Result};
use lodc_passes::edit::append;
use lodc_passes::gradients::Front;
use lodc_passes::shader::Stage;
use lodc_passes::{Shader, operands};
use naga::proc::Layouter;
use naga::{
    Binding, Block, Expression, Function, FunctionResult, Handle, Literal, Module, Scalar, Span,
    Statement, StructMember, Type, TypeInner,
};

/// The fragment stage of a level, the one at this place in the list, written with what it needs.
pub(crate) fn fragment_function(
    body: &Body<'_>,
    (at, level): (usize, &EmitLevel),
    name: &str,
    block: Option<&ParameterBlock>,
    names: &Names,
) -> Result<Printed> {
    let (mut module, mut function) = stage_of(body, level, Stage::Fragment)?;
    if let Some(block) = block {
        block.put_into((at, level), &mut module, &mut function);
    }
    if let Some(result) = &mut function.result {
        result.binding = None;
    }
    let mut keep = block.map_or(Vec::new(), |block| block.names().to_vec());
    keep.extend(generated_names(level));
    let value = named(level, Stage::Fragment);
    written(body, (&mut module, function), (name, &keep), &value, names)
}

/// What the vertex stage of a shader with several levels returns: a struct of what the author's does and of what levels
/// hand over beside it.
pub(crate) struct HandedOver<'a> {
    /// The struct's name.
    pub(crate) name: &'a str,
    /// The shader before any level.
    pub(crate) base: &'a Shader,
    /// What levels hand over.
    pub(crate) varyings: &'a Varyings,
}

/// The vertex stage of a level, the one at this place in the list, written with what it needs: with the struct that it
/// returns, or a bare position without one.
pub(crate) fn vertex_function(
    body: &Body<'_>,
    (at, level): (usize, &EmitLevel),
    name: &str,
    (handed_over, block): (Option<&HandedOver<'_>>, Option<&ParameterBlock>),
    names: &Names,
) -> Result<Printed> {
    let (mut module, mut function) = stage_of(body, level, Stage::Vertex)?;
    if let Some(block) = block {
        block.put_into((at, level), &mut module, &mut function);
    }
    if let Some(handed_over) = handed_over {
        let own = &handed_over.varyings.of_levels[at];
        if handed_over
            .returned_by(&mut module, &mut function, own)
            .is_none()
        {
            let error = Diagnostic::error("internal error: a level's vertex stage returns nothing");
            return Err(flaw(error, body.source));
        }
    } else if let Some(result) = &mut function.result {
        result.binding = None;
    }
    let mut keep = block.map_or(Vec::new(), |block| block.names().to_vec());
    keep.extend(handed_over.map(|handed_over| handed_over.name));
    let value = named(level, Stage::Vertex);
    written(body, (&mut module, function), (name, &keep), &value, names)
}

/// What the parameter stage of a level does for the members at these places of its own block, written with what it needs.
pub(crate) fn parameter_function(
    body: &Body<'_>,
    (at, level): (usize, &EmitLevel),
    members: &[usize],
    name: &str,
    block: &ParameterBlock,
    names: &Names,
) -> Result<Printed> {
    let (mut module, _) = stage_of(body, level, Stage::Parameter)?;
    let Some(part) = level.shader.parameter_part(members) else {
        let error = Diagnostic::error("internal error: a level has no parameter stage");
        return Err(flaw(error, body.source));
    };
    let mut function = part.function;
    block.put_into((at, level), &mut module, &mut function);
    let value = |value: Handle<Expression>| {
        let id = part.ids.get(value.index())?.as_ref()?;
        Some(path_name(&level.shader, id.path()))
    };
    written(
        body,
        (&mut module, function),
        (name, &block.names()),
        &value,
        names,
    )
}

/// What computes the gradients of a level's fragment stage, written with the struct of them that it returns.
pub(crate) fn gradient_function(
    body: &Body<'_>,
    (at, level): (usize, &EmitLevel),
    front: &Front,
    (name, result): (&str, &str),
    block: Option<&ParameterBlock>,
    names: &Names,
) -> Result<Printed> {
    let (mut module, _) = stage_of(body, level, Stage::Fragment)?;
    let mut function = front.function.clone();
    for argument in &mut function.arguments {
        argument.binding = None;
    }
    if let Some(block) = block {
        block.put_into((at, level), &mut module, &mut function);
    }
    let members = front.gradients.iter().map(|(name, inner)| {
        let ty = insert(&mut module, inner);
        (name.clone(), None, ty)
    });
    let members: Vec<_> = members.collect();
    let ty = insert_struct(&mut module, result, members.into_iter());
    let returned = match function.body.last() {
        Some(Statement::Return { value }) => *value,
        _ => None,
    };
    let (Some(of_gradients), Some(returned)) = (ty, returned) else {
        let error = Diagnostic::error("internal error: gradients have no place in memory");
        return Err(flaw(error, body.source));
    };
    let mut derived = Vec::new();
    if let Expression::Compose { ty, components } = &mut function.expressions[returned] {
        *ty = of_gradients;
        derived.clone_from(components);
    }
    function.result = Some(FunctionResult {
        ty: of_gradients,
        binding: None,
    });
    let mut keep = block.map_or(Vec::new(), |block| block.names().to_vec());
    keep.push(result);
    let value = |value: Handle<Expression>| {
        if let Some(at) = derived.iter().position(|gradient| *gradient == value) {
            return front.gradients.get(at).map(|(name, _)| name.clone());
        }
        let id = front.ids.get(value.index())?.as_ref()?;
        Some(path_name(&level.shader, id.path()))
    };
    written(body, (&mut module, function), (name, &keep), &value, names)
}

/// The names of a level's generated textures.
fn generated_names(level: &EmitLevel) -> impl Iterator<Item = &str> {
    let generated = level.shader.generated().into_iter();
    let variables = &level.shader.module().global_variables;
    generated.filter_map(|(variable, _)| variables[variable].name.as_deref())
}

/// A level's module without its entry points, and the function of one of them, without the attributes of its arguments.
fn stage_of(body: &Body<'_>, level: &EmitLevel, stage: Stage) -> Result<(Module, Function)> {
    let mut module = renamed_module(body, level);
    let Some(entry) = level.shader.index(stage) else {
        let stage = format!("{stage:?}").to_lowercase();
        let error = format!("internal error: a level has no {stage} entry point");
        return Err(flaw(Diagnostic::error(error), body.source));
    };
    let mut function = module.entry_points.swap_remove(entry).function;
    module.entry_points.clear();
    for argument in &mut function.arguments {
        argument.binding = None;
    }
    Ok((module, function))
}

/// Writes a level's function under a name, and what else is there under the names to keep. `value` names its values.
fn written(
    body: &Body<'_>,
    (module, mut function): (&mut Module, Function),
    (name, keep): (&str, &[&str]),
    value: &dyn Fn(Handle<Expression>) -> Option<String>,
    names: &Names,
) -> Result<Printed> {
    function.name = Some(name.to_owned());
    let handle = module.functions.append(function, Span::UNDEFINED);
    let mut outside = Names::default();
    outside.reserve(body.declared.iter().copied());
    print(
        module,
        &Wishes {
            keep: &|wish| wish == name || keep.contains(&wish) || body.declared.contains(wish),
            taken: names,
            outside: &outside,
            value: &|owner, of| (owner == Owner::Function(handle)).then(|| value(of))?,
            short_types: body.text.uses_short_types(),
        },
    )
    .map_err(|reason| unwritable(body.source, &reason))
}

/// Names the values that a stage of a level had before it was changed here.
fn named(level: &EmitLevel, stage: Stage) -> impl Fn(Handle<Expression>) -> Option<String> {
    let function = level.shader.function(stage);
    let values = function.map_or(0, |function| function.expressions.len());
    move |value| {
        let is_levels = value.index() < values;
        is_levels.then(|| value_name(&level.shader, stage, value))?
    }
}

impl HandedOver<'_> {
    /// Makes a vertex function of a level return the struct: what it does not return itself is 0. `None` when it returns
    /// nothing.
    fn returned_by(
        &self,
        module: &mut Module,
        function: &mut Function,
        own: &[(u32, usize)],
    ) -> Option<()> {
        let base = self.base.function(Stage::Vertex)?;
        let of_base = outputs(self.base.module(), base);
        let of_level = outputs(module, function);
        // Where the level returns each member, if it does.
        let mut members = Vec::new();
        for output in of_base {
            let found = of_level
                .iter()
                .position(|of_level| same_place(&of_level.binding, &output.binding));
            let ty = match found {
                Some(at) => of_level[at].ty,
                None => insert(module, &self.base.module().types[output.ty].inner),
            };
            let name = output.member.unwrap_or_else(|| "position".to_owned());
            members.push((name, output.binding, ty, found));
        }
        for (place, varying) in self.varyings.shared.iter().enumerate() {
            let own = own.iter().find(|(_, shared)| *shared == place);
            let found = own.and_then(|(own, _)| {
                of_level
                    .iter()
                    .position(|of_level| location(&of_level.binding) == Some(*own))
            });
            let ty = insert(module, &varying.ty);
            members.push((varying.name.clone(), varying.binding.clone(), ty, found));
        }

        let Some(Statement::Return { value: Some(value) }) = function.body.last() else {
            return None;
        };
        let value = *value;
        let last = function.body.len() - 1;
        function.body.cull(last..);
        let is_struct = of_level.iter().all(|output| output.member.is_some());
        let known = match (&function.expressions[value], is_struct) {
            (Expression::Compose { components, .. }, true) => {
                let components = components.clone();
                take_away(function, value);
                Some(components)
            }
            (_, true) => None,
            (_, false) => Some(vec![value]),
        };
        let mut components = Vec::new();
        for (_, _, ty, found) in &members {
            let expression = match (found, &known) {
                (Some(at), Some(known)) => {
                    components.push(*known.get(*at)?);
                    continue;
                }
                (Some(at), None) => Expression::AccessIndex {
                    base: value,
                    index: *at as u32,
                },
                (None, _) if module.types[*ty].inner == TypeInner::Scalar(Scalar::F32) => {
                    Expression::Literal(Literal::F32(0.0))
                }
                (None, _) => Expression::ZeroValue(*ty),
            };
            components.push(append(function, expression));
        }
        let members = members.into_iter();
        let members = members.map(|(name, binding, ty, _)| (name, Some(binding), ty));
        let ty = insert_struct(module, self.name, members)?;
        let returned = append(function, Expression::Compose { ty, components });
        let statement = Statement::Return {
            value: Some(returned),
        };
        function.body.push(statement, Span::UNDEFINED);
        function.result = Some(FunctionResult { ty, binding: None });
        Some(())
    }
}

fn insert(module: &mut Module, inner: &TypeInner) -> Handle<Type> {
    let ty = Type {
        name: None,
        inner: inner.clone(),
    };
    module.types.insert(ty, Span::UNDEFINED)
}

/// A struct of this name with its members, each with its place in memory. `None` when a member's type has none.
fn insert_struct(
    module: &mut Module,
    name: &str,
    members: impl Iterator<Item = (String, Option<Binding>, Handle<Type>)>,
) -> Option<Handle<Type>> {
    let mut layouter = Layouter::default();
    layouter.update(module.to_ctx()).ok()?;
    let mut offset = 0;
    let mut widest = naga::proc::Alignment::ONE;
    let members: Vec<StructMember> = members
        .map(|(name, binding, ty)| {
            let layout = layouter[ty];
            let start = layout.alignment.round_up(offset);
            offset = start + layout.size;
            widest = widest.max(layout.alignment);
            StructMember {
                name: Some(name),
                ty,
                binding,
                offset: start,
            }
        })
        .collect();
    let ty = Type {
        name: Some(name.to_owned()),
        inner: TypeInner::Struct {
            members,
            span: widest.round_up(offset),
        },
    };
    Some(module.types.insert(ty, Span::UNDEFINED))
}

/// Takes the use away that a value of the function's outermost block makes of others, where nothing uses the value: what
/// is used once is written where it is used.
fn take_away(function: &mut Function, value: Handle<Expression>) {
    let mut is_used = false;
    let mut see = |operand| is_used |= operand == value;
    for (_, expression) in function.expressions.iter() {
        operands::each(expression, &mut see);
    }
    operands::walk(&function.body, &mut |statement| {
        operands::each_of_statement(statement, &mut see);
    });
    if is_used {
        return;
    }
    let mut body = Block::with_capacity(function.body.len() + 1);
    let mut is_found = false;
    for (statement, span) in function.body.span_iter() {
        let range = match statement {
            Statement::Emit(range) if range.clone().any(|one| one == value) => range.clone(),
            other => {
                body.push(other.clone(), *span);
                continue;
            }
        };
        is_found = true;
        let [before, behind]: [Vec<Handle<Expression>>; 2] = [
            range.clone().filter(|one| *one < value).collect(),
            range.filter(|one| *one > value).collect(),
        ];
        for part in [before, behind] {
            if let (Some(first), Some(last)) = (part.first(), part.last()) {
                let range = naga::Range::new_from_bounds(*first, *last);
                body.push(Statement::Emit(range), *span);
            }
        }
    }
    if is_found {
        function.body = body;
        function.expressions[value] = Expression::Literal(Literal::Bool(false));
    }
}
