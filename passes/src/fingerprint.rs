//! What a module does, as a hash that is the same on every machine: names, spans and unused arena
//! entries do not enter it.

use crate::operands;
use crate::shader::Fingerprint;
use naga::{
    AddressSpace, Block, Expression, Function, GlobalVariable, Handle, ImageQuery, LocalVariable,
    Module, Override, SampleLevel, Statement, StorageAccess, Type, TypeInner,
};
use std::hash::{Hash, Hasher};
use std::mem::discriminant;

/// A hash of words, stable across runs and machines: two multiplicative hashes with different odd
/// constants, side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Words {
    low: u64,
    high: u64,
}

impl Words {
    pub(crate) fn new() -> Self {
        Self {
            low: 0xcbf2_9ce4_8422_2325,
            high: 0x9ae1_6a3b_2f90_404f,
        }
    }

    fn word(&mut self, word: u64) {
        self.low = (self.low ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.low ^= self.low >> 29;
        self.high = (self.high.rotate_left(23) ^ word).wrapping_mul(0xff51_afd7_ed55_8ccd);
        self.high ^= self.high >> 32;
    }

    pub(crate) fn bytes16(self) -> [u8; 16] {
        let mut bytes = [0; 16];
        bytes[..8].copy_from_slice(&self.low.to_be_bytes());
        bytes[8..].copy_from_slice(&self.high.to_be_bytes());
        bytes
    }
}

/// Derived `Hash` of naga's small enums lands here; everything is widened, so that the width of a
/// `usize` does not matter.
impl Hasher for Words {
    fn finish(&self) -> u64 {
        let mut mixed = self.low ^ self.high.rotate_left(32);
        mixed = (mixed ^ (mixed >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        mixed ^ (mixed >> 33)
    }
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.word(u64::from_le_bytes(word));
        }
        self.word(bytes.len() as u64);
    }
    fn write_u8(&mut self, n: u8) {
        self.word(n.into());
    }
    fn write_u16(&mut self, n: u16) {
        self.word(n.into());
    }
    fn write_u32(&mut self, n: u32) {
        self.word(n.into());
    }
    fn write_u64(&mut self, n: u64) {
        self.word(n);
    }
    fn write_usize(&mut self, n: usize) {
        self.word(n as u64);
    }
    fn write_i32(&mut self, n: i32) {
        self.word(n as u64);
    }
    fn write_i64(&mut self, n: i64) {
        self.word(n as u64);
    }
    fn write_isize(&mut self, n: isize) {
        self.word(n as u64);
    }
}

/// Hashes of what a module declares, by content.
#[derive(Debug)]
pub(crate) struct Declared {
    types: Vec<u64>,
    constants: Vec<u64>,
    overrides: Vec<u64>,
    globals: Vec<u64>,
    /// For each global variable, whether what it holds never changes while the shader runs.
    constant_memory: Vec<bool>,
}

impl Declared {
    pub(crate) fn of(module: &Module) -> Self {
        let mut declared = Self {
            types: Vec::with_capacity(module.types.len()),
            constants: Vec::new(),
            overrides: Vec::new(),
            globals: Vec::new(),
            constant_memory: Vec::new(),
        };
        for (_, ty) in module.types.iter() {
            let hash = declared.of_type(module, ty);
            declared.types.push(hash);
        }
        // An override is known by what the host sets it by; its default may be an expression over
        // other overrides, which are declared before it.
        let mut constants = vec![0; module.global_expressions.len()];
        for (_, o) in module.overrides.iter() {
            let mut words = Words::new();
            match o.id {
                Some(id) => id.hash(&mut words),
                None => o.name.hash(&mut words),
            }
            words.word(declared.ty(o.ty));
            o.init.is_some().hash(&mut words);
            declared.overrides.push(words.finish());
        }
        for (handle, expression) in module.global_expressions.iter() {
            // Constants refer to expressions before them only.
            while let Some((_, constant)) = module.constants.iter().nth(declared.constants.len())
                && constant.init < handle
            {
                declared.constants.push(constants[constant.init.index()]);
            }
            constants[handle.index()] =
                declared.expression(expression, |operand| constants[operand.index()]);
        }
        for (_, constant) in module.constants.iter().skip(declared.constants.len()) {
            declared.constants.push(constants[constant.init.index()]);
        }
        for (_, global) in module.global_variables.iter() {
            let GlobalVariable {
                name: _,
                space,
                binding,
                ty,
                init,
                memory_decorations,
            } = global;
            let mut words = Words::new();
            (space, binding, memory_decorations).hash(&mut words);
            words.word(declared.ty(*ty));
            words.word(init.map_or(0, |init| constants[init.index()]));
            declared.globals.push(words.finish());
            declared.constant_memory.push(match space {
                AddressSpace::Uniform | AddressSpace::Immediate => true,
                AddressSpace::Storage { access } => !access.contains(StorageAccess::STORE),
                _ => false,
            });
        }
        declared
    }

