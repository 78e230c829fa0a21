//! The only way to change a function of a [`Shader`]: name what replaces what, then rebuild.
//!
//! Old handles stay valid while the edit is described. [`Edit::finish`] rebuilds the function in body
//! order with an old-to-new map, so that operands come before users and each value is computed where
//! it is available; what nobody needs any more is left out.

use crate::operands::{self, User};
use crate::shader::{Shader, Stage, ValueId};
use naga::{
    Arena, Block, Expression, Function, Handle, Literal, Range, Scalar, Span, Statement, Type,
    TypeInner, VectorSize,
};
use std::collections::{BTreeMap, BTreeSet};

/// What a value is replaced by.
#[derive(Clone, Debug, PartialEq)]
pub enum New {
    /// Another value of the same type: an old one, or one made by [`Edit::add`].
    Value(Handle<Expression>),
    /// A constant of the old value's type, which is a scalar, vector or matrix of f32: as many numbers
    /// as that has components, a matrix column by column.
    Numbers(Vec<f32>),
}

/// A change of one function, being described.
pub struct Edit<'a> {
    shader: &'a Shader,
    stage: Stage,
    entry: usize,
    module: naga::Module,
    /// The old values, and behind them those that were added.
    expressions: Arena<Expression>,
    /// The paths of the added values.
    added: Vec<String>,
    replaced: BTreeMap<Handle<Expression>, Handle<Expression>>,
    replaced_for: BTreeMap<(User, Handle<Expression>), Handle<Expression>>,
}

impl<'a> Edit<'a> {
    /// An edit that changes nothing yet.
    ///
    /// # Panics
    /// When the shader lacks the stage.
    pub fn new(shader: &'a Shader, stage: Stage) -> Self {
        let entry = shader.index(stage).expect("the shader has this stage");
        Self {
            shader,
            stage,
            entry,
            module: shader.module.clone(),
            expressions: shader.module.entry_points[entry]
                .function
                .expressions
                .clone(),
            added: Vec::new(),
            replaced: BTreeMap::new(),
            replaced_for: BTreeMap::new(),
        }
    }

    fn function(&self) -> &'a Function {
        &self.shader.module.entry_points[self.entry].function
    }

    /// An old or an added value.
    pub fn expression(&self, value: Handle<Expression>) -> &Expression {
        &self.expressions[value]
    }

    /// Makes a new value over old and added ones. It is computed right before its first user, and
    /// dropped when it gets none. `path` names it, such as `fs_main.specular.pow.lookup`; an ordinal
    /// is put behind a path that is taken.
    pub fn add(&mut self, path: impl Into<String>, expression: Expression) -> Handle<Expression> {
        self.added.push(path.into());
        self.expressions.append(expression, Span::UNDEFINED)
    }

    /// The handle of a type of the module, which is added when it is not there.
    pub fn ty(&mut self, inner: TypeInner) -> Handle<Type> {
        let ty = Type { name: None, inner };
        self.module.types.insert(ty, Span::UNDEFINED)
    }

    /// From now on all users of `old` use the replacement.
    ///
    /// # Panics
    /// When the replacement has another type in an obvious way (numbers of another count).
    pub fn replace(&mut self, old: Handle<Expression>, new: New) {
        let new = self.value(old, new);
        self.replaced.insert(old, new);
    }

    /// From now on `user`, and no other, uses the replacement where it used `old`. It goes before
    /// [`replace`](Self::replace), and applies to added users too.
    pub fn replace_operand(&mut self, user: User, old: Handle<Expression>, new: New) {
        let new = self.value(old, new);
        self.replaced_for.insert((user, old), new);
    }

    fn value(&mut self, old: Handle<Expression>, new: New) -> Handle<Expression> {
        match new {
            New::Value(value) => value,
            New::Numbers(numbers) => self.constant(old, &numbers),
        }
    }

    /// A constant of the type of `like`.
    fn constant(&mut self, like: Handle<Expression>, numbers: &[f32]) -> Handle<Expression> {
        let path = format!("{}.constant", self.shader.id(self.stage, like).path());
        let inner = self.shader.type_of(self.stage, like);
        let count = match *inner {
            TypeInner::Scalar(Scalar::F32) => 1,
            TypeInner::Vector {
                size,
                scalar: Scalar::F32,
            } => size as usize,
            TypeInner::Matrix {
                columns,
                rows,
                scalar: Scalar::F32,
            } => columns as usize * rows as usize,
            ref other => panic!("{path}: numbers cannot replace a value of type {other:?}"),
        };
        assert_eq!(
            count,
            numbers.len(),
            "{path}: as many numbers as components"
        );
        match *inner {
            TypeInner::Vector { size, .. } => self.constant_vector(&path, size, numbers),
            TypeInner::Matrix {
                columns,
                rows,
                scalar,
            } => {
                let components = numbers
                    .chunks(rows as usize)
                    .map(|column| self.constant_vector(&path, rows, column))
                    .collect();
                let ty = self.ty(TypeInner::Matrix {
                    columns,
                    rows,
                    scalar,
                });
                self.add(path, Expression::Compose { ty, components })
            }
            _ => self.add(path, Expression::Literal(Literal::F32(numbers[0]))),
        }
    }

    fn constant_vector(
        &mut self,
        path: &str,
        size: VectorSize,
        numbers: &[f32],
    ) -> Handle<Expression> {
        let ty = self.ty(TypeInner::Vector {
            size,
            scalar: Scalar::F32,
        });
        let components = numbers
            .iter()
            .map(|number| self.add(path, Expression::Literal(Literal::F32(*number))))
            .collect();
        self.add(path, Expression::Compose { ty, components })
    }

    /// Whether `value` is computed wherever `old` is used, so that it may replace `old`. Both are
    /// values of the shader as it was.
    pub fn available(&self, old: Handle<Expression>, value: Handle<Expression>) -> bool {
        let places = self.shader.places(self.stage);
        let mut users = places.users(old).iter();
        users.all(|user| places.reaches(value, *user))
    }

    /// The shader with the changes made: rebuilt in body order, without what nobody needs any more.
    ///
    /// # Panics
    /// When a replacement is not computed where it is used: [`available`](Self::available) tells
    /// beforehand.
    pub fn finish(mut self) -> Shader {
        let old = self.function();
        let mut rebuild = Rebuild {
            edit: &self,
            new: Arena::new(),
            ids: Vec::new(),
            taken: BTreeSet::new(),
            map: vec![None; self.expressions.len()],
            scope: Vec::new(),
            needed: vec![false; self.expressions.len()],
            number: 0,
            pending: None,
            origins: Vec::new(),
        };
        rebuild.taken = self.shader.ids[self.entry]
            .iter()
            .map(|id| id.path().to_owned())
            .collect();
        rebuild.mark(&old.body);
        let mut locals = old.local_variables.clone();
        for (_, local) in locals.iter_mut() {
            if let Some(init) = &mut local.init {
                *init = rebuild.constant_tree(*init);
            }
        }
        rebuild.number = 0;
        let body = rebuild.block(&old.body);
        let Rebuild {
            new, ids, origins, ..
        } = rebuild;
        let mut named = naga::FastIndexMap::default();
        for ((value, _), origin) in new.iter().zip(origins) {
            if let Some(name) = old.named_expressions.get(&origin) {
                named.insert(value, name.clone());
            }
        }
        let function = Function {
            name: old.name.clone(),
            arguments: old.arguments.clone(),
            result: old.result.clone(),
            local_variables: locals,
            expressions: new,
            named_expressions: named,
            body,
            diagnostic_filter_leaf: old.diagnostic_filter_leaf,
        };
        self.module.entry_points[self.entry].function = function;
        let mut all = self.shader.ids.clone();
        all[self.entry] = ids;
        Shader::new(self.module, all)
    }
}

