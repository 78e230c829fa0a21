//! What values decide beside the picture: when loops end, built-in outputs, what is written to memory.

use super::{Value, is_float, local};
use crate::operands;
use crate::shader::{Shader, Stage};
use naga::{
    Binding, Block, Expression, Function, Handle, Literal, LocalVariable, Statement, TypeInner,
    UnaryOperator,
};
use std::fmt;

/// What a value decides that a picture's error does not measure, or measures too late.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Decides {
    /// Whether a loop goes on: changed, it might never end.
    Loop,
    /// A built-in output: the position or the depth.
    BuiltIn,
    /// What is written to memory, or where.
    Memory,
}

impl fmt::Display for Decides {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Loop => "it decides when a loop ends",
            Self::BuiltIn => "it decides a built-in output",
            Self::Memory => "it decides what is written to memory",
        })
    }
}

/// A side of an `if`, or a case of a `switch`, around a statement.
struct Branch {
    outer: Option<usize>,
    condition: Value,
    /// What the condition is there; `None` for a case.
    side: Option<bool>,
    /// How many loops are around it.
    depth: usize,
}

/// A store to a local variable, or to a part of one.
#[derive(Debug)]
pub(super) struct LocalStore {
    pub(super) local: Handle<LocalVariable>,
    pointer: Value,
    pub(super) value: Value,
    branch: Option<usize>,
    /// The loops around it, outermost first.
    loops: Vec<usize>,
    /// Whether it is reached in every round of its innermost loop that goes on.
    every_round: bool,
}

/// A way out of a loop, or one around its ways out.
struct Exit {
    loop_: usize,
    conditions: Vec<Value>,
    /// What the only condition is when the loop is left, if every round tests it.
    test: Option<bool>,
}

/// The part of an exit that ends its loop whatever becomes of the rest.
struct Counter {
    /// The comparison of the counter with its end.
    comparison: Value,
    /// What the comparison is a part of, up to the exit's condition.
    around: Vec<Value>,
}

/// Reads a function's statements.
pub(super) struct Reader<'a> {
    shader: &'a Shader,
    stage: Stage,
    function: &'a Function,
    branches: Vec<Branch>,
    stores: Vec<LocalStore>,
    /// The loops around the statement that is read, outermost first.
    loops: Vec<usize>,
    /// For each loop met, whether a `continue` has been read in it.
    continued: Vec<bool>,
    exits: Vec<Exit>,
    /// Values that statements make count for more than the picture.
    roots: Vec<(Value, Decides)>,
    /// For each value, the innermost loop that computes it.
    homes: Vec<Option<usize>>,
}

impl<'a> Reader<'a> {
    /// What each value of a function decides, and the function's stores to local variables.
    pub(super) fn read(
        shader: &'a Shader,
        stage: Stage,
        function: &'a Function,
    ) -> (Vec<Option<Decides>>, Vec<LocalStore>) {
        let mut reader = Self {
            shader,
            stage,
            function,
            branches: Vec::new(),
            stores: Vec::new(),
            loops: Vec::new(),
            continued: Vec::new(),
            exits: Vec::new(),
            roots: Vec::new(),
            homes: vec![None; function.expressions.len()],
        };
        reader.block(&function.body, None, false);
        (reader.decisions(), reader.stores)
    }

    fn branch(
        &mut self,
        outer: Option<usize>,
        condition: Value,
        side: Option<bool>,
    ) -> Option<usize> {
        let depth = self.loops.len();
        self.branches.push(Branch {
            outer,
            condition,
            side,
            depth,
        });
        Some(self.branches.len() - 1)
    }

    /// The branches between a statement and a loop of the given depth around it, innermost first.
    fn inside(&self, mut branch: Option<usize>, depth: usize) -> Vec<usize> {
        let mut found = Vec::new();
        while let Some(i) = branch {
            if self.branches[i].depth < depth {
                break;
            }
            found.push(i);
            branch = self.branches[i].outer;
        }
        found
    }

