//! Lockstep: loops of one function that go the same rounds become one loop, and so do branches that go the same way.
//!
//! What is moved to a stage brings copies of the loops that it needs (see [`crate::slice`]). Where the stage has such a loop
//! already, the two have the same rounds: they end by tests of equal values. Then the statements of the second are done in
//! the rounds of the first, each part up to a jump behind that of the first. Of variables that hold the same in both, the
//! second one is set to the first where each round begins, so that the rest of the normal form finds what is equal and
//! drops the second. Which variables these are is found by trying: all that begin the same are taken to stay the same,
//! until a round tells some apart.
//!
//! Exact: nothing is computed from other numbers than before, and what two loops store to is not the other's.
//! Two stay apart where the second needs what the first results in, where a test differs, and where one does more than compute.

mod numbers;
mod touched;

use crate::edit::{Edit, emit};
use crate::normalize::forward::root;
use crate::operands;
use crate::shader::{Shader, Stage};
use naga::{Block, Expression, Function, Handle, LocalVariable, Span, Statement, SwitchCase};
use numbers::{Numbers, State};
use std::collections::{BTreeMap, BTreeSet};
use touched::{Touched, stored};

/// The shader in which loops and branches of a stage that go the same way are one. It is a stage in which no value depends
/// on neighbours, as derivatives do.
pub(crate) fn joined(shader: Shader, stage: Stage) -> Shader {
    let Some(function) = shader.function(stage) else {
        return shader;
    };
    let mut branching = 0;
    operands::walk(&function.body, &mut |statement| {
        branching += usize::from(branches(statement));
    });
    if branching < 2 {
        return shader;
    }
    let mut walk = Walk {
        function,
        numbers: Numbers::of(shader.module(), function),
        targets: Vec::new(),
        joins: 0,
    };
    let body = walk.block(&function.body, None);
    let Walk { numbers, joins, .. } = walk;
    let Some((body, _)) = body.filter(|_| joins > 0) else {
        return shader;
    };
    let mut edit = Edit::new(&shader, stage);
    let added = numbers.expressions.iter().skip(function.expressions.len());
    let entry = shader.entry_point(stage).map_or("", |entry| &entry.name);
    for (_, expression) in added {
        let local = match *expression {
            Expression::Load { pointer } => root(&numbers.expressions, pointer),
            _ => None,
        };
        let name = local.and_then(|local| function.local_variables[local].name.as_deref());
        edit.add(
            format!("{entry}.{}", name.unwrap_or("same")),
            expression.clone(),
        );
    }
    edit.put_body(body);
    edit.finish()
}

fn branches(statement: &Statement) -> bool {
    matches!(
        statement,
        Statement::If { .. } | Statement::Switch { .. } | Statement::Loop { .. }
    )
}

/// Whether control may leave a statement for another place than the one behind it.
fn jumps(statement: &Statement) -> bool {
    match statement {
        Statement::Break | Statement::Continue => true,
        Statement::Loop { .. } => false,
        Statement::Switch { cases, .. } => cases.iter().any(|case| continues(&case.body)),
        other => operands::blocks(other).any(|block| block.iter().any(jumps)),
    }
}

/// Whether the next round of a loop may begin from inside of a block.
fn continues(block: &Block) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Continue => true,
        Statement::Loop { .. } => false,
        other => operands::blocks(other).any(continues),
    })
}

/// A walk over a function that joins what goes the same way.
struct Walk<'a> {
    function: &'a Function,
    numbers: Numbers<'a>,
    /// What is around the place that is looked at, and may be jumped out of.
    targets: Vec<Target>,
    /// How many statements have become one with another.
    joins: usize,
}

/// A loop or a switch that is walked.
struct Target {
    is_loop: bool,
    /// What variables hold on each way out.
    out: Vec<State>,
    /// What they hold at each `continue`.
    again: Vec<State>,
}

/// A statement that has been walked.
struct Item {
    statement: Statement,
    span: Span,
    touched: Touched,
    /// What the variables that it touches hold before it and behind it, of one that branches.
    around: Option<(State, State)>,
}

