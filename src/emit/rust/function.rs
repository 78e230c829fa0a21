//! A function of a module as a function of Rust: its variables, statements and values.
//!
//! A value with a name is a `let` of that name, and so is one that is used twice, or that is loaded from a variable which may
//! change before it is used. All others are written where they are used.

use super::prelude::{MODULE, Prelude};
use super::text::{Level, Text, rust_name};
use super::types::{Types, length};
use super::{Global, Written};
use crate::front::identifiers::Names;
use lodc_passes::cost;
use lodc_passes::operands::{self, User};
use lodc_passes::semantics::{Operation, Shape};
use naga::front::Typifier;
use naga::{
    Arena, ArraySize, Block, Constant, Expression, Function, GlobalVariable, Handle, Literal,
    Statement, SwitchCase, SwitchValue, Type, TypeInner,
};
use std::collections::{BTreeMap, BTreeSet};

/// What all functions share.
pub(super) struct Shared<'a> {
    pub(super) types: Types<'a>,
    pub(super) prelude: Prelude,
    /// Constants that have been asked for and take a declaration.
    pub(super) constants: BTreeMap<Handle<Constant>, String>,
    /// The variables that functions take, by what they are called.
    pub(super) globals: BTreeMap<Handle<GlobalVariable>, Global>,
    /// Which of them each function needs, by its place in the arena.
    pub(super) needs: Vec<BTreeSet<Handle<GlobalVariable>>>,
    /// What each function is called.
    pub(super) functions: Vec<String>,
}

/// A function that is being written.
pub(super) struct Body<'s, 'a> {
    shared: &'s mut Shared<'a>,
    function: &'a Function,
    types: Typifier,
    users: Vec<Vec<User>>,
    /// The name of each value that has a `let`.
    lets: Vec<Option<String>>,
    arguments: Vec<String>,
    locals: Vec<String>,
    /// What a return without a value returns.
    returned: Option<String>,
    /// The variable that is a variable here, and not a reference to one.
    own: Option<Handle<GlobalVariable>>,
    /// Values whose `let` is outside of the block that computes them.
    declared: BTreeSet<Handle<Expression>>,
    /// What `break` and `continue` lead to, from the outermost.
    jumps: Vec<Jump>,
    labels: usize,
    out: String,
    depth: usize,
}

/// What can be left.
struct Jump {
    /// The label of what a `break` leaves, where it needs one, and whether it has been used.
    left: String,
    is_left: bool,
    /// What a `continue` of a loop leaves.
    continued: Option<String>,
    is_loop: bool,
}

/// A place that can be read and, but for an element of a slice, written.
struct Place {
    text: String,
    /// Whether the text is a reference to the place.
    is_reference: bool,
    /// Whether what is there is padded.
    is_padded: bool,
}

impl<'s, 'a> Body<'s, 'a> {
    pub(super) fn new(
        shared: &'s mut Shared<'a>,
        function: &'a Function,
        own: Option<Handle<GlobalVariable>>,
    ) -> Written<Self> {
        let module = shared.types.module;
        let types = cost::types(module, function).map_err(|error| error.to_string())?;
        let mut names = Names::default();
        names.reserve([MODULE, "libm"]);
        names.reserve(shared.globals.values().map(|global| global.name.as_str()));
        let slices = shared
            .globals
            .values()
            .filter_map(|global| global.slice.as_ref());
        names.reserve(slices.cloned().collect::<Vec<_>>());
        let constants = module.constants.iter();
        names.reserve(constants.filter_map(|(_, constant)| constant.name.clone()));
        let mut called = |wish: Option<&str>, otherwise: &str| {
            let wish = wish.unwrap_or(otherwise);
            rust_name(&names.take_local(wish, &BTreeSet::new()))
        };
        let arguments = function.arguments.iter();
        let arguments = arguments.map(|argument| called(argument.name.as_deref(), "argument"));
        let arguments = arguments.collect();
        let locals = function.local_variables.iter();
        let locals = locals.map(|(_, local)| called(local.name.as_deref(), "local"));
        let locals = locals.collect();
        let mut body = Self {
            users: operands::users(function),
            lets: vec![None; function.expressions.len()],
            shared,
            function,
            types,
            arguments,
            locals,
            returned: None,
            own,
            declared: BTreeSet::new(),
            jumps: Vec::new(),
            labels: 0,
            out: String::new(),
            depth: 1,
        };
        let lets = body.values_with_lets();
        for (value, _) in function.expressions.iter() {
            if lets[value.index()] {
                let wish = function.named_expressions.get(&value).map(String::as_str);
                body.lets[value.index()] = Some(called(wish, "value"));
            }
        }
        Ok(body)
    }