    fn exit(&mut self, depth: usize, branch: Option<usize>) {
        let loop_ = self.loops[depth - 1];
        let branches = self.inside(branch, depth);
        let test = match branches[..] {
            [only] if depth == self.loops.len() && !self.continued[loop_] => {
                self.branches[only].side
            }
            _ => None,
        };
        let conditions = branches
            .iter()
            .map(|&i| self.branches[i].condition)
            .collect();
        self.exits.push(Exit {
            loop_,
            conditions,
            test,
        });
    }

    /// Reads a block. `switch` says that a `break` in it leaves a switch, not a loop.
    fn block(&mut self, block: &Block, branch: Option<usize>, switch: bool) {
        for statement in block {
            match *statement {
                Statement::Block(ref block) => self.block(block, branch, switch),
                Statement::If {
                    condition,
                    ref accept,
                    ref reject,
                } => {
                    let side = self.branch(branch, condition, Some(true));
                    self.block(accept, side, switch);
                    let side = self.branch(branch, condition, Some(false));
                    self.block(reject, side, switch);
                }
                Statement::Switch {
                    selector,
                    ref cases,
                } => {
                    let branch = self.branch(branch, selector, None);
                    for case in cases {
                        self.block(&case.body, branch, true);
                    }
                }
                Statement::Loop {
                    ref body,
                    ref continuing,
                    break_if,
                } => {
                    let loop_ = self.continued.len();
                    self.continued.push(false);
                    self.loops.push(loop_);
                    self.block(body, branch, false);
                    // A `continue` leads here: what stands here runs in every round.
                    let continued = std::mem::replace(&mut self.continued[loop_], false);
                    self.block(continuing, branch, false);
                    self.continued[loop_] = continued;
                    if let Some(condition) = break_if {
                        let conditions = vec![condition];
                        self.exits.push(Exit {
                            loop_,
                            conditions,
                            test: Some(true),
                        });
                    }
                    self.loops.pop();
                }
                Statement::Break if !switch => {
                    if !self.loops.is_empty() {
                        self.exit(self.loops.len(), branch);
                    }
                }
                Statement::Continue => {
                    if let Some(&loop_) = self.loops.last() {
                        // It may pass by the test and the step of a counter.
                        self.exit(self.loops.len(), branch);
                        self.continued[loop_] = true;
                        if let Some(exit) = self.exits.last_mut() {
                            exit.test = None;
                        }
                    }
                }
                Statement::Return { value } => {
                    for depth in 1..=self.loops.len() {
                        self.exit(depth, branch);
                    }
                    if let Some(value) = value {
                        self.result(value);
                    }
                }
                Statement::Store { pointer, value } => match local(self.function, pointer) {
                    Some(local) => {
                        let depth = self.loops.len();
                        let every_round = self.loops.last().is_some_and(|&loop_| {
                            !self.continued[loop_] && self.inside(branch, depth).is_empty()
                        });
                        self.stores.push(LocalStore {
                            local,
                            pointer,
                            value,
                            branch,
                            loops: self.loops.clone(),
                            every_round,
                        });
                    }
                    None => self.memory(statement, branch),
                },
                Statement::Emit(ref values) => {
                    for value in values.clone() {
                        self.homes[value.index()] = self.loops.last().copied();
                    }
                }
                Statement::Break
                | Statement::Kill
                | Statement::ControlBarrier(_)
                | Statement::MemoryBarrier(_) => {}
                _ => self.memory(statement, branch),
            }
        }
    }

    /// A statement with an effect outside the picture: all that it uses, and all that decides whether
    /// it runs.
    fn memory(&mut self, statement: &Statement, branch: Option<usize>) {
        let roots = &mut self.roots;
        operands::each_of_statement(statement, |value| roots.push((value, Decides::Memory)));
        for i in self.inside(branch, 0) {
            self.roots
                .push((self.branches[i].condition, Decides::Memory));
        }
    }

