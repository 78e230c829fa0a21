//! Rebuilds a function in body order: forwards stores to loads, folds constants and branches, merges
//! equal values, and puts replacements in place.
//!
//! Memory stays true throughout: every store is kept, and what is known of a variable says what its
//! memory holds. Which stores and values nobody needs is for [`crate::live`] to find out afterwards.
//! Nothing is computed earlier than it was, but for a few cheap operations behind `&&` and `||`.

mod rounds;

use crate::fold;
use crate::semantics::{Constant, Operation, Shape};
use crate::{fingerprint::Declared, operands};
use naga::proc::{ResolveContext, TypeResolution};
use naga::{
    AddressSpace, Arena, ArraySize, BinaryOperator, Block, Expression, Function, Handle,
    ImageClass, Literal, LocalVariable, Module, Range, Scalar, ScalarKind, Span, Statement,
    StorageAccess, SwitchCase, SwitchValue, SwizzleComponent, Type, TypeInner, UnaryOperator,
    VectorSize,
};
use rounds::{Rounds, is_break};
use std::collections::{BTreeMap, HashMap};
use std::hash::{BuildHasher, Hasher};

/// Where a value of a rebuilt function comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Origin {
    /// It is what became of an old value.
    Value(Handle<Expression>),
    /// It is what a local variable holds at some place.
    Local(Handle<LocalVariable>),
    /// It was made on the way, such as a literal.
    Made,
}

/// A rebuilt function.
pub(crate) struct Rebuilt {
    pub(crate) function: Function,
    /// For each expression.
    pub(crate) origins: Vec<Origin>,
    /// For each expression, whether values that were several have become it; its origin is one of them.
    pub(crate) merged: Vec<bool>,
    /// For each store of a value to a local variable: the new value, and the variable that it became
    /// known under. A variable keeps its handle.
    pub(crate) stored: Vec<(Handle<Expression>, Handle<LocalVariable>)>,
    /// Whether loops changed, so that another round may find more.
    pub(crate) again: bool,
}

/// A value of the new function.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Value {
    Computed(Handle<Expression>),
    /// By its place in the table of constants; computed again wherever it is used.
    Constant(usize),
}

/// What is known of a local variable at some place of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Known {
    /// Nothing: it has to be loaded.
    Memory,
    /// It holds this value.
    Value(Value),
    /// It holds its initial value, which is no plain constant.
    Initial,
}

/// Whether control comes out at the end of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Flow {
    Falls,
    Jumps,
}

/// A loop or switch that is being rebuilt.
struct Target {
    is_loop: bool,
    /// What is known on all ways out so far; nothing when there was none.
    out: Option<Vec<Known>>,
    /// Whether a `continue` was met.
    continues: bool,
}

/// A step from a pointer to a part of what it points to.
#[derive(Clone, Copy)]
enum Step {
    Index(u32),
    Dynamic(Handle<Expression>),
}

/// The hasher of keys that are hashes already.
#[derive(Clone, Copy, Default)]
struct Hashed;

impl BuildHasher for Hashed {
    type Hasher = Taken;
    fn build_hasher(&self) -> Taken {
        Taken(0)
    }
}

/// A hash that was taken from the key.
struct Taken(u64);

impl Hasher for Taken {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, _: &[u8]) {
        unreachable!("keys are single words");
    }
    fn write_u64(&mut self, key: u64) {
        self.0 = key;
    }
}

/// How many steps it may take to compute a value again behind `&&`, `||` or for a select.
const CHEAP: u32 = 12;

struct Forward<'a> {
    module: &'a mut Module,
    old: &'a Function,
    expressions: &'a Arena<Expression>,
    replaced: &'a BTreeMap<Handle<Expression>, Handle<Expression>>,
    /// How many of the old expressions were not added by an edit.
    first_added: usize,
    declared: &'a mut Declared,

    new: Arena<Expression>,
    origins: Vec<Origin>,
    merged: Vec<bool>,
    /// For each old expression, whether a statement needs it, as far as can be told beforehand.
    needed: Vec<bool>,
    /// For each new expression, the block that computed it: its depth and number, or none.
    blocks: Vec<Option<(usize, u32)>>,
    /// For each new expression, its place in the table of constants if it is one.
    constant_of: Vec<Option<usize>>,
    types: Vec<Option<TypeResolution>>,
    locals: Arena<LocalVariable>,
    tracked: Vec<bool>,
    pointers: Vec<Option<Handle<Expression>>>,

    constants: Vec<(Constant, Origin)>,
    literals: HashMap<(ScalarKind, u32), Handle<Expression>>,
    fences: HashMap<(ScalarKind, Vec<u32>), Handle<LocalVariable>>,

    map: Vec<Option<Value>>,
    mapped: Vec<Handle<Expression>>,
    equal: HashMap<u64, Handle<Expression>, Hashed>,
    equalled: Vec<(u64, Option<Handle<Expression>>)>,
    open: Vec<u32>,
    opened: u32,
    state: Vec<Known>,
    targets: Vec<Target>,
    out: Block,
    pending: Option<(Handle<Expression>, Handle<Expression>)>,
    stored: Vec<(Handle<Expression>, Handle<LocalVariable>)>,
    again: bool,
}

/// What is changed in a function while it is rebuilt.
#[derive(Clone, Copy)]
pub(crate) struct Changes<'a> {
    /// The old expressions, with other operands where these are replaced for one user, and the added
    /// ones behind them.
    pub(crate) expressions: &'a Arena<Expression>,
    /// The old body, with other operands where these are replaced for one user.
    pub(crate) body: &'a Block,
    /// How many old expressions there are; those behind them are in no `Emit`, and are computed where
    /// they are first used.
    pub(crate) first_added: usize,
    /// Users of a value use the other one.
    pub(crate) replaced: &'a BTreeMap<Handle<Expression>, Handle<Expression>>,
}

impl<'a> Changes<'a> {
    /// Nothing is changed.
    pub(crate) fn none(function: &'a Function) -> Self {
        static NONE: BTreeMap<Handle<Expression>, Handle<Expression>> = BTreeMap::new();
        Self {
            expressions: &function.expressions,
            body: &function.body,
            first_added: function.expressions.len(),
            replaced: &NONE,
        }
    }
}

/// Rebuilds `old`, a function of `module` without calls and early returns, with changes. `declared` is of
/// the module.
///
/// # Panics
/// When a replacement is not computed where it is used.
pub(crate) fn rebuild(
    module: &mut Module,
    declared: &mut Declared,
    old: &Function,
    changes: &Changes,
) -> Rebuilt {
    let &Changes {
        expressions,
        body,
        first_added,
        replaced,
    } = changes;
    let count = expressions.len();
    let mut forward = Forward {
        tracked: tracked(module, old, expressions, body),
        module,
        old,
        expressions,
        replaced,
        first_added,
        declared,
        new: Arena::new(),
        origins: Vec::with_capacity(count),
        merged: Vec::with_capacity(count),
        needed: vec![false; count],
        blocks: Vec::with_capacity(count),
        constant_of: Vec::with_capacity(count),
        types: Vec::new(),
        locals: old.local_variables.clone(),
        pointers: vec![None; old.local_variables.len()],
        constants: Vec::new(),
        literals: HashMap::new(),
        fences: HashMap::new(),
        map: vec![None; count],
        mapped: Vec::new(),
        equal: HashMap::with_capacity_and_hasher(count, Hashed),
        equalled: Vec::new(),
        open: vec![0],
        opened: 0,
        state: Vec::new(),
        targets: Vec::new(),
        out: Block::new(),
        pending: None,
        stored: Vec::new(),
        again: false,
    };
    forward.need(body);
    forward.start();
    forward.statements(body);
    forward.flush();
    let mut names = naga::FastIndexMap::default();
    for (value, origin) in forward.new.iter().zip(&forward.origins) {
        if let Origin::Value(origin) = origin
            && let Some(name) = old.named_expressions.get(origin)
            && !value.1.needs_pre_emit()
        {
            names.insert(value.0, name.clone());
        }
    }
    Rebuilt {
        function: Function {
            name: old.name.clone(),
            arguments: old.arguments.clone(),
            result: old.result.clone(),
            local_variables: forward.locals,
            expressions: forward.new,
            named_expressions: names,
            body: forward.out,
            diagnostic_filter_leaf: old.diagnostic_filter_leaf,
        },
        origins: forward.origins,
        merged: forward.merged,
        stored: forward.stored,
        again: forward.again,
    }
}

