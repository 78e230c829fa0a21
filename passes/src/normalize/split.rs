//! Splits local structures and arrays into one variable per part, where every index into them is a
//! constant.

use crate::operands;
use naga::{
    Arena, ArraySize, Block, Expression, Function, Handle, LocalVariable, Module, Range, Span,
    Statement, SwitchCase, Type, TypeInner,
};

/// The most parts that a variable is split into.
const MOST: usize = 64;

/// A split function.
pub(crate) struct Split {
    pub(crate) function: Function,
    /// For each expression the old one; nothing for those that take a whole apart or put it together.
    pub(crate) origins: Vec<Option<Handle<Expression>>>,
    /// For each local variable the old one, and the members that lead to it, such as `.normal`.
    pub(crate) locals: Vec<(Handle<LocalVariable>, String)>,
}

/// A variable or a part of one.
struct Node {
    ty: Handle<Type>,
    local: Handle<LocalVariable>,
    /// The members that lead here.
    path: String,
    /// Whether it cannot be split: something reads it by a dynamic index, or passes its address on.
    whole: bool,
    /// By index, for what can be split.
    parts: Vec<usize>,
    /// What it became, when it is not split.
    new: Option<Handle<LocalVariable>>,
    pointer: Option<Handle<Expression>>,
}

/// Splits the local variables of a function; nothing when there is nothing to split.
pub(crate) fn split(module: &Module, old: &Function) -> Option<Split> {
    let mut variables = old.local_variables.iter();
    let is_aggregate = |ty: Handle<Type>| {
        matches!(
            module.types[ty].inner,
            TypeInner::Struct { .. } | TypeInner::Array { .. }
        )
    };
    if !variables.any(|(_, variable)| is_aggregate(variable.ty)) {
        return None;
    }
    let mut tree = Tree {
        module,
        nodes: Vec::new(),
        roots: Vec::new(),
        of: vec![None; old.expressions.len()],
    };
    for (local, variable) in old.local_variables.iter() {
        let mut room = MOST;
        let root = tree.node(variable.ty, local, String::new(), &mut room);
        tree.roots.push(root);
    }
    tree.read(old);
    for root in tree.roots.clone() {
        tree.settle(root, false);
    }
    if tree.roots.iter().all(|root| tree.is_whole(*root)) {
        return None;
    }
    let mut splitter = Splitter {
        tree,
        old,
        new: Arena::new(),
        origins: Vec::new(),
        locals: Arena::new(),
        local_origins: Vec::new(),
        map: vec![None; old.expressions.len()],
        pending: None,
        out: Block::new(),
    };
    for root in splitter.tree.roots.clone() {
        let local = splitter.tree.nodes[root].local;
        let init = old.local_variables[local].init;
        let init = init.map(|init| splitter.initialiser(init));
        splitter.variables(root, init);
    }
    splitter.statements(&old.body);
    splitter.flush();
    let mut named = naga::FastIndexMap::default();
    for (value, name) in &old.named_expressions {
        if let Some(new) = splitter.map[value.index()] {
            named.insert(new, name.clone());
        }
    }
    Some(Split {
        function: Function {
            name: old.name.clone(),
            arguments: old.arguments.clone(),
            result: old.result.clone(),
            local_variables: splitter.locals,
            expressions: splitter.new,
            named_expressions: named,
            body: splitter.out,
            diagnostic_filter_leaf: old.diagnostic_filter_leaf,
        },
        origins: splitter.origins,
        locals: splitter.local_origins,
    })
}

struct Tree<'a> {
    module: &'a Module,
    nodes: Vec<Node>,
    roots: Vec<usize>,
    /// For each old expression that points to a variable or a part of one, which.
    of: Vec<Option<usize>>,
}