    /// The built-in outputs in what is returned.
    fn result(&mut self, value: Value) {
        let Some(result) = &self.function.result else {
            return;
        };
        let is_built_in = |binding: &Option<Binding>| matches!(binding, Some(Binding::BuiltIn(_)));
        if is_built_in(&result.binding) {
            self.roots.push((value, Decides::BuiltIn));
        }
        let TypeInner::Struct { ref members, .. } = self.shader.module().types[result.ty].inner
        else {
            return;
        };
        for (i, member) in members.iter().enumerate() {
            if is_built_in(&member.binding) {
                let root = match self.function.expressions[value] {
                    Expression::Compose { ref components, .. } => components.get(i).copied(),
                    _ => Some(value),
                };
                self.roots.extend(root.map(|root| (root, Decides::BuiltIn)));
            }
        }
    }

    /// For each value, what it decides.
    fn decisions(&self) -> Vec<Option<Decides>> {
        let mut decides = vec![None; self.function.expressions.len()];
        let mut mark = |value, why| {
            self.slice(value, |value| {
                let fresh = decides[value.index()].is_none();
                decides[value.index()].get_or_insert(why);
                fresh
            });
        };
        for &(value, why) in &self.roots {
            mark(value, why);
        }
        let mut around = Vec::new();
        for loop_ in 0..self.continued.len() {
            let own = || self.exits.iter().filter(|exit| exit.loop_ == loop_);
            // A counter suffices, and then it is all that has to stay.
            match own().find_map(|exit| self.counter(exit)) {
                Some(counter) => {
                    mark(counter.comparison, Decides::Loop);
                    around.extend(counter.around);
                }
                None => {
                    for condition in own().flat_map(|exit| &exit.conditions) {
                        mark(*condition, Decides::Loop);
                    }
                }
            }
        }
        for value in around {
            decides[value.index()].get_or_insert(Decides::Loop);
        }
        decides
    }

    /// Visits a value and all that it is computed from, through local variables and the branches
    /// around their stores. `enter` says whether to go on from a value.
    fn slice(&self, value: Value, mut enter: impl FnMut(Value) -> bool) {
        let mut todo = vec![value];
        while let Some(value) = todo.pop() {
            if !enter(value) {
                continue;
            }
            let expression = &self.function.expressions[value];
            operands::each(expression, |operand| todo.push(operand));
            if let Expression::LocalVariable(local) = *expression {
                for store in self.stores.iter().filter(|store| store.local == local) {
                    todo.extend([store.value, store.pointer]);
                    let mut branch = store.branch;
                    while let Some(i) = branch {
                        todo.push(self.branches[i].condition);
                        branch = self.branches[i].outer;
                    }
                }
            }
        }
    }

    /// The counter of an exit: every round tests it, nothing but integers enters it, every round steps
    /// it by a constant, and the exit lies the way that it is stepped.
    fn counter(&self, exit: &Exit) -> Option<Counter> {
        let (&[condition], Some(when)) = (&exit.conditions[..], exit.test) else {
            return None;
        };
        let mut around = Vec::new();
        let comparison = self.comparison(condition, when, exit.loop_, &mut around)?;
        Some(Counter { comparison, around })
    }

    /// The comparison with a counter that makes a condition `when`, whatever the rest of it is.
    fn comparison(
        &self,
        condition: Value,
        when: bool,
        loop_: usize,
        around: &mut Vec<Value>,
    ) -> Option<Value> {
        use naga::BinaryOperator as Op;
        let (op, left, right) = match self.function.expressions[condition] {
            Expression::Unary {
                op: UnaryOperator::LogicalNot,
                expr,
            } => {
                around.push(condition);
                return self.comparison(expr, !when, loop_, around);
            }
            Expression::Binary { op, left, right } => (op, left, right),
            _ => return None,
        };
        let rises = match op {
            Op::Greater | Op::GreaterEqual => when,
            Op::Less | Op::LessEqual => !when,
            // One side alone makes `a | b` true, and `a & b` false.
            Op::LogicalOr | Op::InclusiveOr if when => {
                around.push(condition);
                let left = self.comparison(left, when, loop_, around);
                return left.or_else(|| self.comparison(right, when, loop_, around));
            }
            Op::LogicalAnd | Op::And if !when => {
                around.push(condition);
                let left = self.comparison(left, when, loop_, around);
                return left.or_else(|| self.comparison(right, when, loop_, around));
            }
            _ => return None,
        };
        let ends = |counter: Value, end: Value, rises: bool| {
            self.step(counter, loop_) == Some(rises) && self.stays_in(end, loop_)
        };
        (ends(left, right, rises) || ends(right, left, !rises)).then_some(condition)
    }

