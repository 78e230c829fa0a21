//! The only way to change a function of a [`Shader`]: name what replaces what, then rebuild.
//!
//! Old handles stay valid while the edit is described. [`Edit::finish`] rebuilds the function in body
//! order with an old-to-new map, so that operands come before users and each value is computed where
//! it is available, and brings it to normal form again.

use crate::fingerprint::Declared;
use crate::generated::Generated;
use crate::interface::{self, Output};
use crate::live;
use crate::normalize::forward::{self, Changes, Origin};
use crate::normalize::{names, split};
use crate::operands::{self, User};
use crate::parameters;
use crate::semantics::{Constant, Shape};
use crate::shader::{Shader, Stage, ValueId};
use naga::{
    AddressSpace, Arena, Block, EntryPoint, Expression, Function, FunctionArgument, GlobalVariable,
    Handle, Literal, LocalVariable, Module, Range, ResourceBinding, Scalar, Span, Statement,
    SwizzleComponent, Type, TypeInner, VectorSize,
};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Rounds of rebuilding after which an edit is done, should there still be something to find.
const ROUNDS: usize = 8;

/// What a value is replaced by.
#[derive(Clone, Debug, PartialEq)]
pub enum New {
    /// Another value of the same type: an old one, or one made by [`Edit::add`].
    Value(Handle<Expression>),
    /// A constant of the old value's type, which is a scalar, vector or matrix of f32: as many numbers
    /// as that has components, a matrix column by column.
    Numbers(Vec<f32>),
    /// A constant of the old value's type, which is a scalar, vector or matrix of 32-bit numbers or of bools: the bits of
    /// each component, a matrix column by column, a bool as 0 or 1.
    Words(Vec<u32>),
}

/// One side of a branch that leaves a value.
pub(crate) struct Side {
    /// The old values that are computed there and nowhere else from now on, in order.
    pub(crate) computed: Vec<Handle<Expression>>,
    /// What it leaves, an old value or an added one.
    pub(crate) left: Handle<Expression>,
}

/// A branch that a value is left by.
struct Branch {
    value: Handle<Expression>,
    condition: Handle<Expression>,
    /// Where that is kept.
    pointer: Handle<Expression>,
    sides: [Side; 2],
}