/// The local variable that a pointer leads into.
pub(crate) fn root(
    expressions: &Arena<Expression>,
    mut pointer: Handle<Expression>,
) -> Option<Handle<LocalVariable>> {
    loop {
        match expressions[pointer] {
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                pointer = base;
            }
            Expression::LocalVariable(local) => return Some(local),
            _ => return None,
        }
    }
}

/// For each local variable, whether its value is followed: scalars, vectors and matrices that are only
/// loaded and stored.
fn tracked(
    module: &Module,
    function: &Function,
    expressions: &Arena<Expression>,
    body: &Block,
) -> Vec<bool> {
    let mut tracked: Vec<bool> = function
        .local_variables
        .iter()
        .map(|(_, local)| {
            matches!(
                module.types[local.ty].inner,
                TypeInner::Scalar(_) | TypeInner::Vector { .. } | TypeInner::Matrix { .. }
            )
        })
        .collect();
    operands::walk(body, &mut |statement| {
        let mut lose = |operand: Handle<Expression>| {
            if let Some(local) = root(expressions, operand) {
                tracked[local.index()] = false;
            }
        };
        match statement {
            Statement::Store { value, .. } => lose(*value),
            other => operands::each_of_statement(other, lose),
        }
    });
    tracked
}

/// The local variables that a block stores to.
fn stores(expressions: &Arena<Expression>, block: &Block, found: &mut impl FnMut(usize)) {
    operands::walk(block, &mut |statement| {
        if let Statement::Store { pointer, .. } = statement
            && let Some(local) = root(expressions, *pointer)
        {
            found(local.index());
        }
    });
}

/// Whether control can leave the innermost loop around a block from inside it, or start its next round.
fn jumps(statements: &[Statement], in_switch: bool) -> bool {
    statements.iter().any(|statement| match statement {
        Statement::Break => !in_switch,
        Statement::Continue => true,
        Statement::Loop { .. } => false,
        Statement::Switch { cases, .. } => cases.iter().any(|case| jumps(&case.body, true)),
        other => operands::blocks(other).any(|inner| jumps(inner, in_switch)),
    })
}

/// Whether a block breaks out of the switch around it.
fn breaks(statements: &[Statement]) -> bool {
    statements.iter().any(|statement| match statement {
        Statement::Break => true,
        Statement::Loop { .. } | Statement::Switch { .. } => false,
        other => operands::blocks(other).any(|inner| breaks(inner)),
    })
}