impl Tree<'_> {
    fn node(
        &mut self,
        ty: Handle<Type>,
        local: Handle<LocalVariable>,
        path: String,
        room: &mut usize,
    ) -> usize {
        let at = self.nodes.len();
        self.nodes.push(Node {
            ty,
            local,
            path: path.clone(),
            whole: true,
            parts: Vec::new(),
            new: None,
            pointer: None,
        });
        let parts: Vec<(Handle<Type>, String)> = match &self.module.types[ty].inner {
            TypeInner::Struct { members, .. } => members
                .iter()
                .enumerate()
                .map(|(i, member)| {
                    let name = member.name.clone().unwrap_or_else(|| format!("member{i}"));
                    (member.ty, format!("{path}.{name}"))
                })
                .collect(),
            TypeInner::Array {
                base,
                size: ArraySize::Constant(size),
                ..
            } if size.get() as usize <= *room => (0..size.get())
                .map(|i| (*base, format!("{path}.{i}")))
                .collect(),
            _ => Vec::new(),
        };
        if !parts.is_empty() && parts.len() <= *room {
            *room -= parts.len();
            self.nodes[at].whole = false;
            for (ty, path) in parts {
                let part = self.node(ty, local, path, room);
                self.nodes[at].parts.push(part);
            }
        }
        at
    }

    fn is_whole(&self, node: usize) -> bool {
        self.nodes[node].whole
    }

    /// Reads off a function what cannot be split.
    fn read(&mut self, function: &Function) {
        for (value, expression) in function.expressions.iter() {
            match *expression {
                Expression::LocalVariable(local) => {
                    self.of[value.index()] = Some(self.roots[local.index()]);
                }
                Expression::AccessIndex { base, index } => {
                    if let Some(node) = self.of[base.index()] {
                        // Into a vector, a matrix or what is too large, there is no part to lead to.
                        self.of[value.index()] =
                            self.nodes[node].parts.get(index as usize).copied();
                    }
                }
                Expression::Load { .. } => {}
                Expression::Access { base, index } => {
                    self.keep_whole(base);
                    self.keep_whole(index);
                }
                ref other => operands::each(other, |operand| self.keep_whole(operand)),
            }
        }
        operands::walk(&function.body, &mut |statement| match statement {
            Statement::Store { .. } => {}
            other => operands::each_of_statement(other, |operand| self.keep_whole(operand)),
        });
    }

    /// What lies in something whole is no variable of its own.
    fn settle(&mut self, node: usize, inside: bool) {
        self.nodes[node].whole |= inside;
        let whole = self.nodes[node].whole;
        for part in self.nodes[node].parts.clone() {
            self.settle(part, whole);
        }
    }

    fn keep_whole(&mut self, pointer: Handle<Expression>) {
        if let Some(node) = self.of[pointer.index()] {
            self.nodes[node].whole = true;
        }
    }
}

struct Splitter<'a> {
    tree: Tree<'a>,
    old: &'a Function,
    new: Arena<Expression>,
    origins: Vec<Option<Handle<Expression>>>,
    locals: Arena<LocalVariable>,
    local_origins: Vec<(Handle<LocalVariable>, String)>,
    map: Vec<Option<Handle<Expression>>>,
    pending: Option<(Handle<Expression>, Handle<Expression>)>,
    out: Block,
}