/// A change of one function, being described.
pub struct Edit<'a> {
    shader: &'a Shader,
    stage: Stage,
    entry: usize,
    module: Module,
    /// The function as it was, with the arguments, variables and names that were added.
    function: Cow<'a, Function>,
    /// What it returns beside what it returned.
    outputs: Vec<(Output, Handle<Expression>)>,
    /// What it stores in the parameter block beside what it stored: names, types and values.
    parameters: Vec<(String, Handle<Type>, Handle<Expression>)>,
    /// The textures that it reads beside those that it read.
    generated: Vec<Generated>,
    /// What is done in the place of what was.
    body: Option<Block>,
    /// What is done before it returns.
    before_return: Block,
    branches: Vec<Branch>,
    /// The old values, and behind them those that were added.
    expressions: Arena<Expression>,
    /// The paths of the added values.
    added: Vec<String>,
    /// The new paths of old values that are others now.
    renamed: BTreeMap<usize, String>,
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
        let function = &shader.module.entry_points[entry].function;
        Self {
            shader,
            stage,
            entry,
            module: without(&shader.module, entry),
            function: Cow::Borrowed(function),
            outputs: Vec::new(),
            parameters: Vec::new(),
            generated: Vec::new(),
            body: None,
            before_return: Block::new(),
            branches: Vec::new(),
            expressions: function.expressions.clone(),
            added: Vec::new(),
            renamed: BTreeMap::new(),
            replaced: BTreeMap::new(),
            replaced_for: BTreeMap::new(),
        }
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

    /// Gives an added value the name that writers print.
    pub(crate) fn name(&mut self, value: Handle<Expression>, name: String) {
        self.function.to_mut().named_expressions.insert(value, name);
    }

    /// Gives an old value another path, since it is another value once its operands have been replaced: no recipe that means
    /// the old one may find it.
    pub(crate) fn rename(&mut self, value: Handle<Expression>, path: String) {
        self.renamed.insert(value.index(), path);
    }

    /// Makes a new input behind those of the function, and the value that it is, named by `path`.
    pub(crate) fn add_argument(
        &mut self,
        path: impl Into<String>,
        argument: FunctionArgument,
    ) -> Handle<Expression> {
        let arguments = &mut self.function.to_mut().arguments;
        arguments.push(argument);
        let at = arguments.len() as u32 - 1;
        self.add(path, Expression::FunctionArgument(at))
    }

    /// Makes a new local variable. Its initial value is an added one that is made of constants.
    pub(crate) fn add_local(&mut self, variable: LocalVariable) -> Handle<LocalVariable> {
        let locals = &mut self.function.to_mut().local_variables;
        locals.append(variable, Span::UNDEFINED)
    }

    /// From now on the function returns a value, an old or an added one, behind all that it returned; what it returned at the same
    /// location it returns no more.
    pub(crate) fn add_output(&mut self, output: Output, value: Handle<Expression>) {
        self.outputs.push((output, value));
    }

    /// From now on the parameter stage stores a value, an old or an added one, behind all that it stored.
    pub(crate) fn add_parameter(
        &mut self,
        name: String,
        ty: Handle<Type>,
        value: Handle<Expression>,
    ) {
        self.parameters.push((name, ty, value));
    }

    /// Declares a texture that is generated, at the binding that it has.
    pub(crate) fn add_texture(
        &mut self,
        name: String,
        ty: TypeInner,
        generated: Generated,
    ) -> Handle<GlobalVariable> {
        let (group, binding) = generated.binding;
        let variable = GlobalVariable {
            name: Some(name),
            space: AddressSpace::Handle,
            binding: Some(ResourceBinding { group, binding }),
            ty: self.ty(ty),
            init: None,
            memory_decorations: naga::MemoryDecorations::empty(),
        };
        self.generated.push(generated);
        self.module
            .global_variables
            .append(variable, Span::UNDEFINED)
    }

    /// Has statements done before the function returns, behind those that were given before. Values that they compute are
    /// added ones, in one `Emit` each.
    pub(crate) fn do_before_return(&mut self, mut statements: Block) {
        self.before_return.append(&mut statements);
    }

    /// Has other statements done than were. Old values are computed in one `Emit` each, and added ones where they are used.
    pub(crate) fn put_body(&mut self, body: Block) {
        self.body = Some(body);
    }

    /// From now on an old value, a scalar or a vector, is what a branch leaves: the first side where the condition holds, the
    /// second where it does not. What the sides compute has been computed in the value's own block, and has no users but
    /// on its side. Where the second computes nothing it is what the value is unless the condition holds.
    pub(crate) fn branch(
        &mut self,
        value: Handle<Expression>,
        condition: Handle<Expression>,
        sides: [Side; 2],
    ) {
        let id = self.shader.id(self.stage, value);
        let path = format!("{}.left", id.path());
        // The variable is called as the value was, or by the end of its path.
        let names = &self.function.named_expressions;
        let name = match names.contains_key(&value) {
            true => self.function.to_mut().named_expressions.swap_remove(&value),
            false => {
                let mut parts: Vec<&str> = id.path().rsplit('.').take(2).collect();
                parts.reverse();
                Some(parts.join("_"))
            }
        };
        let ty = match *self.shader.type_of(self.stage, value) {
            TypeInner::Scalar(scalar) => TypeInner::Scalar(scalar),
            TypeInner::Vector { size, scalar } => TypeInner::Vector { size, scalar },
            ref other => panic!("{}: a branch cannot leave {other:?}", id.path()),
        };
        let ty = self.ty(ty);
        let kept = self.add_local(LocalVariable {
            name,
            ty,
            init: None,
        });
        let pointer = self.add(path, Expression::LocalVariable(kept));
        self.expressions[value] = Expression::Load { pointer };
        self.branches.push(Branch {
            value,
            condition,
            pointer,
            sides,
        });
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

    /// An old value is computed so from now on, where it was: of old values that are there by then, and of added ones. It
    /// has the type that it had.
    pub(crate) fn rewrite(&mut self, value: Handle<Expression>, expression: Expression) {
        self.expressions[value] = expression;
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
            New::Numbers(numbers) => {
                let words: Vec<u32> = numbers.iter().map(|number| number.to_bits()).collect();
                self.constant(old, &words)
            }
            New::Words(words) => self.constant(old, &words),
        }
    }

    /// A constant of the type of `like`, of these bits of each component.
    pub(crate) fn constant(
        &mut self,
        like: Handle<Expression>,
        words: &[u32],
    ) -> Handle<Expression> {
        let path = format!("{}.constant", self.shader.id(self.stage, like).path());
        let inner = self.shader.type_of(self.stage, like);
        let constant = Shape::of(inner).map(|shape| Constant {
            shape,
            words: words.to_vec(),
        });
        let Some(constant) = constant else {
            panic!("{path}: a constant cannot replace a value of type {inner:?}");
        };
        assert_eq!(
            constant.shape.components(),
            words.len(),
            "{path}: as many numbers as components"
        );
        let literals = constant.literals();
        let literals = literals.unwrap_or_else(|| panic!("{path}: {words:x?} are not all finite"));
        match *inner {
            TypeInner::Vector { size, scalar } => {
                self.constant_vector(&path, size, scalar, &literals)
            }
            TypeInner::Matrix {
                columns,
                rows,
                scalar,
            } => {
                let components = literals
                    .chunks(rows as usize)
                    .map(|column| self.constant_vector(&path, rows, scalar, column))
                    .collect();
                let ty = self.ty(TypeInner::Matrix {
                    columns,
                    rows,
                    scalar,
                });
                self.add(path, Expression::Compose { ty, components })
            }
            _ => self.add(path, Expression::Literal(literals[0])),
        }
    }

    /// A new constant: of one number a float, of more a vector of them.
    pub(crate) fn add_numbers(&mut self, path: &str, numbers: &[f32]) -> Handle<Expression> {
        let literals: Vec<Literal> = numbers.iter().copied().map(Literal::F32).collect();
        match vector_size(literals.len()) {
            Some(size) => self.constant_vector(path, size, Scalar::F32, &literals),
            None => self.add(path, Expression::Literal(literals[0])),
        }
    }

    fn constant_vector(
        &mut self,
        path: &str,
        size: VectorSize,
        scalar: Scalar,
        literals: &[Literal],
    ) -> Handle<Expression> {
        let ty = self.ty(TypeInner::Vector { size, scalar });
        let components = literals
            .iter()
            .map(|literal| self.add(path, Expression::Literal(*literal)))
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

    /// The shader with the changes made: rebuilt in body order and in normal form again, with constants
    /// folded, and without what nobody needs any more.
    ///
    /// # Panics
    /// When a replacement is not computed where it is used: [`available`](Self::available) tells
    /// beforehand.
    pub fn finish(mut self) -> Shader {
        let base_body = &self.shader.module.entry_points[self.entry].function.body;
        let mut body = match self.body.take() {
            Some(body) => Cow::Owned(body),
            None => Cow::Borrowed(base_body),
        };
        for ((user, value), new) in &self.replaced_for {
            match *user {
                User::Value(user) => {
                    operands::each_mut(&mut self.expressions[user], |operand| {
                        if operand == value {
                            *operand = *new;
                        }
                    });
                }
                User::Statement(number) => {
                    let statement = nth(body.to_mut(), &mut { number });
                    let statement = statement.expect("the user is a statement of the body");
                    operands::each_mut_of_statement(
                        statement,
                        |operand| {
                            if operand == value {
                                *operand = *new;
                            }
                        },
                        |_| {},
                    );
                }
            }
        }
        for branch in &self.branches {
            let put = branch.put_into(body.to_mut());
            assert!(put, "what a branch leaves is computed in the body");
        }
        if self.stage == Stage::Parameter {
            self.change_stored(body.to_mut());
        } else if !self.outputs.is_empty() || !self.before_return.is_empty() {
            self.change_end(body.to_mut());
        }
        let old = &*self.function;
        let base = &self.shader.ids[self.entry];
        let changes = Changes {
            expressions: &self.expressions,
            body: &body,
            first_added: base.len(),
            replaced: &self.replaced,
        };
        let mut declared = Declared::of(&self.module);
        let mut rebuilt = forward::rebuild(&mut self.module, &mut declared, old, &changes);
        let mut sources: Vec<Source> = rebuilt.origins.iter().map(|o| Source::of(*o)).collect();
        for (source, merged) in sources.iter_mut().zip(&rebuilt.merged) {
            source.merge(*merged);
        }
        let mut again = rebuilt.again;
        let mut rounds = 0;
        let function = loop {
            let kept = live::keep_needed(&rebuilt.function);
            let origins = kept.origins.iter();
            sources = origins.map(|old| sources[old.index()]).collect();
            again |= kept.again;
            let mut function = kept.function;
            // An index that is constant now may have been what kept a variable whole.
            if let Some(split) = split::split(&self.module, &function) {
                function = split.function;
                let of = |old: &Option<Handle<Expression>>| {
                    old.map_or(Source::Made, |old| sources[old.index()])
                };
                sources = split.origins.iter().map(of).collect();
                again = true;
            }
            rounds += 1;
            if !again || rounds == ROUNDS {
                break function;
            }
            rebuilt = forward::rebuild(
                &mut self.module,
                &mut declared,
                &function,
                &Changes::none(&function),
            );
            sources = rebuilt
                .origins
                .iter()
                .zip(&rebuilt.merged)
                .map(|(origin, merged)| {
                    let mut source = match origin {
                        Origin::Value(old) => sources[old.index()],
                        other => Source::of(*other),
                    };
                    source.merge(*merged);
                    source
                })
                .collect();
            again = rebuilt.again;
        };
        let mut ids = self.shader.ids.clone();
        ids[self.entry] = self.ids(&function, &sources);
        self.module.entry_points[self.entry].function = function;
        let mut generated = self.shader.generated.clone();
        generated.append(&mut self.generated);
        let shader = Shader::changed(
            self.module,
            ids,
            self.shader.authors,
            generated,
            self.shader.passes.clone(),
        );
        match self.stage {
            Stage::Fragment => parameters::settle(interface::settle(shader)),
            Stage::Vertex => parameters::settle(shader),
            Stage::Parameter => shader,
        }
    }

    /// Puts in place what is done before the function returns, and what it returns then.
    fn change_end(&mut self, body: &mut Block) {
        let returned = match body.last() {
            Some(Statement::Return { value }) => *value,
            _ => None,
        };
        let outputs = std::mem::take(&mut self.outputs);
        let returned = match outputs.is_empty() {
            true => returned,
            false => {
                let function = &*self.function;
                let (outputs, values): (Vec<_>, Vec<_>) = outputs.into_iter().unzip();
                let result = function.result.as_ref();
                let parts = interface::parts(&self.module, result);
                let replaced = interface::replaced(&self.module, result, &outputs);
                let ty = interface::result(&mut self.module, result, &outputs);
                let mut components = match (returned, parts) {
                    (Some(returned), None) => vec![returned],
                    (Some(returned), Some(count)) => match &self.expressions[returned] {
                        Expression::Compose { components, .. } => components.clone(),
                        _ => {
                            let part = |index| Expression::AccessIndex {
                                base: returned,
                                index,
                            };
                            let path = format!("{}.returned", self.entry_name());
                            (0..count)
                                .map(|i| self.add(path.clone(), part(i)))
                                .collect()
                        }
                    },
                    (None, _) => Vec::new(),
                };
                let mut replaced = replaced.into_iter();
                components.retain(|_| !replaced.next().unwrap_or(false));
                components.extend(values);
                self.function.to_mut().result = Some(naga::FunctionResult { ty, binding: None });
                let path = format!("{}.return", self.entry_name());
                Some(self.add(path, Expression::Compose { ty, components }))
            }
        };
        let statements = std::mem::take(&mut self.before_return);
        if let Some(last) = body.len().checked_sub(1) {
            body.splice(last..last, statements);
        }
        if let Some(Statement::Return { value }) = body.iter_mut().last() {
            *value = returned;
        }
    }

    /// Puts in place what is done before the parameters are stored, and what is stored then.
    fn change_stored(&mut self, body: &mut Block) {
        let before = std::mem::take(&mut self.before_return);
        let added = std::mem::take(&mut self.parameters);
        if before.is_empty() && added.is_empty() {
            return;
        }
        let stored = parameters::stored(body, &self.expressions);
        let (at, storage, mut components) = match stored {
            Some(stored) => (stored.at, Some(stored.variable), stored.values.to_vec()),
            None => (body.len() - 1, None, Vec::new()),
        };
        let mut members = Vec::new();
        for (name, ty, value) in added {
            members.push((name, ty));
            components.push(value);
        }
        let (storage, ty) = parameters::extended(&mut self.module, storage, members);
        let path = format!("{}.stored", self.entry_name());
        let pointer = self.add(path.clone(), Expression::GlobalVariable(storage));
        let value = self.add(path, Expression::Compose { ty, components });
        let mut end = before;
        end.push(Statement::Store { pointer, value }, Span::UNDEFINED);
        let last = body.len() - 1;
        body.splice(at..last, end);
    }

    fn entry_name(&self) -> &str {
        &self.shader.module.entry_points[self.entry].name
    }

    /// The ids of the new values. Old values keep theirs. What several values have become, a second copy of one, and what was made on the
    /// way, gets an ordinal behind a `~`, which no path of the normal form has.
    fn ids(&self, function: &Function, sources: &[Source]) -> Vec<ValueId> {
        let base = &self.shader.ids[self.entry];
        let entry = &self.shader.module.entry_points[self.entry].name;
        let mut seen = vec![false; self.expressions.len()];
        let mut taken: Option<BTreeSet<Arc<str>>> = None;
        let mut fresh = |stem: &str| {
            let taken = taken.get_or_insert_with(|| {
                let marked = base.iter().filter(|id| id.path().contains('~'));
                marked.map(|id| id.path().into()).collect()
            });
            let mut ordinal = 1;
            loop {
                ordinal += 1;
                let path: Arc<str> = format!("{stem}~{ordinal}").into();
                if taken.insert(path.clone()) {
                    return ValueId::new(path, 0);
                }
            }
        };
        let values = function.expressions.iter().zip(sources);
        values
            .map(|((_, expression), source)| {
                if let Expression::Literal(literal) = expression {
                    return ValueId::new(names::literal_path(entry, *literal), 0);
                }
                match *source {
                    Source::Merged(at) => fresh(match base.get(at) {
                        Some(id) => id.path(),
                        None => &self.added[at - base.len()],
                    }),
                    Source::Value(at) => {
                        let first = !std::mem::replace(&mut seen[at], true);
                        let is_free = |path: &str| base.iter().all(|id| id.path() != path);
                        if let Some(path) = self.renamed.get(&at) {
                            return match first && is_free(path) {
                                true => ValueId::new(path.as_str(), 0),
                                false => fresh(path),
                            };
                        }
                        match base.get(at) {
                            Some(id) if first => id.clone(),
                            Some(id) => fresh(id.path()),
                            None => {
                                let path = &self.added[at - base.len()];
                                if first && is_free(path) {
                                    ValueId::new(path.as_str(), 0)
                                } else {
                                    fresh(path)
                                }
                            }
                        }
                    }
                    Source::Made => fresh(&format!("{entry}.part")),
                }
            })
            .collect()
    }
}

