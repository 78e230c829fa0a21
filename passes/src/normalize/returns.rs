//! Removes early returns: afterwards a function returns at its end alone.
//!
//! Where the statements that follow can move into the other side of an `if`, they do, and no flag is
//! needed. Else a flag says that the function has returned: it guards what follows, and `break` leaves
//! loops and switches on the way.

use naga::{
    Block, Expression, Function, Handle, Literal, LocalVariable, Range, Scalar, Span, Statement,
    SwitchCase, Type, TypeInner,
};

/// Rewrites a function so that its only `return` is its last statement. One that is so
/// already is left alone.
pub(super) fn remove_early(types: &mut naga::UniqueArena<Type>, function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let early = match body.split_last() {
        Some((_, before)) => before.iter().any(may_return) || nested_return(body.last()),
        None => false,
    };
    if !early {
        function.body = body;
        return;
    }
    let mut remover = Remover {
        types,
        function,
        result: None,
        flag: None,
    };
    if let Some(result) = &remover.function.result {
        let ty = result.ty;
        remover.result = Some(remover.local("result", ty));
    }
    let old: Vec<_> = std::mem::take(&mut body).span_into_iter().collect();
    let mut body = remover.sequence(old, After::Nothing);
    let value = remover.result.map(|pointer| {
        let value = remover
            .function
            .expressions
            .append(Expression::Load { pointer }, Span::UNDEFINED);
        body.push(
            Statement::Emit(Range::new_from_bounds(value, value)),
            Span::UNDEFINED,
        );
        value
    });
    body.push(Statement::Return { value }, Span::UNDEFINED);
    function.body = body;
}

fn nested_return(last: Option<&Statement>) -> bool {
    last.is_some_and(|last| !matches!(last, Statement::Return { .. }) && may_return(last))
}

/// Whether a statement or one in its blocks returns.
fn may_return(statement: &Statement) -> bool {
    matches!(statement, Statement::Return { .. })
        || crate::operands::blocks(statement).any(|block| block.iter().any(may_return))
}

/// Whether a `break` in the block leaves the loop or switch around it.
fn breaks(block: &Block) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Break => true,
        Statement::Block(inner) => breaks(inner),
        Statement::If { accept, reject, .. } => breaks(accept) || breaks(reject),
        _ => false,
    })
}

/// Whether control never comes out at the end of a sequence.
fn never_ends<'a>(mut statements: impl DoubleEndedIterator<Item = &'a Statement>) -> bool {
    statements.any(|statement| match statement {
        Statement::Return { .. } | Statement::Break | Statement::Continue => true,
        Statement::Block(inner) => never_ends(inner.iter()),
        Statement::If { accept, reject, .. } => {
            never_ends(accept.iter()) && never_ends(reject.iter())
        }
        Statement::Switch { cases, .. } => cases
            .iter()
            .all(|case| !breaks(&case.body) && (case.fall_through || never_ends(case.body.iter()))),
        Statement::Loop { body, break_if, .. } => break_if.is_none() && !breaks(body),
        _ => false,
    })
}

/// What is executed after a sequence, and so what a `return` in it has to do.
#[derive(Clone, Copy, PartialEq)]
enum After {
    /// Nothing: coming to the end of the sequence is returning.
    Nothing,
    /// Something that the flag guards; coming to the end of the sequence leads there.
    Guarded,
    /// Something that the flag guards; a `break` leads there.
    Break,
    /// Nothing, once a `break` has left the switch or loop around.
    BreakThenNothing,
}

struct Remover<'a> {
    types: &'a mut naga::UniqueArena<Type>,
    function: &'a mut Function,
    /// Pointers to the local variables.
    result: Option<Handle<Expression>>,
    flag: Option<Handle<Expression>>,
}

type Spanned = (Statement, Span);