/// A function being rebuilt.
struct Rebuild<'e, 'a> {
    edit: &'e Edit<'a>,
    new: Arena<Expression>,
    ids: Vec<ValueId>,
    /// The old value of each new one.
    origins: Vec<Handle<Expression>>,
    taken: BTreeSet<String>,
    map: Vec<Option<Handle<Expression>>>,
    /// Old values that were computed in the open blocks, to be forgotten when these close.
    scope: Vec<Handle<Expression>>,
    needed: Vec<bool>,
    /// The number of the next statement in walking order.
    number: usize,
    /// The first and last new expression that no `Emit` covers yet.
    pending: Option<(Handle<Expression>, Handle<Expression>)>,
}

impl Rebuild<'_, '_> {
    fn operand(&self, user: User, old: Handle<Expression>) -> Handle<Expression> {
        if let Some(new) = self.edit.replaced_for.get(&(user, old)) {
            return self.replaced(*new);
        }
        self.replaced(old)
    }

    fn replaced(&self, mut old: Handle<Expression>) -> Handle<Expression> {
        let mut steps = 0;
        while let Some(new) = self.edit.replaced.get(&old) {
            old = *new;
            steps += 1;
            assert!(
                steps <= self.edit.replaced.len(),
                "a value is replaced by itself"
            );
        }
        old
    }

    /// Marks what the statements of a block need.
    fn mark(&mut self, block: &Block) {
        let mut roots = Vec::new();
        let mut number = self.number;
        operands::walk(block, &mut |statement| {
            operands::each_of_statement(statement, |operand| {
                roots.push((User::Statement(number), operand));
            });
            number += 1;
        });
        let mut open: Vec<_> = roots
            .into_iter()
            .map(|(user, operand)| self.operand(user, operand))
            .collect();
        while let Some(value) = open.pop() {
            if !std::mem::replace(&mut self.needed[value.index()], true) {
                operands::each(&self.edit.expressions[value], |operand| {
                    open.push(self.operand(User::Value(value), operand));
                });
            }
        }
    }

