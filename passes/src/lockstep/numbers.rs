//! Which values of a function are equal, wherever they are computed: equal ones have one number.
//!
//! A number stands for an expression over numbers, or for something of which nothing is known. What variables hold has a
//! number too, and a load has the number of what it loads. Inside a loop numbers are those of a round.

use crate::fingerprint::Declared;
use crate::normalize::forward::{is_function, root, same};
use crate::operands;
use naga::{
    AddressSpace, Arena, Expression, Function, GlobalVariable, Handle, ImageClass, LocalVariable,
    Module, Span, StorageAccess, TypeInner,
};
use std::collections::BTreeMap;

/// The number of a value: a handle of [`Numbers::terms`].
pub(super) type Number = Handle<Expression>;

/// What each local variable holds.
pub(super) type State = Vec<Number>;

/// The numbers of a function's values.
pub(super) struct Numbers<'a> {
    module: &'a Module,
    function: &'a Function,
    /// The values of the function, and behind them those that were added.
    pub(super) expressions: Arena<Expression>,
    declared: Declared,
    /// For each number the expression over numbers that it stands for.
    terms: Arena<Expression>,
    /// The numbers by the hashes of their terms.
    equal: BTreeMap<u64, Vec<Number>>,
    /// For each value of the function, its number once it has been computed.
    values: Vec<Option<Number>>,
    /// What the local variables hold at the place that is looked at.
    pub(super) state: State,
}

impl<'a> Numbers<'a> {
    pub(super) fn of(module: &'a Module, function: &'a Function) -> Self {
        let mut numbers = Self {
            module,
            function,
            expressions: function.expressions.clone(),
            declared: Declared::of(module),
            terms: Arena::new(),
            equal: BTreeMap::new(),
            values: vec![None; function.expressions.len()],
            state: Vec::new(),
        };
        for (_, local) in function.local_variables.iter() {
            let held = match local.init {
                Some(init) => numbers.of_value(init),
                None => numbers.term(Expression::ZeroValue(local.ty)),
            };
            numbers.state.push(held);
        }
        numbers
    }

    /// A number that nothing else has.
    pub(super) fn unknown(&mut self) -> Number {
        // Any expression would do: it is never looked up.
        let any = Expression::RayQueryProceedResult;
        self.terms.append(any, Span::UNDEFINED)
    }

    fn term(&mut self, term: Expression) -> Number {
        let key = self
            .declared
            .expression(&term, |operand| operand.index() as u64);
        let numbers = self.equal.entry(key).or_default();
        let terms = &mut self.terms;
        let known = numbers.iter().find(|number| same(&terms[**number], &term));
        known.copied().unwrap_or_else(|| {
            let number = terms.append(term, Span::UNDEFINED);
            numbers.push(number);
            number
        })
    }

    /// The number of one of two values, by which of them a condition chooses.
    pub(super) fn choice(&mut self, condition: Number, accept: Number, reject: Number) -> Number {
        if accept == reject {
            return accept;
        }
        self.term(Expression::Select {
            condition,
            accept,
            reject,
        })
    }

    /// Gives a value its number where it is computed.
    pub(super) fn compute(&mut self, value: Handle<Expression>) {
        let number = self.new_number(value);
        self.set(value, number);
    }

    /// Gives a value that a statement makes a number of its own.
    pub(super) fn make(&mut self, value: Handle<Expression>) {
        let number = self.unknown();
        self.set(value, number);
    }

    fn set(&mut self, value: Handle<Expression>, number: Number) {
        if let Some(known) = self.values.get_mut(value.index()) {
            *known = Some(number);
        }
    }

    /// The number of a value that has been computed, or needs not be.
    pub(super) fn of_value(&mut self, value: Handle<Expression>) -> Number {
        let known = self.values.get(value.index()).copied().flatten();
        known.unwrap_or_else(|| self.new_number(value))
    }

    fn new_number(&mut self, value: Handle<Expression>) -> Number {
        let expression = self.expressions[value].clone();
        if let Expression::Load { pointer } = expression
            && let Some(held) = self.held(pointer)
        {
            return held;
        }
        if !self.is_repeatable(&expression) {
            return self.unknown();
        }
        let term = operands::map(&expression, |operand| self.of_value(operand));
        self.term(term)
    }

    /// What is held where a pointer into a local variable leads.
    fn held(&mut self, pointer: Handle<Expression>) -> Option<Number> {
        match self.expressions[pointer] {
            Expression::LocalVariable(local) => Some(self.state[local.index()]),
            Expression::AccessIndex { base, index } => {
                let base = self.held(base)?;
                Some(self.term(Expression::AccessIndex { base, index }))
            }
            Expression::Access { base, index } => {
                let base = self.held(base)?;
                let index = self.of_value(index);
                Some(self.term(Expression::Access { base, index }))
            }
            _ => None,
        }
    }

    /// Has a local variable hold what is stored.
    pub(super) fn store(&mut self, pointer: Handle<Expression>, value: Handle<Expression>) {
        let Some(local) = root(&self.expressions, pointer) else {
            return;
        };
        let whole = matches!(self.expressions[pointer], Expression::LocalVariable(_));
        self.state[local.index()] = match whole {
            true => self.of_value(value),
            false => self.unknown(),
        };
    }

    /// What variables hold where control comes from several places. What differs between them is known by what it is on
    /// each way.
    pub(super) fn join(&mut self, ways: &[State]) -> State {
        let mut joined: BTreeMap<Vec<Number>, Number> = BTreeMap::new();
        let count = self.state.len();
        let locals = (0..count).map(|local| {
            let on_ways: Vec<Number> = ways.iter().map(|state| state[local]).collect();
            match on_ways.first() {
                Some(first) if on_ways.iter().all(|number| number == first) => *first,
                _ => match joined.get(&on_ways) {
                    Some(number) => *number,
                    None => {
                        let number = self.unknown();
                        joined.insert(on_ways, number);
                        number
                    }
                },
            }
        });
        locals.collect()
    }

    /// Whether an expression gives the same value wherever its operands do.
    fn is_repeatable(&self, expression: &Expression) -> bool {
        match *expression {
            Expression::Load { pointer } => {
                let space = self.global(pointer).map(|variable| variable.space);
                match space {
                    Some(AddressSpace::Uniform | AddressSpace::Immediate) => true,
                    Some(AddressSpace::Storage { access }) => {
                        !access.contains(StorageAccess::STORE)
                    }
                    _ => false,
                }
            }
            Expression::ImageLoad { image, .. } => {
                let ty = self.global(image).map(|variable| variable.ty);
                let class = ty.map(|ty| &self.module.types[ty].inner);
                matches!(class, Some(TypeInner::Image { class, .. })
                    if !matches!(class, ImageClass::Storage { access, .. } if access.contains(StorageAccess::STORE)))
            }
            ref other => is_function(other),
        }
    }

    /// The global variable that a pointer or an image comes from.
    fn global(&self, mut pointer: Handle<Expression>) -> Option<&'a GlobalVariable> {
        loop {
            match self.expressions[pointer] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                    pointer = base;
                }
                Expression::GlobalVariable(variable) => {
                    return Some(&self.module.global_variables[variable]);
                }
                _ => return None,
            }
        }
    }

    /// Whether a local variable is a number, a vector or a matrix.
    pub(super) fn is_plain(&self, local: Handle<LocalVariable>) -> bool {
        let ty = self.function.local_variables[local].ty;
        matches!(
            self.module.types[ty].inner,
            TypeInner::Scalar(_) | TypeInner::Vector { .. } | TypeInner::Matrix { .. }
        )
    }
}