impl Forward<'_> {
    // ---- Values ----

    fn span(&self, origin: Origin) -> Span {
        match origin {
            Origin::Value(old) => self.expressions.get_span(old),
            Origin::Local(local) => self.locals.get_span(local),
            Origin::Made => Span::UNDEFINED,
        }
    }

    fn append(&mut self, expression: Expression, origin: Origin) -> Handle<Expression> {
        let emitted = !expression.needs_pre_emit();
        if !emitted {
            self.flush();
        }
        let span = self.span(origin);
        let new = self.new.append(expression, span);
        self.origins.push(origin);
        self.merged.push(false);
        self.constant_of.push(None);
        self.types.push(None);
        let place = (self.open.len() - 1, self.open[self.open.len() - 1]);
        self.blocks.push(emitted.then_some(place));
        if emitted {
            let first = self.pending.map_or(new, |(first, _)| first);
            self.pending = Some((first, new));
        }
        new
    }

    fn flush(&mut self) {
        if let Some((first, last)) = self.pending.take() {
            let range = Range::new_from_bounds(first, last);
            self.out.push(Statement::Emit(range), Span::UNDEFINED);
        }
    }

    fn push(&mut self, statement: Statement, span: Span) {
        self.flush();
        self.out.push(statement, span);
    }

    /// Computes an expression over new operands, unless an equal one is at hand.
    fn compute(&mut self, expression: Expression, origin: Origin) -> Value {
        if let Expression::Literal(literal) = expression
            && let Some(constant) = Constant::from_literal(literal)
        {
            return self.constant(constant, origin);
        }
        if !self.repeatable(&expression) {
            return Value::Computed(self.append(expression, origin));
        }
        let key = self
            .declared
            .expression(&expression, |operand| operand.index() as u64);
        if let Some(&equal) = self.equal.get(&key)
            && same(&self.new[equal], &expression)
        {
            self.merged[equal.index()] |= self.origins[equal.index()] != origin;
            // The first one takes the name that a person gave the second.
            if let (Origin::Value(first), Origin::Value(second)) =
                (self.origins[equal.index()], origin)
            {
                let names = &self.old.named_expressions;
                if !names.contains_key(&first) && names.contains_key(&second) {
                    self.origins[equal.index()] = origin;
                }
            } else if !matches!(self.origins[equal.index()], Origin::Value(_)) {
                self.origins[equal.index()] = origin;
            }
            return Value::Computed(equal);
        }
        let lasts = expression.needs_pre_emit();
        let new = self.append(expression, origin);
        let before = self.equal.insert(key, new);
        if !lasts {
            self.equalled.push((key, before));
        }
        Value::Computed(new)
    }

    /// Whether an expression gives the same value wherever its operands do.
    fn repeatable(&mut self, expression: &Expression) -> bool {
        match *expression {
            Expression::Load { pointer } => self.read_only(pointer),
            Expression::ImageLoad { image, .. } => match *self.type_of(image) {
                TypeInner::Image {
                    class: ImageClass::Storage { access, .. },
                    ..
                } => !access.contains(StorageAccess::STORE),
                _ => true,
            },
            ref other => is_function(other),
        }
    }

    /// Whether what a pointer leads to never changes while the shader runs.
    fn read_only(&mut self, pointer: Handle<Expression>) -> bool {
        match self.type_of(pointer).pointer_space() {
            Some(AddressSpace::Uniform | AddressSpace::Immediate) => true,
            Some(AddressSpace::Storage { access }) => !access.contains(StorageAccess::STORE),
            _ => false,
        }
    }

    /// The type of a new expression.
    fn type_of(&mut self, value: Handle<Expression>) -> &TypeInner {
        self.resolve(value);
        match &self.types[value.index()] {
            Some(resolution) => resolution.inner_with(&self.module.types),
            None => unreachable!("it was just resolved"),
        }
    }

    fn resolve(&mut self, value: Handle<Expression>) {
        if self.types[value.index()].is_some() {
            return;
        }
        let mut needs = Vec::new();
        operands::each(&self.new[value], |operand| needs.push(operand));
        for operand in needs {
            self.resolve(operand);
        }
        let types = &self.types;
        let context = ResolveContext::with_locals(self.module, &self.locals, &self.old.arguments);
        let resolved = context.resolve(&self.new[value], |operand| {
            types[operand.index()]
                .as_ref()
                .ok_or(naga::proc::ResolveError::InvalidPointer(operand))
        });
        self.types[value.index()] = Some(resolved.expect("a valid function has types"));
    }

    fn ty(&mut self, inner: TypeInner) -> Handle<Type> {
        let before = self.module.types.len();
        let ty = Type { name: None, inner };
        let ty = self.module.types.insert(ty, Span::UNDEFINED);
        if self.module.types.len() != before {
            self.declared.add_type(self.module, ty);
        }
        ty
    }

    // ---- Constants ----

    fn constant(&mut self, constant: Constant, origin: Origin) -> Value {
        self.constants.push((constant, origin));
        Value::Constant(self.constants.len() - 1)
    }

    fn as_constant(&self, value: Value) -> Option<&Constant> {
        match value {
            Value::Constant(index) => Some(&self.constants[index].0),
            Value::Computed(_) => None,
        }
    }

    fn as_bool(&self, value: Value) -> Option<bool> {
        match self.as_constant(value)? {
            Constant {
                shape: Shape::Scalar(ScalarKind::Bool),
                words,
            } => Some(words[0] != 0),
            _ => None,
        }
    }

    /// A value of the new function for a handle of it.
    fn value_of(&self, new: Handle<Expression>) -> Value {
        match self.constant_of[new.index()] {
            Some(constant) => Value::Constant(constant),
            None => Value::Computed(new),
        }
    }

    /// A handle for a value, to be used here.
    fn handle(&mut self, value: Value) -> Handle<Expression> {
        match value {
            Value::Computed(new) => new,
            Value::Constant(index) => {
                let (constant, origin) = self.constants[index].clone();
                self.materialise(index, &constant, origin, true)
            }
        }
    }

    fn literal(&mut self, kind: ScalarKind, word: u32) -> Handle<Expression> {
        if let Some(literal) = self.literals.get(&(kind, word)) {
            return *literal;
        }
        let scalar = Constant {
            shape: Shape::Scalar(kind),
            words: vec![word],
        };
        let literal = scalar.literals().and_then(|all| all.first().copied());
        let literal = literal.expect("constants are finite");
        let new = self.append(Expression::Literal(literal), Origin::Made);
        self.constants.push((scalar, Origin::Made));
        self.constant_of[new.index()] = Some(self.constants.len() - 1);
        self.literals.insert((kind, word), new);
        new
    }

    fn materialise(
        &mut self,
        index: usize,
        constant: &Constant,
        origin: Origin,
        emit: bool,
    ) -> Handle<Expression> {
        let new = match constant.shape {
            Shape::Scalar(kind) => return self.literal(kind, constant.words[0]),
            Shape::Vector(size, kind) => {
                let size = vector_size(size);
                let expression = if constant.words.iter().all(|word| *word == constant.words[0]) {
                    let value = self.literal(kind, constant.words[0]);
                    Expression::Splat { size, value }
                } else {
                    let scalar = Scalar {
                        kind,
                        width: if kind == ScalarKind::Bool { 1 } else { 4 },
                    };
                    let ty = self.ty(TypeInner::Vector { size, scalar });
                    let components = constant.words.iter();
                    let components = components.map(|word| self.literal(kind, *word)).collect();
                    Expression::Compose { ty, components }
                };
                self.append_constant(expression, origin, emit)
            }
            Shape::Matrix { columns, rows } => {
                let kind = ScalarKind::Float;
                let ty = self.ty(TypeInner::Matrix {
                    columns: vector_size(columns),
                    rows: vector_size(rows),
                    scalar: Scalar::F32,
                });
                let parts = constant.words.chunks(rows).map(|words| Constant {
                    shape: Shape::Vector(rows, kind),
                    words: words.to_vec(),
                });
                let parts: Vec<_> = parts.collect();
                let mut components = Vec::with_capacity(columns);
                for part in parts {
                    let Value::Constant(index) = self.constant(part.clone(), Origin::Made) else {
                        unreachable!("a constant is one");
                    };
                    components.push(self.materialise(index, &part, Origin::Made, emit));
                }
                self.append_constant(Expression::Compose { ty, components }, origin, emit)
            }
        };
        self.constant_of[new.index()] = Some(index);
        new
    }

    fn append_constant(
        &mut self,
        expression: Expression,
        origin: Origin,
        emit: bool,
    ) -> Handle<Expression> {
        if emit {
            return self.append(expression, origin);
        }
        self.flush();
        let new = self.append(expression, origin);
        self.pending = None;
        new
    }

    /// The zero of a type that is a scalar, vector or matrix of a known kind.
    fn zero(inner: &TypeInner) -> Option<Constant> {
        let shape = Shape::of(inner)?;
        Some(Constant {
            shape,
            words: vec![0; shape.components()],
        })
    }

    /// A constant that the constant folding of others cannot see through: it is loaded from a variable.
    fn fence(&mut self, constant: &Constant) -> Handle<Expression> {
        let key = (constant.shape.kind(), constant.words.clone());
        let local = match self.fences.get(&key) {
            Some(local) => *local,
            None => {
                let Value::Constant(index) = self.constant(constant.clone(), Origin::Made) else {
                    unreachable!("a constant is one");
                };
                let init = self.materialise(index, constant, Origin::Made, false);
                let inner = inner_of(constant.shape);
                let ty = self.ty(inner);
                let local = LocalVariable {
                    name: Some("opaque".into()),
                    ty,
                    init: Some(init),
                };
                let local = self.locals.append(local, Span::UNDEFINED);
                // What is known of variables leaves out those that were made here.
                self.tracked.push(false);
                self.pointers.push(None);
                self.fences.insert(key, local);
                local
            }
        };
        let pointer = self.pointer(local);
        self.append(Expression::Load { pointer }, Origin::Local(local))
    }

    // ---- Old values ----

    /// Finds out what is needed. What a replacement has left without users is not computed, or equal values
    /// further in would be taken for it.
    fn need(&mut self, body: &Block) {
        let mut open = Vec::new();
        operands::walk(body, &mut |statement| {
            operands::each_of_statement(statement, |operand| open.push(operand));
        });
        while let Some(value) = open.pop() {
            let value = self.replacement(value);
            if !std::mem::replace(&mut self.needed[value.index()], true) {
                operands::each(&self.expressions[value], |operand| open.push(operand));
            }
        }
    }

    fn replacement(&self, mut old: Handle<Expression>) -> Handle<Expression> {
        let mut steps = 0;
        while let Some(new) = self.replaced.get(&old) {
            old = *new;
            steps += 1;
            assert!(steps <= self.replaced.len(), "a value replaces itself");
        }
        old
    }

    /// What became of an old value, for a user here.
    fn get(&mut self, old: Handle<Expression>) -> Value {
        let old = self.replacement(old);
        if let Some(value) = self.map[old.index()] {
            return value;
        }
        let expression = &self.expressions[old];
        assert!(
            expression.needs_pre_emit() || old.index() >= self.first_added,
            "the old value {old:?}, {expression:?}, is used where it is not computed"
        );
        self.make(old)
    }

    /// Computes an old value here.
    fn make(&mut self, old: Handle<Expression>) -> Value {
        let origin = Origin::Value(old);
        let expressions = self.expressions;
        let value = self.value(&expressions[old], origin);
        self.map[old.index()] = Some(value);
        if !expressions[old].needs_pre_emit() {
            self.mapped.push(old);
        }
        value
    }

    /// The value of an expression over old operands.
    fn value(&mut self, expression: &Expression, origin: Origin) -> Value {
        match *expression {
            Expression::Literal(literal) => self.compute(Expression::Literal(literal), origin),
            Expression::ZeroValue(ty) => match Self::zero(&self.module.types[ty].inner) {
                Some(zero) => self.constant(zero, origin),
                None => self.compute(expression.clone(), origin),
            },
            Expression::Constant(constant) => {
                let init = self.module.constants[constant].init;
                match fold::module_constant(self.module, init) {
                    Some(folded) => self.constant(folded, origin),
                    None => self.compute(expression.clone(), origin),
                }
            }
            Expression::LocalVariable(local) => Value::Computed(self.pointer(local)),
            Expression::Load { pointer } => {
                let pointer = self.get(pointer);
                let pointer = self.handle(pointer);
                self.load(pointer, origin)
            }
            Expression::Access { base, index } => {
                let (base, index) = (self.get(base), self.get(index));
                self.access(base, index, origin)
            }
            Expression::AccessIndex { base, index } => {
                let base = self.get(base);
                self.component(base, index, origin)
            }
            Expression::Compose { ty, ref components } => {
                let components = components.iter().map(|c| self.get(*c)).collect();
                self.compose(ty, components, origin)
            }
            Expression::Splat { size, value } => {
                let value = self.get(value);
                self.splat(size, value, origin)
            }
            Expression::Swizzle {
                size,
                vector,
                pattern,
            } => {
                let vector = self.get(vector);
                self.swizzle(size, vector, pattern, origin)
            }
            _ => self.operation(expression, origin),
        }
    }

    fn operation(&mut self, expression: &Expression, origin: Origin) -> Value {
        // No expression that comes here has more operands than a texture sample.
        let mut given = [Value::Constant(usize::MAX); 8];
        let mut count = 0;
        let mut constants = 0;
        operands::each(expression, |operand| {
            let value = self.get(operand);
            constants += usize::from(self.as_constant(value).is_some());
            given[count] = value;
            count += 1;
        });
        let given = &mut given[..count];
        if let Some(simple) = self.simplified(expression, given) {
            return simple;
        }
        if constants == count && count > 0 && Operation::of(expression).is_some() {
            let known: Vec<Constant> = given
                .iter()
                .filter_map(|value| self.as_constant(*value).cloned())
                .collect();
            if let Some(folded) = fold::operation(expression, &known) {
                return self.constant(folded, origin);
            }
            // An infinite or undefined result has no literal, and writing the operation with its
            // literals would be an error in most languages: the operand is hidden in a variable.
            given[0] = Value::Computed(self.fence(&known[0]));
        }
        let mut handles = given.iter().map(|value| self.handle(*value));
        let mapped = operands::map(expression, |old| handles.next().unwrap_or(old));
        drop(handles);
        self.compute(mapped, origin)
    }

    /// Exact simplifications of operations whose operands are known in part.
    fn simplified(&mut self, expression: &Expression, given: &[Value]) -> Option<Value> {
        match expression {
            Expression::Select { .. } => self.select_known(given[0], given[1], given[2]),
            Expression::Binary {
                op: BinaryOperator::LogicalAnd,
                ..
            } => match (self.as_bool(given[0]), self.as_bool(given[1])) {
                (Some(true), _) => Some(given[1]),
                (_, Some(true)) => Some(given[0]),
                (Some(false), _) => Some(given[0]),
                (_, Some(false)) => Some(given[1]),
                _ => None,
            },
            Expression::Binary {
                op: BinaryOperator::LogicalOr,
                ..
            } => match (self.as_bool(given[0]), self.as_bool(given[1])) {
                (Some(false), _) => Some(given[1]),
                (_, Some(false)) => Some(given[0]),
                (Some(true), _) => Some(given[0]),
                (_, Some(true)) => Some(given[1]),
                _ => None,
            },
            Expression::Unary {
                op: UnaryOperator::LogicalNot,
                ..
            } => match given[0] {
                Value::Computed(new) => match self.new[new] {
                    Expression::Unary {
                        op: UnaryOperator::LogicalNot,
                        expr,
                    } => Some(self.value_of(expr)),
                    _ => None,
                },
                Value::Constant(_) => None,
            },
            _ => None,
        }
    }

    fn same(&self, a: Value, b: Value) -> bool {
        match (self.as_constant(a), self.as_constant(b)) {
            (Some(a), Some(b)) => a == b,
            _ => a == b,
        }
    }

    fn select_known(&self, condition: Value, accept: Value, reject: Value) -> Option<Value> {
        match self.as_bool(condition) {
            Some(true) => Some(accept),
            Some(false) => Some(reject),
            None if self.same(accept, reject) => Some(accept),
            None if self.as_bool(accept) == Some(true) && self.as_bool(reject) == Some(false) => {
                // Both are single bools, so the condition is one too.
                Some(condition)
            }
            None => None,
        }
    }

    /// A part of a value, or the pointer to a part.
    fn component(&mut self, base: Value, index: u32, origin: Origin) -> Value {
        let base = match base {
            Value::Constant(at) => {
                let part = fold::component(&self.constants[at].0, index);
                return self.constant(part, origin);
            }
            Value::Computed(base) => base,
        };
        if let Expression::Load { pointer } = self.new[base]
            && self.read_only(pointer)
            && self.is_aggregate(base)
        {
            // Reading a part alone gives the same bits, and leaves the rest unread.
            let part = self.component(Value::Computed(pointer), index, Origin::Made);
            let part = self.handle(part);
            return self.load(part, origin);
        }
        match self.new[base] {
            Expression::Compose { ty, ref components } => {
                let components = components.clone();
                if !matches!(self.module.types[ty].inner, TypeInner::Vector { .. }) {
                    return self.value_of(components[index as usize]);
                }
                let mut at = index;
                for part in components {
                    match *self.type_of(part) {
                        TypeInner::Vector { size, .. } if at >= size as u32 => at -= size as u32,
                        TypeInner::Vector { .. } => {
                            let part = self.value_of(part);
                            return self.component(part, at, origin);
                        }
                        _ if at >= 1 => at -= 1,
                        _ => return self.value_of(part),
                    }
                }
                unreachable!("a vector is composed of all its components")
            }
            Expression::Splat { value, .. } => self.value_of(value),
            Expression::Swizzle {
                vector, pattern, ..
            } => {
                let vector = self.value_of(vector);
                self.component(vector, pattern[index as usize] as u32, origin)
            }
            Expression::ZeroValue(ty) => match self.part_type(ty, index) {
                Some(part) => self.value(&Expression::ZeroValue(part), origin),
                None => self.compute(Expression::AccessIndex { base, index }, origin),
            },
            _ => {
                let expression = Expression::AccessIndex { base, index };
                if let Some(constant) = fold::path(self.module, &self.new, base, index) {
                    return self.constant(constant, origin);
                }
                self.compute(expression, origin)
            }
        }
    }

    fn is_aggregate(&mut self, value: Handle<Expression>) -> bool {
        matches!(
            self.type_of(value),
            TypeInner::Struct { .. } | TypeInner::Array { .. }
        )
    }

    fn part_type(&self, ty: Handle<Type>, index: u32) -> Option<Handle<Type>> {
        match &self.module.types[ty].inner {
            TypeInner::Struct { members, .. } => members.get(index as usize).map(|m| m.ty),
            TypeInner::Array { base, .. } => Some(*base),
            _ => None,
        }
    }

    fn access(&mut self, base: Value, index: Value, origin: Origin) -> Value {
        if let Some(constant) = self.as_constant(index) {
            let signed = constant.shape.kind() == ScalarKind::Sint;
            let index = constant.words[0];
            if !(signed && (index as i32) < 0) && self.in_bounds(base, index) {
                return self.component(base, index, origin);
            }
        }
        let base = self.handle(base);
        let index = self.handle(index);
        self.compute(Expression::Access { base, index }, origin)
    }

    fn in_bounds(&mut self, base: Value, index: u32) -> bool {
        let length = match base {
            Value::Constant(at) => match self.constants[at].0.shape {
                Shape::Scalar(_) => 0,
                Shape::Vector(size, _) => size as u32,
                Shape::Matrix { columns, .. } => columns as u32,
            },
            Value::Computed(base) => {
                self.resolve(base);
                let types = &self.module.types;
                let resolution = self.types[base.index()].as_ref();
                let inner = match resolution.map(|r| r.inner_with(types)) {
                    Some(TypeInner::Pointer { base, .. }) => &types[*base].inner,
                    Some(TypeInner::ValuePointer {
                        size: Some(size), ..
                    }) => return index < *size as u32,
                    Some(inner) => inner,
                    None => return false,
                };
                match *inner {
                    TypeInner::Vector { size, .. } => size as u32,
                    TypeInner::Matrix { columns, .. } => columns as u32,
                    TypeInner::Array {
                        size: ArraySize::Constant(size),
                        ..
                    } => size.get(),
                    _ => 0,
                }
            }
        };
        index < length
    }

    fn splat(&mut self, size: VectorSize, value: Value, origin: Origin) -> Value {
        if let Some(constant) = self.as_constant(value) {
            let splat = Constant {
                shape: Shape::Vector(size as usize, constant.shape.kind()),
                words: vec![constant.words[0]; size as usize],
            };
            return self.constant(splat, origin);
        }
        let value = self.handle(value);
        self.compute(Expression::Splat { size, value }, origin)
    }

    fn swizzle(
        &mut self,
        size: VectorSize,
        vector: Value,
        mut pattern: [SwizzleComponent; 4],
        origin: Origin,
    ) -> Value {
        let count = size as usize;
        // What lies beyond the size means nothing.
        pattern[count..].fill(SwizzleComponent::X);
        let new = match vector {
            Value::Constant(at) => {
                let constant = &self.constants[at].0;
                let words = pattern[..count].iter();
                let picked = Constant {
                    shape: Shape::Vector(count, constant.shape.kind()),
                    words: words.map(|c| constant.words[*c as usize]).collect(),
                };
                return self.constant(picked, origin);
            }
            Value::Computed(new) => new,
        };
        let in_order = pattern[..count]
            .iter()
            .enumerate()
            .all(|(i, component)| *component as usize == i);
        if in_order
            && matches!(*self.type_of(new), TypeInner::Vector { size: whole, .. } if whole == size)
        {
            return vector;
        }
        match self.new[new] {
            Expression::Splat { value, .. } => {
                let value = self.value_of(value);
                self.splat(size, value, origin)
            }
            Expression::Swizzle {
                vector,
                pattern: before,
                ..
            } => {
                let vector = self.value_of(vector);
                let composed = pattern.map(|component| before[component as usize]);
                self.swizzle(size, vector, composed, origin)
            }
            Expression::Compose { ref components, .. } => {
                let components = components.clone();
                if let Some(value) = self.picked(&components, size, &pattern[..count], origin) {
                    return value;
                }
                let expression = Expression::Swizzle {
                    size,
                    vector: new,
                    pattern,
                };
                self.compute(expression, origin)
            }
            _ => {
                let expression = Expression::Swizzle {
                    size,
                    vector: new,
                    pattern,
                };
                self.compute(expression, origin)
            }
        }
    }

    /// A swizzle of a composed vector, when it takes one of the parts, or single components only.
    fn picked(
        &mut self,
        parts: &[Handle<Expression>],
        size: VectorSize,
        pattern: &[SwizzleComponent],
        origin: Origin,
    ) -> Option<Value> {
        let mut places = Vec::new();
        for part in parts {
            let width = match *self.type_of(*part) {
                TypeInner::Vector { size, .. } => size as u32,
                _ => 1,
            };
            places.extend((0..width).map(|at| (*part, width, at)));
        }
        let picked: Vec<_> = pattern.iter().map(|c| places[*c as usize]).collect();
        let first = picked[0].0;
        let whole = picked.iter().enumerate().all(|(i, (part, width, at))| {
            *part == first && *width == size as u32 && *at == i as u32
        });
        if whole {
            return Some(self.value_of(first));
        }
        if picked.iter().all(|(part, ..)| *part == first) {
            let mut inner = [SwizzleComponent::X; 4];
            for (to, (_, width, at)) in inner.iter_mut().zip(&picked) {
                if *width == 1 {
                    let value = self.value_of(first);
                    return Some(self.splat(size, value, origin));
                }
                *to = SwizzleComponent::XYZW[*at as usize];
            }
            let vector = self.value_of(first);
            return Some(self.swizzle(size, vector, inner, origin));
        }
        if picked.iter().all(|(_, width, _)| *width == 1) {
            let scalar = self.type_of(first).scalar()?;
            let ty = self.ty(TypeInner::Vector { size, scalar });
            let values = picked.iter().map(|(part, ..)| self.value_of(*part));
            let values: Vec<_> = values.collect();
            return Some(self.compose(ty, values, origin));
        }
        None
    }

    fn compose(&mut self, ty: Handle<Type>, parts: Vec<Value>, origin: Origin) -> Value {
        if let Some(shape) = Shape::of(&self.module.types[ty].inner)
            && parts.iter().all(|part| self.as_constant(*part).is_some())
        {
            let words = parts.iter().filter_map(|part| self.as_constant(*part));
            let words: Vec<u32> = words.flat_map(|part| part.words.clone()).collect();
            return self.constant(Constant { shape, words }, origin);
        }
        if let Some(whole) = self.reassembled(ty, &parts) {
            return whole;
        }
        let components = parts.into_iter().map(|part| self.handle(part)).collect();
        self.compute(Expression::Compose { ty, components }, origin)
    }

    /// The value whose components, all of them and in order, are the parts.
    fn reassembled(&mut self, ty: Handle<Type>, parts: &[Value]) -> Option<Value> {
        let part = |this: &Self, value: Value| match value {
            Value::Computed(new) => match this.new[new] {
                Expression::AccessIndex { base, index } => Some((base, index)),
                _ => None,
            },
            Value::Constant(_) => None,
        };
        let (whole, _) = part(self, *parts.first()?)?;
        for (at, value) in parts.iter().enumerate() {
            if part(self, *value)? != (whole, at as u32) {
                return None;
            }
        }
        self.resolve(whole);
        let types = &self.module.types;
        let resolution = self.types[whole.index()].as_ref()?;
        let equal = match (resolution, &types[ty].inner) {
            (TypeResolution::Handle(have), _) if *have == ty => true,
            (have, wanted @ TypeInner::Vector { .. }) => have.inner_with(types) == wanted,
            _ => false,
        };
        equal.then_some(Value::Computed(whole))
    }

    // ---- Memory ----

    fn pointer(&mut self, local: Handle<LocalVariable>) -> Handle<Expression> {
        if let Some(pointer) = self.pointers[local.index()] {
            return pointer;
        }
        let pointer = self.append(Expression::LocalVariable(local), Origin::Local(local));
        self.pointers[local.index()] = Some(pointer);
        pointer
    }

    /// The followed variable that a pointer leads into, and the way there.
    fn way(&self, pointer: Handle<Expression>) -> Option<(Handle<LocalVariable>, Vec<Step>)> {
        let mut steps = Vec::new();
        let mut at = pointer;
        loop {
            match self.new[at] {
                Expression::Access { base, index } => {
                    steps.push(Step::Dynamic(index));
                    at = base;
                }
                Expression::AccessIndex { base, index } => {
                    steps.push(Step::Index(index));
                    at = base;
                }
                Expression::LocalVariable(local) => {
                    steps.reverse();
                    return self.tracked[local.index()].then_some((local, steps));
                }
                _ => return None,
            }
        }
    }

    fn is_matrix(&self, local: Handle<LocalVariable>) -> bool {
        let ty = self.locals[local].ty;
        matches!(self.module.types[ty].inner, TypeInner::Matrix { .. })
    }

    /// What a followed variable holds here.
    fn read(&mut self, local: Handle<LocalVariable>) -> Value {
        let value = match self.state[local.index()] {
            Known::Value(value) => return value,
            Known::Memory => {
                let pointer = self.pointer(local);
                let load = Expression::Load { pointer };
                Value::Computed(self.append(load, Origin::Local(local)))
            }
            Known::Initial => match self.old.local_variables[local].init {
                Some(init) => self.initial(init),
                None => {
                    let zero = Expression::ZeroValue(self.locals[local].ty);
                    self.value(&zero, Origin::Local(local))
                }
            },
        };
        self.state[local.index()] = Known::Value(value);
        value
    }

    /// The value of an initialiser, computed here.
    fn initial(&mut self, init: Handle<Expression>) -> Value {
        let expressions = self.expressions;
        let mut inner = Vec::new();
        operands::each(&expressions[init], |operand| inner.push(operand));
        let before: Vec<_> = inner
            .iter()
            .map(|operand| {
                let value = self.initial(*operand);
                self.map[operand.index()].replace(value)
            })
            .collect();
        let value = self.value(&expressions[init], Origin::Value(init));
        for (operand, before) in inner.into_iter().zip(before) {
            self.map[operand.index()] = before;
        }
        value
    }

    fn load(&mut self, pointer: Handle<Expression>, origin: Origin) -> Value {
        if let Some((local, steps)) = self.way(pointer) {
            let dynamic = steps.iter().any(|step| matches!(step, Step::Dynamic(_)));
            if !(dynamic && self.is_matrix(local)) {
                let mut value = self.read(local);
                if steps.is_empty()
                    && let Value::Computed(new) = value
                {
                    let loaded = matches!(self.new[new], Expression::Load { .. });
                    let before = self.origins[new.index()];
                    let first = matches!(before, Origin::Local(_));
                    // Of a value that was stored, or loaded elsewhere too, this load is one user of several.
                    self.merged[new.index()] |= match loaded {
                        true => !first && before != origin,
                        false => first,
                    };
                    if first {
                        self.origins[new.index()] = origin;
                    }
                }
                for (at, step) in steps.iter().enumerate() {
                    let last = at + 1 == steps.len();
                    let origin = if last { origin } else { Origin::Made };
                    value = match *step {
                        Step::Index(index) => self.component(value, index, origin),
                        Step::Dynamic(index) => {
                            let index = self.value_of(index);
                            self.access(value, index, origin)
                        }
                    };
                }
                return value;
            }
            return Value::Computed(self.append(Expression::Load { pointer }, origin));
        }
        // A component of a vector in read-only memory is taken from the whole, so that one load
        // serves all.
        let part = match self.new[pointer] {
            Expression::AccessIndex { base, index } => Some((base, Ok(index))),
            Expression::Access { base, index } => Some((base, Err(index))),
            _ => None,
        };
        if let Some((base, index)) = part
            && self.read_only(pointer)
            && self.points_to_vector(base)
        {
            let whole = self.load(base, Origin::Made);
            return match index {
                Ok(index) => self.component(whole, index, origin),
                Err(index) => {
                    let index = self.value_of(index);
                    self.access(whole, index, origin)
                }
            };
        }
        self.compute(Expression::Load { pointer }, origin)
    }

    fn points_to_vector(&mut self, pointer: Handle<Expression>) -> bool {
        self.resolve(pointer);
        let types = &self.module.types;
        match self.types[pointer.index()]
            .as_ref()
            .map(|r| r.inner_with(types))
        {
            Some(TypeInner::Pointer { base, .. }) => {
                matches!(types[*base].inner, TypeInner::Vector { .. })
            }
            Some(TypeInner::ValuePointer { size, .. }) => size.is_some(),
            _ => false,
        }
    }

    fn store(&mut self, pointer: Handle<Expression>, value: Value, span: Span) {
        let Some((local, steps)) = self.way(pointer) else {
            let value = self.handle(value);
            self.push(Statement::Store { pointer, value }, span);
            return;
        };
        if steps.iter().any(|step| matches!(step, Step::Dynamic(_))) {
            let value = self.handle(value);
            self.push(Statement::Store { pointer, value }, span);
            self.state[local.index()] = Known::Memory;
            return;
        }
        let whole = if steps.is_empty() {
            value
        } else {
            let before = self.read(local);
            let ty = self.locals[local].ty;
            self.insert(before, ty, &steps, value, local)
        };
        self.set(local, whole, span);
    }

    /// Stores a whole value.
    fn set(&mut self, local: Handle<LocalVariable>, value: Value, span: Span) {
        if let Known::Value(before) = self.state[local.index()]
            && self.same(before, value)
        {
            // A loop without this store may be one that leaves the variable alone.
            self.again = true;
            return;
        }
        let pointer = self.pointer(local);
        let new = self.handle(value);
        if let Value::Computed(new) = value {
            self.stored.push((new, local));
        }
        self.push(
            Statement::Store {
                pointer,
                value: new,
            },
            span,
        );
        self.state[local.index()] = Known::Value(value);
    }

    /// A vector or matrix with a part changed.
    fn insert(
        &mut self,
        whole: Value,
        ty: Handle<Type>,
        steps: &[Step],
        value: Value,
        local: Handle<LocalVariable>,
    ) -> Value {
        let origin = Origin::Local(local);
        let Some((Step::Index(index), rest)) = steps.split_first() else {
            return value;
        };
        let (count, column) = match self.module.types[ty].inner {
            TypeInner::Matrix {
                columns,
                rows,
                scalar,
            } => {
                let column = TypeInner::Vector { size: rows, scalar };
                (columns as u32, Some(column))
            }
            TypeInner::Vector { size, .. } => (size as u32, None),
            ref other => unreachable!("{other:?} is not followed"),
        };
        let mut parts = Vec::with_capacity(count as usize);
        for at in 0..count {
            let part = match &column {
                _ if at != *index => self.component(whole, at, Origin::Made),
                Some(column) if !rest.is_empty() => {
                    let column = self.ty(match *column {
                        TypeInner::Vector { size, scalar } => TypeInner::Vector { size, scalar },
                        ref other => unreachable!("{other:?} is no column"),
                    });
                    let before = self.component(whole, at, Origin::Made);
                    self.insert(before, column, rest, value, local)
                }
                _ => value,
            };
            parts.push(part);
        }
        self.compose(ty, parts, origin)
    }

    // ---- Control flow ----

    /// What is known when the function begins.
    fn start(&mut self) {
        for (local, variable) in self.old.local_variables.iter() {
            let known = if !self.tracked[local.index()] {
                Known::Memory
            } else {
                match variable.init {
                    None => match Self::zero(&self.module.types[variable.ty].inner) {
                        Some(zero) => Known::Value(self.constant(zero, Origin::Local(local))),
                        None => Known::Initial,
                    },
                    Some(init) => match self.constant_tree(init) {
                        Some(value) => Known::Value(value),
                        None => Known::Initial,
                    },
                }
            };
            self.state.push(known);
        }
        // Initialisers are constants outside of every block.
        let inits: Vec<_> = self
            .old
            .local_variables
            .iter()
            .filter_map(|(local, variable)| Some((local, variable.init?)))
            .collect();
        for (local, init) in inits {
            let new = self.initialiser(init);
            self.locals[local].init = Some(new);
        }
    }

    fn initialiser(&mut self, init: Handle<Expression>) -> Handle<Expression> {
        if let Some(Value::Constant(index)) = self.constant_tree(init) {
            let (constant, origin) = self.constants[index].clone();
            return self.materialise(index, &constant, origin, false);
        }
        let expressions = self.expressions;
        let expression = operands::map(&expressions[init], |operand| self.initialiser(operand));
        self.append_constant(expression, Origin::Value(init), false)
    }

    /// An initialiser as a constant, if it is a scalar, vector or matrix.
    fn constant_tree(&mut self, init: Handle<Expression>) -> Option<Value> {
        let constant = fold::tree(self.module, self.expressions, init)?;
        Some(self.constant(constant, Origin::Value(init)))
    }

    /// Whether a value can be used here.
    fn available(&self, value: Handle<Expression>) -> bool {
        match self.blocks[value.index()] {
            Some((depth, number)) => self.open.get(depth) == Some(&number),
            None => true,
        }
    }

    /// What is known, as far as it can be used here.
    fn visible(&self, mut state: Vec<Known>) -> Vec<Known> {
        for known in &mut state {
            if let Known::Value(Value::Computed(value)) = known
                && !self.available(*value)
            {
                *known = Known::Memory;
            }
        }
        state
    }

    /// What is known when control may come from two places.
    fn meet(&self, a: Vec<Known>, b: &[Known]) -> Vec<Known> {
        let mut met = a;
        for (a, b) in met.iter_mut().zip(b) {
            let equal = match (*a, *b) {
                (Known::Value(a), Known::Value(b)) => self.same(a, b),
                (a, b) => a == b,
            };
            if !equal {
                *a = Known::Memory;
            }
        }
        met
    }

    /// Rebuilds a block of its own.
    fn nested(&mut self, old: &Block) -> (Block, Flow) {
        self.flush();
        let outside = std::mem::take(&mut self.out);
        let marks = self.enter();
        let flow = self.statements(old);
        self.flush();
        self.leave(marks);
        (std::mem::replace(&mut self.out, outside), flow)
    }

    fn enter(&mut self) -> (usize, usize) {
        self.opened += 1;
        self.open.push(self.opened);
        (self.mapped.len(), self.equalled.len())
    }

    fn leave(&mut self, (mapped, equalled): (usize, usize)) {
        self.open.pop();
        for old in self.mapped.drain(mapped..) {
            self.map[old.index()] = None;
        }
        self.forget(equalled);
    }

    fn forget(&mut self, equalled: usize) {
        for (key, before) in self.equalled.drain(equalled..).rev() {
            match before {
                Some(before) => self.equal.insert(key, before),
                None => self.equal.remove(&key),
            };
        }
    }

    fn statements(&mut self, old: &Block) -> Flow {
        for (statement, span) in old.span_iter() {
            if self.statement(statement, *span) == Flow::Jumps {
                return Flow::Jumps;
            }
        }
        Flow::Falls
    }

    fn statement(&mut self, statement: &Statement, span: Span) -> Flow {
        match statement {
            Statement::Emit(range) => {
                for old in range.clone() {
                    if self.needed[old.index()] && self.map[old.index()].is_none() {
                        self.make(old);
                    }
                }
                Flow::Falls
            }
            Statement::Block(inner) => self.statements(inner),
            Statement::If {
                condition,
                accept,
                reject,
            } => self.branch(*condition, accept, reject, span),
            Statement::Switch { selector, cases } => self.switch(*selector, cases, span),
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => self.repeat(body, continuing, *break_if, span),
            Statement::Break => {
                self.push(Statement::Break, span);
                let state = self.state.clone();
                self.reach(state);
                Flow::Jumps
            }
            Statement::Continue => {
                self.push(Statement::Continue, span);
                if let Some(target) = self.targets.iter_mut().rev().find(|t| t.is_loop) {
                    target.continues = true;
                }
                Flow::Jumps
            }
            Statement::Return { value } => {
                let value = value.map(|value| self.get(value));
                let value = value.map(|value| self.handle(value));
                self.push(Statement::Return { value }, span);
                Flow::Jumps
            }
            Statement::Store { pointer, value } => {
                let pointer = self.get(*pointer);
                let pointer = self.handle(pointer);
                let value = self.get(*value);
                self.store(pointer, value, span);
                Flow::Falls
            }
            other => {
                let mut new = other.clone();
                operands::each_mut_of_statement(
                    &mut new,
                    |operand| {
                        let value = self.get(*operand);
                        *operand = self.handle(value);
                    },
                    |_| {},
                );
                if let Some(result) = operands::result(other) {
                    self.flush();
                    let expression = self.expressions[result].clone();
                    let value = self.append(expression, Origin::Value(result));
                    // The statement computes it, not an `Emit`.
                    self.pending = None;
                    self.map[result.index()] = Some(Value::Computed(value));
                    self.mapped.push(result);
                    operands::each_mut_of_statement(&mut new, |_| {}, |result| *result = value);
                }
                self.push(new, span);
                Flow::Falls
            }
        }
    }

    /// Joins what is known here to what is known behind the innermost loop or switch.
    fn reach(&mut self, state: Vec<Known>) {
        let Some(mut target) = self.targets.pop() else {
            return;
        };
        target.out = Some(match target.out.take() {
            Some(before) => self.meet(before, &state),
            None => state,
        });
        self.targets.push(target);
    }

    /// Notes that a branch was decided: a loop around it may store to fewer variables than it seemed.
    fn folded(&mut self) {
        self.again |= self.targets.iter().any(|target| target.is_loop);
    }

    fn branch(
        &mut self,
        condition: Handle<Expression>,
        accept: &Block,
        reject: &Block,
        span: Span,
    ) -> Flow {
        let condition = self.get(condition);
        if let Some(known) = self.as_bool(condition) {
            self.folded();
            return self.statements(if known { accept } else { reject });
        }
        let test = self.handle(condition);
        self.flush();
        let before = self.state.clone();
        let (accept, accept_flow) = self.nested(accept);
        let accepted = std::mem::replace(&mut self.state, before);
        let (reject, reject_flow) = self.nested(reject);
        let rejected = std::mem::take(&mut self.state);
        self.push(
            Statement::If {
                condition: test,
                accept,
                reject,
            },
            span,
        );
        match (accept_flow, reject_flow) {
            (Flow::Jumps, Flow::Jumps) => {
                self.state = accepted;
                return Flow::Jumps;
            }
            (Flow::Jumps, Flow::Falls) => self.state = self.visible(rejected),
            (Flow::Falls, Flow::Jumps) => self.state = self.visible(accepted),
            (Flow::Falls, Flow::Falls) => self.join(condition, accepted, rejected, span),
        }
        Flow::Falls
    }

    /// What is known after an `if`: where both sides left something that is at hand, the variable is set
    /// to a choice of the two.
    fn join(&mut self, condition: Value, accepted: Vec<Known>, rejected: Vec<Known>, span: Span) {
        self.state = vec![Known::Memory; accepted.len()];
        let mut choices = Vec::new();
        for (at, (a, b)) in accepted.iter().zip(&rejected).enumerate() {
            self.state[at] = match (*a, *b) {
                (Known::Value(a), Known::Value(b)) if self.same(a, b) => {
                    self.visible(vec![Known::Value(a)])[0]
                }
                (Known::Value(a), Known::Value(b)) => {
                    choices.push((at, a, b));
                    Known::Memory
                }
                (a, b) if a == b => a,
                _ => Known::Memory,
            };
        }
        if choices.is_empty() {
            return;
        }
        let locals: Vec<_> = self.locals.iter().map(|(local, _)| local).collect();
        for (at, accept, reject) in choices {
            if let Some(chosen) = self.choice(condition, accept, reject, locals[at]) {
                self.set(locals[at], chosen, span);
            }
        }
    }

    fn choice(
        &mut self,
        condition: Value,
        accept: Value,
        reject: Value,
        local: Handle<LocalVariable>,
    ) -> Option<Value> {
        let origin = Origin::Local(local);
        let ty = &self.module.types[self.locals[local].ty].inner;
        if !matches!(ty, TypeInner::Scalar(_) | TypeInner::Vector { .. }) {
            return None;
        }
        // `a && b` and `a || b` arrive as branches; what they guard is worth computing either way
        // when it is cheap.
        let is_bool = matches!(ty, TypeInner::Scalar(Scalar::BOOL));
        let logical = is_bool && (self.as_bool(accept).is_some() || self.as_bool(reject).is_some());
        let mut left = if logical { CHEAP } else { 0 };
        if !self.repeats(accept, &mut left) || !self.repeats(reject, &mut left) {
            return None;
        }
        let accept = self.again_here(accept);
        let reject = self.again_here(reject);
        if let Some(known) = self.select_known(condition, accept, reject) {
            return Some(known);
        }
        let (op, left, right) = match (is_bool, self.as_bool(accept), self.as_bool(reject)) {
            (true, _, Some(false)) => (BinaryOperator::LogicalAnd, condition, accept),
            (true, Some(true), _) => (BinaryOperator::LogicalOr, condition, reject),
            (true, _, Some(true)) => {
                let not = self.not(condition, origin);
                (BinaryOperator::LogicalOr, not, accept)
            }
            (true, Some(false), _) => {
                let not = self.not(condition, origin);
                (BinaryOperator::LogicalAnd, not, reject)
            }
            _ => {
                let select = Expression::Select {
                    condition: self.handle(condition),
                    accept: self.handle(accept),
                    reject: self.handle(reject),
                };
                return Some(self.compute(select, origin));
            }
        };
        let binary = Expression::Binary {
            op,
            left: self.handle(left),
            right: self.handle(right),
        };
        Some(self.compute(binary, origin))
    }

    fn not(&mut self, condition: Value, origin: Origin) -> Value {
        let not = Expression::Unary {
            op: UnaryOperator::LogicalNot,
            expr: self.handle(condition),
        };
        if let Some(known) = self.simplified(&not, &[condition]) {
            return known;
        }
        self.compute(not, origin)
    }

    /// Whether a value is at hand here, or can be computed again from what is, in as many steps as are
    /// left. Taking components and putting them together costs nothing.
    fn repeats(&self, value: Value, left: &mut u32) -> bool {
        let Value::Computed(new) = value else {
            return true;
        };
        if self.available(new) {
            return true;
        }
        let expression = &self.new[new];
        match expression {
            Expression::AccessIndex { .. }
            | Expression::Splat { .. }
            | Expression::Swizzle { .. } => {}
            Expression::Compose { ty, .. }
                if matches!(self.module.types[*ty].inner, TypeInner::Vector { .. }) => {}
            Expression::Unary { .. }
            | Expression::Binary { .. }
            | Expression::Select { .. }
            | Expression::Relational { .. }
            | Expression::As { .. }
                if *left > 0 =>
            {
                *left -= 1;
            }
            Expression::Load { pointer } if *left > 0 && self.plain_uniform(*pointer) => {
                *left -= 1;
            }
            _ => return false,
        }
        let mut all = true;
        operands::each(expression, |operand| {
            all = all && self.repeats(self.value_of(operand), left);
        });
        all
    }

    /// Whether a pointer leads by constant indices into a uniform buffer.
    fn plain_uniform(&self, mut pointer: Handle<Expression>) -> bool {
        loop {
            match self.new[pointer] {
                Expression::AccessIndex { base, .. } => pointer = base,
                Expression::GlobalVariable(global) => {
                    let space = self.module.global_variables[global].space;
                    return space == AddressSpace::Uniform;
                }
                _ => return false,
            }
        }
    }

    /// Computes a value here that [`repeats`](Self::repeats).
    fn again_here(&mut self, value: Value) -> Value {
        let Value::Computed(new) = value else {
            return value;
        };
        if self.available(new) {
            return value;
        }
        let origin = self.origins[new.index()];
        let expression = self.new[new].clone();
        let expression = operands::map(&expression, |operand| {
            let value = self.again_here(self.value_of(operand));
            self.handle(value)
        });
        self.compute(expression, origin)
    }

    fn switch(&mut self, selector: Handle<Expression>, cases: &[SwitchCase], span: Span) -> Flow {
        let selector = self.get(selector);
        let mut cases = cases;
        let narrowed;
        if let Some(constant) = self.as_constant(selector) {
            narrowed = narrow(cases, constant);
            if let [only] = &narrowed[..] {
                let body = match only.body.split_last() {
                    Some((Statement::Break, before)) if !breaks(before) => {
                        self.folded();
                        let mut body = only.body.clone();
                        body.cull(body.len() - 1..);
                        return self.statements(&body);
                    }
                    _ => &only.body,
                };
                if !breaks(body) {
                    self.folded();
                    return self.statements(body);
                }
            }
            cases = &narrowed;
        }
        let selector = self.handle(selector);
        self.flush();
        let before = self.state.clone();
        self.targets.push(Target {
            is_loop: false,
            out: None,
            continues: false,
        });
        let mut built = Vec::with_capacity(cases.len());
        let mut fell: Option<Vec<Known>> = None;
        for case in cases {
            self.state = match fell.take() {
                Some(fell) => {
                    let fell = self.visible(fell);
                    self.meet(before.clone(), &fell)
                }
                None => before.clone(),
            };
            let (mut body, flow) = self.nested(&case.body);
            if let Some(Statement::Break) = body.last()
                && !case.fall_through
            {
                body.cull(body.len() - 1..);
            }
            if flow == Flow::Falls {
                let state = std::mem::take(&mut self.state);
                if case.fall_through {
                    fell = Some(state);
                } else {
                    self.reach(state);
                }
            }
            built.push(SwitchCase {
                value: case.value,
                body,
                fall_through: case.fall_through,
            });
        }
        if let ([only], true) = (&built[..], self.constant_of[selector.index()].is_some()) {
            // It was kept for a `break` that may be gone.
            self.again |= !breaks(&only.body);
        }
        let target = self.targets.pop();
        self.push(
            Statement::Switch {
                selector,
                cases: built,
            },
            span,
        );
        match target.and_then(|target| target.out) {
            Some(state) => {
                self.state = self.visible(state);
                Flow::Falls
            }
            None => {
                self.state = before;
                Flow::Jumps
            }
        }
    }

    fn repeat(
        &mut self,
        body: &Block,
        continuing: &Block,
        break_if: Option<Handle<Expression>>,
        span: Span,
    ) -> Flow {
        if let Some(rounds) = self.rounds(body, continuing, break_if) {
            self.folded();
            return match rounds {
                Rounds::None => Flow::Falls,
                // Inside are no jumps but the test, so that it does not matter that the loop is not around any more.
                Rounds::One { test } => {
                    for (at, (statement, span)) in body.span_iter().enumerate() {
                        let flow = match statement {
                            Statement::If { accept, reject, .. } if Some(at) == test => {
                                self.statements(if is_break(accept) { reject } else { accept })
                            }
                            other => self.statement(other, *span),
                        };
                        if flow == Flow::Jumps {
                            return flow;
                        }
                    }
                    self.statements(continuing)
                }
            };
        }
        self.flush();
        let expressions = self.expressions;
        for block in [body, continuing] {
            let state = &mut self.state;
            stores(expressions, block, &mut |local| {
                state[local] = Known::Memory;
            });
        }
        let head = self.state.clone();
        self.targets.push(Target {
            is_loop: true,
            out: None,
            continues: false,
        });
        // The continuing block may use what the body computed where the source does so, but nothing
        // new: back ends write it in front of the body.
        let outside = std::mem::take(&mut self.out);
        let marks = self.enter();
        let flow = self.statements(body);
        self.flush();
        let mut built = std::mem::take(&mut self.out);
        self.forget(marks.1);
        let continues = flow == Flow::Falls || self.targets.last().is_some_and(|t| t.continues);
        let mut end = None;
        let mut built_continuing = Block::new();
        if continues {
            self.state = head.clone();
            self.opened += 1;
            let inside = self.open.len() - 1;
            let number = std::mem::replace(&mut self.open[inside], self.opened);
            self.statements(continuing);
            if let Some(condition) = break_if {
                let condition = self.get(condition);
                end = match self.as_bool(condition) {
                    Some(false) => None,
                    _ => {
                        let state = self.state.clone();
                        self.reach(state);
                        Some(self.handle(condition))
                    }
                };
            }
            self.flush();
            self.open[inside] = number;
            built_continuing = std::mem::take(&mut self.out);
        }
        self.leave(marks);
        self.out = outside;
        let target = self.targets.pop();
        let state = target.and_then(|target| target.out);
        let once = !continues
            && matches!(built.last(), Some(Statement::Break))
            && !jumps(&built[..built.len() - 1], false);
        if once {
            // One round: the body without its `break`.
            self.again = true;
            built.cull(built.len() - 1..);
            self.flush();
            self.out.extend_block(built);
        } else {
            self.push(
                Statement::Loop {
                    body: built,
                    continuing: built_continuing,
                    break_if: end,
                },
                span,
            );
        }
        match state {
            Some(state) => {
                self.state = self.visible(state);
                Flow::Falls
            }
            None => {
                self.state = head;
                Flow::Jumps
            }
        }
    }
}