    fn append(
        &mut self,
        expression: Expression,
        old: Handle<Expression>,
        emit: bool,
    ) -> Handle<Expression> {
        let span = self.edit.expressions.get_span(old);
        let new = self.new.append(expression, span);
        let known = &self.edit.shader.ids[self.edit.entry];
        let id = match known.get(old.index()) {
            Some(id) => id.clone(),
            None => {
                let path = &self.edit.added[old.index() - known.len()];
                let mut unique = path.clone();
                let mut ordinal = 1;
                while !self.taken.insert(unique.clone()) {
                    ordinal += 1;
                    unique = format!("{path}_{ordinal}");
                }
                ValueId::new(unique, 0)
            }
        };
        self.ids.push(id);
        self.origins.push(old);
        self.map[old.index()] = Some(new);
        if emit {
            let first = self.pending.map_or(new, |(first, _)| first);
            self.pending = Some((first, new));
        }
        new
    }

    /// An initial value of a local variable: constant, and outside of every block.
    fn constant_tree(&mut self, old: Handle<Expression>) -> Handle<Expression> {
        let expression = operands::map(&self.edit.expressions[old], |operand| {
            self.constant_tree(operand)
        });
        let new = self.append(expression, old, false);
        self.map[old.index()] = None;
        new
    }

    fn flush(&mut self, block: &mut Block) {
        if let Some((first, last)) = self.pending.take() {
            block.push(
                Statement::Emit(Range::new_from_bounds(first, last)),
                Span::UNDEFINED,
            );
        }
    }

    /// The new handle of an old value as `user` sees it; added values and those that need no
    /// `Emit` are made now.
    fn get(
        &mut self,
        block: &mut Block,
        user: User,
        old: Handle<Expression>,
    ) -> Handle<Expression> {
        let old = self.operand(user, old);
        if let Some(new) = self.map[old.index()] {
            return new;
        }
        let expression = &self.edit.expressions[old];
        let added = old.index() >= self.edit.shader.ids[self.edit.entry].len();
        if expression.needs_pre_emit() {
            self.flush(block);
            return self.append(expression.clone(), old, false);
        }
        assert!(
            added,
            "{} is used where it is not computed",
            self.edit.shader.ids[self.edit.entry][old.index()]
        );
        self.compute(block, old)
    }

    fn compute(&mut self, block: &mut Block, old: Handle<Expression>) -> Handle<Expression> {
        let mut expression = self.edit.expressions[old].clone();
        operands::each_mut(&mut expression, |operand| {
            *operand = self.get(block, User::Value(old), *operand);
        });
        let new = self.append(expression, old, true);
        self.scope.push(old);
        new
    }

    fn block(&mut self, old: &Block) -> Block {
        let open = self.scope.len();
        let block = self.statements(old);
        self.close(open);
        block
    }

    fn close(&mut self, open: usize) {
        for value in self.scope.drain(open..) {
            self.map[value.index()] = None;
        }
    }

    fn statements(&mut self, old: &Block) -> Block {
        let mut block = Block::new();
        for (statement, span) in old.span_iter() {
            let user = User::Statement(self.number);
            self.number += 1;
            if let Statement::Emit(range) = statement {
                for value in range.clone() {
                    if self.needed[value.index()] && self.map[value.index()].is_none() {
                        self.compute(&mut block, value);
                    }
                }
                continue;
            }
            let statement = match statement {
                Statement::Block(inner) => {
                    self.flush(&mut block);
                    Statement::Block(self.block(inner))
                }
                Statement::If {
                    condition,
                    accept,
                    reject,
                } => {
                    let condition = self.get(&mut block, user, *condition);
                    self.flush(&mut block);
                    Statement::If {
                        condition,
                        accept: self.block(accept),
                        reject: self.block(reject),
                    }
                }
                Statement::Switch { selector, cases } => {
                    let selector = self.get(&mut block, user, *selector);
                    self.flush(&mut block);
                    let cases = cases
                        .iter()
                        .map(|case| naga::SwitchCase {
                            value: case.value,
                            body: self.block(&case.body),
                            fall_through: case.fall_through,
                        })
                        .collect();
                    Statement::Switch { selector, cases }
                }
                Statement::Loop {
                    body,
                    continuing,
                    break_if,
                } => {
                    self.flush(&mut block);
                    // What the body computes can be seen in the continuing block.
                    let open = self.scope.len();
                    let body = self.statements(body);
                    let mut continuing = self.statements(continuing);
                    let break_if = break_if.map(|c| self.get(&mut continuing, user, c));
                    self.flush(&mut continuing);
                    self.close(open);
                    Statement::Loop {
                        body,
                        continuing,
                        break_if,
                    }
                }
                other => {
                    let mut new = other.clone();
                    let mut results = Vec::new();
                    operands::each_mut_of_statement(
                        &mut new,
                        |operand| *operand = self.get(&mut block, user, *operand),
                        |result| results.push(*result),
                    );
                    self.flush(&mut block);
                    for old in results {
                        let expression = self.edit.expressions[old].clone();
                        self.append(expression, old, false);
                        self.scope.push(old);
                    }
                    operands::each_mut_of_statement(
                        &mut new,
                        |_| {},
                        |result| *result = self.map[result.index()].unwrap_or(*result),
                    );
                    new
                }
            };
            self.flush(&mut block);
            block.push(statement, *span);
        }
        self.flush(&mut block);
        block
    }
}
