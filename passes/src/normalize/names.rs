//! The id of every value, and readable names for the values that a person named.
//!
//! A path leads from the entry point through inlined calls to the nearest named value, and from there
//! to the operation: `fs_main.fresnel.f0.mul`. Inputs, uniforms and their members have paths of their
//! own, `fs_main.in.uv` and `fs_main.material.roughness`. A value without a name belongs to the first
//! value or statement that uses it. Ordinals are local to a path, so that lines elsewhere do not
//! matter.

use crate::fingerprint::Declared;
use crate::operands::{self, User};
use crate::shader::ValueId;
use naga::{
    AddressSpace, Arena, Block, EntryPoint, Expression, Function, Handle, Literal, Module,
    Statement, SwizzleComponent, Type, TypeInner,
};
use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

/// Where a value comes from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tag {
    /// The path of calls that led to it, such as `fs_main.fresnel`.
    pub(crate) path: Arc<str>,
    /// What a person called it.
    pub(crate) name: Option<Arc<str>>,
}

impl Tag {
    /// A value without a name.
    pub(crate) fn of(path: Arc<str>) -> Self {
        Self { path, name: None }
    }

    pub(crate) fn named(path: Arc<str>, name: Option<&str>) -> Self {
        Self {
            path,
            name: name.map(Into::into),
        }
    }
}

/// The ids of the values of each entry point. Names that a person gave are made the values' names, so
/// that writers print them.
pub(super) fn ids(module: &mut Module, tags: &[Vec<Tag>]) -> Vec<Vec<ValueId>> {
    let declared = Declared::of(module);
    let mut all = Vec::with_capacity(tags.len());
    for (entry, tags) in tags.iter().enumerate() {
        let ids = Naming::new(module, &module.entry_points[entry], tags).ids(&declared);
        all.push(ids);
        let function = &mut module.entry_points[entry].function;
        let users = operands::users(function);
        let stored = stored_alone(function, &users);
        let mut names = naga::FastIndexMap::default();
        for (value, expression) in function.expressions.iter() {
            if let Some(name) = &tags[value.index()].name
                && may_be_named(function, expression)
                && !stored[value.index()]
                && !is_constant(&function.expressions, value)
            {
                names.insert(value, name.replace('.', "_"));
            }
        }
        function.named_expressions = names;
    }
    all
}

/// For each value, whether nothing is done with it but storing it in a variable, which has a name
/// already.
fn stored_alone(function: &Function, users: &[Vec<User>]) -> Vec<bool> {
    let mut stored = vec![false; users.len()];
    operands::walk(&function.body, &mut |statement| {
        if let Statement::Store { value, .. } = statement {
            stored[value.index()] = users[value.index()].len() == 1;
        }
    });
    stored
}

/// Whether a value is an input, a uniform, or a part of one: these have paths of their own, and are not
/// called after the variables and parameters that they are passed through.
pub(super) fn is_place(expressions: &Arena<Expression>, mut value: Handle<Expression>) -> bool {
    loop {
        value = match expressions[value] {
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => base,
            Expression::Load { pointer } => pointer,
            Expression::Swizzle { vector, .. } => vector,
            Expression::FunctionArgument(_) | Expression::GlobalVariable(_) => return true,
            _ => return false,
        }
    }
}

/// Whether a value is made of literals alone.
fn is_constant(expressions: &Arena<Expression>, value: Handle<Expression>) -> bool {
    match &expressions[value] {
        Expression::Literal(_) | Expression::ZeroValue(_) => true,
        Expression::Splat { value, .. } => is_constant(expressions, *value),
        Expression::Compose { components, .. } => components
            .iter()
            .all(|part| is_constant(expressions, *part)),
        _ => false,
    }
}

/// Whether a writer may bind a value to a name: it is computed, no pointer, and not just what a variable
/// holds.
fn may_be_named(function: &Function, expression: &Expression) -> bool {
    let leads_into_memory = |mut at: Handle<Expression>| {
        loop {
            match function.expressions[at] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => at = base,
                Expression::GlobalVariable(_) | Expression::LocalVariable(_) => return true,
                _ => return false,
            }
        }
    };
    match *expression {
        Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
            !leads_into_memory(base)
        }
        Expression::Load { pointer } => {
            !matches!(function.expressions[pointer], Expression::LocalVariable(_))
        }
        ref other => !other.needs_pre_emit(),
    }
}

/// Who uses a value first.
#[derive(Clone, Debug)]
enum Owner {
    Value(Handle<Expression>),
    /// A statement, by its word or by the variable that it stores to.
    Statement(Arc<str>),
}