impl Walk<'_> {
    /// Walks a block, or two of which the statements are done in turns; returns what is done, and whether control comes to the
    /// end of it. `None` when they do not jump alike.
    fn block(&mut self, one: &Block, other: Option<&Block>) -> Option<(Block, bool)> {
        let mut done = Block::new();
        let mut rest = one.span_iter();
        let mut rest_of_other = other.map(Block::span_iter);
        loop {
            let mut items = Vec::new();
            let jump = self.up_to_jump(&mut items, &mut rest);
            let other_jump = match &mut rest_of_other {
                Some(rest) => self.up_to_jump(&mut items, rest),
                None => None,
            };
            for item in items {
                done.push(item.statement, item.span);
            }
            let (jump, span) = match (jump, &rest_of_other, other_jump) {
                (None, _, None) => return Some((done, true)),
                (Some(jump), None, _) | (Some(jump), Some(_), Some(_)) => jump,
                _ => return None,
            };
            let other_jump = other_jump.map(|(statement, _)| statement);
            let (statement, falls) = self.statement(jump, other_jump)?;
            done.push(statement, *span);
            if !falls {
                return Some((done, false));
            }
            if let Some(other) = other_jump {
                done.append(&mut self.set_same(jump, other).into());
            }
        }
    }

    /// Walks statements up to the next that jumps.
    fn up_to_jump<'b>(
        &mut self,
        items: &mut Vec<Item>,
        rest: &mut impl Iterator<Item = (&'b Statement, &'b Span)>,
    ) -> Option<(&'b Statement, &'b Span)> {
        for (statement, span) in rest {
            if jumps(statement) {
                return Some((statement, span));
            }
            self.take(items, statement, *span);
        }
        None
    }

    fn touched(&self, statement: &Statement) -> Touched {
        let emitted = self.function.expressions.len();
        Touched::by(&self.numbers.expressions, emitted, statement)
    }

    /// Walks a statement that does not jump, and puts it behind others or into one of them.
    fn take(&mut self, items: &mut Vec<Item>, statement: &Statement, span: Span) {
        if let Statement::Emit(range) = statement {
            for value in range.clone() {
                self.numbers.compute(value);
                let statement = emit(value);
                items.push(self.item(statement, span));
            }
            return;
        }
        if !branches(statement) {
            match *statement {
                Statement::Store { pointer, value } => self.numbers.store(pointer, value),
                ref other => self.lose(other),
            }
            items.push(self.item(statement.clone(), span));
            return;
        }
        let touched = self.touched(statement);
        for at in 0..items.len() {
            if self.join(items, at, statement, &touched) {
                return;
            }
        }
        let before = self.numbers.state.clone();
        let (targets, joins) = (self.targets.len(), self.joins);
        let statement = match self.statement(statement, None) {
            Some((walked, _)) => walked,
            None => {
                self.targets.truncate(targets);
                self.joins = joins;
                self.numbers.state.clone_from(&before);
                self.lose(statement);
                statement.clone()
            }
        };
        let around = Some((before, self.numbers.state.clone()));
        items.push(Item {
            statement,
            span,
            touched,
            around,
        });
    }

    fn item(&self, statement: Statement, span: Span) -> Item {
        Item {
            touched: self.touched(&statement),
            statement,
            span,
            around: None,
        }
    }

    /// Notes that nothing is known of what a statement leaves.
    fn lose(&mut self, statement: &Statement) {
        if let Some(result) = operands::result(statement) {
            self.numbers.make(result);
        }
        for local in stored(&self.numbers.expressions, operands::blocks(statement)) {
            self.numbers.state[local.index()] = self.numbers.unknown();
        }
    }

    /// Puts a statement into an item that goes the same way, if it does, with what has to be done before. Returns whether it did.
    fn join(
        &mut self,
        items: &mut Vec<Item>,
        at: usize,
        statement: &Statement,
        touched: &Touched,
    ) -> bool {
        let item = &items[at];
        let Some((before, behind)) = &item.around else {
            return false;
        };
        if item.touched.acts || touched.acts {
            return false;
        }
        // What is between the two, and must be done before the second.
        let mut first = touched.clone();
        let mut goes_first = Vec::new();
        for between in items[at + 1..].iter().rev() {
            let goes = between.touched.meets(&first);
            if goes {
                first.add(&between.touched);
            }
            goes_first.push(goes);
        }
        if first.meets(&item.touched) {
            return false;
        }
        goes_first.reverse();

        let now = self.numbers.state.clone();
        let (targets, joins) = (self.targets.len(), self.joins);
        for local in item.touched.locals() {
            self.numbers.state[local.index()] = before[local.index()];
        }
        let before = self.numbers.state.clone();
        let Some((joined, _)) = self.statement(&item.statement, Some(statement)) else {
            self.targets.truncate(targets);
            self.joins = joins;
            self.numbers.state = now;
            return false;
        };
        self.joins += 1;
        let same = self.set_same(&item.statement, statement);
        // What the first one left was known by other numbers than now.
        let walked = std::mem::replace(&mut self.numbers.state, now);
        let mut behind = behind.clone();
        let of = |statement| stored(&self.numbers.expressions, operands::blocks(statement));
        let of_first = of(&item.statement);
        for local in of(statement) {
            let mut equal = of_first.iter();
            let equal = equal.find(|other| walked[other.index()] == walked[local.index()]);
            let held = match equal {
                Some(other) => behind[other.index()],
                None => walked[local.index()],
            };
            behind[local.index()] = held;
            self.numbers.state[local.index()] = held;
        }
        let mut later = Vec::new();
        for (between, goes) in items.split_off(at + 1).into_iter().zip(goes_first) {
            match goes {
                true => items.push(between),
                false => later.push(between),
            }
        }
        let mut item = items.remove(at);
        item.touched.add(touched);
        item.statement = joined;
        item.around = Some((before, behind));
        let span = item.span;
        items.push(item);
        for store in same {
            items.push(self.item(store, span));
        }
        items.extend(later);
        true
    }

    /// Walks a statement that branches or jumps, or two of them in lockstep; returns what becomes of it, and whether control comes out behind it.
    /// `None` when they do not go the same way.
    fn statement(
        &mut self,
        one: &Statement,
        other: Option<&Statement>,
    ) -> Option<(Statement, bool)> {
        match (one, other) {
            (Statement::Break, None | Some(Statement::Break)) => {
                let state = self.numbers.state.clone();
                self.targets.last_mut()?.out.push(state);
                Some((Statement::Break, false))
            }
            (Statement::Continue, None | Some(Statement::Continue)) => {
                let state = self.numbers.state.clone();
                let mut targets = self.targets.iter_mut().rev();
                targets.find(|target| target.is_loop)?.again.push(state);
                Some((Statement::Continue, false))
            }
            (
                Statement::If {
                    condition,
                    accept,
                    reject,
                },
                None,
            ) => self.branch(*condition, [accept, reject], None),
            (
                Statement::If {
                    condition,
                    accept,
                    reject,
                },
                Some(Statement::If {
                    condition: other,
                    accept: other_accept,
                    reject: other_reject,
                }),
            ) if self.are_equal(*condition, *other) => self.branch(
                *condition,
                [accept, reject],
                Some([other_accept, other_reject]),
            ),
            (Statement::Switch { selector, cases }, None) => self.switch(*selector, cases, None),
            (
                Statement::Switch { selector, cases },
                Some(Statement::Switch {
                    selector: other,
                    cases: others,
                }),
            ) if self.are_equal(*selector, *other) => self.switch(*selector, cases, Some(others)),
            (Statement::Loop { .. }, None | Some(Statement::Loop { .. })) => {
                self.repeat(Rounds::of(one)?, other.and_then(Rounds::of))
            }
            _ => None,
        }
    }

    fn are_equal(&mut self, one: Handle<Expression>, other: Handle<Expression>) -> bool {
        self.numbers.of_value(one) == self.numbers.of_value(other)
    }

    fn branch(
        &mut self,
        condition: Handle<Expression>,
        [accept, reject]: [&Block; 2],
        others: Option<[&Block; 2]>,
    ) -> Option<(Statement, bool)> {
        let before = self.numbers.state.clone();
        let (accept, accepts) = self.block(accept, others.map(|[accept, _]| accept))?;
        let accepted = std::mem::replace(&mut self.numbers.state, before);
        let (reject, rejects) = self.block(reject, others.map(|[_, reject]| reject))?;
        match (accepts, rejects) {
            (true, true) => {
                let test = self.numbers.of_value(condition);
                for (local, accepted) in accepted.into_iter().enumerate() {
                    let rejected = self.numbers.state[local];
                    self.numbers.state[local] = self.numbers.choice(test, accepted, rejected);
                }
            }
            (true, false) => self.numbers.state = accepted,
            (false, _) => {}
        }
        let branch = Statement::If {
            condition,
            accept,
            reject,
        };
        Some((branch, accepts || rejects))
    }

    fn switch(
        &mut self,
        selector: Handle<Expression>,
        cases: &[SwitchCase],
        others: Option<&Vec<SwitchCase>>,
    ) -> Option<(Statement, bool)> {
        let are_alike = |other: &Vec<SwitchCase>| {
            let mut pairs = other.iter().zip(cases);
            other.len() == cases.len()
                && pairs.all(|(a, b)| (a.value, a.fall_through) == (b.value, b.fall_through))
        };
        if !others.is_none_or(are_alike) {
            return None;
        }
        let before = self.numbers.state.clone();
        self.targets.push(Target {
            is_loop: false,
            out: Vec::new(),
            again: Vec::new(),
        });
        let mut walked = Vec::new();
        let mut entry = before.clone();
        for (at, case) in cases.iter().enumerate() {
            self.numbers.state = entry;
            let (body, falls) = self.block(&case.body, others.map(|others| &others[at].body))?;
            walked.push(SwitchCase {
                body,
                ..case.clone()
            });
            let behind = self.numbers.state.clone();
            entry = match (falls, case.fall_through) {
                (true, true) => self.numbers.join(&[before.clone(), behind]),
                (true, false) => {
                    self.targets.last_mut()?.out.push(behind);
                    before.clone()
                }
                (false, _) => before.clone(),
            };
        }
        let out = self.targets.pop()?.out;
        let cases = walked;
        let falls = self.go_on(&out);
        Some((Statement::Switch { selector, cases }, falls))
    }

    /// Goes on where several ways meet. Returns whether there is one.
    fn go_on(&mut self, ways: &[State]) -> bool {
        if !ways.is_empty() {
            self.numbers.state = self.numbers.join(ways);
        }
        !ways.is_empty()
    }

    fn repeat(&mut self, one: Rounds<'_>, other: Option<Rounds<'_>>) -> Option<(Statement, bool)> {
        let stores = |rounds: Rounds<'_>| {
            stored(&self.numbers.expressions, [rounds.body, rounds.continuing])
        };
        let first = stores(one);
        let second = other.map_or(BTreeSet::new(), stores);
        let all: Vec<Local> = first.union(&second).copied().collect();
        let before = self.numbers.state.clone();
        // Those of one class hold the same when a round begins.
        let mut classes: Vec<usize> = match other {
            None => (0..all.len()).collect(),
            Some(_) => {
                let locals = &self.function.local_variables;
                let begin = all.iter().map(|l| (locals[*l].ty, before[l.index()]));
                by_first(begin)
            }
        };
        let joins = self.joins;
        loop {
            self.joins = joins;
            self.numbers.state.clone_from(&before);
            let mut held = BTreeMap::new();
            for (local, class) in all.iter().zip(&classes) {
                let number = held.entry(class);
                let number = *number.or_insert_with(|| self.numbers.unknown());
                self.numbers.state[local.index()] = number;
            }
            let same = self.same(&first, &second);
            self.targets.push(Target {
                is_loop: true,
                out: Vec::new(),
                again: Vec::new(),
            });
            let (mut body, falls) = self.block(one.body, other.map(|other| other.body))?;
            self.begin(&mut body, same);
            let Target {
                mut out, mut again, ..
            } = self.targets.pop()?;
            if falls {
                again.push(self.numbers.state.clone());
            }
            let mut continuing = Block::new();
            let mut finer = classes.clone();
            if self.go_on(&again) {
                continuing = self.same(&first, &second).into();
                let of_other = other.map(|other| other.continuing);
                let (mut walked, _) = self.block(one.continuing, of_other)?;
                continuing.append(&mut walked);
                if let Some(other) = other
                    && !match (one.break_if, other.break_if) {
                        (None, None) => true,
                        (Some(one), Some(other)) => self.are_equal(one, other),
                        _ => false,
                    }
                {
                    return None;
                }
                if one.break_if.is_some() {
                    out.push(self.numbers.state.clone());
                }
                let ends = all.iter().map(|local| self.numbers.state[local.index()]);
                finer = by_first(classes.iter().copied().zip(ends));
            }
            if other.is_none() || finer == classes {
                let falls = self.go_on(&out);
                let rounds = Statement::Loop {
                    body,
                    continuing,
                    break_if: one.break_if,
                };
                return Some((rounds, falls));
            }
            classes = finer;
        }
    }

    /// Puts stores where a round begins: behind the test that it begins with, as far as they do not matter to that.
    fn begin(&self, body: &mut Block, stores: Vec<Statement>) {
        let is_test = |statement: &Statement| matches!(statement, Statement::If { .. });
        let test = body.iter().position(|s| !matches!(s, Statement::Emit(_)));
        let test = test.filter(|at| is_test(&body[*at]) && jumps(&body[*at]));
        let mut tested = BTreeSet::new();
        for statement in &body[..test.map_or(0, |test| test + 1)] {
            tested.extend(self.touched(statement).locals());
        }
        let matters = |store: &Statement| {
            let touched = self.touched(store);
            touched.locals().any(|local| tested.contains(&local))
        };
        let (first, behind): (Vec<_>, Vec<_>) = stores.into_iter().partition(matters);
        let at = test.map_or(0, |test| test + 1);
        body.splice(at..at, behind.into());
        body.splice(0..0, first.into());
    }

    /// Sets each variable that the second of two statements stores to, to one of the first that holds the same.
    fn set_same(&mut self, one: &Statement, other: &Statement) -> Vec<Statement> {
        let of = |statement| stored(&self.numbers.expressions, operands::blocks(statement));
        let (first, second) = (of(one), of(other));
        self.same(&first, &second)
    }

    /// Sets each of the second variables to one of the first that holds the same, if one does.
    fn same(&mut self, first: &BTreeSet<Local>, second: &BTreeSet<Local>) -> Vec<Statement> {
        let mut stores = Vec::new();
        let locals = &self.function.local_variables;
        for local in second {
            let is_same = |other: &&Local| {
                locals[*local].ty == locals[**other].ty
                    && self.numbers.state[local.index()] == self.numbers.state[other.index()]
            };
            if !self.numbers.is_plain(*local) || first.contains(local) {
                continue;
            }
            if let Some(same) = first.iter().find(is_same) {
                let pointer = self.add(Expression::LocalVariable(*same));
                let value = self.add(Expression::Load { pointer });
                let pointer = self.add(Expression::LocalVariable(*local));
                stores.push(Statement::Store { pointer, value });
            }
        }
        stores
    }

    fn add(&mut self, expression: Expression) -> Handle<Expression> {
        self.numbers.expressions.append(expression, Span::UNDEFINED)
    }
}

