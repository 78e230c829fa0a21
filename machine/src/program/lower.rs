//! Lowers an entry point to the intermediate form: statements, calls, variables.
//!
//! Calls are inlined; one that returns early becomes a scope that its returns leave. What a variable holds is
//! forwarded to its loads as far as control flow is straight: a store is kept back until a branch,
//! a loop or an exit makes it necessary. Buffers and everything computed from them and from constants alone
//! goes to the prologue, which runs once for a draw.

use super::ir::{Case, Id, Ir, Label, NONE, Node, Slot, SlotId};
use super::refused::{Refused, Unsupported};
use lodc_passes::semantics::{self, Kind, Op, Scalars};
use lodc_passes::{Work, cost};
use naga::front::Typifier;
use naga::proc::ResolveContext;
use naga::{
    AddressSpace, Arena, ArraySize, Block, Expression, Function, GlobalVariable, Handle, Literal,
    Module, ScalarKind, Span, Statement, SwitchValue, Type, TypeInner,
};
use std::collections::HashMap;
use std::rc::Rc;

/// Nodes in one program; beyond, something has been inlined too often.
const MAX_NODES: usize = 4_000_000;
/// Scalars in one variable or buffer value that is loaded whole.
const MAX_SCALARS: u32 = 1 << 16;

/// What an expression stands for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entity {
    /// Not computed yet.
    Unknown,
    /// Scalars, in [`Lowering::flat`].
    Values {
        first: usize,
        count: usize,
    },
    Pointer(Pointer),
    /// A texture, by its variable.
    Image(Handle<GlobalVariable>),
    Sampler(Handle<GlobalVariable>),
}

/// A place in a variable or in a buffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pointer {
    pub(super) root: Root,
    /// Scalars into a variable, bytes into a buffer.
    pub(super) offset: u32,
    /// What is added to the offset while the program runs; it is in range.
    pub(super) index: Option<Id>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Root {
    Variable(Variable),
    /// In [`Ir::buffers`].
    Buffer(u32),
}

/// Where a variable is.
#[derive(Clone, Copy, Debug)]
pub(super) enum Variable {
    /// A slot for each scalar, from this one on.
    Scalars(SlotId),
    /// Two arrays of slots, for its floats and for its words, since it is indexed.
    Indexed { floats: SlotId, words: SlotId },
}

/// What is known of a function before it is inlined.
#[derive(Debug)]
pub(super) struct Facts {
    pub(super) types: Typifier,
    /// The work of each expression.
    works: Vec<Work>,
    /// Which local variables are indexed while the program runs.
    indexed: Vec<bool>,
    /// Which pointer arguments are.
    indexed_arguments: Vec<bool>,
    /// Whether it returns anywhere but at its end.
    early: bool,
    /// Whether it may end without a return.
    kills: bool,
}

/// A function that is being inlined.
pub(super) struct Frame<'a> {
    pub(super) expressions: &'a Arena<Expression>,
    pub(super) facts: Rc<Facts>,
    pub(super) values: Vec<Entity>,
    arguments: Vec<Entity>,
    locals: Vec<Variable>,
    /// Where an early return leads, and the slots that take its value.
    result: Option<(Label, Vec<SlotId>)>,
    /// What `break` and `continue` lead to.
    breaks: Vec<Label>,
    continues: Vec<Label>,
    /// Whether values may be computed where they are first read, as constants may.
    on_demand: bool,
    watched: Watched,
}

/// What is probed in the entry point.
#[derive(Default)]
struct Watched {
    /// Probes by expression.
    probes: HashMap<usize, u32>,
    /// By expression, the probes of it beside an operand of it, with the operand.
    pairs: HashMap<usize, Vec<(u32, Handle<Expression>)>>,
}

/// The value of a slot in straight-line code.
#[derive(Clone, Copy)]
struct Known {
    value: Id,
    /// Whether the slot does not have it yet.
    pending: bool,
}

const UNKNOWN: Known = Known {
    value: NONE,
    pending: false,
};

/// A block that is being written.
#[derive(Default)]
struct Open {
    nodes: Vec<Node>,
    work: Work,
    /// Slots whose value is pending.
    pending: Vec<SlotId>,
    /// Slots that are read in it, and those that are written.
    gets: Vec<SlotId>,
    sets: Vec<SlotId>,
    /// The outermost label that it exits to.
    exits: Option<Label>,
    /// Whether its end is not reached.
    ended: bool,
}

/// The state of lowering.
pub(super) struct Lowering<'a> {
    pub(super) module: &'a Module,
    pub(super) ir: Ir,
    pub(super) frame: Frame<'a>,
    /// The frame of the module's global expressions, while it is not the current one.
    globals: Option<Frame<'a>>,
    variables: Vec<Option<Variable>>,
    facts: Vec<Option<Rc<Facts>>>,
    /// Which private variables are indexed while the program runs.
    indexed_globals: Vec<bool>,
    pub(super) flat: Vec<Id>,
    /// Scalars of each type, once they are known.
    counts: Vec<Option<u32>>,
    constants: HashMap<(bool, u32), Id>,
    pub(super) fetched: HashMap<(u32, u32, bool), Id>,
    pub(super) tables: HashMap<usize, (SlotId, SlotId)>,
    known: Vec<Known>,
    open: Open,
    nodes: usize,
    /// How many calls are being inlined, one in another.
    calls: u32,
    pub(super) span: Span,
}

