//! Finds what is the same for all lanes that run: it is computed once for a block, and branches on it
//! are jumps.
//!
//! A fixpoint from the optimistic side: everything is uniform until something makes it vary. A value
//! varies with its operands; a slot varies when a varying value is written to it, or when a write is
//! seen by lanes that did not take part in it. Which writes those are decides [`Homes`]. Lanes that
//! are not running do not matter to a uniform slot, as long as they never read it again before
//! it is written for them too.

use super::ir::{Id, Ir, Label, NONE, Node, SlotId};

/// What was found.
#[derive(Debug)]
pub(super) struct Uniformity {
    /// For each value, whether lanes differ.
    pub(super) values: Vec<bool>,
    /// For each slot, whether lanes differ.
    pub(super) slots: Vec<bool>,
    /// For each write of a slot, in the order of the text: whether lanes that do not take part must keep
    /// what they had.
    pub(super) masked: Vec<bool>,
}

/// Analyses a program.
pub(super) fn analyse(ir: &Ir, homes: &Homes) -> Uniformity {
    let mut values = vec![false; ir.values.len()];
    for &input in &ir.inputs {
        values[input as usize] = true;
    }
    let mut walk = Walk {
        homes,
        values,
        slots: vec![false; ir.slots.len()],
        masked: Vec::new(),
        loops: vec![false; ir.labels as usize],
        escapes: vec![Vec::new(); ir.labels as usize],
        stack: Vec::new(),
        next: 0,
        changed: true,
    };
    while walk.changed {
        walk.changed = false;
        walk.masked.clear();
        walk.next = 0;
        walk.construct(None, false, |w| w.block(&ir.body));
    }
    Uniformity {
        values: walk.values,
        slots: walk.slots,
        masked: walk.masked,
    }
}

/// A region of the text that control enters and leaves as a whole.
#[derive(Debug)]
struct Construct {
    parent: usize,
    start: u32,
    end: u32,
    /// Whether its contents may run again right after themselves.
    repeats: bool,
}

/// For each slot the smallest construct that holds everything that can happen between a write that
/// some lanes missed and a read of theirs: the slot's home. Divergence outside of it does not matter.
///
/// It holds all reads. It grows around a loop when what is read in one round may have been written in an
/// earlier one, that is, unless a write that every reader has passed comes first in the round.
#[derive(Debug)]
pub(super) struct Homes {
    constructs: Vec<Construct>,
    homes: Vec<usize>,
}

impl Homes {
    pub(super) fn of(ir: &Ir) -> Self {
        let mut survey = Survey {
            constructs: Vec::new(),
            now: 0,
            reads: vec![None; ir.slots.len()],
            sets: vec![Vec::new(); ir.slots.len()],
            at: 0,
        };
        // The whole text, then the body of the entry point; outputs are read between the two ends.
        survey.enter(false, |s| s.block(&ir.body));
        let constructs = survey.constructs;
        let homes = survey
            .reads
            .iter()
            .zip(&survey.sets)
            .zip(&ir.slots)
            .map(|((reads, sets), slot)| {
                // A write to an array leaves its other elements as they were.
                let sets = if slot.len == 1 { &sets[..] } else { &[] };
                home(&constructs, *reads, sets)
            })
            .collect();
        Self { constructs, homes }
    }

    /// Where a slot's home starts and ends in the text, in the numbers of the survey: every construct
    /// has one for its start and one for its end, and every node has one.
    pub(super) fn range(&self, slot: SlotId) -> (u32, u32) {
        let home = &self.constructs[self.homes[slot as usize]];
        (home.start, home.end)
    }

    fn holds(&self, construct: usize, slot: SlotId) -> bool {
        let outer = &self.constructs[construct];
        let home = &self.constructs[self.homes[slot as usize]];
        outer.start <= home.start && home.end <= outer.end
    }
}