    /// Whether a counter rises or falls in a loop: the value is what an integer variable holds or is
    /// about to, and all that the loop does to that variable is to add a constant in every round.
    fn step(&self, value: Value, loop_: usize) -> Option<bool> {
        let expressions = &self.function.expressions;
        let held = |value: Value| match expressions[value] {
            Expression::Load { pointer } if self.homes[value.index()] == Some(loop_) => {
                match expressions[pointer] {
                    Expression::LocalVariable(local) => Some(local),
                    _ => None,
                }
            }
            _ => None,
        };
        let is_positive = |value: Value| match expressions[value] {
            Expression::Literal(Literal::I32(step)) if step != 0 => Some(step > 0),
            Expression::Literal(Literal::U32(step)) if step != 0 => Some(true),
            _ => None,
        };
        let stepped = |value: Value| match expressions[value] {
            Expression::Binary {
                op: naga::BinaryOperator::Add,
                left,
                right,
            } => match (held(left), held(right)) {
                (Some(local), _) => Some((local, is_positive(right)?)),
                (_, Some(local)) => Some((local, is_positive(left)?)),
                _ => None,
            },
            Expression::Binary {
                op: naga::BinaryOperator::Subtract,
                left,
                right,
            } => Some((held(left)?, !is_positive(right)?)),
            _ => None,
        };
        let local = held(value).or_else(|| Some(stepped(value)?.0))?;
        let mut inside = self
            .stores
            .iter()
            .filter(|store| store.local == local && store.loops.contains(&loop_));
        let (Some(store), None) = (inside.next(), inside.next()) else {
            return None;
        };
        let (stored, rises) = stepped(store.value)?;
        let always = store.every_round && store.loops.last() == Some(&loop_);
        (always && stored == local).then_some(rises)
    }