    /// Writes all statements. `returned` is what a return without a value returns.
    pub(super) fn written(mut self, returned: Option<String>) -> Written<String> {
        self.returned = returned;
        for (local, variable) in self.function.local_variables.iter() {
            let mut loads = self.function.expressions.iter();
            if !loads.any(|(_, e)| matches!(e, Expression::LocalVariable(of) if *of == local)) {
                continue;
            }
            let ty = self.shared.types.value(variable.ty)?;
            let init = match variable.init {
                Some(init) => self.value(init)?,
                None => self.shared.types.zero(variable.ty)?,
            };
            let name = self.locals[local.index()].clone();
            self.line(&format!("let mut {name}: {ty} = {};", init.text));
        }
        // What is returned at the end stands there by itself.
        let mut body = self.function.body.clone();
        let mut end = self.returned.clone();
        if let Some(Statement::Return { value }) = body.last() {
            let value = *value;
            let last = body.len() - 1;
            body.cull(last..);
            self.block(&body)?;
            if let Some(value) = value {
                end = Some(self.value(value)?.text);
            }
        } else {
            self.block(&body)?;
        }
        if let Some(end) = end {
            self.line(&end);
        }
        Ok(self.out)
    }

    /// The arguments of the function, without the variables that it needs.
    pub(super) fn parameters(&mut self) -> Written<Vec<String>> {
        let function = self.function;
        let all = function.arguments.iter().enumerate().map(|(at, argument)| {
            let ty = self.shared.types.value(argument.ty)?;
            Ok(format!("{}: {ty}", self.arguments[at]))
        });
        all.collect()
    }

    fn inner(&self, value: Handle<Expression>) -> &TypeInner {
        self.types.get(value, &self.shared.types.module.types)
    }

    fn is_pointer(&self, value: Handle<Expression>) -> bool {
        self.inner(value).pointer_space().is_some()
    }

    // Which values have a `let`.

    fn values_with_lets(&self) -> Vec<bool> {
        let function = self.function;
        let mut lets = vec![false; function.expressions.len()];
        for (value, expression) in function.expressions.iter() {
            let uses = self.users[value.index()].len();
            let is_free = expression.needs_pre_emit() || self.is_pointer(value);
            let named = function.named_expressions.contains_key(&value);
            lets[value.index()] = match expression {
                Expression::CallResult(_) => true,
                Expression::Literal(_) | Expression::ZeroValue(_) => named && uses > 1,
                _ => !is_free && uses > 0 && (named || uses > 1),
            };
        }
        self.keep_loads(&function.body, None, &mut lets);
        lets
    }

    /// Gives a `let` to what is loaded from variables and not used at once.
    fn keep_loads(&self, block: &Block, last: Option<Handle<Expression>>, lets: &mut [bool]) {
        let mut run = Vec::new();
        for statement in block {
            if let Statement::Emit(range) = statement {
                run.extend(range.clone());
                continue;
            }
            let mut read = Vec::new();
            if !matches!(statement, Statement::Loop { .. }) {
                operands::each_of_statement(statement, |operand| read.push(operand));
            }
            self.keep_of_run(&run, &read, lets);
            run.clear();
            match statement {
                Statement::Loop {
                    body,
                    continuing,
                    break_if,
                } => {
                    self.keep_loads(body, None, lets);
                    self.keep_loads(continuing, *break_if, lets);
                }
                other => operands::blocks(other).for_each(|b| self.keep_loads(b, None, lets)),
            }
        }
        let read: Vec<Handle<Expression>> = last.into_iter().collect();
        self.keep_of_run(&run, &read, lets);
    }

    /// The same for values that are computed one after the other, before a statement that reads some.
    fn keep_of_run(
        &self,
        run: &[Handle<Expression>],
        read: &[Handle<Expression>],
        lets: &mut [bool],
    ) {
        let mut here: BTreeSet<Handle<Expression>> = BTreeSet::new();
        for &value in run.iter().rev() {
            let mut by_statements = 0;
            let mut stays = true;
            for user in &self.users[value.index()] {
                match user {
                    User::Statement(_) => by_statements += 1,
                    User::Value(user) => {
                        stays &= run.contains(user) && (lets[user.index()] || here.contains(user));
                    }
                }
            }
            stays &= by_statements == read.iter().filter(|one| **one == value).count();
            if stays {
                here.insert(value);
            } else if let Expression::Load { pointer } = self.function.expressions[value]
                && !self.is_pointer(value)
                && self.may_change(pointer)
            {
                lets[value.index()] = true;
            }
        }
    }

