//! Puts the body of every called function in the place of its call.
//!
//! What a callee computes keeps its names and its spans, and remembers the path of calls that led to
//! it. Private variables become local variables of the entry point.

use super::names::{Tag, is_place};
use super::{NormalizeError, returns};
use crate::operands;
use naga::{
    AddressSpace, Block, EntryPoint, Expression, Function, GlobalVariable, Handle, LocalVariable,
    Module, Range, Span, Statement, SwitchCase,
};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A function without calls, and where its values and variables come from.
pub(super) struct Inlined {
    pub(super) function: Function,
    /// For each expression.
    pub(super) tags: Vec<Tag>,
    /// For each local variable.
    pub(super) locals: Vec<Tag>,
}

/// Inlines everything that an entry point of `module` calls. `functions` are the module's functions
/// without early returns, in arena order.
pub(super) fn inline(
    module: &Module,
    functions: &[Function],
    entry: &EntryPoint,
    limit: usize,
) -> Result<Inlined, NormalizeError> {
    let path: Arc<str> = entry.name.as_str().into();
    let mut inliner = Inliner {
        module,
        functions,
        entry,
        limit,
        out: Inlined {
            function: Function {
                name: entry.function.name.clone(),
                arguments: entry.function.arguments.clone(),
                result: entry.function.result.clone(),
                diagnostic_filter_leaf: entry.function.diagnostic_filter_leaf,
                ..Function::default()
            },
            tags: Vec::new(),
            locals: Vec::new(),
        },
        private: BTreeMap::new(),
        calls: BTreeMap::new(),
        pending: None,
    };
    let mut frame = inliner.frame(&entry.function, path, None);
    let mut body = Block::new();
    for (local, variable) in entry.function.local_variables.iter() {
        let init = variable
            .init
            .map(|init| inliner.value(&entry.function, &mut frame, init));
        let local = frame.locals[local.index()];
        inliner.out.function.local_variables[local].init = init;
    }
    inliner.block(&entry.function, &mut frame, &entry.function.body, &mut body)?;
    inliner.out.function.body = body;
    Ok(inliner.out)
}

/// The functions of a module without early returns, in arena order.
pub(super) fn prepare(module: &mut Module) -> Vec<Function> {
    let mut functions: Vec<Function> = std::mem::take(&mut module.functions)
        .into_inner()
        .into_iter()
        .collect();
    for function in &mut functions {
        returns::remove_early(&mut module.types, function);
    }
    functions
}

struct Inliner<'a> {
    module: &'a Module,
    functions: &'a [Function],
    entry: &'a EntryPoint,
    limit: usize,
    out: Inlined,
    /// Pointers to the local variables that stand for private variables.
    private: BTreeMap<Handle<GlobalVariable>, Handle<Expression>>,
    /// How often each path was called.
    calls: BTreeMap<String, u32>,
    /// The first and last new expression that no `Emit` covers yet.
    pending: Option<(Handle<Expression>, Handle<Expression>)>,
}

/// A function that is being copied.
struct Frame {
    /// The path of calls, such as `fs_main.fresnel`.
    path: Arc<str>,
    /// The arguments' values; nothing for the entry point, whose arguments stay.
    arguments: Option<Vec<Handle<Expression>>>,
    map: Vec<Option<Handle<Expression>>>,
    locals: Vec<Handle<LocalVariable>>,
    /// What the function returned.
    returned: Option<Handle<Expression>>,
}

