//! Where the values of a function are computed, where they are in scope, and who reads them.

use crate::operands::{self, User};
use naga::{Block, Expression, Function, Handle, Statement};

/// The places of a function's values. A place is a number that grows along the text of the body.
#[derive(Debug)]
pub(crate) struct Places {
    /// For each expression: the place after which it can be read, and the end of its scope.
    scope: Vec<(u32, u32)>,
    /// For each statement in the order of [`operands::walk`]: where it reads its operands.
    statements: Vec<u32>,
    users: Vec<Vec<User>>,
}

impl Places {
    pub(crate) fn of(function: &Function) -> Self {
        // What needs no `Emit` can be read everywhere; what is never emitted, nowhere.
        let scope = function
            .expressions
            .iter()
            .map(|(_, e)| {
                if e.needs_pre_emit() {
                    (0, u32::MAX)
                } else {
                    (u32::MAX, 0)
                }
            })
            .collect();
        let mut walk = Walk {
            places: Self {
                scope,
                statements: Vec::new(),
                users: operands::users(function),
            },
            open: Vec::new(),
            now: 0,
        };
        walk.block(&function.body);
        walk.places
    }

    /// What reads a value.
    pub(crate) fn users(&self, value: Handle<Expression>) -> &[User] {
        &self.users[value.index()]
    }

    /// Where a user reads its operands.
    fn place(&self, user: User) -> u32 {
        match user {
            User::Value(value) => self.scope[value.index()].0,
            User::Statement(number) => self.statements[number],
        }
    }

    /// Whether `value` can be read where `user` reads.
    pub(crate) fn reaches(&self, value: Handle<Expression>, user: User) -> bool {
        let (from, until) = self.scope[value.index()];
        let place = self.place(user);
        from < place && place < until
    }
}

struct Walk {
    places: Places,
    /// Values computed in the open blocks.
    open: Vec<Handle<Expression>>,
    now: u32,
}

impl Walk {
    fn step(&mut self) -> u32 {
        self.now += 1;
        self.now
    }

    fn block(&mut self, block: &Block) {
        let open = self.open.len();
        self.statements(block);
        let end = self.step();
        for value in self.open.drain(open..) {
            self.places.scope[value.index()].1 = end;
        }
    }

    fn statements(&mut self, block: &Block) {
        for statement in block {
            let number = self.places.statements.len();
            let now = self.step();
            self.places.statements.push(now);
            match statement {
                Statement::Emit(range) => {
                    for value in range.clone() {
                        self.computed(value);
                    }
                }
                Statement::Loop {
                    body, continuing, ..
                } => {
                    // The continuing block may read what the body computed before its first
                    // `continue`; nothing new should, so its scope ends with the body.
                    self.block(body);
                    let open = self.open.len();
                    self.statements(continuing);
                    self.places.statements[number] = self.step();
                    let end = self.step();
                    for value in self.open.drain(open..) {
                        self.places.scope[value.index()].1 = end;
                    }
                }
                other => {
                    for inner in operands::blocks(other) {
                        self.block(inner);
                    }
                }
            }
            if let Some(result) = operands::result(statement) {
                self.computed(result);
            }
        }
    }

    fn computed(&mut self, value: Handle<Expression>) {
        self.places.scope[value.index()] = (self.step(), u32::MAX);
        self.open.push(value);
    }
}