    /// Whether a value is an integer that is the same in every round of a loop, and no float enters it.
    fn stays_in(&self, value: Value, loop_: usize) -> bool {
        let mut seen = vec![false; self.function.expressions.len()];
        let mut stays = true;
        self.slice(value, |value| {
            stays &= !is_float(self.shader.type_of(self.stage, value));
            if let Expression::LocalVariable(local) = self.function.expressions[value] {
                let mut stores = self.stores.iter();
                stays &= !stores.any(|s| s.local == local && s.loops.contains(&loop_));
            }
            stays && !std::mem::replace(&mut seen[value.index()], true)
        });
        stays
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::Flow;
    use crate::flow::tests::shader;

    fn decides(source: &str, name: &str) -> Option<Decides> {
        let shader = shader(source);
        let (stage, value) = shader.find(&name.into()).expect("the test names a value");
        Flow::new(&shader, stage).and_then(|flow| flow.decides(value))
    }

    fn in_loop(before: &str, body: &str) -> String {
        format!(
            "@fragment fn main(@location(0) x: f32) -> @location(0) vec4f {{
                 let slope = x * 0.5; var height = 0.0; var i = 0; var n = 9; var done = false;
                 {before} {{ {body} }}
                 return vec4f(height + slope);
             }}"
        )
    }

    #[test]
    fn a_value_that_a_break_waits_for_stays() {
        let direct = in_loop("loop", "if height > slope { break; } height += 0.1;");
        assert_eq!(decides(&direct, "slope"), Some(Decides::Loop));
        let through_the_variable = in_loop("loop", "height += slope; if height > 1.0 { break; }");
        assert_eq!(decides(&through_the_variable, "slope"), Some(Decides::Loop));
        let through_a_flag = in_loop("loop", "if done { break; } if slope > 0.1 { done = true; }");
        assert_eq!(decides(&through_a_flag, "slope"), Some(Decides::Loop));
        let by_break_if = in_loop(
            "loop",
            "continuing { height += slope; break if height > 1.0; }",
        );
        assert_eq!(decides(&by_break_if, "slope"), Some(Decides::Loop));
        let by_return = in_loop(
            "loop",
            "if height > slope { return vec4f(1.0); } height += 0.1;",
        );
        assert_eq!(decides(&by_return, "slope"), Some(Decides::Loop));
    }

    #[test]
    fn a_counter_that_every_round_tests_and_steps_sets_the_others_free() {
        let free = |before: &str, body: &str| decides(&in_loop(before, body), "slope").is_none();
        let late_break = "if height > slope { break; } height += slope;";
        assert!(free("for (; i < 4; i++)", late_break));
        assert!(free("for (; i < 4; i += 2)", "height += slope;"));
        assert!(free(
            "loop",
            "if i > 4 { break; } if height > slope { break; } i = 1 + i;"
        ));
        // A `continue` before the test, or around the step, and the counter counts for nothing.
        assert!(!free(
            "loop",
            "if slope > 0.5 { continue; } if i > 4 { break; } i++;"
        ));
        assert!(!free("loop", "if i > 4 { break; } if slope > 0.5 { i++; }"));
        // So does a counter beside another test, or one that falls.
        assert!(free(
            "loop",
            "if !((i < 4) & (height < slope)) { break; } height += slope; i++;"
        ));
        assert!(free(
            "loop",
            "if i < -4 { break; } height += slope; if height > 9.0 { break; } i--;"
        ));
        // The wrong way, or up to an end that runs away.
        assert!(!free(
            "loop",
            "if i < -4 { break; } height += slope; if height > 9.0 { break; } i++;"
        ));
        assert!(!free(
            "loop",
            "if i > n { break; } height += slope; if height > 9.0 { break; } i++; n += 1;"
        ));
        assert!(!free(
            "loop",
            "if (i > 4) & (height > slope) { break; } height += 0.1; i++;"
        ));
        // A step back, or by a float, is none; nor is a test in a branch.
        assert!(!free("for (; i < 4; i++)", "if slope > 0.5 { i = 0; }"));
        assert!(!free("loop", "if i > 4 { break; } i += i32(slope);"));
        assert!(!free("loop", "if slope > 0.5 { if i > 4 { break; } } i++;"));
    }

    #[test]
    fn a_break_out_of_a_switch_is_no_way_out_of_the_loop() {
        let body = "if i > 4 { break; } switch i { case 1: { if slope > 0.5 { break; } height += 1.0; } default: {} } i++;";
        assert_eq!(decides(&in_loop("loop", body), "slope"), None);
    }

    #[test]
    fn only_the_built_in_part_of_an_output_stays() {
        let source = "struct Out { @location(0) c: vec4f, @builtin(frag_depth) d: f32 }
            @fragment fn main(@location(0) x: f32) -> Out {
                let tone = x * x; let depth = x + 0.5; return Out(vec4f(tone), depth);
            }";
        assert_eq!(decides(source, "tone"), None);
        assert_eq!(decides(source, "depth"), Some(Decides::BuiltIn));
    }

    #[test]
    fn what_is_written_to_memory_stays_with_the_branch_around_it() {
        let source = "@group(0) @binding(0) var<storage, read_write> log: f32;
            @fragment fn main(@location(0) x: f32) -> @location(0) vec4f {
                let heat = x * x; let when = x + 0.5; let tone = x * 2.0;
                if when > 1.0 { log = heat; }
                return vec4f(tone);
            }";
        assert_eq!(decides(source, "heat"), Some(Decides::Memory));
        assert_eq!(decides(source, "when"), Some(Decides::Memory));
        assert_eq!(decides(source, "tone"), None);
    }
}