    /// Takes in a type that was added to the module.
    pub(crate) fn add_type(&mut self, module: &Module, ty: Handle<Type>) {
        let hash = self.of_type(module, &module.types[ty]);
        self.types.push(hash);
    }

    fn of_type(&self, module: &Module, ty: &Type) -> u64 {
        let mut words = Words::new();
        match &ty.inner {
            TypeInner::Pointer { base, space } => (1, self.ty(*base), space).hash(&mut words),
            TypeInner::Array { base, size, stride } => {
                (2, self.ty(*base), stride).hash(&mut words);
                match size {
                    naga::ArraySize::Pending(o) => module.overrides[*o].name.hash(&mut words),
                    size => size.hash(&mut words),
                }
            }
            TypeInner::Struct { members, span } => {
                (3, span).hash(&mut words);
                for member in members {
                    (self.ty(member.ty), &member.binding, member.offset).hash(&mut words);
                }
            }
            TypeInner::BindingArray { base, size } => {
                (4, self.ty(*base)).hash(&mut words);
                discriminant(size).hash(&mut words);
                if let naga::ArraySize::Constant(size) = size {
                    size.hash(&mut words);
                }
            }
            other => other.hash(&mut words),
        }
        words.finish()
    }

    pub(crate) fn ty(&self, ty: Handle<Type>) -> u64 {
        self.types[ty.index()]
    }

    fn over(&self, o: Handle<Override>) -> u64 {
        self.overrides[o.index()]
    }

    /// The hash of an expression over those of its operands. A local variable is its handle.
    pub(crate) fn expression(
        &self,
        expression: &Expression,
        of: impl Fn(Handle<Expression>) -> u64,
    ) -> u64 {
        let mut words = Words::new();
        let w = &mut words;
        discriminant(expression).hash(w);
        match expression {
            Expression::Literal(literal) => self.literal(literal, w),
            Expression::Constant(constant) => {
                w.word(self.constants.get(constant.index()).copied().unwrap_or(0));
            }
            Expression::Override(o) => w.word(self.over(*o)),
            Expression::ZeroValue(ty) | Expression::Compose { ty, .. } => w.word(self.ty(*ty)),
            Expression::AccessIndex { index, .. } => index.hash(w),
            Expression::Splat { size, .. } => size.hash(w),
            Expression::Swizzle { size, pattern, .. } => {
                size.hash(w);
                for component in &pattern[..*size as usize] {
                    w.word(*component as u64);
                }
            }
            Expression::FunctionArgument(index) => index.hash(w),
            Expression::GlobalVariable(global) => w.word(self.globals[global.index()]),
            Expression::LocalVariable(local) => w.word(local.index() as u64),
            Expression::ImageSample {
                gather,
                array_index,
                offset,
                level,
                depth_ref,
                clamp_to_edge,
                ..
            } => {
                gather.map(|component| component as u8).hash(w);
                (array_index.is_some(), offset.is_some()).hash(w);
                (depth_ref.is_some(), clamp_to_edge).hash(w);
                discriminant::<SampleLevel>(level).hash(w);
            }
            Expression::ImageLoad {
                array_index,
                sample,
                level,
                ..
            } => (array_index.is_some(), sample.is_some(), level.is_some()).hash(w),
            Expression::ImageQuery { query, .. } => {
                discriminant(query).hash(w);
                if let ImageQuery::Size { level } = query {
                    level.is_some().hash(w);
                }
            }
            Expression::Unary { op, .. } => op.hash(w),
            Expression::Binary { op, .. } => op.hash(w),
            Expression::Derivative { axis, ctrl, .. } => (axis, ctrl).hash(w),
            Expression::Relational { fun, .. } => fun.hash(w),
            Expression::Math { fun, .. } => fun.hash(w),
            Expression::As { kind, convert, .. } => (kind, convert).hash(w),
            Expression::AtomicResult { ty, comparison } => {
                w.word(self.ty(*ty));
                comparison.hash(w);
            }
            Expression::WorkGroupUniformLoadResult { ty }
            | Expression::SubgroupOperationResult { ty } => w.word(self.ty(*ty)),
            Expression::RayQueryVertexPositions { committed, .. }
            | Expression::RayQueryGetIntersection { committed, .. } => committed.hash(w),
            Expression::CooperativeLoad {
                columns,
                rows,
                role,
                data,
            } => (columns, rows, role, data.row_major).hash(w),
            Expression::Access { .. }
            | Expression::Load { .. }
            | Expression::Select { .. }
            | Expression::CallResult(_)
            | Expression::ArrayLength(_)
            | Expression::RayQueryProceedResult
            | Expression::SubgroupBallotResult
            | Expression::CooperativeMultiplyAdd { .. } => {}
        }
        operands::each(expression, |operand| words.word(of(operand)));
        words.finish()
    }