impl Splitter<'_> {
    /// Makes the variables of a node.
    fn variables(&mut self, node: usize, init: Option<Handle<Expression>>) {
        let Node {
            ty,
            local,
            ref path,
            whole,
            ..
        } = self.tree.nodes[node];
        let variable = &self.old.local_variables[local];
        if !whole {
            for (index, part) in self.tree.nodes[node].parts.clone().into_iter().enumerate() {
                let init = init.map(|whole| self.part(whole, index, self.tree.nodes[part].ty));
                self.variables(part, init);
            }
            return;
        }
        let name = variable
            .name
            .as_ref()
            .map(|name| format!("{name}{path}").replace('.', "_"));
        let copy = LocalVariable { name, ty, init };
        let span = self.old.local_variables.get_span(local);
        let new = self.locals.append(copy, span);
        self.local_origins.push((local, path.clone()));
        self.tree.nodes[node].new = Some(new);
    }

    fn append(
        &mut self,
        expression: Expression,
        old: Option<Handle<Expression>>,
    ) -> Handle<Expression> {
        let emitted = !expression.needs_pre_emit();
        if !emitted {
            self.flush();
        }
        let span = old.map_or(Span::UNDEFINED, |old| self.old.expressions.get_span(old));
        let new = self.new.append(expression, span);
        self.origins.push(old);
        if emitted {
            self.pending = Some((self.pending.map_or(new, |(first, _)| first), new));
        }
        new
    }

    fn flush(&mut self) {
        if let Some((first, last)) = self.pending.take() {
            let range = Range::new_from_bounds(first, last);
            self.out.push(Statement::Emit(range), Span::UNDEFINED);
        }
    }

    fn initialiser(&mut self, old: Handle<Expression>) -> Handle<Expression> {
        let copy = operands::map(&self.old.expressions[old], |operand| {
            self.initialiser(operand)
        });
        self.origins.push(Some(old));
        self.new.append(copy, self.old.expressions.get_span(old))
    }

    /// A part of an initial value, of that type. Not every writer takes constants apart where a variable is made, so it
    /// is done here.
    fn part(
        &mut self,
        whole: Handle<Expression>,
        index: usize,
        ty: Handle<Type>,
    ) -> Handle<Expression> {
        let part = match &self.new[whole] {
            Expression::Compose { components, .. } => return components[index],
            Expression::ZeroValue(_) => Expression::ZeroValue(ty),
            Expression::Constant(constant) => {
                let whole = self.tree.module.constants[*constant].init;
                let whole = self.constant(whole);
                return self.part(whole, index, ty);
            }
            _ => Expression::AccessIndex {
                base: whole,
                index: index as u32,
            },
        };
        self.origins.push(None);
        self.new.append(part, Span::UNDEFINED)
    }

    /// A copy of a constant of the module.
    fn constant(&mut self, value: Handle<Expression>) -> Handle<Expression> {
        let expressions = &self.tree.module.global_expressions;
        let copy = operands::map(&expressions[value], |operand| self.constant(operand));
        self.origins.push(None);
        self.new.append(copy, expressions.get_span(value))
    }

    /// The pointer to a variable that is not split further.
    fn pointer(&mut self, node: usize) -> Handle<Expression> {
        if let Some(pointer) = self.tree.nodes[node].pointer {
            return pointer;
        }
        let Some(local) = self.tree.nodes[node].new else {
            unreachable!("only what is not split is pointed to");
        };
        let pointer = self.append(Expression::LocalVariable(local), None);
        self.tree.nodes[node].pointer = Some(pointer);
        pointer
    }

    fn get(&mut self, old: Handle<Expression>) -> Handle<Expression> {
        if let Some(new) = self.map[old.index()] {
            return new;
        }
        if let Some(node) = self.tree.of[old.index()]
            && self.is_variable(node)
        {
            return self.pointer(node);
        }
        let copy = operands::map(&self.old.expressions[old], |operand| self.get(operand));
        let new = self.append(copy, Some(old));
        if self.old.expressions[old].needs_pre_emit() {
            self.map[old.index()] = Some(new);
        }
        new
    }

    /// Whether a node has a variable of its own.
    fn is_variable(&self, node: usize) -> bool {
        self.tree.nodes[node].new.is_some()
    }

    /// Whether a node lies in, or is, something that is split.
    fn is_split(&self, node: usize) -> bool {
        !self.tree.nodes[node].whole && self.tree.nodes[node].new.is_none()
    }

    fn load(&mut self, node: usize, old: Option<Handle<Expression>>) -> Handle<Expression> {
        if self.is_variable(node) {
            let pointer = self.pointer(node);
            return self.append(Expression::Load { pointer }, old);
        }
        let ty = self.tree.nodes[node].ty;
        let parts = self.tree.nodes[node].parts.clone();
        let components = parts
            .into_iter()
            .map(|part| self.load(part, None))
            .collect();
        self.append(Expression::Compose { ty, components }, old)
    }

    fn store(&mut self, node: usize, value: Handle<Expression>, span: Span) {
        if self.is_variable(node) {
            let pointer = self.pointer(node);
            self.flush();
            self.out.push(Statement::Store { pointer, value }, span);
            return;
        }
        for (index, part) in self.tree.nodes[node].parts.clone().into_iter().enumerate() {
            let index = index as u32;
            let value = self.append(Expression::AccessIndex { base: value, index }, None);
            self.store(part, value, span);
        }
    }

    fn nested(&mut self, old: &Block) -> Block {
        self.flush();
        let outside = std::mem::take(&mut self.out);
        self.statements(old);
        self.flush();
        std::mem::replace(&mut self.out, outside)
    }

    fn statements(&mut self, old: &Block) {
        for (statement, span) in old.span_iter() {
            let copy = match statement {
                Statement::Emit(range) => {
                    for value in range.clone() {
                        self.emit(value);
                    }
                    continue;
                }
                Statement::Store { pointer, value } => {
                    let value = self.get(*value);
                    match self.tree.of[pointer.index()] {
                        Some(node) if self.is_split(node) || self.is_variable(node) => {
                            self.store(node, value, *span);
                        }
                        _ => {
                            let pointer = self.get(*pointer);
                            self.flush();
                            self.out.push(Statement::Store { pointer, value }, *span);
                        }
                    }
                    continue;
                }
                Statement::Block(inner) => Statement::Block(self.nested(inner)),
                Statement::If {
                    condition,
                    accept,
                    reject,
                } => Statement::If {
                    condition: self.get(*condition),
                    accept: self.nested(accept),
                    reject: self.nested(reject),
                },
                Statement::Switch { selector, cases } => Statement::Switch {
                    selector: self.get(*selector),
                    cases: cases
                        .iter()
                        .map(|case| SwitchCase {
                            value: case.value,
                            body: self.nested(&case.body),
                            fall_through: case.fall_through,
                        })
                        .collect(),
                },
                Statement::Loop {
                    body,
                    continuing,
                    break_if,
                } => {
                    let body = self.nested(body);
                    self.flush();
                    let outside = std::mem::take(&mut self.out);
                    self.statements(continuing);
                    let break_if = break_if.map(|condition| self.get(condition));
                    self.flush();
                    let continuing = std::mem::replace(&mut self.out, outside);
                    Statement::Loop {
                        body,
                        continuing,
                        break_if,
                    }
                }
                other => {
                    let mut copy = other.clone();
                    operands::each_mut_of_statement(
                        &mut copy,
                        |operand| *operand = self.get(*operand),
                        |_| {},
                    );
                    if let Some(result) = operands::result(other) {
                        self.flush();
                        let new = self.append(self.old.expressions[result].clone(), Some(result));
                        self.pending = None;
                        self.map[result.index()] = Some(new);
                        operands::each_mut_of_statement(&mut copy, |_| {}, |r| *r = new);
                    }
                    copy
                }
            };
            self.flush();
            self.out.push(copy, *span);
        }
    }

    fn emit(&mut self, old: Handle<Expression>) {
        // Pointers to what is split, and to the variables that it became, are made where they are used.
        if let Some(node) = self.tree.of[old.index()]
            && (self.is_split(node) || self.is_variable(node))
        {
            return;
        }
        let new = match self.old.expressions[old] {
            Expression::Load { pointer }
                if let Some(node) = self.tree.of[pointer.index()]
                    && (self.is_split(node) || self.is_variable(node)) =>
            {
                self.load(node, Some(old))
            }
            ref other => {
                let copy = operands::map(other, |operand| self.get(operand));
                self.append(copy, Some(old))
            }
        };
        self.map[old.index()] = Some(new);
    }
}