fn home(
    constructs: &[Construct],
    reads: Option<(usize, u32, u32)>,
    sets: &[(usize, u32)],
) -> usize {
    let Some((mut home, first, last)) = reads else {
        return 0;
    };
    while constructs[home].end < last {
        home = constructs[home].parent;
    }
    let mut outer = home;
    while outer != 0 {
        outer = constructs[outer].parent;
        if !constructs[outer].repeats {
            continue;
        }
        let passed = sets.iter().any(|&(construct, at)| {
            let inside = |a: &Construct, b: &Construct| b.start <= a.start && a.end <= b.end;
            at < first
                && inside(&constructs[construct], &constructs[outer])
                && construct != outer
                && inside(&constructs[home], &constructs[construct])
        });
        if !passed {
            home = outer;
        }
    }
    home
}

struct Survey {
    constructs: Vec<Construct>,
    now: u32,
    /// For each slot: the construct of its first read, and where the first and the last are.
    reads: Vec<Option<(usize, u32, u32)>>,
    /// For each slot: the constructs and the places of its writes.
    sets: Vec<Vec<(usize, u32)>>,
    at: usize,
}

impl Survey {
    fn enter(&mut self, repeats: bool, inside: impl FnOnce(&mut Self)) {
        let parent = self.at;
        self.at = self.constructs.len();
        self.constructs.push(Construct {
            parent,
            start: self.now,
            end: u32::MAX,
            repeats,
        });
        self.now += 1;
        inside(self);
        let me = self.at;
        self.constructs[me].end = self.now;
        self.now += 1;
        self.at = parent;
    }

    fn block(&mut self, nodes: &[Node]) {
        for node in nodes {
            self.now += 1;
            match node {
                Node::Get { slot, .. } => {
                    let read = &mut self.reads[*slot as usize];
                    let (construct, first, _) = read.unwrap_or((self.at, self.now, self.now));
                    *read = Some((construct, first, self.now));
                }
                Node::Set { slot, .. } => {
                    self.sets[*slot as usize].push((self.at, self.now));
                }
                Node::If { accept, reject, .. } => {
                    self.enter(false, |s| s.block(accept));
                    self.enter(false, |s| s.block(reject));
                }
                Node::Switch { cases, .. } => self.enter(false, |s| {
                    for case in cases {
                        s.enter(false, |s| s.block(&case.body));
                    }
                }),
                Node::Loop {
                    body, continuing, ..
                } => self.enter(true, |s| {
                    s.enter(false, |s| s.block(body));
                    s.enter(false, |s| s.block(continuing));
                }),
                Node::Scope { body, .. } => self.enter(false, |s| s.block(body)),
                _ => {}
            }
        }
    }
}

/// A construct that the walk is in.
struct Inside {
    construct: usize,
    label: Option<Label>,
    /// Whether lanes that entered it may be missing here.
    partial: bool,
}

struct Walk<'a> {
    homes: &'a Homes,
    values: Vec<bool>,
    slots: Vec<bool>,
    masked: Vec<bool>,
    /// For each loop, by its label, whether lanes leave it one by one.
    loops: Vec<bool>,
    /// For each loop, by its label, the constructs around it that lanes leave one by one from inside it:
    /// in its second round, those constructs have lost lanes already.
    escapes: Vec<Vec<Label>>,
    stack: Vec<Inside>,
    /// The next construct, in the order of the survey.
    next: usize,
    changed: bool,
}