impl Branch {
    /// Puts it before the value, in the block that computes that. Returns whether the value was found.
    fn put_into(&self, block: &mut Block) -> bool {
        let computes = |statement: &Statement| match statement {
            Statement::Emit(range) => range.clone().any(|value| value == self.value),
            _ => false,
        };
        if !block.iter().any(computes) {
            return block.iter_mut().any(|statement| {
                let mut inner = operands::blocks_mut(statement);
                inner.any(|block| self.put_into(block))
            });
        }
        let moves = |value| self.sides.iter().any(|side| side.computed.contains(&value));
        for (statement, span) in std::mem::take(block).span_into_iter() {
            let Statement::Emit(range) = statement else {
                block.push(statement, span);
                continue;
            };
            for value in range.filter(|value| !moves(*value)) {
                if value == self.value {
                    self.put(block);
                }
                block.push(emit(value), span);
            }
        }
        true
    }

    fn put(&self, block: &mut Block) {
        let [mut accept, mut reject] = [0, 1].map(|at| {
            let side = &self.sides[at];
            let mut inner: Block = side
                .computed
                .iter()
                .map(|value| emit(*value))
                .collect::<Vec<_>>()
                .into();
            inner.push(
                Statement::Store {
                    pointer: self.pointer,
                    value: side.left,
                },
                Span::UNDEFINED,
            );
            inner
        });
        if self.sides[1].computed.is_empty() {
            block.append(&mut reject);
        }
        let branch = Statement::If {
            condition: self.condition,
            accept: std::mem::take(&mut accept),
            reject,
        };
        block.push(branch, Span::UNDEFINED);
    }
}