impl Inliner<'_> {
    fn frame(
        &mut self,
        function: &Function,
        path: Arc<str>,
        arguments: Option<Vec<Handle<Expression>>>,
    ) -> Frame {
        let locals = function
            .local_variables
            .iter()
            .map(|(local, variable)| {
                let tag = Tag::named(path.clone(), variable.name.as_deref());
                self.out.locals.push(tag);
                let copy = LocalVariable {
                    init: None,
                    ..variable.clone()
                };
                let span = function.local_variables.get_span(local);
                self.out.function.local_variables.append(copy, span)
            })
            .collect();
        Frame {
            path,
            arguments,
            map: vec![None; function.expressions.len()],
            locals,
            returned: None,
        }
    }

    fn append(&mut self, expression: Expression, span: Span, tag: Tag) -> Handle<Expression> {
        self.out.tags.push(tag);
        self.out.function.expressions.append(expression, span)
    }

    fn flush(&mut self, block: &mut Block) {
        if let Some((first, last)) = self.pending.take() {
            let range = Range::new_from_bounds(first, last);
            block.push(Statement::Emit(range), Span::UNDEFINED);
        }
    }

    /// The local variable that stands for a private variable.
    fn private(&mut self, global: Handle<GlobalVariable>) -> Handle<Expression> {
        if let Some(pointer) = self.private.get(&global) {
            return *pointer;
        }
        let variable = &self.module.global_variables[global];
        let path: Arc<str> = self.entry.name.as_str().into();
        let init = variable.init.map(|init| self.global_value(init, &path));
        let span = self.module.global_variables.get_span(global);
        let tag = Tag::named(path, variable.name.as_deref());
        self.out.locals.push(tag.clone());
        let local = LocalVariable {
            name: variable.name.clone(),
            ty: variable.ty,
            init,
        };
        let local = self.out.function.local_variables.append(local, span);
        let pointer = self.append(Expression::LocalVariable(local), span, tag);
        self.private.insert(global, pointer);
        pointer
    }

    /// A copy of an initial value of the module.
    fn global_value(&mut self, value: Handle<Expression>, path: &Arc<str>) -> Handle<Expression> {
        let expressions = &self.module.global_expressions;
        let copy = operands::map(&expressions[value], |operand| {
            self.global_value(operand, path)
        });
        self.append(copy, expressions.get_span(value), Tag::of(path.clone()))
    }

    /// The copy of a value; what needs no `Emit`, and the constants that initialise variables, are
    /// copied when they are first met.
    fn value(
        &mut self,
        function: &Function,
        frame: &mut Frame,
        value: Handle<Expression>,
    ) -> Handle<Expression> {
        if let Some(copy) = frame.map[value.index()] {
            return copy;
        }
        let expression = &function.expressions[value];
        let name = function.named_expressions.get(&value).map(String::as_str);
        let tag = Tag::named(frame.path.clone(), name);
        let span = function.expressions.get_span(value);
        let copy = match expression {
            Expression::FunctionArgument(index) if frame.arguments.is_some() => {
                let arguments = frame.arguments.as_deref().unwrap_or_default();
                arguments[*index as usize]
            }
            Expression::GlobalVariable(global)
                if self.module.global_variables[*global].space == AddressSpace::Private =>
            {
                self.private(*global)
            }
            Expression::LocalVariable(local) => {
                let local = frame.locals[local.index()];
                let tag = self.out.locals[local.index()].clone();
                self.append(Expression::LocalVariable(local), span, tag)
            }
            other => {
                let copy = operands::map(other, |operand| self.value(function, frame, operand));
                self.append(copy, span, tag)
            }
        };
        if expression.needs_pre_emit() {
            frame.map[value.index()] = Some(copy);
        }
        copy
    }

    fn emit(
        &mut self,
        function: &Function,
        frame: &mut Frame,
        value: Handle<Expression>,
        block: &mut Block,
    ) {
        let name = function.named_expressions.get(&value).map(String::as_str);
        let expression = &function.expressions[value];
        let before = self.out.function.expressions.len();
        let copy = operands::map(expression, |operand| self.value(function, frame, operand));
        if self.out.function.expressions.len() != before {
            // An operand that needs no `Emit` came between.
            self.flush(block);
        }
        let tag = Tag::named(frame.path.clone(), name);
        let copy = self.append(copy, function.expressions.get_span(value), tag);
        frame.map[value.index()] = Some(copy);
        if let Some(name) = name {
            let names = &mut self.out.function.named_expressions;
            names.insert(copy, name.to_owned());
        }
        let first = self.pending.map_or(copy, |(first, _)| first);
        self.pending = Some((first, copy));
    }

    fn inner(
        &mut self,
        function: &Function,
        frame: &mut Frame,
        block: &Block,
    ) -> Result<Block, NormalizeError> {
        let mut copy = Block::new();
        self.block(function, frame, block, &mut copy)?;
        Ok(copy)
    }

    fn block(
        &mut self,
        function: &Function,
        frame: &mut Frame,
        block: &Block,
        out: &mut Block,
    ) -> Result<(), NormalizeError> {
        for (statement, span) in block.span_iter() {
            if let Statement::Emit(range) = statement {
                for value in range.clone() {
                    self.emit(function, frame, value, out);
                }
                continue;
            }
            // Operands that need no `Emit` may be appended from here on.
            self.flush(out);
            let copy = match statement {
                Statement::Call {
                    function: callee,
                    arguments,
                    result,
                } => {
                    let arguments = arguments
                        .iter()
                        .map(|argument| self.value(function, frame, *argument))
                        .collect();
                    let returned = self.call(*callee, arguments, frame, out)?;
                    if let Some(result) = result {
                        frame.map[result.index()] = returned;
                        let named = function.named_expressions.get(result);
                        if let (Some(name), Some(value)) = (named, returned) {
                            self.name(value, name, &frame.path);
                        }
                    }
                    continue;
                }
                Statement::Return { value } if frame.arguments.is_some() => {
                    frame.returned = value.map(|value| self.value(function, frame, value));
                    continue;
                }
                Statement::Block(inner) => {
                    self.block(function, frame, inner, out)?;
                    continue;
                }
                Statement::If {
                    condition,
                    accept,
                    reject,
                } => Statement::If {
                    condition: self.value(function, frame, *condition),
                    accept: self.inner(function, frame, accept)?,
                    reject: self.inner(function, frame, reject)?,
                },
                Statement::Switch { selector, cases } => {
                    let selector = self.value(function, frame, *selector);
                    let mut copies = Vec::with_capacity(cases.len());
                    for case in cases {
                        copies.push(SwitchCase {
                            value: case.value,
                            body: self.inner(function, frame, &case.body)?,
                            fall_through: case.fall_through,
                        });
                    }
                    Statement::Switch {
                        selector,
                        cases: copies,
                    }
                }
                Statement::Loop {
                    body,
                    continuing,
                    break_if,
                } => Statement::Loop {
                    body: self.inner(function, frame, body)?,
                    continuing: self.inner(function, frame, continuing)?,
                    break_if: break_if.map(|c| self.value(function, frame, c)),
                },
                other => {
                    let mut copy = other.clone();
                    if let Some(result) = operands::result(other) {
                        let expression = function.expressions[result].clone();
                        let span = function.expressions.get_span(result);
                        let tag = Tag::of(frame.path.clone());
                        let new = self.append(expression, span, tag);
                        frame.map[result.index()] = Some(new);
                    }
                    let map = &frame.map;
                    let results = |result: &mut Handle<Expression>| {
                        *result = map[result.index()].unwrap_or(*result);
                    };
                    operands::each_mut_of_statement(&mut copy, |_| {}, results);
                    let value = |operand: &mut _| *operand = self.value(function, frame, *operand);
                    operands::each_mut_of_statement(&mut copy, value, |_| {});
                    copy
                }
            };
            out.push(copy, *span);
        }
        self.flush(out);
        Ok(())
    }

    /// Names a value after what a person called it, unless it has a name.
    fn name(&mut self, value: Handle<Expression>, name: &str, path: &Arc<str>) {
        let tag = &mut self.out.tags[value.index()];
        let expressions = &self.out.function.expressions;
        let computed = !expressions[value].needs_pre_emit() && !is_place(expressions, value);
        if computed && tag.name.is_none() {
            *tag = Tag::named(path.clone(), Some(name));
            let names = &mut self.out.function.named_expressions;
            names.insert(value, name.to_owned());
        }
    }

    fn call(
        &mut self,
        callee: Handle<Function>,
        arguments: Vec<Handle<Expression>>,
        caller: &Frame,
        out: &mut Block,
    ) -> Result<Option<Handle<Expression>>, NormalizeError> {
        let functions = self.functions;
        let function = &functions[callee.index()];
        if self.out.function.expressions.len() + function.expressions.len() > self.limit {
            let name = function.name.as_deref().unwrap_or("a function");
            return Err(NormalizeError {
                message: format!(
                    "entry point `{}` grows beyond {} values when its calls are inlined, at a call \
                     of `{name}`",
                    self.entry.name, self.limit
                ),
                span: place(self.entry),
            });
        }
        // A function without a name is a part of its caller that a reader put apart.
        let path: Arc<str> = match function.name.as_deref() {
            None => caller.path.clone(),
            Some(name) => {
                let mut path = format!("{}.{name}", caller.path);
                let calls = self.calls.entry(path.clone()).or_insert(0);
                *calls += 1;
                if *calls > 1 {
                    path = format!("{path}_{calls}");
                }
                path.into()
            }
        };
        for (argument, value) in function.arguments.iter().zip(&arguments) {
            if let Some(name) = &argument.name {
                self.name(*value, name, &path);
            }
        }
        let mut frame = self.frame(function, path, Some(arguments));
        for (local, variable) in function.local_variables.iter() {
            // A call in a loop starts afresh each time.
            let local = frame.locals[local.index()];
            let tag = self.out.locals[local.index()].clone();
            let span = function.local_variables.get_span(local);
            if matches!(
                self.module.types[variable.ty].inner,
                naga::TypeInner::RayQuery { .. }
            ) {
                continue;
            }
            let pointer = self.append(Expression::LocalVariable(local), span, tag.clone());
            let value = match variable.init {
                Some(init) => {
                    let value = self.value(function, &mut frame, init);
                    self.emit_constant(value, out)
                }
                None => self.append(Expression::ZeroValue(variable.ty), span, tag),
            };
            out.push(Statement::Store { pointer, value }, span);
        }
        self.block(function, &mut frame, &function.body, out)?;
        Ok(frame.returned)
    }

    /// Computes a constant that initialised a variable where it can be stored.
    fn emit_constant(&mut self, value: Handle<Expression>, out: &mut Block) -> Handle<Expression> {
        let expression = self.out.function.expressions[value].clone();
        if expression.needs_pre_emit() {
            return value;
        }
        let mut copy = expression;
        operands::each_mut(&mut copy, |operand| {
            *operand = self.emit_constant(*operand, out);
        });
        let span = self.out.function.expressions.get_span(value);
        let tag = self.out.tags[value.index()].clone();
        let copy = self.append(copy, span, tag);
        out.push(Statement::Emit(Range::new_from_bounds(copy, copy)), span);
        copy
    }
}

/// Where an entry point is in the source.
pub(super) fn place(entry: &EntryPoint) -> Span {
    let body = entry.function.body.span_iter();
    body.map(|(_, span)| *span)
        .find(|span| span.is_defined())
        .unwrap_or(Span::UNDEFINED)
}