impl Walk<'_> {
    fn construct(&mut self, label: Option<Label>, partial: bool, inside: impl FnOnce(&mut Self)) {
        self.stack.push(Inside {
            construct: self.next,
            label,
            partial,
        });
        self.next += 1;
        inside(self);
        self.stack.pop();
    }

    fn varies(&self, id: Id) -> bool {
        self.values[id as usize]
    }

    fn value(&mut self, id: Id, varies: bool) {
        if varies && !self.values[id as usize] {
            self.values[id as usize] = true;
            self.changed = true;
        }
    }

    fn block(&mut self, nodes: &[Node]) {
        for node in nodes {
            self.node(node);
        }
    }

    fn node(&mut self, node: &Node) {
        match node {
            Node::Get {
                result,
                slot,
                index,
                ..
            } => {
                let varies =
                    self.slots[*slot as usize] || index.is_some_and(|index| self.varies(index));
                self.value(*result, varies);
            }
            Node::Set {
                slot, index, value, ..
            } => {
                let masked = self
                    .stack
                    .iter()
                    .skip_while(|inside| self.homes.holds(inside.construct, *slot))
                    .any(|inside| inside.partial);
                self.masked.push(masked);
                let varies =
                    masked || self.varies(*value) || index.is_some_and(|index| self.varies(index));
                if varies && !self.slots[*slot as usize] {
                    self.slots[*slot as usize] = true;
                    self.changed = true;
                }
            }
            Node::Sample(_) | Node::TexelLoad(_) => {
                let mut results = [NONE; 4];
                collect(node, &mut results);
                for id in results.into_iter().filter(|&id| id != NONE) {
                    self.value(id, true);
                }
            }
            Node::If {
                condition,
                accept,
                reject,
            } => {
                let partial = self.varies(*condition);
                self.construct(None, partial, |w| w.block(accept));
                self.construct(None, partial, |w| w.block(reject));
            }
            Node::Switch {
                selector,
                label,
                cases,
            } => {
                let partial = self.varies(*selector);
                self.construct(Some(*label), false, |w| {
                    for case in cases {
                        w.construct(None, partial, |w| w.block(&case.body));
                    }
                });
            }
            Node::Loop {
                label,
                next,
                body,
                continuing,
                break_if,
            } => {
                let partial = self.loops[*label as usize];
                for outer in &self.escapes[*label as usize] {
                    if let Some(inside) = self.stack.iter_mut().rfind(|i| i.label == Some(*outer)) {
                        inside.partial = true;
                    }
                }
                self.construct(Some(*label), partial, |w| {
                    w.construct(Some(*next), false, |w| w.block(body));
                    w.construct(None, false, |w| {
                        w.block(continuing);
                        if break_if.is_some_and(|condition| w.varies(condition)) {
                            w.leave_one_by_one(*label);
                        }
                    });
                });
            }
            Node::Scope { label, body } => {
                self.construct(Some(*label), false, |w| w.block(body));
            }
            Node::Exit(label) => {
                let inner = self.stack.iter().rposition(|i| i.label == Some(*label));
                let at = inner.unwrap_or(0);
                if self.stack[at + 1..].iter().any(|inside| inside.partial) {
                    self.leave_one_by_one(*label);
                }
            }
            Node::Count(_) | Node::Kill | Node::Probe { .. } => {}
            Node::Op { .. }
            | Node::Fetch { .. }
            | Node::Length { .. }
            | Node::Derivative { .. }
            | Node::Query { .. } => {
                let mut varies = false;
                node.operands(|id| varies |= self.values[id as usize]);
                let mut results = [NONE; 4];
                collect(node, &mut results);
                for id in results.into_iter().filter(|&id| id != NONE) {
                    self.value(id, varies);
                }
            }
        }
    }

    /// Some of the lanes leave the construct with this label here, others stay.
    fn leave_one_by_one(&mut self, label: Label) {
        if !self.loops[label as usize] {
            self.loops[label as usize] = true;
            self.changed = true;
        }
        let Some(at) = self.stack.iter().rposition(|i| i.label == Some(label)) else {
            return;
        };
        self.stack[at].partial = true;
        for inside in &self.stack[at + 1..] {
            if let Some(inner) = inside.label
                && !self.escapes[inner as usize].contains(&label)
            {
                self.escapes[inner as usize].push(label);
                self.changed = true;
            }
        }
    }
}

fn collect(node: &Node, results: &mut [Id; 4]) {
    let mut count = 0;
    node.results(|id| {
        results[count] = id;
        count += 1;
    });
}