    fn literal(&self, literal: &naga::Literal, w: &mut Words) {
        use naga::Literal as L;
        discriminant(literal).hash(w);
        match *literal {
            L::F64(n) => n.to_bits().hash(w),
            L::F32(n) => n.to_bits().hash(w),
            L::F16(n) => n.to_bits().hash(w),
            L::U16(n) => n.hash(w),
            L::I16(n) => n.hash(w),
            L::U32(n) => n.hash(w),
            L::I32(n) => n.hash(w),
            L::U64(n) => n.hash(w),
            L::I64(n) => n.hash(w),
            L::Bool(b) => b.hash(w),
            L::AbstractInt(n) => n.hash(w),
            L::AbstractFloat(n) => n.to_bits().hash(w),
        }
    }
}

/// The fingerprint of a module's entry points.
pub(crate) fn of(module: &Module) -> Fingerprint {
    let declared = Declared::of(module);
    let mut words = Words::new();
    for entry in &module.entry_points {
        (entry.stage, entry.early_depth_test, entry.workgroup_size).hash(&mut words);
        take_in(&declared, &entry.function, &mut words);
    }
    Fingerprint(words.bytes16())
}

/// The fingerprint of a function over the declarations of its module.
pub(crate) fn of_function(declared: &Declared, function: &Function) -> Fingerprint {
    let mut words = Words::new();
    take_in(declared, function, &mut words);
    Fingerprint(words.bytes16())
}

fn take_in(declared: &Declared, function: &Function, words: &mut Words) {
    let mut walk = Canonical {
        declared,
        function,
        keys: vec![0; function.expressions.len()],
        locals: vec![0; function.local_variables.len()],
        blocks: 0,
        statements: 0,
        words,
    };
    walk.interface();
    walk.name_locals();
    walk.block(&function.body);
}

/// A walk over a body. A value is known by what it is made of, wherever it is computed: an edit may leave it
/// further out than another order of the same edits does. What depends on its place is known by that too:
/// derivatives and samples by their block, what is loaded from memory that may change by the number of
/// statements before it.
struct Canonical<'a> {
    declared: &'a Declared,
    function: &'a Function,
    /// For each expression, what its users hash; 0 when it was not met.
    keys: Vec<u64>,
    /// For each local variable, what pointers to it hash.
    locals: Vec<u64>,
    /// The number of the block that is walked.
    blocks: u64,
    statements: u64,
    words: &'a mut Words,
}