impl Scalars for Lowering<'_> {
    type Value = Id;

    fn word(&mut self, bits: u32) -> Id {
        self.constant(Kind::W, bits)
    }

    fn float(&mut self, x: f32) -> Id {
        self.constant(Kind::F, x.to_bits())
    }

    fn apply(&mut self, op: Op, operands: &[Id]) -> Id {
        let values = &self.ir.values;
        let (_, kind) = op.signature();
        if operands
            .iter()
            .all(|&o| values[o as usize].constant.is_some())
        {
            let mut bits = [0; 3];
            for (bits, &operand) in bits.iter_mut().zip(operands) {
                *bits = values[operand as usize].constant.unwrap_or(0);
            }
            let bits = semantics::evaluate(op, &bits[..operands.len()]);
            return self.constant(kind, bits);
        }
        let invariant = operands.iter().all(|&o| values[o as usize].invariant);
        let result = self.ir.value(kind);
        let mut row = [NONE; 3];
        row[..operands.len()].copy_from_slice(operands);
        self.compute(
            result,
            invariant,
            Node::Op {
                op,
                result,
                operands: row,
            },
        );
        result
    }
}

impl<'a> Lowering<'a> {
    /// Lowers an entry point.
    pub(super) fn run(
        module: &'a Module,
        entry: &'a naga::EntryPoint,
        probes: &[Handle<Expression>],
        pairs: &[(Handle<Expression>, Handle<Expression>)],
    ) -> Result<Ir, Refused> {
        let context = ResolveContext::with_locals(module, EMPTY_LOCALS, &[]);
        let mut types = Typifier::new();
        if let Some((last, _)) = module.global_expressions.iter().next_back() {
            types
                .grow(last, &module.global_expressions, &context)
                .map_err(|e| Refused::invalid(e.to_string()))?;
        }
        let globals = Frame {
            expressions: &module.global_expressions,
            facts: Rc::new(Facts {
                types,
                works: Vec::new(),
                indexed: Vec::new(),
                indexed_arguments: Vec::new(),
                early: false,
                kills: false,
            }),
            values: vec![Entity::Unknown; module.global_expressions.len()],
            arguments: Vec::new(),
            locals: Vec::new(),
            result: None,
            breaks: Vec::new(),
            continues: Vec::new(),
            on_demand: true,
            watched: Watched::default(),
        };
        let mut lowering = Self {
            module,
            ir: Ir {
                origin: NONE,
                ..Ir::default()
            },
            frame: globals,
            globals: None,
            variables: vec![None; module.global_variables.len()],
            facts: vec![None; module.functions.len()],
            indexed_globals: vec![false; module.global_variables.len()],
            flat: Vec::new(),
            counts: vec![None; module.types.len()],
            constants: HashMap::new(),
            fetched: HashMap::new(),
            tables: HashMap::new(),
            known: Vec::new(),
            open: Open::default(),
            nodes: 0,
            calls: 0,
            span: Span::UNDEFINED,
        };
        for (handle, _) in module.functions.iter() {
            lowering.facts_of(handle)?;
        }
        let facts = lowering.examine(&entry.function)?;
        lowering.private_variables()?;
        lowering.entry_point(entry, facts, probes, pairs)?;
        lowering.ir.body = std::mem::take(&mut lowering.open.nodes);
        Ok(lowering.ir)
    }

    /// Refuses what is lowered now; what has no place of its own, at the variable that it reads.
    pub(super) fn refuse_read<T>(
        &self,
        what: Unsupported,
        of: Handle<GlobalVariable>,
    ) -> Result<T, Refused> {
        let span = match self.span.is_defined() {
            true => self.span,
            false => self.module.global_variables.get_span(of),
        };
        Err(Refused::new(what, span))
    }

    pub(super) fn refuse<T>(&self, what: Unsupported) -> Result<T, Refused> {
        Err(Refused::new(what, self.span))
    }

    // Values and nodes.

    pub(super) fn constant(&mut self, kind: Kind, bits: u32) -> Id {
        let values = &mut self.ir.values;
        *self
            .constants
            .entry((kind == Kind::F, bits))
            .or_insert_with(|| {
                values.push(super::ir::Value {
                    kind,
                    constant: Some(bits),
                    invariant: true,
                    origin: NONE,
                });
                values.len() as Id - 1
            })
    }

    /// Adds the node that computes a value: to the prologue when it is the same for a whole draw.
    pub(super) fn compute(&mut self, result: Id, invariant: bool, node: Node) {
        if invariant {
            self.ir.values[result as usize].invariant = true;
            self.ir.prologue.push(node);
        } else {
            self.push(node);
        }
    }

    pub(super) fn push(&mut self, node: Node) {
        self.nodes += 1;
        self.open.nodes.push(node);
    }

    pub(super) fn list(&mut self, values: impl IntoIterator<Item = Id>) -> Entity {
        let first = self.flat.len();
        self.flat.extend(values);
        Entity::Values {
            first,
            count: self.flat.len() - first,
        }
    }