impl Remover<'_> {
    fn local(&mut self, name: &str, ty: Handle<Type>) -> Handle<Expression> {
        let local = LocalVariable {
            name: Some(name.to_owned()),
            ty,
            init: None,
        };
        let local = self.function.local_variables.append(local, Span::UNDEFINED);
        self.function
            .expressions
            .append(Expression::LocalVariable(local), Span::UNDEFINED)
    }

    /// The flag, false at first as every variable is.
    fn flag(&mut self) -> Handle<Expression> {
        if let Some(flag) = self.flag {
            return flag;
        }
        let bool = Type {
            name: None,
            inner: TypeInner::Scalar(Scalar::BOOL),
        };
        let bool = self.types.insert(bool, Span::UNDEFINED);
        let flag = self.local("returned", bool);
        self.flag = Some(flag);
        flag
    }

    fn leave(
        &mut self,
        block: &mut Block,
        value: Option<Handle<Expression>>,
        after: After,
        span: Span,
    ) {
        if let (Some(pointer), Some(value)) = (self.result, value) {
            block.push(Statement::Store { pointer, value }, span);
        }
        if matches!(after, After::Guarded | After::Break) {
            let pointer = self.flag();
            let value = self
                .function
                .expressions
                .append(Expression::Literal(Literal::Bool(true)), span);
            block.push(Statement::Store { pointer, value }, span);
        }
        if matches!(after, After::Break | After::BreakThenNothing) {
            block.push(Statement::Break, span);
        }
    }

    /// `if returned { accept } else { reject }`.
    fn if_returned(&mut self, block: &mut Block, accept: Block, reject: Block, span: Span) {
        let pointer = self.flag();
        let condition = self
            .function
            .expressions
            .append(Expression::Load { pointer }, span);
        block.push(
            Statement::Emit(Range::new_from_bounds(condition, condition)),
            span,
        );
        block.push(
            Statement::If {
                condition,
                accept,
                reject,
            },
            span,
        );
    }

    fn sequence(&mut self, statements: Vec<Spanned>, after: After) -> Block {
        let mut block = Block::new();
        let mut rest: std::collections::VecDeque<Spanned> = statements.into();
        while let Some((statement, span)) = rest.pop_front() {
            if !may_return(&statement) {
                let jumps = matches!(statement, Statement::Break | Statement::Continue);
                block.push(statement, span);
                if jumps {
                    break;
                }
                continue;
            }
            // Whether control comes out of it in other ways than by returning.
            let leaves = !never_ends(std::iter::once(&statement));
            match statement {
                Statement::Return { value } => {
                    self.leave(&mut block, value, after, span);
                    break;
                }
                Statement::Block(inner) => {
                    for spanned in inner.span_into_iter().collect::<Vec<_>>().into_iter().rev() {
                        rest.push_front(spanned);
                    }
                }
                Statement::If {
                    condition,
                    accept,
                    reject,
                } => {
                    let accept_ends = never_ends(accept.iter());
                    let reject_ends = never_ends(reject.iter());
                    let mut accept: Vec<_> = accept.span_into_iter().collect();
                    let mut reject: Vec<_> = reject.span_into_iter().collect();
                    // Where a return jumps, what follows needs no care; else it moves into the side
                    // that comes to its end.
                    let jumps = matches!(after, After::Break | After::BreakThenNothing);
                    let mut inner = after;
                    if !rest.is_empty() && !jumps {
                        if accept_ends || reject_ends {
                            if !accept_ends {
                                accept.extend(rest.drain(..));
                            } else if !reject_ends {
                                reject.extend(rest.drain(..));
                            } else {
                                rest.clear();
                            }
                        } else {
                            inner = After::Guarded;
                        }
                    }
                    let accept = self.sequence(accept, inner);
                    let reject = self.sequence(reject, inner);
                    let statement = Statement::If {
                        condition,
                        accept,
                        reject,
                    };
                    block.push(statement, span);
                    if !rest.is_empty() && !jumps {
                        let rest = rest.drain(..).collect();
                        let rest = self.sequence(rest, after);
                        self.if_returned(&mut block, Block::new(), rest, span);
                    }
                }
                Statement::Switch { selector, cases } => {
                    if !leaves {
                        rest.clear();
                    }
                    let inner = self.inner(after, rest.is_empty(), leaves);
                    let cases = cases
                        .into_iter()
                        .map(|case| SwitchCase {
                            value: case.value,
                            body: self.sequence(case.body.span_into_iter().collect(), inner),
                            fall_through: case.fall_through,
                        })
                        .collect();
                    block.push(Statement::Switch { selector, cases }, span);
                    if !self.follow(&mut block, &mut rest, after, leaves, span) {
                        break;
                    }
                }
                Statement::Loop {
                    body,
                    continuing,
                    break_if,
                } => {
                    if !leaves {
                        rest.clear();
                    }
                    let inner = self.inner(after, rest.is_empty(), leaves);
                    let body = self.sequence(body.span_into_iter().collect(), inner);
                    let statement = Statement::Loop {
                        body,
                        continuing,
                        break_if,
                    };
                    block.push(statement, span);
                    if !self.follow(&mut block, &mut rest, after, leaves, span) {
                        break;
                    }
                }
                other => unreachable!("{other:?} holds no return"),
            }
        }
        block
    }

    /// What a return in a loop or switch has to do, when that may be `left` in other ways too.
    fn inner(&self, after: After, last: bool, leaves: bool) -> After {
        if !leaves || (last && matches!(after, After::Nothing)) {
            // Whoever comes out has returned.
            match after {
                After::Guarded | After::Break => After::Break,
                After::Nothing | After::BreakThenNothing => After::BreakThenNothing,
            }
        } else {
            After::Break
        }
    }

    /// Goes on after a loop or switch in which there were returns. Returns whether the sequence goes on.
    fn follow(
        &mut self,
        block: &mut Block,
        rest: &mut std::collections::VecDeque<Spanned>,
        after: After,
        leaves: bool,
        span: Span,
    ) -> bool {
        let jump = |block: &mut Block| block.push(Statement::Break, span);
        match after {
            // The returns set the flag, or nothing follows.
            After::Nothing | After::Guarded if rest.is_empty() => {}
            After::Nothing | After::Guarded => {
                let rest = rest.drain(..).collect();
                let rest = self.sequence(rest, after);
                self.if_returned(block, Block::new(), rest, span);
            }
            After::Break | After::BreakThenNothing if !leaves => {
                jump(block);
                return false;
            }
            After::Break | After::BreakThenNothing => {
                let mut accept = Block::new();
                jump(&mut accept);
                self.if_returned(block, accept, Block::new(), span);
            }
        }
        true
    }
}