type Local = Handle<LocalVariable>;

/// The parts of a loop.
#[derive(Clone, Copy)]
struct Rounds<'b> {
    body: &'b Block,
    continuing: &'b Block,
    break_if: Option<Handle<Expression>>,
}

impl<'b> Rounds<'b> {
    fn of(statement: &'b Statement) -> Option<Self> {
        match statement {
            Statement::Loop {
                body,
                continuing,
                break_if,
            } => Some(Self {
                body,
                continuing,
                break_if: *break_if,
            }),
            _ => None,
        }
    }
}

/// For each key the place of the first that is equal.
fn by_first<K: Ord>(keys: impl Iterator<Item = K>) -> Vec<usize> {
    let mut first = BTreeMap::new();
    let places = keys.enumerate();
    places
        .map(|(at, key)| *first.entry(key).or_insert(at))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::MathFunction;

    /// How many loops, branches and calls of `dot` there are in a vertex stage of these statements that returns `at`,
    /// before and after.
    fn counts(statements: &str) -> [[usize; 3]; 2] {
        let text = format!(
            "struct U {{ lights: array<vec4f, 8>, count: u32, other: u32, kind: u32 }}
             @group(0) @binding(0) var<uniform> u: U;
             @group(0) @binding(1) var<storage, read_write> kept: f32;
             @vertex fn vs(@location(0) p: vec3f) -> @builtin(position) vec4f {{
                 var at = vec4f(); {statements} return at;
             }}
             @fragment fn fs() -> @location(0) vec4f {{ return vec4f(); }}"
        );
        let module = naga::front::wgsl::parse_str(&text).expect("it parses");
        let base = crate::normalize(&module, Some("vs"), "fs", 1000).expect("it is small");
        let joined = joined(base.clone(), Stage::Vertex);
        joined.validate().expect("it is valid");
        [&base, &joined].map(|shader| {
            let function = shader.function(Stage::Vertex).expect("it has one");
            let mut found = [0; 3];
            operands::walk(&function.body, &mut |statement| match statement {
                Statement::Loop { .. } => found[0] += 1,
                Statement::If { .. } | Statement::Switch { .. } => found[1] += 1,
                _ => {}
            });
            let is_dot = |expression: &Expression| {
                let fun = MathFunction::Dot;
                matches!(expression, Expression::Math { fun: other, .. } if *other == fun)
            };
            let mut values = function.expressions.iter();
            found[2] = values.by_ref().filter(|(_, e)| is_dot(e)).count();
            found
        })
    }

    #[test]
    fn two_sums_over_one_range_are_one_loop_that_computes_what_they_share_once() {
        let sum = "var S = 0.0;
            for (var i = 0u; i < u.count; i++) {
                let d = dot(u.lights[i].xyz, p);
                if d < 0.0 { continue; }
                S += d * S;
                if d > 9.0 { break; }
            }";
        let two = [
            sum.replace('S', "a"),
            sum.replace("S +=", "S -=").replace('S', "b"),
        ]
        .concat();
        let both = format!("{two} at = vec4f(a, b, a, b);");
        assert_eq!(counts(&both), [[2, 6, 2], [1, 3, 1]]);
        // What is done between the two goes where it must.
        let between = format!(
            "{} at = vec4f(at.x, a, b, b);",
            two.replacen("var b", "at.x = sin(a); var b", 1)
        );
        assert_eq!(counts(&between), [[2, 6, 2], [1, 3, 1]]);
        // So are three.
        let three = format!(
            "{two} {} at = vec4f(a, b, c, c);",
            sum.replace("+=", "*=").replace('S', "c")
        );
        assert_eq!(counts(&three), [[3, 9, 3], [1, 3, 1]]);
    }

    #[test]
    fn what_both_carry_from_round_to_round_is_carried_once() {
        // A falling weight, which is used by both and decides when they end.
        let sum = "var S = 0.0; var weight_S = 1.0;
            for (var i = 0u; i < 8u; i++) {
                S OP weight_S * u.lights[i].x;
                weight_S *= 1.0 - dot(u.lights[i], u.lights[i]);
                if weight_S < 0.01 { break; }
            }";
        let two = ["a +=", "b -="].map(|name| {
            let (name, op) = name.split_once(' ').expect("two words");
            sum.replace('S', name).replace("OP", op)
        });
        let both = format!("{} at = vec4f(a, b, weight_a, weight_b);", two.concat());
        assert_eq!(counts(&both), [[2, 4, 2], [1, 2, 1]]);
        // A weight that is another after the first round is carried for itself, and then they do not end together.
        let apart = both.replacen("1.0 - dot", "0.9 - dot", 1);
        assert_eq!(counts(&apart), [[2, 4, 2], [2, 4, 2]]);
    }

    #[test]
    fn loops_that_may_end_in_other_rounds_stay_apart() {
        let sum = |name: &str, count: &str, more: &str| {
            format!(
                "var {name} = 0.0;
                 for (var i = 0u; i < {count}; i++) {{ {name} += dot(u.lights[i].xyz, p); {more} }}"
            )
        };
        let end = "at = vec4f(a, b, a, b);";
        for (count, more, why) in [
            ("u.other", "", "another count"),
            ("u.count", "if b > 4.0 { break; }", "another test"),
            (
                "u.count",
                "if b > 4.0 { continue; } b += 1.0;",
                "another jump",
            ),
            ("u.count", "i++;", "another step"),
            ("min(u32(a), 8u)", "", "a count that the first results in"),
            ("u.count", "b += a;", "what the first results in"),
            ("u.count", "kept += b;", "more than it computes"),
        ] {
            let both = [&sum("a", "u.count", ""), &*sum("b", count, more), end].concat();
            let [before, after] = counts(&both);
            assert_eq!((before[0], after[0]), (2, 2), "{why}");
        }
        let own = |name| sum(name, "u.count", &format!("if {name} > 4.0 {{ break; }}"));
        let doubled = own("b").replace("b +=", "b -=");
        let [_, after] = counts(&[&own("a"), &*doubled, end].concat());
        assert_eq!(after[0], 2, "each ends by its own sum");
        let [_, after] = counts(&[&own("a"), &*own("b"), end].concat());
        assert_eq!(after, [1, 2, 1], "their sums are the same");
    }

    #[test]
    fn a_variable_that_is_changed_before_a_break_and_one_behind_it_are_two() {
        let a = "var a = 0.0; for (var i = 0u; i < 8u; i++) { if u.lights[i].x > 1.0 { break; } a += 1.0; }";
        let b = "var b = 0.0; for (var i = 0u; i < 8u; i++) { b += 1.0; if u.lights[i].x > 1.0 { break; } }";
        let [before, after] = counts(&format!("{a} {b} at = vec4f(a, b, b, a);"));
        assert_eq!((before[0], after[0]), (2, 1));
        let text = format!("{a} {b} at = vec4f(a, b, b, a) + dot(vec4f(a), vec4f(b));");
        assert_eq!(counts(&text)[1], [1, 2, 1]);
    }

    #[test]
    fn branches_and_loops_in_loops_are_joined_as_well() {
        let nested = "var S = 0.0;
            if u.kind == 1u {
                for (var i = 0u; i < u.count; i++) {
                    var inner = 0.0;
                    for (var j = 0u; j <= i; j++) { inner += dot(u.lights[j].xyz, p); }
                    switch u.kind + i {
                        case 1u: { inner *= 2.0; }
                        case 2u, 3u: { inner = sqrt(inner); if inner > 2.0 { break; } inner += 1.0; }
                        default: { inner = 0.5; }
                    }
                    S += inner * u.lights[i].FIELD;
                }
            }";
        let one = |name, field| nested.replace('S', name).replace("FIELD", field);
        let both = [&one("a", "x"), &*one("b", "y"), "at = vec4f(a, b, a, b);"].concat();
        let [before, after] = counts(&both);
        assert_eq!(before[0], 4);
        assert_eq!((after[0], after[2]), (2, 1));
        assert_eq!(after[1] * 2, before[1]);
    }
}