impl Canonical<'_> {
    fn interface(&mut self) {
        for argument in &self.function.arguments {
            self.words.word(self.declared.ty(argument.ty));
            argument.binding.hash(self.words);
        }
        if let Some(result) = &self.function.result {
            self.words.word(self.declared.ty(result.ty));
            result.binding.hash(self.words);
        }
    }

    /// Numbers local variables in the order in which statements touch them.
    fn name_locals(&mut self) {
        let mut order = Vec::new();
        operands::walk(&self.function.body, &mut |statement| {
            operands::each_of_statement(statement, |operand| {
                order.extend(root(&self.function.expressions, operand));
            });
        });
        let rest = self.function.local_variables.iter().map(|(local, _)| local);
        let mut met = 0;
        for (at, local) in order.iter().copied().chain(rest).enumerate() {
            if self.locals[local.index()] == 0 {
                let mut words = Words::new();
                // What nothing stores to is known by what it begins with.
                met += u64::from(at < order.len());
                words.word(if at < order.len() { met } else { 0 });
                let variable = &self.function.local_variables[local];
                words.word(self.declared.ty(variable.ty));
                if let Some(init) = variable.init {
                    words.word(self.key(init));
                }
                self.locals[local.index()] = words.finish() | 1;
            }
        }
    }

    fn key(&mut self, value: Handle<Expression>) -> u64 {
        if self.keys[value.index()] == 0 {
            // Not emitted, or part of a constant.
            self.keys[value.index()] = self.content(value) | 1;
        }
        self.keys[value.index()]
    }

    fn content(&mut self, value: Handle<Expression>) -> u64 {
        let expression = &self.function.expressions[value];
        if let Expression::LocalVariable(local) = expression {
            return self.locals[local.index()];
        }
        operands::each(expression, |operand| {
            self.key(operand);
        });
        self.declared
            .expression(expression, |operand| self.keys[operand.index()])
    }

    fn computed(&mut self, value: Handle<Expression>, block: u64) {
        let mut words = Words::new();
        words.word(self.content(value));
        match self.function.expressions[value] {
            Expression::Load { pointer } if self.is_constant_memory(pointer) => {}
            Expression::Load { .. } | Expression::ImageLoad { .. } => {
                words.word(block);
                words.word(self.statements);
            }
            Expression::ImageSample { .. } | Expression::Derivative { .. } => words.word(block),
            _ => {}
        }
        self.keys[value.index()] = words.finish() | 1;
    }

    fn block(&mut self, block: &Block) {
        self.blocks += 1;
        let number = self.blocks;
        for statement in block {
            if let Statement::Emit(range) = statement {
                for value in range.clone() {
                    self.computed(value, number);
                }
                continue;
            }
            self.statements += 1;
            discriminant(statement).hash(self.words);
            match statement {
                Statement::Switch { cases, .. } => {
                    for case in cases {
                        (case.value, case.fall_through).hash(self.words);
                    }
                }
                Statement::Atomic { fun, .. } | Statement::ImageAtomic { fun, .. } => {
                    discriminant(fun).hash(self.words);
                }
                Statement::ControlBarrier(barrier) | Statement::MemoryBarrier(barrier) => {
                    barrier.bits().hash(self.words);
                }
                Statement::SubgroupGather { mode, .. } => discriminant(mode).hash(self.words),
                Statement::SubgroupCollectiveOperation {
                    op, collective_op, ..
                } => (op, collective_op).hash(self.words),
                Statement::RayQuery { fun, .. } => discriminant(fun).hash(self.words),
                _ => {}
            }
            // A loop's condition is read at its end, after its blocks computed it.
            let late = matches!(statement, Statement::Loop { .. });
            if !late {
                self.operands(statement);
            }
            for inner in operands::blocks(statement) {
                self.block(inner);
                self.words.word(u64::MAX);
            }
            if late {
                self.operands(statement);
            }
            if let Some(result) = operands::result(statement) {
                self.words.word(self.statements);
                self.keys[result.index()] = self.statements;
            }
        }
    }

    /// Whether a pointer leads into a buffer that never changes while the shader runs.
    fn is_constant_memory(&self, mut pointer: Handle<Expression>) -> bool {
        loop {
            match self.function.expressions[pointer] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => {
                    pointer = base;
                }
                Expression::GlobalVariable(global) => {
                    return self.declared.constant_memory[global.index()];
                }
                _ => return false,
            }
        }
    }

    fn operands(&mut self, statement: &Statement) {
        operands::each_of_statement(statement, |operand| {
            let key = self.key(operand);
            self.words.word(key);
        });
    }
}

/// The local variable that a pointer leads into.
fn root(
    expressions: &naga::Arena<Expression>,
    pointer: Handle<Expression>,
) -> Option<Handle<LocalVariable>> {
    crate::normalize::forward::root(expressions, pointer)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn print(source: &str) -> Fingerprint {
        of(&naga::front::wgsl::parse_str(source).expect("the test's shader parses"))
    }

    #[test]
    fn names_and_layout_do_not_enter_but_numbers_and_bindings_do() {
        let base = print(
            "struct M { rough: f32, metal: f32 }
             @group(0) @binding(0) var<uniform> m: M;
             @fragment fn main() -> @location(0) vec4f { return vec4f(m.rough * 2.0); }",
        );
        let renamed = print(
            "struct Other { a: f32, b: f32 } struct Unused { c: vec4f }
             @group(0) @binding(0) var<uniform> uni : Other;
             // a comment
             @fragment fn shade() -> @location(0) vec4f { let k = uni.a * 2.0; return vec4f(k); }",
        );
        assert_eq!(base, renamed);
        let others = [
            "struct M { rough: f32, metal: f32 }
             @group(0) @binding(0) var<uniform> m: M;
             @fragment fn main() -> @location(0) vec4f { return vec4f(m.rough * 2.5); }",
            "struct M { rough: f32, metal: f32 }
             @group(0) @binding(0) var<uniform> m: M;
             @fragment fn main() -> @location(0) vec4f { return vec4f(m.metal * 2.0); }",
            "struct M { rough: f32, metal: f32 }
             @group(0) @binding(1) var<uniform> m: M;
             @fragment fn main() -> @location(0) vec4f { return vec4f(m.rough * 2.0); }",
            "struct M { rough: f32, metal: f32 }
             @group(0) @binding(0) var<uniform> m: M;
             @fragment fn main() -> @location(1) vec4f { return vec4f(m.rough * 2.0); }",
        ];
        for other in others {
            assert_ne!(base, print(other), "{other}");
        }
    }
}