/// A statement that computes one value.
pub(crate) fn emit(value: Handle<Expression>) -> Statement {
    Statement::Emit(naga::Range::new_from_bounds(value, value))
}

/// Where a new value comes from.
#[derive(Clone, Copy)]
enum Source {
    /// An old or added value, by its index.
    Value(usize),
    /// Several, of which this is one. What an edit would do to one of them, it would do to all now: so none
    /// of their ids may name it, or the order of two edits would matter.
    Merged(usize),
    /// Nowhere.
    Made,
}

impl Source {
    fn of(origin: Origin) -> Self {
        match origin {
            Origin::Value(old) => Self::Value(old.index()),
            Origin::Local(_) | Origin::Made => Self::Made,
        }
    }

    fn merge(&mut self, merged: bool) {
        if let (Self::Value(at), true) = (*self, merged) {
            *self = Self::Merged(at);
        }
    }
}

/// The statement of that number in the order of [`operands::walk`], to be changed.
fn nth<'b>(block: &'b mut Block, number: &mut usize) -> Option<&'b mut Statement> {
    for statement in block.iter_mut() {
        if *number == 0 {
            return Some(statement);
        }
        *number -= 1;
        for inner in operands::blocks_mut(statement) {
            if let Some(found) = nth(inner, number) {
                return Some(found);
            }
        }
    }
    None
}