/// The cases of a switch that a known selector can reach.
fn narrow(cases: &[SwitchCase], selector: &Constant) -> Vec<SwitchCase> {
    let chosen = |value: &SwitchValue| match *value {
        SwitchValue::I32(value) => value as u32 == selector.words[0],
        SwitchValue::U32(value) => value == selector.words[0],
        SwitchValue::Default => false,
    };
    let start = cases
        .iter()
        .position(|case| chosen(&case.value))
        .or_else(|| {
            let default = |case: &SwitchCase| case.value == SwitchValue::Default;
            cases.iter().position(default)
        })
        .unwrap_or(0);
    let mut body = Block::new();
    for case in &cases[start..] {
        body.extend_block(case.body.clone());
        if !case.fall_through {
            break;
        }
    }
    vec![SwitchCase {
        value: SwitchValue::Default,
        body,
        fall_through: false,
    }]
}

fn vector_size(count: usize) -> VectorSize {
    match count {
        2 => VectorSize::Bi,
        3 => VectorSize::Tri,
        _ => VectorSize::Quad,
    }
}

fn inner_of(shape: Shape) -> TypeInner {
    let scalar = |kind| Scalar {
        kind,
        width: if kind == ScalarKind::Bool { 1 } else { 4 },
    };
    match shape {
        Shape::Scalar(kind) => TypeInner::Scalar(scalar(kind)),
        Shape::Vector(size, kind) => TypeInner::Vector {
            size: vector_size(size),
            scalar: scalar(kind),
        },
        Shape::Matrix { columns, rows } => TypeInner::Matrix {
            columns: vector_size(columns),
            rows: vector_size(rows),
            scalar: Scalar::F32,
        },
    }
}

/// Whether an expression is a function of its operands and of what they lead to, not what a statement gave.
pub(crate) fn is_function(expression: &Expression) -> bool {
    !matches!(
        expression,
        Expression::CallResult(_)
            | Expression::AtomicResult { .. }
            | Expression::WorkGroupUniformLoadResult { .. }
            | Expression::RayQueryProceedResult
            | Expression::RayQueryGetIntersection { .. }
            | Expression::RayQueryVertexPositions { .. }
            | Expression::SubgroupBallotResult
            | Expression::SubgroupOperationResult { .. }
            | Expression::CooperativeLoad { .. }
            | Expression::CooperativeMultiplyAdd { .. }
    )
}

/// Whether two expressions are the same to the bit.
pub(crate) fn same(a: &Expression, b: &Expression) -> bool {
    match (a, b) {
        // Zeros of both signs are equal, but not the same.
        (Expression::Literal(Literal::F64(a)), Expression::Literal(Literal::F64(b))) => {
            a.to_bits() == b.to_bits()
        }
        (Expression::Literal(Literal::F16(a)), Expression::Literal(Literal::F16(b))) => {
            a.to_bits() == b.to_bits()
        }
        _ => a == b,
    }
}