    pub(super) fn slot(&mut self, kind: Kind, len: u32) -> SlotId {
        self.ir.slots.push(Slot { kind, len });
        self.known.push(UNKNOWN);
        self.ir.slots.len() as SlotId - 1
    }

    /// The value of a slot of one scalar.
    pub(super) fn get(&mut self, slot: SlotId) -> Id {
        let known = self.known[slot as usize].value;
        if known != NONE {
            return known;
        }
        let result = self.ir.value(self.ir.slots[slot as usize].kind);
        self.push(Node::Get {
            result,
            slot,
            index: None,
            offset: 0,
        });
        self.open.gets.push(slot);
        self.known[slot as usize].value = result;
        result
    }

    /// Gives a slot of one scalar a value.
    pub(super) fn set(&mut self, slot: SlotId, value: Id) {
        let known = &mut self.known[slot as usize];
        known.value = value;
        if !known.pending {
            known.pending = true;
            self.open.pending.push(slot);
        }
    }

    /// Writes what is pending.
    fn settle(&mut self) {
        let pending = std::mem::take(&mut self.open.pending);
        for &slot in &pending {
            self.settle_slot(slot);
        }
    }

    fn settle_slot(&mut self, slot: SlotId) {
        let known = &mut self.known[slot as usize];
        if known.pending {
            known.pending = false;
            let value = known.value;
            self.push(Node::Set {
                slot,
                index: None,
                offset: 0,
                value,
            });
            self.open.sets.push(slot);
        }
    }

    /// Closes the account of the current basic block.
    fn count(&mut self) {
        let work = std::mem::take(&mut self.open.work);
        if work != Work::default() {
            self.push(Node::Count(self.ir.work.len() as u32));
            self.ir.work.push(work);
        }
    }

    fn exit(&mut self, label: Label) {
        self.count();
        self.settle();
        self.push(Node::Exit(label));
        self.open.exits = Some(self.open.exits.map_or(label, |l| l.min(label)));
        self.open.ended = true;
    }

    fn label(&mut self) -> Label {
        self.ir.labels += 1;
        self.ir.labels - 1
    }

    /// Lowers a block of its own. With `forget`, it may run after itself, so that nothing is known in it.
    fn inner(
        &mut self,
        forget: bool,
        lower: impl FnOnce(&mut Self) -> Result<(), Refused>,
    ) -> Result<Open, Refused> {
        let saved = self.known.clone();
        for known in &mut self.known {
            known.pending = false;
            if forget {
                known.value = NONE;
            }
        }
        let outer = std::mem::take(&mut self.open);
        let result = lower(self);
        if result.is_ok() {
            self.count();
            self.settle();
        }
        let inner = std::mem::replace(&mut self.open, outer);
        let slots = self.known.len();
        self.known = saved;
        self.known.resize(slots, UNKNOWN);
        result.map(|()| inner)
    }