struct Naming<'a> {
    module: &'a Module,
    entry: &'a EntryPoint,
    function: &'a Function,
    tags: &'a [Tag],
    owners: Vec<Option<Owner>>,
    /// The path of each value before ordinals, once it is known.
    stems: Vec<Option<Arc<str>>>,
    /// The final path of each value, once it is known.
    paths: Vec<Option<Arc<str>>>,
    /// How often each path was given out.
    taken: HashMap<Arc<str>, u32>,
    types: Vec<naga::proc::TypeResolution>,
}

impl<'a> Naming<'a> {
    fn new(module: &'a Module, entry: &'a EntryPoint, tags: &'a [Tag]) -> Self {
        let function = &entry.function;
        let count = function.expressions.len();
        let mut naming = Self {
            module,
            entry,
            function,
            tags,
            owners: vec![None; count],
            stems: vec![None; count],
            paths: vec![None; count],
            taken: HashMap::new(),
            types: crate::shader::resolve(module, function),
        };
        naming.own(&function.body);
        naming
    }

    /// Finds the first user of each value that has no name.
    fn own(&mut self, block: &Block) {
        let mut statements = Vec::new();
        operands::walk(block, &mut |statement| {
            let word: &str = match statement {
                Statement::If { .. } => "if",
                Statement::Switch { .. } => "switch",
                Statement::Loop { .. } => "loop",
                Statement::Return { .. } => "return",
                Statement::Store { pointer, value } => {
                    statements.push((*pointer, None, Some(*value)));
                    return;
                }
                _ => "do",
            };
            operands::each_of_statement(statement, |operand| {
                statements.push((operand, Some(word), None));
            });
        });
        // Expressions come first: the nearest value, and only then the statement.
        for (user, expression) in self.function.expressions.iter() {
            operands::each(expression, |operand| {
                let owner = &mut self.owners[operand.index()];
                if owner.is_none() {
                    *owner = Some(Owner::Value(user));
                }
            });
        }
        for (operand, word, stored) in statements {
            let (value, word): (_, Arc<str>) = match (word, stored) {
                (Some(word), _) => (operand, word.into()),
                (None, Some(stored)) => (stored, self.variable(operand)),
                (None, None) => continue,
            };
            let owner = &mut self.owners[value.index()];
            if owner.is_none() {
                *owner = Some(Owner::Statement(word));
            }
        }
    }

