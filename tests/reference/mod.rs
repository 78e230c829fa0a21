//! A slow evaluator for tests: one lane at a time, naga's IR as it is written, and nothing clever. It
//! shares only the table of what scalar operations mean with the rest.

use lodc_passes::semantics::{self, Op, Operation, Scalars, Shape};
use naga::{
    AddressSpace, Block, Expression, Function, Handle, Literal, Module, ScalarKind, Statement,
    SwitchValue, Type, TypeInner,
};

/// A value: a scalar, vector or matrix, or what is made of others.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    /// The bits of the components, column by column.
    Plain(Shape, Vec<u32>),
    /// Members or elements.
    Parts(Vec<Value>),
    /// A variable, and the way to a part of it.
    Pointer(Root, Vec<usize>),
}

/// What a pointer points into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Root {
    /// A local variable of the call at that depth.
    Local(usize, usize),
    /// A variable of the module.
    Global(usize),
}

enum Flow {
    Next,
    Break,
    Continue,
    Return(Option<Value>),
    Discard,
}

struct Call {
    arguments: Vec<Value>,
    locals: Vec<Value>,
    values: Vec<Option<Value>>,
}

struct Run<'a> {
    module: &'a Module,
    globals: Vec<Value>,
    calls: Vec<Call>,
    /// Statements that may still be run.
    left: u32,
}

/// What the first entry point of a module returns for arguments, all of its buffers holding numbers of
/// the tests'. Nothing when it discards; an error when it takes too long.
pub(crate) fn run(module: &Module, arguments: Vec<Value>) -> Result<Option<Value>, ()> {
    let mut run = Run {
        module,
        globals: Vec::new(),
        calls: Vec::new(),
        left: 200_000,
    };
    for (_, global) in module.global_variables.iter() {
        let value = match (global.space, global.init) {
            (AddressSpace::Private, Some(init)) => run.constant(init),
            (AddressSpace::Private, None) => run.zero(global.ty),
            _ => {
                let mut number = 0;
                run.numbered(global.ty, &mut number)
            }
        };
        run.globals.push(value);
    }
    let function = &module.entry_points[0].function;
    match run.call(function, arguments) {
        _ if run.left == 0 => Err(()),
        Flow::Return(value) => Ok(value),
        _ => Ok(None),
    }
}

/// The bytes of a buffer of that type, which holds the numbers of the tests.
pub(crate) fn buffer(module: &Module, ty: Handle<Type>) -> Vec<u8> {
    let run = Run {
        module,
        globals: Vec::new(),
        calls: Vec::new(),
        left: 0,
    };
    let mut bytes = Vec::new();
    lay_out(module, ty, &run.numbered(ty, &mut 0), 0, &mut bytes);
    bytes
}

fn lay_out(module: &Module, ty: Handle<Type>, value: &Value, at: usize, bytes: &mut Vec<u8>) {
    match (&module.types[ty].inner, value) {
        (TypeInner::Struct { members, span }, Value::Parts(parts)) => {
            bytes.resize(bytes.len().max(at + *span as usize), 0);
            for (member, part) in members.iter().zip(parts) {
                lay_out(module, member.ty, part, at + member.offset as usize, bytes);
            }
        }
        (TypeInner::Array { base, stride, .. }, Value::Parts(parts)) => {
            for (i, part) in parts.iter().enumerate() {
                lay_out(module, *base, part, at + i * *stride as usize, bytes);
            }
        }
        (_, Value::Plain(_, words)) => {
            bytes.resize(bytes.len().max(at + 4 * words.len()), 0);
            for (i, word) in words.iter().enumerate() {
                bytes[at + 4 * i..][..4].copy_from_slice(&word.to_le_bytes());
            }
        }
        other => panic!("no test has {other:?} in a buffer"),
    }
}

/// A float.
pub(crate) fn float(x: f32) -> Value {
    Value::Plain(Shape::Scalar(ScalarKind::Float), vec![x.to_bits()])
}

/// An integer.
pub(crate) fn int(x: i32) -> Value {
    Value::Plain(Shape::Scalar(ScalarKind::Sint), vec![x as u32])
}

/// The bits of a value's scalars.
pub(crate) fn bits(value: &Value) -> Vec<u32> {
    match value {
        Value::Plain(_, words) => words.clone(),
        Value::Parts(parts) => parts.iter().flat_map(bits).collect(),
        Value::Pointer(..) => panic!("a pointer has no bits"),
    }
}

struct Now;

impl Scalars for Now {
    type Value = u32;
    fn word(&mut self, bits: u32) -> u32 {
        bits
    }
    fn float(&mut self, x: f32) -> u32 {
        x.to_bits()
    }
    fn apply(&mut self, op: Op, operands: &[u32]) -> u32 {
        semantics::evaluate(op, operands)
    }
}

fn scalar(kind: ScalarKind, word: u32) -> Value {
    Value::Plain(Shape::Scalar(kind), vec![word])
}