/// The size of a vector of so many components; `None` of one.
pub(crate) fn vector_size(components: usize) -> Option<VectorSize> {
    match components {
        2 => Some(VectorSize::Bi),
        3 => Some(VectorSize::Tri),
        4 => Some(VectorSize::Quad),
        _ => None,
    }
}

/// The type of so many floats.
pub(crate) fn floats(components: usize) -> TypeInner {
    let scalar = Scalar::F32;
    match vector_size(components) {
        Some(size) => TypeInner::Vector { size, scalar },
        None => TypeInner::Scalar(scalar),
    }
}

/// So many components of a vector, from one on.
pub(crate) fn part(whole: Handle<Expression>, from: usize, count: usize) -> Expression {
    match vector_size(count) {
        None => Expression::AccessIndex {
            base: whole,
            index: from as u32,
        },
        Some(size) => Expression::Swizzle {
            size,
            vector: whole,
            pattern: [0, 1, 2, 3].map(|at| SwizzleComponent::XYZW[(from + at).min(3)]),
        },
    }
}

/// Puts a value at the end of a function that is being made, computed there where it has to be.
pub fn append(function: &mut Function, expression: Expression) -> Handle<Expression> {
    let is_emitted = !expression.needs_pre_emit();
    let value = function.expressions.append(expression, Span::UNDEFINED);
    if is_emitted {
        let range = Range::new_from_bounds(value, value);
        function.body.push(Statement::Emit(range), Span::UNDEFINED);
    }
    value
}

/// Everything of a module but the function of one of its entry points.
pub(crate) fn without(module: &Module, entry: usize) -> Module {
    let entry_points = module.entry_points.iter().enumerate().map(|(at, point)| {
        let function = match at == entry {
            true => Function::default(),
            false => point.function.clone(),
        };
        EntryPoint {
            name: point.name.clone(),
            workgroup_size_overrides: point.workgroup_size_overrides,
            mesh_info: point.mesh_info.clone(),
            function,
            ..*point
        }
    });
    Module {
        types: module.types.clone(),
        special_types: module.special_types.clone(),
        constants: module.constants.clone(),
        overrides: module.overrides.clone(),
        global_variables: module.global_variables.clone(),
        global_expressions: module.global_expressions.clone(),
        functions: module.functions.clone(),
        entry_points: entry_points.collect(),
        diagnostic_filters: module.diagnostic_filters.clone(),
        diagnostic_filter_leaf: module.diagnostic_filter_leaf,
        doc_comments: module.doc_comments.clone(),
    }
}