    /// The name of what a pointer leads to.
    fn variable(&self, pointer: Handle<Expression>) -> Arc<str> {
        match self.function.expressions[pointer] {
            Expression::LocalVariable(local) => {
                let name = self.function.local_variables[local].name.as_deref();
                name.unwrap_or("value").into()
            }
            Expression::GlobalVariable(global) => {
                let name = self.module.global_variables[global].name.as_deref();
                name.unwrap_or("value").into()
            }
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                self.variable(base)
            }
            _ => "value".into(),
        }
    }

    fn ids(mut self, declared: &Declared) -> Vec<ValueId> {
        let hashes = self.hashes(declared);
        let values: Vec<_> = self.function.expressions.iter().map(|(v, _)| v).collect();
        // People's names go first, so that no operation takes them.
        for value in &values {
            if self.named(*value).is_some() || self.place(*value).is_some() {
                self.path(*value);
            }
        }
        for value in &values {
            self.path(*value);
        }
        values
            .into_iter()
            .map(|value| {
                let path = self.path(value);
                ValueId::new(path, hashes[value.index()])
            })
            .collect()
    }

    /// How each value is computed: a hash of the operation and of its operands' hashes.
    fn hashes(&self, declared: &Declared) -> Vec<u64> {
        let mut hashes: Vec<u64> = Vec::with_capacity(self.function.expressions.len());
        for (_, expression) in self.function.expressions.iter() {
            let hash = match expression {
                Expression::LocalVariable(local) => {
                    // By name: the number of a variable moves with unrelated lines.
                    let variable = &self.function.local_variables[*local];
                    let mut words = crate::fingerprint::Words::new();
                    (variable.name.as_deref(), declared.ty(variable.ty)).hash(&mut words);
                    words.finish()
                }
                other => declared.expression(other, |operand| hashes[operand.index()]),
            };
            hashes.push(hash.max(1));
        }
        hashes
    }

    fn inner(&self, value: Handle<Expression>) -> &TypeInner {
        self.types[value.index()].inner_with(&self.module.types)
    }

    /// The path of a value that is an input, a variable of the module, or part of a named value.
    fn place(&self, value: Handle<Expression>) -> Option<String> {
        let entry = &self.entry.name;
        match self.function.expressions[value] {
            Expression::FunctionArgument(index) => {
                let name = self.function.arguments[index as usize].name.as_deref();
                match name {
                    Some(name) => Some(format!("{entry}.{name}")),
                    None => Some(format!("{entry}.argument{index}")),
                }
            }
            Expression::GlobalVariable(global) => {
                let variable = &self.module.global_variables[global];
                let name = variable.name.clone();
                let name = name.unwrap_or_else(|| format!("global{}", global.index()));
                let mark = match variable.space {
                    AddressSpace::Handle => "",
                    _ => "&",
                };
                Some(format!("{entry}.{mark}{name}"))
            }
            Expression::LocalVariable(local) => {
                let name = self.function.local_variables[local].name.as_deref();
                Some(format!("{entry}.&{}", name.unwrap_or("value")))
            }
            Expression::Constant(constant) => {
                let name = self.module.constants[constant].name.as_deref();
                Some(format!("{entry}.{}", name.unwrap_or("constant")))
            }
            Expression::Override(o) => {
                let name = self.module.overrides[o].name.as_deref();
                Some(format!("{entry}.{}", name.unwrap_or("override")))
            }
            Expression::Literal(literal) => Some(literal_path(entry, literal)),
            Expression::AccessIndex { base, index } => {
                let whole = self.place(base).or_else(|| self.named(base))?;
                Some(format!("{whole}.{}", self.member(base, index)))
            }
            Expression::Access { base, .. } => Some(format!("{}.at", self.place(base)?)),
            Expression::Swizzle {
                size,
                vector,
                pattern,
            } => {
                let whole = self.place(vector).or_else(|| self.named(vector))?;
                Some(format!("{whole}.{}", swizzle(&pattern[..size as usize])))
            }
            Expression::Load { pointer } => {
                let place = self.place(pointer)?;
                // The pointer has the mark, the value has none. A local's loads are named after what
                // they hold, like other values.
                match crate::normalize::forward::root(&self.function.expressions, pointer) {
                    None => Some(place.replacen('&', "", 1)),
                    Some(_) => None,
                }
            }
            _ => None,
        }
    }

    /// The path of a value that a person named.
    fn named(&self, value: Handle<Expression>) -> Option<String> {
        let Tag { path, name } = &self.tags[value.index()];
        if self.function.expressions[value].needs_pre_emit() {
            return None;
        }
        name.as_ref().map(|name| format!("{path}.{name}"))
    }

    fn member(&self, base: Handle<Expression>, index: u32) -> String {
        let member = |ty: Handle<Type>| match &self.module.types[ty].inner {
            TypeInner::Struct { members, .. } => members
                .get(index as usize)
                .and_then(|member| member.name.clone()),
            TypeInner::Vector { .. } => Some(component(index).to_owned()),
            _ => None,
        };
        let name = match (self.inner(base), &self.types[base.index()]) {
            (TypeInner::Pointer { base, .. }, _) => member(*base),
            (_, naga::proc::TypeResolution::Handle(ty)) => member(*ty),
            (TypeInner::Vector { .. } | TypeInner::ValuePointer { .. }, _) => {
                Some(component(index).to_owned())
            }
            _ => None,
        };
        name.unwrap_or_else(|| index.to_string())
    }

    /// The path of a value, which is given out when it is first asked for.
    fn path(&mut self, value: Handle<Expression>) -> Arc<str> {
        if let Some(path) = &self.paths[value.index()] {
            return path.clone();
        }
        let stem: Arc<str> = match self.place(value).or_else(|| self.named(value)) {
            Some(place) => place.into(),
            None => {
                let word = self.word(value);
                format!("{}.{word}", self.stem_of_owner(value)).into()
            }
        };
        let path = self.take(stem);
        self.paths[value.index()] = Some(path.clone());
        path
    }

    /// The named value, or statement, that a value without a name belongs to.
    fn stem_of_owner(&mut self, value: Handle<Expression>) -> Arc<str> {
        if let Some(stem) = &self.stems[value.index()] {
            return stem.clone();
        }
        let stem: Arc<str> = match self.owners[value.index()].clone() {
            Some(Owner::Value(user)) => {
                if self.named(user).is_some() {
                    self.path(user)
                } else {
                    self.stem_of_owner(user)
                }
            }
            Some(Owner::Statement(word)) => {
                let path = &self.tags[value.index()].path;
                format!("{path}.{word}").into()
            }
            None => self.tags[value.index()].path.clone(),
        };
        self.stems[value.index()] = Some(stem.clone());
        stem
    }

    fn take(&mut self, stem: Arc<str>) -> Arc<str> {
        let mut ordinal = *self.taken.get(&stem).unwrap_or(&0);
        loop {
            ordinal += 1;
            let path: Arc<str> = match ordinal {
                1 => stem.clone(),
                _ => format!("{stem}_{ordinal}").into(),
            };
            if ordinal == 1 || !self.taken.contains_key(&path) {
                self.taken.insert(stem, ordinal);
                if ordinal > 1 {
                    self.taken.insert(path.clone(), 1);
                }
                return path;
            }
        }
    }

    /// The word for what an expression does.
    fn word(&self, value: Handle<Expression>) -> String {
        match &self.function.expressions[value] {
            Expression::ZeroValue(_) => "zero".into(),
            Expression::Compose { .. } | Expression::Splat { .. } => self.kind_word(value),
            Expression::Access { .. } => "at".into(),
            Expression::AccessIndex { base, index } => self.member(*base, *index),
            Expression::Swizzle { size, pattern, .. } => swizzle(&pattern[..*size as usize]),
            Expression::Load { .. } => "load".into(),
            Expression::ImageSample { gather: None, .. } => "sample".into(),
            Expression::ImageSample { .. } => "gather".into(),
            Expression::ImageLoad { .. } => "load".into(),
            Expression::ImageQuery { .. } => "size".into(),
            Expression::Unary { op, .. } => match op {
                naga::UnaryOperator::Negate => "neg".into(),
                naga::UnaryOperator::LogicalNot | naga::UnaryOperator::BitwiseNot => "not".into(),
            },
            Expression::Binary { op, .. } => binary_word(*op).into(),
            Expression::Select { .. } => "select".into(),
            Expression::Derivative { axis, .. } => match axis {
                naga::DerivativeAxis::X => "dpdx".into(),
                naga::DerivativeAxis::Y => "dpdy".into(),
                naga::DerivativeAxis::Width => "fwidth".into(),
            },
            Expression::Relational { fun, .. } => format!("{fun:?}").to_lowercase(),
            Expression::Math { fun, .. } => format!("{fun:?}").to_lowercase(),
            Expression::As { .. } => self.kind_word(value),
            Expression::ArrayLength(_) => "length".into(),
            _ => "result".into(),
        }
    }

    fn kind_word(&self, value: Handle<Expression>) -> String {
        let kind = |scalar: &naga::Scalar| match scalar.kind {
            naga::ScalarKind::Sint => "int",
            naga::ScalarKind::Uint => "uint",
            naga::ScalarKind::Bool => "bool",
            _ => "float",
        };
        match self.inner(value) {
            TypeInner::Scalar(scalar) => kind(scalar).into(),
            TypeInner::Vector { size, .. } => format!("vec{}", *size as u32),
            TypeInner::Matrix { columns, rows, .. } => {
                format!("mat{}x{}", *columns as u32, *rows as u32)
            }
            TypeInner::Array { .. } => "array".into(),
            _ => match self.types[value.index()].handle() {
                Some(ty) => {
                    let name = self.module.types[ty].name.as_deref();
                    name.unwrap_or("struct").to_lowercase()
                }
                None => "value".into(),
            },
        }
    }
}