    /// Whether a pointer leads to what this function may store to.
    fn may_change(&self, pointer: Handle<Expression>) -> bool {
        match self.function.expressions[pointer] {
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                self.may_change(base)
            }
            Expression::GlobalVariable(variable) => {
                (self.shared.globals.get(&variable)).is_none_or(|global| global.is_stored)
            }
            _ => true,
        }
    }

    // Statements.

    fn line(&mut self, text: &str) {
        for _ in 0..self.depth {
            self.out.push_str("    ");
        }
        self.out.push_str(text);
        self.out.push('\n');
    }

    fn block(&mut self, block: &Block) -> Written<()> {
        block
            .iter()
            .try_for_each(|statement| self.statement(statement))
    }

    /// A block with one more level of indentation.
    fn inner_block(&mut self, block: &Block) -> Written<()> {
        self.depth += 1;
        let done = self.block(block);
        self.depth -= 1;
        done
    }

    fn statement(&mut self, statement: &Statement) -> Written<()> {
        match statement {
            Statement::Emit(range) => {
                for value in range.clone() {
                    if self.lets[value.index()].is_some() {
                        let text = self.computed(value)?;
                        self.name(value, &text)?;
                    }
                }
            }
            // Names are unique in a function, so that a block hides none.
            Statement::Block(block) => self.block(block)?,
            Statement::If {
                condition,
                accept,
                reject,
            } => self.branch(*condition, accept, reject)?,
            Statement::Switch { selector, cases } => self.switch(*selector, cases)?,
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => self.rounds(body, continuing, *break_if)?,
            Statement::Break => {
                let jump = self.jumps.last_mut().ok_or("a break out of nothing")?;
                jump.is_left = true;
                let text = format!("break {};", jump.left);
                self.line(&text);
            }
            Statement::Continue => {
                let mut loops = self.jumps.iter().rev();
                let jump = loops
                    .find(|jump| jump.is_loop)
                    .ok_or("a continue of nothing")?;
                let text = match &jump.continued {
                    Some(label) => format!("break {label};"),
                    None => format!("continue {};", jump.left),
                };
                self.line(&text);
            }
            Statement::Return { value } => {
                let value = match value {
                    Some(value) => Some(self.value(*value)?.text),
                    None => self.returned.clone(),
                };
                match value {
                    Some(value) => self.line(&format!("return {value};")),
                    None => self.line("return;"),
                }
            }
            Statement::Store { pointer, value } => {
                let place = self.place(*pointer)?;
                let value = self.value(*value)?;
                let is_matrix = matches!(self.pointee(*pointer)?.1, TypeInner::Matrix { .. });
                let value = match (place.is_padded, is_matrix) {
                    (false, _) => value,
                    (true, true) => self.padded_columns(&value)?,
                    (true, false) => self.shared.prelude.call("padded", &[value])?,
                };
                let star = if place.is_reference { "*" } else { "" };
                self.line(&format!("{star}{} = {};", place.text, value.text));
            }
            Statement::Call {
                function,
                arguments,
                result,
            } => {
                let mut all = Vec::new();
                for argument in arguments {
                    all.push(self.value(*argument)?.text);
                }
                for need in self.shared.needs[function.index()].clone() {
                    let Some(global) = self.shared.globals.get(&need) else {
                        continue;
                    };
                    if global.has_value {
                        let is_own = self.own == Some(need);
                        all.push(format!(
                            "{}{}",
                            if is_own { "&mut " } else { "" },
                            global.name
                        ));
                    }
                    all.extend(global.slice.clone());
                }
                let name = &self.shared.functions[function.index()];
                let call = format!("{name}({})", all.join(", "));
                match result {
                    Some(result) => self.name(*result, &Text::atom(call))?,
                    None => self.line(&format!("{call};")),
                }
            }
            _ => return Err("a statement that only a GPU has".into()),
        }
        Ok(())
    }

    /// Gives a value its name.
    fn name(&mut self, value: Handle<Expression>, text: &Text) -> Written<()> {
        let name = self.lets[value.index()].clone().unwrap_or_default();
        if self.declared.contains(&value) {
            self.line(&format!("{name} = {};", text.text));
        } else if text.is_loose {
            let ty = self.type_of(value)?;
            self.line(&format!("let {name}: {ty} = {};", text.text));
        } else {
            self.line(&format!("let {name} = {};", text.text));
        }
        Ok(())
    }

    fn type_of(&mut self, value: Handle<Expression>) -> Written<String> {
        if let Some(ty) = self.types[value].handle() {
            return self.shared.types.value(ty);
        }
        super::types::plain(self.inner(value))?.ok_or_else(|| "a value of no type".into())
    }

    fn branch(
        &mut self,
        condition: Handle<Expression>,
        accept: &Block,
        reject: &Block,
    ) -> Written<()> {
        let condition = self.value(condition)?;
        if accept.is_empty() && !reject.is_empty() {
            self.line(&format!("if !{} {{", condition.within(Level::Atom)));
            self.inner_block(reject)?;
        } else {
            self.line(&format!("if {} {{", condition.text));
            self.inner_block(accept)?;
            if !reject.is_empty() {
                self.line("} else {");
                self.inner_block(reject)?;
            }
        }
        self.line("}");
        Ok(())
    }

    fn label(&mut self, what: &str) -> String {
        self.labels += 1;
        format!("'{what}_{}", self.labels)
    }

    fn rounds(
        &mut self,
        body: &Block,
        continuing: &Block,
        break_if: Option<Handle<Expression>>,
    ) -> Written<()> {
        let left = self.label("rounds");
        let has_end = !continuing.is_empty() || break_if.is_some();
        let continued = (has_end && continues(body)).then(|| self.label("round"));
        self.jumps.push(Jump {
            left: left.clone(),
            is_left: false,
            continued: continued.clone(),
            is_loop: true,
        });
        self.line(&format!("{left}: loop {{"));
        self.depth += 1;
        match continued {
            Some(label) => {
                for value in self.seen_behind(body, continuing, break_if) {
                    if let Some(name) = self.lets[value.index()].clone() {
                        let ty = self.type_of(value)?;
                        self.line(&format!("let {name}: {ty};"));
                        self.declared.insert(value);
                    }
                }
                self.line(&format!("{label}: {{"));
                self.inner_block(body)?;
                self.line("}");
            }
            None => self.block(body)?,
        }
        self.block(continuing)?;
        if let Some(condition) = break_if {
            let condition = self.value(condition)?;
            self.line(&format!("if {} {{", condition.text));
            self.line(&format!("    break {left};"));
            self.line("}");
        }
        self.depth -= 1;
        self.line("}");
        self.jumps.pop();
        Ok(())
    }

    /// Values of a loop's body that what is behind it reads.
    fn seen_behind(
        &self,
        body: &Block,
        continuing: &Block,
        break_if: Option<Handle<Expression>>,
    ) -> Vec<Handle<Expression>> {
        let mut seen = BTreeSet::new();
        let mut wanted: Vec<Handle<Expression>> = break_if.into_iter().collect();
        operands::walk(continuing, &mut |statement| {
            operands::each_of_statement(statement, |operand| wanted.push(operand));
            if let Statement::Emit(range) = statement {
                wanted.extend(range.clone());
            }
        });
        while let Some(value) = wanted.pop() {
            if seen.insert(value) {
                operands::each(&self.function.expressions[value], |operand| {
                    wanted.push(operand)
                });
            }
        }
        let computed = body.iter().flat_map(|statement| match statement {
            Statement::Emit(range) => range.clone().collect(),
            other => operands::result(other).into_iter().collect::<Vec<_>>(),
        });
        computed.filter(|value| seen.contains(value)).collect()
    }

    fn switch(&mut self, selector: Handle<Expression>, cases: &[SwitchCase]) -> Written<()> {
        let selector = self.value(selector)?;
        let left = self.label("switch");
        self.jumps.push(Jump {
            left: left.clone(),
            is_left: false,
            continued: None,
            is_loop: false,
        });
        let start = self.out.len();
        self.depth += 1;
        self.line(&format!("match {} {{", selector.text));
        self.depth += 1;
        // The arms, the default apart since it comes last.
        let (mut values, mut is_default) = (Vec::new(), false);
        let mut otherwise: Option<&Block> = None;
        for case in cases {
            match case.value {
                SwitchValue::I32(value) => values.push(value.to_string()),
                SwitchValue::U32(value) => values.push(value.to_string()),
                SwitchValue::Default => is_default = true,
            }
            if case.fall_through {
                if !case.body.is_empty() {
                    return Err("a case that falls through".into());
                }
                continue;
            }
            if is_default {
                otherwise = Some(&case.body);
            } else {
                self.arm(&values.join(" | "), &case.body)?;
            }
            values.clear();
            is_default = false;
        }
        match otherwise {
            Some(body) => self.arm("_", body)?,
            None => self.line("_ => {}"),
        }
        self.depth -= 1;
        self.line("}");
        self.depth -= 1;
        let is_left = self.jumps.pop().is_some_and(|jump| jump.is_left);
        let written = self.out.split_off(start);
        if is_left {
            self.line(&format!("{left}: {{"));
            self.out.push_str(&written);
            self.line("}");
        } else {
            // One level less, since it is in no block of its own.
            for line in written.lines() {
                self.out.push_str(line.strip_prefix("    ").unwrap_or(line));
                self.out.push('\n');
            }
        }
        Ok(())
    }

    fn arm(&mut self, pattern: &str, body: &Block) -> Written<()> {
        // A break at its end leaves nothing undone.
        let mut body = body.clone();
        if let Some(Statement::Break) = body.last() {
            let last = body.len() - 1;
            body.cull(last..);
        }
        if body.is_empty() {
            self.line(&format!("{pattern} => {{}}"));
            return Ok(());
        }
        self.line(&format!("{pattern} => {{"));
        self.inner_block(&body)?;
        self.line("}");
        Ok(())
    }

    // Values.

    fn value(&mut self, value: Handle<Expression>) -> Written<Text> {
        match &self.lets[value.index()] {
            Some(name) if !self.function.expressions[value].needs_pre_emit() => {
                Ok(Text::atom(name.clone()))
            }
            _ => self.computed(value),
        }
    }

    fn computed(&mut self, value: Handle<Expression>) -> Written<Text> {
        let function = self.function;
        let module = self.shared.types.module;
        match function.expressions[value] {
            Expression::Literal(literal) => written_literal(literal),
            Expression::Constant(constant) => self.constant(constant),
            Expression::ZeroValue(ty) => self.shared.types.zero(ty),
            Expression::Compose { ty, ref components } => {
                let mut parts = Vec::new();
                for component in components {
                    let size = match self.inner(*component) {
                        TypeInner::Vector { size, .. } => *size as usize,
                        _ => 1,
                    };
                    parts.push((self.value(*component)?, size));
                }
                self.composed(ty, &parts)
            }
            Expression::Splat { size, value } => {
                let text = self.value(value)?;
                Ok(Text {
                    is_loose: text.is_loose,
                    ..Text::atom(format!("[{}; {}]", text.text, size as usize))
                })
            }
            Expression::Swizzle {
                size,
                vector,
                pattern,
            } => {
                let vector = self.value(vector)?;
                let picked: Vec<String> = (pattern[..size as usize].iter())
                    .map(|component| (*component as usize).to_string())
                    .collect();
                let at = Text::atom(format!("[{}]", picked.join(", ")));
                Ok(Text {
                    is_loose: vector.is_loose,
                    ..self.shared.prelude.call("pick", &[vector, at])?
                })
            }
            Expression::Access { base, index } => {
                let at = self.place_in(base, index)?;
                let text = self.value(base)?;
                self.component(base, &text, &at, None)
            }
            Expression::AccessIndex { base, index } => {
                let text = self.value(base)?;
                self.component(base, &text, &index.to_string(), Some(index as usize))
            }
            Expression::FunctionArgument(at) => {
                let name = self
                    .arguments
                    .get(at as usize)
                    .ok_or("an argument that is not there")?;
                Ok(Text::atom(name.clone()))
            }
            Expression::Load { pointer } => {
                let place = self.place(pointer)?;
                let star = if place.is_reference { "*" } else { "" };
                let text = match star {
                    "" => Text::atom(place.text),
                    _ => Text::new(format!("*{}", place.text), Level::Unary),
                };
                let is_matrix = matches!(self.inner(value), TypeInner::Matrix { .. });
                match (place.is_padded, is_matrix) {
                    (false, _) => Ok(text),
                    (true, true) => self.unpadded_columns(&text),
                    (true, false) => self.shared.prelude.call("three", &[text]),
                }
            }
            Expression::ArrayLength(list) => {
                let place = self.place(list)?;
                Ok(Text::new(
                    format!("{}.len() as u32", place.text),
                    Level::Cast,
                ))
            }
            ref other => {
                let Some((operation, operands)) = Operation::of(other) else {
                    return Err(refused(other).to_owned());
                };
                let mut given = Vec::new();
                for operand in operands {
                    let shape = Shape::of(self.types.get(operand, &module.types));
                    let shape = shape.ok_or("numbers of 16 or 64 bits")?;
                    given.push((shape, self.value(operand)?));
                }
                let result = Shape::of(self.inner(value));
                let is_pair = matches!(self.inner(value), TypeInner::Struct { .. });
                if result.is_none() && !is_pair {
                    return Err("numbers of 16 or 64 bits".into());
                }
                self.shared.prelude.operation(operation, &given)
            }
        }
    }

    /// A part of a value, at a place that is written; `at` is its number where it is known.
    fn component(
        &mut self,
        base: Handle<Expression>,
        text: &Text,
        place: &str,
        at: Option<usize>,
    ) -> Written<Text> {
        let handle = self.types[base].handle();
        match (self.inner(base).clone(), handle) {
            (TypeInner::Struct { members, .. }, Some(ty)) => {
                let at = at.ok_or("a member without a number")?;
                let of = |name: &str| Text::atom(format!("{}.{name}", text.within(Level::Atom)));
                if self.shared.types.is_pair(ty) {
                    return Ok(of(&at.to_string()));
                }
                let member = members.get(at).ok_or("a member that is not there")?;
                let part = of(&rust_name(member.name.as_deref().unwrap_or("unnamed")));
                self.unstored(member.ty, &part)
            }
            (TypeInner::Array { base, .. }, _) => {
                let part = text.index(place);
                if matches!(self.shared.types.inner(base), TypeInner::Vector { .. })
                    && self.shared.types.is_padded_element(base)
                {
                    return self.shared.prelude.call("three", &[part]);
                }
                self.unstored(base, &part)
            }
            _ => Ok(text.index(place)),
        }
    }

    /// A member of a structure as a value.
    fn unstored(&mut self, ty: Handle<Type>, text: &Text) -> Written<Text> {
        match self.shared.types.is_padded_stored(ty) {
            true => self.unpadded_columns(text),
            false => Ok(text.clone()),
        }
    }

    fn unpadded_columns(&mut self, text: &Text) -> Written<Text> {
        self.shared.prelude.known("three")?;
        Ok(Text::atom(format!(
            "{}.map({MODULE}::three)",
            text.within(Level::Atom)
        )))
    }

    fn padded_columns(&mut self, text: &Text) -> Written<Text> {
        self.shared.prelude.known("padded")?;
        Ok(Text::atom(format!(
            "{}.map({MODULE}::padded)",
            text.within(Level::Atom)
        )))
    }

    /// A value of a type from its parts, each with its number of components.
    fn composed(&mut self, ty: Handle<Type>, parts: &[(Text, usize)]) -> Written<Text> {
        let texts: Vec<Text> = parts.iter().map(|(text, _)| text.clone()).collect();
        match self.shared.types.inner(ty) {
            TypeInner::Vector { .. } => match parts {
                [(text, size)] if *size > 1 => Ok(text.clone()),
                _ if parts.iter().all(|(_, size)| *size == 1) => Ok(Text::array(&texts)),
                _ => {
                    let sizes: Vec<String> =
                        parts.iter().map(|(_, size)| size.to_string()).collect();
                    let name = format!("join_{}", sizes.join("_"));
                    Ok(Text {
                        is_loose: texts.iter().all(|text| text.is_loose),
                        ..self.shared.prelude.call(&name, &texts)?
                    })
                }
            },
            TypeInner::Array { base, .. } => {
                let is_vector = matches!(self.shared.types.inner(*base), TypeInner::Vector { .. });
                let mut elements = Vec::new();
                for text in texts {
                    elements.push(match self.shared.types.is_padded_element(*base) {
                        false => text,
                        true if is_vector => self.shared.prelude.call("padded", &[text])?,
                        true => self.padded_columns(&text)?,
                    });
                }
                Ok(Text::array(&elements))
            }
            TypeInner::Struct { members, .. } if !self.shared.types.is_pair(ty) => {
                let mut fields = Vec::new();
                for (member, text) in members.iter().zip(texts) {
                    let text = match self.shared.types.is_padded_stored(member.ty) {
                        true => self.padded_columns(&text)?,
                        false => text,
                    };
                    let name = rust_name(member.name.as_deref().unwrap_or("unnamed"));
                    fields.push(match name == text.text {
                        true => name,
                        false => format!("{name}: {}", text.text),
                    });
                }
                let name = self.shared.types.value(ty)?;
                if self.shared.types.has_padding(ty) {
                    fields.push(format!("..{name}::default()"));
                }
                Ok(Text::new(
                    format!("{name} {{ {} }}", fields.join(", ")),
                    Level::Block,
                ))
            }
            _ => Ok(Text::array(&texts)),
        }
    }

    fn constant(&mut self, constant: Handle<Constant>) -> Written<Text> {
        let module = self.shared.types.module;
        let Constant { name, ty, init } = &module.constants[constant];
        let text = self.constant_value(&module.global_expressions, *init)?;
        if !matches!(
            self.shared.types.inner(*ty),
            TypeInner::Array { .. } | TypeInner::Struct { .. }
        ) {
            return Ok(text);
        }
        let name = rust_name(name.as_deref().unwrap_or("UNNAMED"));
        let ty = self.shared.types.value(*ty)?;
        let text = format!(
            "\n#[allow(non_upper_case_globals)]\nconst {name}: {ty} = {};\n",
            text.text
        );
        self.shared.constants.insert(constant, text);
        Ok(Text::atom(name))
    }

    fn constant_value(
        &mut self,
        all: &Arena<Expression>,
        value: Handle<Expression>,
    ) -> Written<Text> {
        let module = self.shared.types.module;
        match all[value] {
            Expression::Literal(literal) => written_literal(literal),
            Expression::Constant(constant) => {
                self.constant_value(all, module.constants[constant].init)
            }
            Expression::ZeroValue(ty) => self.shared.types.zero(ty),
            Expression::Splat { size, value } => {
                let text = self.constant_value(all, value)?;
                Ok(Text::array(&vec![text; size as usize]))
            }
            Expression::Compose { ty, ref components } => {
                let mut parts = Vec::new();
                for component in components {
                    parts.push((self.constant_value(all, *component)?, 1));
                }
                // A function of the prelude is none that a constant can be made with.
                match self.shared.types.inner(ty) {
                    TypeInner::Array { base, .. } if self.shared.types.is_padded_element(*base) => {
                        Err("a constant of padded vectors".into())
                    }
                    _ => self.composed(ty, &parts),
                }
            }
            _ => Err("a constant that is computed".into()),
        }
    }

    // Places.

    /// What a pointer leads to: its type, and that without a name.
    fn pointee(&self, pointer: Handle<Expression>) -> Written<(Option<Handle<Type>>, TypeInner)> {
        match *self.inner(pointer) {
            TypeInner::Pointer { base, .. } => {
                Ok((Some(base), self.shared.types.inner(base).clone()))
            }
            TypeInner::ValuePointer {
                size: Some(size),
                scalar,
                ..
            } => Ok((None, TypeInner::Vector { size, scalar })),
            TypeInner::ValuePointer { scalar, .. } => Ok((None, TypeInner::Scalar(scalar))),
            _ => Err("a pointer that is none".into()),
        }
    }

    fn place(&mut self, pointer: Handle<Expression>) -> Written<Place> {
        match self.function.expressions[pointer] {
            Expression::LocalVariable(local) => Ok(Place {
                text: self.locals[local.index()].clone(),
                is_reference: false,
                is_padded: false,
            }),
            Expression::GlobalVariable(variable) => {
                let ty = self.shared.types.module.global_variables[variable].ty;
                let global = self.shared.globals.get(&variable);
                let global = global.ok_or("memory that the shader writes")?;
                let is_slice = self.shared.types.runtime_element(ty).is_some();
                Ok(Place {
                    text: match &global.slice {
                        Some(slice) if is_slice => slice.clone(),
                        _ => global.name.clone(),
                    },
                    is_reference: self.own != Some(variable),
                    is_padded: self.shared.types.is_padded_stored(ty),
                })
            }
            Expression::Access { base, index } => {
                let at = match self.pointee(base)?.1 {
                    TypeInner::Array {
                        size: ArraySize::Dynamic,
                        ..
                    } => self.index(index)?,
                    _ => self.place_in(base, index)?,
                };
                self.place_of(base, &at, None)
            }
            Expression::AccessIndex { base, index } => {
                let at = match self.pointee(base)?.1 {
                    TypeInner::Array {
                        size: ArraySize::Dynamic,
                        ..
                    } => format!("{index}u32"),
                    _ => index.to_string(),
                };
                self.place_of(base, &at, Some(index as usize))
            }
            _ => Err("a pointer that is handed around".into()),
        }
    }

    /// The place of a part.
    fn place_of(
        &mut self,
        base: Handle<Expression>,
        at: &str,
        number: Option<usize>,
    ) -> Written<Place> {
        let whole = self.place(base)?;
        let part = |text: String, is_padded: bool| Place {
            text,
            is_reference: false,
            is_padded,
        };
        Ok(match self.pointee(base)?.1 {
            TypeInner::Struct { members, .. } => {
                let member = number.and_then(|number| members.get(number));
                let member = member.ok_or("a member that is not there")?;
                if self.shared.types.runtime_element(member.ty).is_some()
                    && let Expression::GlobalVariable(of) = self.function.expressions[base]
                    && let Some(slice) = self.shared.globals.get(&of).and_then(|g| g.slice.clone())
                {
                    return Ok(part(slice, false));
                }
                let name = rust_name(member.name.as_deref().unwrap_or("unnamed"));
                let is_padded = self.shared.types.is_padded_stored(member.ty);
                part(format!("{}.{name}", whole.text), is_padded)
            }
            TypeInner::Array {
                base,
                size: ArraySize::Dynamic,
                ..
            } => {
                let none = self.shared.types.zero_element(base)?;
                let all = [Text::atom(whole.text), Text::atom(at), none];
                let element = self.shared.prelude.call("element", &all)?;
                part(element.text, self.shared.types.is_padded_element(base))
            }
            TypeInner::Array { base, .. } => part(
                format!("{}[{at}]", whole.text),
                self.shared.types.is_padded_element(base),
            ),
            TypeInner::Matrix { .. } => part(format!("{}[{at}]", whole.text), whole.is_padded),
            _ => part(format!("{}[{at}]", whole.text), false),
        })
    }

    /// Where an element is in what has a known number of them; beyond the last it is the last.
    fn place_in(&mut self, base: Handle<Expression>, index: Handle<Expression>) -> Written<String> {
        let inner = match self.is_pointer(base) {
            true => self.pointee(base)?.1,
            false => self.inner(base).clone(),
        };
        let size = match inner {
            TypeInner::Vector { size, .. } => size as u32,
            TypeInner::Matrix { columns, .. } => columns as u32,
            TypeInner::Array { size, .. } => length(size)?,
            _ => return Err("a place in a structure".into()),
        };
        if let Expression::Literal(literal) = self.function.expressions[index] {
            let at = match literal {
                Literal::U32(at) => at,
                Literal::I32(at) => at as u32,
                _ => return Err("a place that is no integer".into()),
            };
            return Ok(at.min(size - 1).to_string());
        }
        let index = Text::atom(self.index(index)?);
        let size = Text::atom(size.to_string());
        Ok(self.shared.prelude.call("at", &[index, size])?.text)
    }

    /// An index as a `u32`.
    fn index(&mut self, index: Handle<Expression>) -> Written<String> {
        let is_signed = self.inner(index).scalar_kind() == Some(naga::ScalarKind::Sint);
        let text = self.value(index)?;
        Ok(match is_signed {
            true => format!("{} as u32", text.within(Level::Cast)),
            false => text.text,
        })
    }
}

/// Whether a block continues the loop that it is of.
fn continues(block: &Block) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Continue => true,
        Statement::Loop { .. } => false,
        other => operands::blocks(other).any(continues),
    })
}

fn written_literal(literal: Literal) -> Written<Text> {
    Ok(match literal {
        Literal::F32(x) => Text::float(x),
        Literal::I32(x) => Text::integer(x as u32, true),
        Literal::U32(x) => Text::integer(x, false),
        Literal::Bool(x) => Text::atom(x.to_string()),
        _ => return Err("numbers of 16 or 64 bits".into()),
    })
}

/// What a value is that cannot be written.
fn refused(expression: &Expression) -> &'static str {
    match expression {
        Expression::ImageSample { .. }
        | Expression::ImageLoad { .. }
        | Expression::ImageQuery { .. } => "a read of a texture",
        Expression::Override(_) => "a pipeline constant",
        Expression::Derivative { .. } => "a derivative",
        _ => "a value that only a GPU has",
    }
}