fn part(value: &Value, index: usize) -> Value {
    match value {
        Value::Parts(parts) => parts[index].clone(),
        Value::Plain(Shape::Matrix { rows, .. }, words) => Value::Plain(
            Shape::Vector(*rows, ScalarKind::Float),
            words[index * rows..][..*rows].to_vec(),
        ),
        Value::Plain(shape, words) => scalar(shape.kind(), words[index]),
        Value::Pointer(root, way) => {
            let mut way = way.clone();
            way.push(index);
            Value::Pointer(*root, way)
        }
    }
}

fn set(value: &mut Value, way: &[usize], new: Value) {
    let Some((first, rest)) = way.split_first() else {
        *value = new;
        return;
    };
    match value {
        Value::Parts(parts) => set(&mut parts[*first], rest, new),
        Value::Plain(shape, words) => {
            let rows = match *shape {
                Shape::Matrix { rows, .. } => rows,
                _ => 1,
            };
            let at = first * rows + rest.first().copied().unwrap_or(0);
            let new = bits(&new);
            words[at..at + new.len()].copy_from_slice(&new);
        }
        Value::Pointer(..) => panic!("no variable holds a pointer"),
    }
}

impl<'a> Run<'a> {
    fn zero(&self, ty: Handle<Type>) -> Value {
        self.filled(ty, &mut |_| 0)
    }

    fn numbered(&self, ty: Handle<Type>, number: &mut u32) -> Value {
        self.filled(ty, &mut |kind| {
            *number += 1;
            let n = *number * 37 % 19;
            match kind {
                ScalarKind::Float => (n as f32 * 0.25 - 2.0).to_bits(),
                _ => n,
            }
        })
    }

    fn filled(&self, ty: Handle<Type>, word: &mut impl FnMut(ScalarKind) -> u32) -> Value {
        let inner = &self.module.types[ty].inner;
        if let Some(shape) = Shape::of(inner) {
            let words = (0..shape.components())
                .map(|_| word(shape.kind()))
                .collect();
            return Value::Plain(shape, words);
        }
        match inner {
            TypeInner::Struct { members, .. } => {
                Value::Parts(members.iter().map(|m| self.filled(m.ty, word)).collect())
            }
            TypeInner::Array {
                base,
                size: naga::ArraySize::Constant(size),
                ..
            } => Value::Parts((0..size.get()).map(|_| self.filled(*base, word)).collect()),
            other => panic!("no test has {other:?}"),
        }
    }

    /// A constant of the module.
    fn constant(&self, value: Handle<Expression>) -> Value {
        let expressions = &self.module.global_expressions;
        self.evaluate(&expressions[value], &|operand| self.constant(operand))
    }

    fn call(&mut self, function: &'a Function, arguments: Vec<Value>) -> Flow {
        self.calls.push(Call {
            arguments,
            locals: Vec::new(),
            values: vec![None; function.expressions.len()],
        });
        for (_, local) in function.local_variables.iter() {
            let value = match local.init {
                Some(init) => self.get(function, init),
                None => self.zero(local.ty),
            };
            self.calls.last_mut().expect("a call").locals.push(value);
        }
        let flow = self.block(function, &function.body);
        self.calls.pop();
        flow
    }

    /// A value that was computed, or that needs no `Emit`.
    fn get(&self, function: &Function, value: Handle<Expression>) -> Value {
        let call = self.calls.last().expect("a call");
        if let Some(value) = &call.values[value.index()] {
            return value.clone();
        }
        match &function.expressions[value] {
            Expression::FunctionArgument(i) => call.arguments[*i as usize].clone(),
            Expression::LocalVariable(local) => {
                Value::Pointer(Root::Local(self.calls.len() - 1, local.index()), vec![])
            }
            Expression::GlobalVariable(global) => {
                Value::Pointer(Root::Global(global.index()), vec![])
            }
            other => self.evaluate(other, &|operand| self.get(function, operand)),
        }
    }

    fn place(&self, root: Root) -> &Value {
        match root {
            Root::Local(call, local) => &self.calls[call].locals[local],
            Root::Global(global) => &self.globals[global],
        }
    }