    /// Prepares the current block for a node that holds `blocks`: pending values that they read or overwrite,
    /// or that must be there when they exit past `own`, are written first.
    fn before(&mut self, blocks: &[&Open], own: Label) {
        self.count();
        let exits = blocks.iter().filter_map(|b| b.exits).min();
        let escapes = exits.is_some_and(|label| label < own);
        if escapes {
            self.settle();
        } else {
            for block in blocks {
                for &slot in block.gets.iter().chain(&block.sets) {
                    self.settle_slot(slot);
                }
            }
        }
        for block in blocks {
            self.open.gets.extend(&block.gets);
            for &slot in &block.sets {
                self.known[slot as usize] = UNKNOWN;
                self.open.sets.push(slot);
            }
        }
        if escapes {
            self.open.exits = match (self.open.exits, exits) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            };
        }
    }

    // Types.

    /// How many scalars a type has.
    pub(super) fn count_of(&mut self, ty: Handle<Type>) -> Result<u32, Refused> {
        if let Some(count) = self.counts[ty.index()] {
            return Ok(count);
        }
        let module = self.module;
        let count = self.count_of_inner(&module.types[ty].inner)?;
        self.counts[ty.index()] = Some(count);
        Ok(count)
    }

    fn count_of_inner(&mut self, inner: &TypeInner) -> Result<u32, Refused> {
        let count = match inner {
            TypeInner::Scalar(_) => Some(1),
            TypeInner::Vector { size, .. } => Some(*size as u32),
            TypeInner::Matrix { columns, rows, .. } => Some(*columns as u32 * *rows as u32),
            TypeInner::Array { base, size, .. } => {
                let each = self.count_of(*base)?;
                match self.array_size(*size)? {
                    Some(size) => size.checked_mul(each),
                    None => return self.refuse(Unsupported::UnknownSize),
                }
            }
            TypeInner::Struct { members, .. } => {
                let mut sum = Some(0u32);
                for member in members {
                    let count = self.count_of(member.ty)?;
                    sum = sum.and_then(|s| s.checked_add(count));
                }
                sum
            }
            other => return self.refuse(Unsupported::of_type(other)),
        };
        match count {
            Some(count) if count <= MAX_SCALARS => Ok(count),
            _ => self.refuse(Unsupported::ManyScalars),
        }
    }

    /// How many elements an array has; nothing when its buffer decides.
    pub(super) fn array_size(&mut self, size: ArraySize) -> Result<Option<u32>, Refused> {
        match size {
            ArraySize::Constant(size) => Ok(Some(size.get())),
            ArraySize::Dynamic => Ok(None),
            ArraySize::Pending(size) => {
                let value = self.override_value(size)?;
                match self.scalar(value)? {
                    id if self.ir.values[id as usize].constant.is_some() => {
                        Ok(self.ir.values[id as usize].constant)
                    }
                    _ => self.refuse(Unsupported::UnknownSize),
                }
            }
        }
    }

    /// The kinds of a type's scalars.
    pub(super) fn kinds(
        &mut self,
        inner: &TypeInner,
        out: &mut Vec<ScalarKind>,
    ) -> Result<(), Refused> {
        let module = self.module;
        match inner {
            TypeInner::Scalar(scalar)
            | TypeInner::Vector { scalar, .. }
            | TypeInner::Matrix { scalar, .. } => {
                if scalar.kind != ScalarKind::Bool && scalar.width != 4 {
                    return self.refuse(Unsupported::Wide);
                }
                let count = self.count_of_inner(inner)?;
                out.extend(std::iter::repeat_n(scalar.kind, count as usize));
            }
            TypeInner::Array { base, size, .. } => {
                self.count_of_inner(inner)?;
                let size = self.array_size(*size)?.unwrap_or(0);
                let start = out.len();
                self.kinds(&module.types[*base].inner, out)?;
                let each = out.len() - start;
                for i in each..each * size as usize {
                    out.push(out[start + i % each]);
                }
            }
            TypeInner::Struct { members, .. } => {
                for member in members {
                    self.kinds(&module.types[member.ty].inner, out)?;
                }
            }
            other => return self.refuse(Unsupported::of_type(other)),
        }
        Ok(())
    }

    /// Examines a function of the module, and those that it calls.
    fn facts_of(&mut self, handle: Handle<Function>) -> Result<Rc<Facts>, Refused> {
        if let Some(facts) = &self.facts[handle.index()] {
            return Ok(facts.clone());
        }
        let module = self.module;
        let facts = self.examine(&module.functions[handle])?;
        self.facts[handle.index()] = Some(facts.clone());
        Ok(facts)
    }

    fn examine(&mut self, function: &'a Function) -> Result<Rc<Facts>, Refused> {
        let module = self.module;
        let types = cost::types(module, function).map_err(|e| Refused::invalid(e.to_string()))?;
        let works = cost::of_expressions(module, &function.expressions, &types);
        let mut facts = Facts {
            indexed: vec![false; function.local_variables.len()],
            indexed_arguments: vec![false; function.arguments.len()],
            early: false,
            kills: false,
            types,
            works,
        };
        for (_, expression) in function.expressions.iter() {
            if let Expression::Access { base, index } = expression
                && !matches!(function.expressions[*index], Expression::Literal(_))
            {
                self.mark_indexed(function, &mut facts, *base);
            }
        }
        let mut calls = Vec::new();
        let mut returns = 0;
        lodc_passes::operands::walk(&function.body, &mut |statement| match statement {
            Statement::Call {
                function,
                arguments,
                ..
            } => calls.push((*function, arguments)),
            Statement::Return { .. } => returns += 1,
            Statement::Kill => facts.kills = true,
            _ => {}
        });
        let last = matches!(function.body.last(), Some(Statement::Return { .. }));
        facts.early = returns > usize::from(last);
        for (callee, arguments) in calls {
            let callee = self.facts_of(callee)?;
            for (&argument, &indexed) in arguments.iter().zip(&callee.indexed_arguments) {
                if indexed {
                    self.mark_indexed(function, &mut facts, argument);
                }
            }
        }
        Ok(Rc::new(facts))
    }

    /// Marks the variable that a pointer leads to as indexed while the program runs.
    fn mark_indexed(
        &mut self,
        function: &Function,
        facts: &mut Facts,
        mut pointer: Handle<Expression>,
    ) {
        loop {
            match function.expressions[pointer] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                    pointer = base;
                }
                Expression::LocalVariable(local) => {
                    facts.indexed[local.index()] = true;
                    return;
                }
                Expression::FunctionArgument(i) => {
                    if let Some(indexed) = facts.indexed_arguments.get_mut(i as usize) {
                        *indexed = true;
                    }
                    return;
                }
                Expression::GlobalVariable(global) => {
                    self.indexed_globals[global.index()] = true;
                    return;
                }
                _ => return,
            }
        }
    }

    // Variables.

    fn variable(&mut self, ty: Handle<Type>, indexed: bool) -> Result<Variable, Refused> {
        let module = self.module;
        let mut kinds = Vec::new();
        self.kinds(&module.types[ty].inner, &mut kinds)?;
        if indexed {
            let len = kinds.len() as u32;
            return Ok(Variable::Indexed {
                floats: self.slot(Kind::F, len),
                words: self.slot(Kind::W, len),
            });
        }
        let first = self.ir.slots.len() as SlotId;
        for kind in kinds {
            self.slot(kind_of(kind), 1);
        }
        Ok(Variable::Scalars(first))
    }

    fn private_variables(&mut self) -> Result<(), Refused> {
        let module = self.module;
        for (handle, variable) in module.global_variables.iter() {
            if variable.space != AddressSpace::Private {
                continue;
            }
            self.span = module.global_variables.get_span(handle);
            let at = self.variable(variable.ty, self.indexed_globals[handle.index()])?;
            self.variables[handle.index()] = Some(at);
            let init = match variable.init {
                Some(init) => self.expression(init)?,
                None => self.zero(&module.types[variable.ty].inner)?,
            };
            self.initialise(at, &module.types[variable.ty].inner, init)?;
        }
        Ok(())
    }

    fn initialise(
        &mut self,
        variable: Variable,
        ty: &TypeInner,
        value: Entity,
    ) -> Result<(), Refused> {
        let pointer = Pointer {
            root: Root::Variable(variable),
            offset: 0,
            index: None,
        };
        self.store(pointer, ty, value)
    }

    pub(super) fn zero(&mut self, inner: &TypeInner) -> Result<Entity, Refused> {
        let mut kinds = Vec::new();
        self.kinds(inner, &mut kinds)?;
        let values: Vec<Id> = kinds
            .into_iter()
            .map(|kind| self.constant(kind_of(kind), 0))
            .collect();
        Ok(self.list(values))
    }

    pub(super) fn load(&mut self, pointer: Pointer, ty: &TypeInner) -> Result<Entity, Refused> {
        match pointer.root {
            Root::Variable(variable) => {
                let mut kinds = Vec::new();
                self.kinds(ty, &mut kinds)?;
                let values: Vec<Id> = kinds
                    .into_iter()
                    .enumerate()
                    .map(|(i, kind)| {
                        let offset = pointer.offset + i as u32;
                        match variable {
                            Variable::Scalars(first) => self.get(first + offset),
                            Variable::Indexed { floats, words } => {
                                let kind = kind_of(kind);
                                let slot = if kind == Kind::F { floats } else { words };
                                let result = self.ir.value(kind);
                                self.push(Node::Get {
                                    result,
                                    slot,
                                    index: pointer.index,
                                    offset,
                                });
                                result
                            }
                        }
                    })
                    .collect();
                Ok(self.list(values))
            }
            Root::Buffer(buffer) => {
                let mut values = Vec::new();
                self.load_buffer(buffer, ty, pointer.offset, pointer.index, &mut values)?;
                Ok(self.list(values))
            }
        }
    }

    fn store(&mut self, pointer: Pointer, ty: &TypeInner, value: Entity) -> Result<(), Refused> {
        let Root::Variable(variable) = pointer.root else {
            return self.refuse(Unsupported::BufferWrite);
        };
        let mut kinds = Vec::new();
        self.kinds(ty, &mut kinds)?;
        let values = self.components(value)?;
        for (i, (kind, value)) in kinds.into_iter().zip(values).enumerate() {
            let offset = pointer.offset + i as u32;
            match variable {
                Variable::Scalars(first) => self.set(first + offset, value),
                Variable::Indexed { floats, words } => {
                    let slot = if kind_of(kind) == Kind::F {
                        floats
                    } else {
                        words
                    };
                    self.push(Node::Set {
                        slot,
                        index: pointer.index,
                        offset,
                        value,
                    });
                }
            }
        }
        Ok(())
    }

    // Functions and statements.

    fn entry_point(
        &mut self,
        entry: &'a naga::EntryPoint,
        facts: Rc<Facts>,
        probes: &[Handle<Expression>],
        pairs: &[(Handle<Expression>, Handle<Expression>)],
    ) -> Result<(), Refused> {
        let module = self.module;
        let mut arguments = Vec::new();
        for argument in &entry.function.arguments {
            let mut kinds = Vec::new();
            self.kinds(&module.types[argument.ty].inner, &mut kinds)?;
            let values: Vec<Id> = kinds
                .into_iter()
                .map(|kind| self.ir.value(kind_of(kind)))
                .collect();
            self.ir.inputs.extend(&values);
            arguments.push(self.list(values));
        }
        let mut watched = Watched::default();
        for (i, &probe) in probes.iter().enumerate() {
            let inner = facts.types.get(probe, &module.types);
            let components = match lodc_passes::semantics::Shape::of(inner) {
                Some(shape) if shape.kind() == ScalarKind::Float => shape.components(),
                _ => 0,
            };
            self.ir.probes.push(components);
            if components > 0 {
                watched.probes.insert(probe.index(), i as u32);
            }
        }
        for (i, &(value, operand)) in (probes.len()..).zip(pairs) {
            let floats = |value| {
                let inner = facts.types.get(value, &module.types);
                let shape = lodc_passes::semantics::Shape::of(inner);
                let shape = shape.filter(|shape| shape.kind() == ScalarKind::Float);
                shape.map_or(0, |shape| shape.components())
            };
            let components = floats(value);
            let fits = [1, components].contains(&floats(operand));
            self.ir.pairs.push(if fits { components } else { 0 });
            if fits {
                let pairs = watched.pairs.entry(value.index()).or_default();
                pairs.push((i as u32, operand));
            }
        }
        let result = self.inline(&entry.function, facts, arguments, watched)?;
        self.count();
        if let Some(ty) = &entry.function.result {
            let mut kinds = Vec::new();
            self.kinds(&module.types[ty.ty].inner, &mut kinds)?;
            let values = self.components(result)?;
            self.ir.outputs = values.into_iter().zip(kinds).collect();
        }
        Ok(())
    }

    /// The value of a call.
    fn inline(
        &mut self,
        function: &'a Function,
        facts: Rc<Facts>,
        arguments: Vec<Entity>,
        watched: Watched,
    ) -> Result<Entity, Refused> {
        let module = self.module;
        let early = facts.early;
        let mut locals = Vec::new();
        let called_from = self.span;
        for (handle, local) in function.local_variables.iter() {
            self.span = function.local_variables.get_span(handle);
            locals.push(self.variable(local.ty, facts.indexed[handle.index()])?);
        }
        self.span = called_from;
        let mut result = None;
        if early {
            let label = self.label();
            let mut slots = Vec::new();
            if let Some(ty) = &function.result {
                let mut kinds = Vec::new();
                self.kinds(&module.types[ty.ty].inner, &mut kinds)?;
                for kind in kinds {
                    let kind = kind_of(kind);
                    let slot = self.slot(kind, 1);
                    if facts.kills {
                        let zero = self.constant(kind, 0);
                        self.set(slot, zero);
                    }
                    slots.push(slot);
                }
            }
            result = Some((label, slots));
        }
        let frame = Frame {
            expressions: &function.expressions,
            values: vec![Entity::Unknown; function.expressions.len()],
            facts,
            arguments,
            locals,
            result: result.clone(),
            breaks: Vec::new(),
            continues: Vec::new(),
            on_demand: false,
            watched,
        };
        let caller = std::mem::replace(&mut self.frame, frame);
        // The frame of global expressions is the first.
        let was_globals = self.globals.is_none();
        let caller = if was_globals {
            self.globals = Some(caller);
            None
        } else {
            Some(caller)
        };
        for (handle, local) in function.local_variables.iter() {
            let inner = &module.types[local.ty].inner;
            let init = match local.init {
                Some(init) => self.demand(init)?,
                None => self.zero(inner)?,
            };
            self.initialise(self.frame.locals[handle.index()], inner, init)?;
        }
        self.probe_arguments()?;
        let value = match result {
            None => {
                let last = self.statements(&function.body)?;
                match (last, &function.result) {
                    (Some(value), _) => value,
                    (None, Some(ty)) => self.zero(&module.types[ty.ty].inner)?,
                    (None, None) => self.list([]),
                }
            }
            Some((label, slots)) => {
                let body = self.inner(false, |s| s.statements(&function.body).map(drop))?;
                self.before(&[&body], label);
                self.push(Node::Scope {
                    label,
                    body: body.nodes,
                });
                let values: Vec<Id> = slots.into_iter().map(|slot| self.get(slot)).collect();
                self.list(values)
            }
        };
        match caller {
            Some(caller) => self.frame = caller,
            None => {
                if let Some(globals) = self.globals.take() {
                    self.frame = globals;
                }
            }
        }
        Ok(value)
    }

    /// Probes on what no statement computes.
    fn probe_arguments(&mut self) -> Result<(), Refused> {
        if self.frame.watched.probes.is_empty() {
            return Ok(());
        }
        let expressions = self.frame.expressions;
        for (handle, expression) in expressions.iter() {
            if expression.needs_pre_emit()
                && self.frame.watched.probes.contains_key(&handle.index())
            {
                self.probe(handle)?;
            }
        }
        Ok(())
    }

    fn probe(&mut self, handle: Handle<Expression>) -> Result<(), Refused> {
        if let Some(&probe) = self.frame.watched.probes.get(&handle.index()) {
            let entity = self.expression(handle)?;
            let values = self.components(entity)?;
            self.push(Node::Probe { probe, values });
        }
        let pairs = self.frame.watched.pairs.remove(&handle.index());
        for (probe, operand) in pairs.into_iter().flatten() {
            let entity = self.expression(handle)?;
            let firsts = self.components(entity)?;
            let entity = self.expression(operand)?;
            let seconds = self.components(entity)?;
            let seconds = seconds.iter().cycle();
            let values = firsts.into_iter().zip(seconds);
            let values = values
                .flat_map(|(first, second)| [first, *second])
                .collect();
            self.push(Node::Probe { probe, values });
        }
        Ok(())
    }

    /// Lowers statements into the current block. Gives the value of a last `return` that is
    /// not early.
    fn statements(&mut self, block: &'a Block) -> Result<Option<Entity>, Refused> {
        for (statement, span) in block.span_iter() {
            if self.open.ended {
                break;
            }
            if self.nodes > MAX_NODES {
                return self.refuse(Unsupported::TooLarge);
            }
            self.span = *span;
            if let Statement::Return { value } = statement {
                let value = match value {
                    Some(value) => Some(self.expression(*value)?),
                    None => None,
                };
                let Some((label, slots)) = self.frame.result.clone() else {
                    return Ok(value);
                };
                if let Some(value) = value {
                    for (slot, value) in slots.into_iter().zip(self.components(value)?) {
                        self.set(slot, value);
                    }
                }
                self.exit(label);
                continue;
            }
            self.statement(statement)?;
        }
        Ok(None)
    }

    fn statement(&mut self, statement: &'a Statement) -> Result<(), Refused> {
        match statement {
            Statement::Emit(range) => {
                for handle in range.clone() {
                    self.span = self.frame.expressions.get_span(handle);
                    if self.calls == 0 {
                        self.ir.origin = handle.index() as u32;
                    }
                    let entity = self.evaluate(handle)?;
                    self.frame.values[handle.index()] = entity;
                    self.open.work += self.frame.facts.works[handle.index()];
                    self.probe(handle)?;
                }
            }
            Statement::Block(block) => {
                self.statements(block)?;
            }
            Statement::If {
                condition,
                accept,
                reject,
            } => {
                let condition = self.expression(*condition)?;
                let condition = self.scalar(condition)?;
                if let Some(taken) = self.ir.values[condition as usize].constant {
                    // The block is part of this one now.
                    self.statements(if taken != 0 { accept } else { reject })?;
                    return Ok(());
                }
                let accept = self.inner(false, |s| s.statements(accept).map(drop))?;
                let reject = self.inner(false, |s| s.statements(reject).map(drop))?;
                self.before(&[&accept, &reject], Label::MAX);
                self.push(Node::If {
                    condition,
                    accept: accept.nodes,
                    reject: reject.nodes,
                });
            }
            Statement::Switch { selector, cases } => self.switch(*selector, cases)?,
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => self.repeat(body, continuing, *break_if)?,
            Statement::Break => match self.frame.breaks.last() {
                Some(&label) => self.exit(label),
                None => return self.refuse(Unsupported::Invalid("a break outside of a loop")),
            },
            Statement::Continue => match self.frame.continues.last() {
                Some(&label) => self.exit(label),
                None => return self.refuse(Unsupported::Invalid("a continue outside of a loop")),
            },
            Statement::Return { .. } => {}
            Statement::Kill => {
                self.count();
                self.ir.discards = true;
                self.push(Node::Kill);
            }
            Statement::Store { pointer, value } => {
                let entity = self.expression(*pointer)?;
                let target = self.pointer(entity)?;
                let ty = self.pointee(*pointer)?;
                let value = self.expression(*value)?;
                self.store(target, &ty, value)?;
            }
            Statement::Call {
                function,
                arguments,
                result,
            } => {
                let mut given = Vec::with_capacity(arguments.len());
                for &argument in arguments {
                    given.push(self.expression(argument)?);
                }
                let module = self.module;
                let facts = self.facts_of(*function)?;
                self.calls += 1;
                let value = self.inline(
                    &module.functions[*function],
                    facts,
                    given,
                    Watched::default(),
                )?;
                self.calls -= 1;
                if let Some(result) = result {
                    self.frame.values[result.index()] = value;
                    self.probe(*result)?;
                }
            }
            Statement::ControlBarrier(_) | Statement::MemoryBarrier(_) => {
                return self.refuse(Unsupported::Barrier);
            }
            Statement::ImageStore { .. } => return self.refuse(Unsupported::StorageTextureWrite),
            Statement::Atomic { .. } | Statement::ImageAtomic { .. } => {
                return self.refuse(Unsupported::Atomic);
            }
            Statement::WorkGroupUniformLoad { .. } => return self.refuse(Unsupported::Workgroup),
            Statement::RayQuery { .. } => return self.refuse(Unsupported::RayQuery),
            Statement::RayPipelineFunction(_) => return self.refuse(Unsupported::RayQuery),
            Statement::SubgroupBallot { .. }
            | Statement::SubgroupGather { .. }
            | Statement::SubgroupCollectiveOperation { .. } => {
                return self.refuse(Unsupported::Subgroup);
            }
            Statement::CooperativeStore { .. } => {
                return self.refuse(Unsupported::CooperativeMatrix);
            }
        }
        Ok(())
    }

    fn switch(
        &mut self,
        selector: Handle<Expression>,
        cases: &'a [naga::SwitchCase],
    ) -> Result<(), Refused> {
        let selector = self.expression(selector)?;
        let selector = self.scalar(selector)?;
        let label = self.label();
        self.frame.breaks.push(label);
        let mut blocks = Vec::new();
        // Slots that the cases above wrote before they fell through to the next one.
        let mut written: Vec<SlotId> = Vec::new();
        for case in cases {
            let block = self.inner(false, |s| {
                for &slot in &written {
                    s.known[slot as usize].value = NONE;
                }
                s.statements(&case.body).map(drop)
            })?;
            if case.fall_through {
                written.extend(&block.sets);
            } else {
                written.clear();
            }
            blocks.push(block);
        }
        self.frame.breaks.pop();
        self.before(&blocks.iter().collect::<Vec<_>>(), label);
        let cases = cases
            .iter()
            .zip(blocks)
            .map(|(case, block)| Case {
                value: match case.value {
                    SwitchValue::I32(value) => Some(value as u32),
                    SwitchValue::U32(value) => Some(value),
                    SwitchValue::Default => None,
                },
                body: block.nodes,
                fall_through: case.fall_through,
            })
            .collect();
        self.push(Node::Switch {
            selector,
            label,
            cases,
        });
        Ok(())
    }

    fn repeat(
        &mut self,
        body: &'a Block,
        continuing: &'a Block,
        break_if: Option<Handle<Expression>>,
    ) -> Result<(), Refused> {
        let label = self.label();
        let next = self.label();
        self.ir.loops.push((label, self.span));
        self.count();
        self.settle();
        self.frame.breaks.push(label);
        self.frame.continues.push(next);
        let body = self.inner(true, |s| s.statements(body).map(drop))?;
        self.frame.breaks.pop();
        self.frame.continues.pop();
        let mut condition = None;
        let continuing = self.inner(true, |s| {
            s.statements(continuing)?;
            if let Some(break_if) = break_if {
                let entity = s.expression(break_if)?;
                condition = Some(s.scalar(entity)?);
            }
            Ok(())
        })?;
        self.before(&[&body, &continuing], label);
        self.push(Node::Loop {
            label,
            next,
            body: body.nodes,
            continuing: continuing.nodes,
            break_if: condition,
        });
        Ok(())
    }

    // Expressions by name.

    /// What an expression stands for.
    pub(super) fn expression(&mut self, handle: Handle<Expression>) -> Result<Entity, Refused> {
        match self.frame.values[handle.index()] {
            Entity::Unknown => {}
            entity => return Ok(entity),
        }
        if !self.frame.on_demand && !self.frame.expressions[handle].needs_pre_emit() {
            return self.refuse(Unsupported::Invalid(
                "a value that is read before it is computed",
            ));
        }
        let entity = self.evaluate(handle)?;
        self.frame.values[handle.index()] = entity;
        Ok(entity)
    }

    /// The same for a constant expression, which no statement may have computed.
    pub(super) fn demand(&mut self, handle: Handle<Expression>) -> Result<Entity, Refused> {
        let before = std::mem::replace(&mut self.frame.on_demand, true);
        let entity = self.expression(handle);
        self.frame.on_demand = before;
        entity
    }

    /// The value of one of the module's global expressions.
    pub(super) fn global_expression(
        &mut self,
        handle: Handle<Expression>,
    ) -> Result<Entity, Refused> {
        let Some(globals) = self.globals.take() else {
            return self.expression(handle);
        };
        let frame = std::mem::replace(&mut self.frame, globals);
        let span = self.span;
        let entity = self.expression(handle);
        self.span = span;
        self.globals = Some(std::mem::replace(&mut self.frame, frame));
        entity
    }

    pub(super) fn override_value(
        &mut self,
        handle: Handle<naga::Override>,
    ) -> Result<Entity, Refused> {
        match self.module.overrides[handle].init {
            Some(init) => self.global_expression(init),
            None => self.refuse(Unsupported::OverrideWithoutDefault),
        }
    }

    pub(super) fn argument(&self, index: u32) -> Option<Entity> {
        self.frame.arguments.get(index as usize).copied()
    }

    pub(super) fn local(&self, index: usize) -> Variable {
        self.frame.locals[index]
    }

    pub(super) fn private(&self, handle: Handle<GlobalVariable>) -> Option<Variable> {
        self.variables[handle.index()]
    }

    /// The scalars of a value.
    pub(super) fn components(&self, entity: Entity) -> Result<Vec<Id>, Refused> {
        match entity {
            Entity::Values { first, count } => Ok(self.flat[first..first + count].to_vec()),
            _ => self.refuse(Unsupported::Invalid(
                "a pointer or a resource used as a value",
            )),
        }
    }

    pub(super) fn scalar(&self, entity: Entity) -> Result<Id, Refused> {
        match entity {
            Entity::Values { first, count: 1 } => Ok(self.flat[first]),
            _ => self.refuse(Unsupported::Invalid("a composite used as a scalar")),
        }
    }

    pub(super) fn pointer(&self, entity: Entity) -> Result<Pointer, Refused> {
        match entity {
            Entity::Pointer(pointer) => Ok(pointer),
            _ => self.refuse(Unsupported::Invalid("a value used as a pointer")),
        }
    }

    /// The type that a pointer expression points to.
    pub(super) fn pointee(&self, pointer: Handle<Expression>) -> Result<TypeInner, Refused> {
        match *self.frame.facts.types.get(pointer, &self.module.types) {
            TypeInner::Pointer { base, .. } => Ok(self.module.types[base].inner.clone()),
            TypeInner::ValuePointer {
                size: Some(size),
                scalar,
                ..
            } => Ok(TypeInner::Vector { size, scalar }),
            TypeInner::ValuePointer {
                size: None, scalar, ..
            } => Ok(TypeInner::Scalar(scalar)),
            _ => self.refuse(Unsupported::Invalid("a value used as a pointer")),
        }
    }

    pub(super) fn literal(&mut self, literal: Literal) -> Result<Id, Refused> {
        match lodc_passes::semantics::Constant::from_literal(literal) {
            Some(constant) => {
                let kind = kind_of(constant.shape.kind());
                Ok(self.constant(kind, constant.words[0]))
            }
            None => self.refuse(Unsupported::Wide),
        }
    }
}

static EMPTY_LOCALS: &Arena<naga::LocalVariable> = &Arena::new();

/// How a scalar is kept: bools and integers are words.
pub(super) fn kind_of(kind: ScalarKind) -> Kind {
    match kind {
        ScalarKind::Float | ScalarKind::AbstractFloat => Kind::F,
        _ => Kind::W,
    }
}