fn component(index: u32) -> &'static str {
    ["x", "y", "z", "w"].get(index as usize).unwrap_or(&"w")
}

fn swizzle(pattern: &[SwizzleComponent]) -> String {
    pattern.iter().map(|c| component(*c as u32)).collect()
}

/// The path of a literal, which is the same wherever it is used.
pub(crate) fn literal_path(entry: &str, literal: Literal) -> String {
    format!("{entry}.{}", literal_text(literal))
}

fn literal_text(literal: Literal) -> String {
    match literal {
        Literal::F64(x) => format!("{x:?}lf"),
        Literal::F32(x) => format!("{x:?}"),
        Literal::F16(x) => format!("{x:?}h"),
        Literal::U16(x) => format!("{x}us"),
        Literal::I16(x) => format!("{x}s"),
        Literal::U32(x) => format!("{x}u"),
        Literal::I32(x) => format!("{x}i"),
        Literal::U64(x) => format!("{x}lu"),
        Literal::I64(x) => format!("{x}li"),
        Literal::Bool(x) => x.to_string(),
        Literal::AbstractInt(x) => x.to_string(),
        Literal::AbstractFloat(x) => format!("{x:?}a"),
    }
}

fn binary_word(op: naga::BinaryOperator) -> &'static str {
    use naga::BinaryOperator as Op;
    match op {
        Op::Add => "add",
        Op::Subtract => "sub",
        Op::Multiply => "mul",
        Op::Divide => "div",
        Op::Modulo => "rem",
        Op::Equal => "equal",
        Op::NotEqual => "not_equal",
        Op::Less => "less",
        Op::LessEqual => "less_equal",
        Op::Greater => "greater",
        Op::GreaterEqual => "greater_equal",
        Op::And | Op::LogicalAnd => "and",
        Op::ExclusiveOr => "xor",
        Op::InclusiveOr | Op::LogicalOr => "or",
        Op::ShiftLeft => "shift_left",
        Op::ShiftRight => "shift_right",
    }
}
