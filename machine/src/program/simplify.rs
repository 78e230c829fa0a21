//! Drops what nothing reads.

use super::ir::{Id, Ir, Node};

/// Drops values, stores and branches that no output, probe or exit depends on.
pub(super) fn simplify(ir: &mut Ir) {
    let mut body = std::mem::take(&mut ir.body);
    let mut prologue = std::mem::take(&mut ir.prologue);
    // Which slots anything reads is known only after a round; a store to one that is read only for another
    // dead store goes in the next.
    let mut read = vec![false; ir.slots.len()];
    mark_reads(&prologue, &mut read);
    mark_reads(&body, &mut read);
    loop {
        let mut sweep = Sweep {
            live: vec![false; ir.values.len()],
            read: &read,
            still_read: vec![false; ir.slots.len()],
        };
        for &(output, _) in &ir.outputs {
            sweep.live[output as usize] = true;
        }
        sweep.block(&mut body);
        sweep.block(&mut prologue);
        let still_read = sweep.still_read;
        if still_read == read {
            break;
        }
        read = still_read;
    }
    ir.body = body;
    ir.prologue = prologue;
}

fn mark_reads(nodes: &[Node], read: &mut [bool]) {
    for node in nodes {
        match node {
            Node::Get { slot, .. } => read[*slot as usize] = true,
            Node::If { accept, reject, .. } => {
                mark_reads(accept, read);
                mark_reads(reject, read);
            }
            Node::Switch { cases, .. } => {
                for case in cases {
                    mark_reads(&case.body, read);
                }
            }
            Node::Loop {
                body, continuing, ..
            } => {
                mark_reads(body, read);
                mark_reads(continuing, read);
            }
            Node::Scope { body, .. } => mark_reads(body, read),
            _ => {}
        }
    }
}

struct Sweep<'a> {
    live: Vec<bool>,
    read: &'a [bool],
    still_read: Vec<bool>,
}

impl Sweep<'_> {
    /// From the last node to the first, since values are computed before they are read.
    fn block(&mut self, nodes: &mut Vec<Node>) {
        let mut keep = vec![false; nodes.len()];
        for (node, keep) in nodes.iter_mut().zip(&mut keep).rev() {
            *keep = self.node(node);
        }
        let mut keep = keep.into_iter();
        nodes.retain(|_| keep.next().unwrap_or(true));
    }

    /// Whether a node stays.
    fn node(&mut self, node: &mut Node) -> bool {
        let mut stays = match node {
            Node::Set { slot, .. } => self.read[*slot as usize],
            Node::Probe { .. } | Node::Count(_) | Node::Kill | Node::Exit(_) => true,
            Node::If { accept, reject, .. } => {
                self.block(accept);
                self.block(reject);
                !accept.is_empty() || !reject.is_empty()
            }
            Node::Switch { cases, .. } => {
                for case in cases.iter_mut() {
                    self.block(&mut case.body);
                }
                cases.iter().any(|case| !case.body.is_empty())
            }
            Node::Loop {
                body,
                continuing,
                break_if,
                ..
            } => {
                // It may be here for nothing, but it may also never end.
                if let Some(condition) = break_if {
                    self.live[*condition as usize] = true;
                }
                self.block(continuing);
                self.block(body);
                true
            }
            Node::Scope { body, .. } => {
                self.block(body);
                !body.is_empty()
            }
            _ => false,
        };
        node.results(|id| stays |= self.live[id as usize]);
        if !stays {
            return false;
        }
        match node {
            Node::Sample(sample) => self.drop_results(&mut sample.results),
            Node::TexelLoad(load) => self.drop_results(&mut load.results),
            Node::Query { results, .. } => self.drop_results(results),
            Node::Get { slot, .. } => self.still_read[*slot as usize] = true,
            _ => {}
        }
        let live = &mut self.live;
        node.operands(|id| live[id as usize] = true);
        true
    }

    fn drop_results(&self, results: &mut [Option<Id>]) {
        for result in results {
            *result = result.filter(|&id| self.live[id as usize]);
        }
    }
}