    fn evaluate(
        &self,
        expression: &Expression,
        get: &dyn Fn(Handle<Expression>) -> Value,
    ) -> Value {
        match *expression {
            Expression::Literal(literal) => match literal {
                Literal::F32(x) => float(x),
                Literal::I32(x) => int(x),
                Literal::U32(x) => scalar(ScalarKind::Uint, x),
                Literal::Bool(x) => scalar(ScalarKind::Bool, x.into()),
                other => panic!("no test has {other:?}"),
            },
            Expression::Constant(constant) => self.constant(self.module.constants[constant].init),
            Expression::ZeroValue(ty) => self.zero(ty),
            Expression::Compose { ty, ref components } => {
                let parts: Vec<Value> = components.iter().map(|c| get(*c)).collect();
                match Shape::of(&self.module.types[ty].inner) {
                    Some(shape) => Value::Plain(shape, parts.iter().flat_map(bits).collect()),
                    None => Value::Parts(parts),
                }
            }
            Expression::Access { base, index } => {
                let (base, index) = (get(base), bits(&get(index))[0]);
                part(&base, index as usize)
            }
            Expression::AccessIndex { base, index } => part(&get(base), index as usize),
            Expression::Splat { size, value } => match get(value) {
                Value::Plain(shape, words) => {
                    let size = size as usize;
                    Value::Plain(Shape::Vector(size, shape.kind()), vec![words[0]; size])
                }
                other => panic!("{other:?} is no scalar"),
            },
            Expression::Swizzle {
                size,
                vector,
                pattern,
            } => match get(vector) {
                Value::Plain(shape, words) => Value::Plain(
                    Shape::Vector(size as usize, shape.kind()),
                    pattern[..size as usize]
                        .iter()
                        .map(|c| words[*c as usize])
                        .collect(),
                ),
                other => panic!("{other:?} is no vector"),
            },
            Expression::Load { pointer } => match get(pointer) {
                Value::Pointer(root, way) => {
                    way.iter().fold(self.place(root).clone(), |value, index| {
                        part(&value, *index)
                    })
                }
                other => panic!("{other:?} is no pointer"),
            },
            ref other => {
                let (operation, operands) =
                    Operation::of(other).unwrap_or_else(|| panic!("no test has {other:?}"));
                let operands: Vec<Value> = operands.into_iter().map(get).collect();
                let plain: Vec<(Shape, &[u32])> = operands
                    .iter()
                    .map(|operand| match operand {
                        Value::Plain(shape, words) => (*shape, &words[..]),
                        other => panic!("{other:?} is no operand"),
                    })
                    .collect();
                let shapes: Vec<Shape> = plain.iter().map(|(shape, _)| *shape).collect();
                let shape = operation.result(&shapes).expect("the operands fit");
                let words = semantics::expand(&mut Now, operation, &plain);
                Value::Plain(shape, words.expect("it is in the table"))
            }
        }
    }

    fn block(&mut self, function: &'a Function, block: &'a Block) -> Flow {
        for statement in block {
            self.left = self.left.saturating_sub(1);
            if self.left == 0 {
                return Flow::Discard;
            }
            let flow = self.statement(function, statement);
            if !matches!(flow, Flow::Next) {
                return flow;
            }
        }
        Flow::Next
    }

    fn statement(&mut self, function: &'a Function, statement: &'a Statement) -> Flow {
        match statement {
            Statement::Emit(range) => {
                for value in range.clone() {
                    self.calls.last_mut().expect("a call").values[value.index()] = None;
                    let new = self.get(function, value);
                    self.calls.last_mut().expect("a call").values[value.index()] = Some(new);
                }
            }
            Statement::Block(inner) => return self.block(function, inner),
            Statement::If {
                condition,
                accept,
                reject,
            } => {
                let taken = bits(&self.get(function, *condition))[0] != 0;
                return self.block(function, if taken { accept } else { reject });
            }
            Statement::Switch { selector, cases } => {
                let selector = bits(&self.get(function, *selector))[0];
                let chosen = cases.iter().position(|case| match case.value {
                    SwitchValue::I32(value) => value as u32 == selector,
                    SwitchValue::U32(value) => value == selector,
                    SwitchValue::Default => false,
                });
                let default = || cases.iter().position(|c| c.value == SwitchValue::Default);
                let first = chosen.or_else(default).expect("there is a default");
                for case in &cases[first..] {
                    match self.block(function, &case.body) {
                        Flow::Next if case.fall_through => {}
                        Flow::Next | Flow::Break => break,
                        other => return other,
                    }
                }
            }
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => loop {
                match self.block(function, body) {
                    Flow::Next | Flow::Continue => {}
                    Flow::Break => break,
                    other => return other,
                }
                match self.block(function, continuing) {
                    Flow::Next => {}
                    other => return other,
                }
                if break_if.is_some_and(|c| bits(&self.get(function, c))[0] != 0) {
                    break;
                }
            },
            Statement::Break => return Flow::Break,
            Statement::Continue => return Flow::Continue,
            Statement::Kill => return Flow::Discard,
            Statement::Return { value } => {
                return Flow::Return(value.map(|value| self.get(function, value)));
            }
            Statement::Store { pointer, value } => {
                let value = self.get(function, *value);
                let Value::Pointer(root, way) = self.get(function, *pointer) else {
                    panic!("it is stored to no pointer");
                };
                let place = match root {
                    Root::Local(call, local) => &mut self.calls[call].locals[local],
                    Root::Global(global) => &mut self.globals[global],
                };
                set(place, &way, value);
            }
            Statement::Call {
                function: callee,
                arguments,
                result,
            } => {
                let arguments = arguments.iter().map(|a| self.get(function, *a)).collect();
                let module = self.module;
                match self.call(&module.functions[*callee], arguments) {
                    Flow::Discard => return Flow::Discard,
                    Flow::Return(value) => {
                        if let Some(result) = result {
                            self.calls.last_mut().expect("a call").values[result.index()] = value;
                        }
                    }
                    _ => {}
                }
            }
            other => panic!("no test has {other:?}"),
        }
        Flow::Next
    }
}
