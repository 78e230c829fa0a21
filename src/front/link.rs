//! Linking: entry points that come in naga modules of their own, with all that they need, in one module.
//!
//! ```text
//! fragment Module + vertex Module --link--> Module
//! ```
//!
//! Types, resources, constants, pipeline constants and functions that several parts have alike are there
//! once; what is called alike and is not alike gets another name in the later part. What no entry point
//! needs is left behind.

use lodc_passes::operands;
use naga::diagnostic_filter::DiagnosticFilterNode;
use naga::{
    Arena, ArraySize, Block, Constant, EntryPoint, Expression, Function, GlobalVariable, Handle,
    LocalVariable, Module, Override, ShaderStage, Span, Statement, StorageAccess, Type, TypeInner,
};
use std::collections::{BTreeMap, BTreeSet};

/// A module that is linked.
pub(crate) struct Part<'a> {
    /// The module, which is valid.
    pub(crate) module: &'a Module,
    /// Which of its entry points are wanted.
    pub(crate) wanted: &'a dyn Fn(&EntryPoint) -> bool,
    /// Where a span of the module lies in all the texts that the linked module is made from.
    pub(crate) place: &'a dyn Fn(Span) -> Span,
}

/// What two parts declare differently, though they share it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Clash {
    /// What it is, such as "`@group(0) @binding(1)`".
    pub(crate) what: String,
    /// The declaration in the earlier part.
    pub(crate) first: Span,
    /// The declaration in the later part.
    pub(crate) second: Span,
}

/// Links parts. Of an entry point whose name an earlier part has, the name gets the stage behind it:
/// `main_vertex`.
///
/// # Errors
/// When two parts bind different things at the same place, or give a pipeline constant different values.
pub(crate) fn link(parts: &[Part<'_>]) -> Result<Module, Box<Clash>> {
    let mut into = Module::default();
    for part in parts {
        // Once to see what is needed, and once to put it in the order in which the part declares it.
        let mut linker = Linker::new(part, into.clone());
        linker.entries()?;
        let needed = linker.needed();
        let mut linker = Linker::new(part, into);
        linker.in_order(&needed)?;
        linker.entries()?;
        into = linker.into;
    }
    Ok(into)
}

/// The module-scope things of a part that its entry points need.
struct Needed {
    types: Vec<Handle<Type>>,
    constants: Vec<Handle<Constant>>,
    globals: Vec<Handle<GlobalVariable>>,
    functions: Vec<Handle<Function>>,
}

/// Puts one part into a module: each thing when it is first asked for.
struct Linker<'a> {
    part: &'a Part<'a>,
    from: &'a Module,
    into: Module,
    /// Module-scope names of the parts before this one, and those that were made up.
    taken: BTreeSet<String>,
    /// How many functions the parts before this one have.
    earlier: usize,
    /// Every global expression of `into`, by what it is.
    known: BTreeMap<String, Handle<Expression>>,
    types: BTreeMap<Handle<Type>, Handle<Type>>,
    constants: BTreeMap<Handle<Constant>, Handle<Constant>>,
    overrides: BTreeMap<Handle<Override>, Handle<Override>>,
    globals: BTreeMap<Handle<GlobalVariable>, Handle<GlobalVariable>>,
    expressions: BTreeMap<Handle<Expression>, Handle<Expression>>,
    functions: BTreeMap<Handle<Function>, Handle<Function>>,
    filters: BTreeMap<Handle<DiagnosticFilterNode>, Handle<DiagnosticFilterNode>>,
}

type Linked<T> = Result<T, Box<Clash>>;

impl<'a> Linker<'a> {
    fn new(part: &'a Part<'a>, into: Module) -> Self {
        let known = into.global_expressions.iter();
        Self {
            part,
            from: part.module,
            taken: names(&into),
            earlier: into.functions.len(),
            known: known.map(|(at, e)| (format!("{e:?}"), at)).collect(),
            into,
            types: BTreeMap::new(),
            constants: BTreeMap::new(),
            overrides: BTreeMap::new(),
            globals: BTreeMap::new(),
            expressions: BTreeMap::new(),
            functions: BTreeMap::new(),
            filters: BTreeMap::new(),
        }
    }

    fn needed(&self) -> Needed {
        Needed {
            types: self.types.keys().copied().collect(),
            constants: self.constants.keys().copied().collect(),
            globals: self.globals.keys().copied().collect(),
            functions: self.functions.keys().copied().collect(),
        }
    }

    fn in_order(&mut self, needed: &Needed) -> Linked<()> {
        // Shared resources come first: they decide which of two types of one shape is used.
        for global in &needed.globals {
            let binding = self.from.global_variables[*global].binding;
            let bound = |have: &GlobalVariable| binding.is_some() && have.binding == binding;
            if self.into.global_variables.fetch_if(bound).is_some() {
                self.global(*global)?;
            }
        }
        for ty in &needed.types {
            self.ty(*ty)?;
        }
        for constant in &needed.constants {
            self.constant(*constant)?;
        }
        for global in &needed.globals {
            self.global(*global)?;
        }
        for function in &needed.functions {
            self.function(*function)?;
        }
        Ok(())
    }

    fn entries(&mut self) -> Linked<()> {
        let from = self.from;
        for entry in from.entry_points.iter().filter(|e| (self.part.wanted)(e)) {
            let name = match self.taken.contains(&entry.name) {
                true => self.fresh(&format!("{}_{}", entry.name, stage_name(entry.stage))),
                false => entry.name.clone(),
            };
            let mut function = self.body(&entry.function)?;
            function.name = Some(name.clone());
            let mut linked = entry.clone();
            linked.name = name;
            linked.function = function;
            // Other stages than those two keep their own sizes and payloads where they are.
            if let Some(sizes) = &mut linked.workgroup_size_overrides {
                for size in sizes.iter_mut().flatten() {
                    *size = self.global_expression(*size)?;
                }
            }
            let payloads = [&mut linked.task_payload, &mut linked.incoming_ray_payload];
            for variable in payloads.into_iter().flatten() {
                *variable = self.global(*variable)?;
            }
            if let Some(mesh) = &mut linked.mesh_info {
                let sizes = [
                    &mut mesh.max_vertices_override,
                    &mut mesh.max_primitives_override,
                ];
                for size in sizes.into_iter().flatten() {
                    *size = self.global_expression(*size)?;
                }
                mesh.vertex_output_type = self.ty(mesh.vertex_output_type)?;
                mesh.primitive_output_type = self.ty(mesh.primitive_output_type)?;
                mesh.output_variable = self.global(mesh.output_variable)?;
            }
            self.into.entry_points.push(linked);
        }
        if self.into.diagnostic_filter_leaf.is_none()
            && let Some(leaf) = from.diagnostic_filter_leaf
        {
            self.into.diagnostic_filter_leaf = Some(self.filter(leaf));
        }
        Ok(())
    }

    fn place(&self, span: Span) -> Span {
        match span.is_defined() {
            true => (self.part.place)(span),
            false => span,
        }
    }

    /// A module-scope name of this part: its own, or when an earlier part has that, one like it.
    fn name(&mut self, name: &Option<String>) -> Option<String> {
        let name = name.as_ref()?;
        Some(match self.taken.contains(name) {
            true => self.fresh(name),
            false => name.clone(),
        })
    }

    /// A name that nobody has, made of letters: naga's writer puts an underscore behind digits.
    fn fresh(&mut self, name: &str) -> String {
        let mut fresh = name.to_owned();
        let all = names(self.from);
        while self.taken.contains(&fresh) || (fresh != name && all.contains(&fresh)) {
            fresh.push_str(if fresh == name { "_other" } else { "s" });
        }
        self.taken.insert(fresh.clone());
        fresh
    }

    fn ty(&mut self, old: Handle<Type>) -> Linked<Handle<Type>> {
        if let Some(new) = self.types.get(&old) {
            return Ok(*new);
        }
        let mut ty = self.from.types[old].clone();
        match &mut ty.inner {
            TypeInner::Pointer { base, .. } => *base = self.ty(*base)?,
            TypeInner::Array { base, size, .. } | TypeInner::BindingArray { base, size } => {
                *base = self.ty(*base)?;
                if let ArraySize::Pending(length) = size {
                    *length = self.setting(*length)?;
                }
            }
            TypeInner::Struct { members, .. } => {
                for member in members {
                    member.ty = self.ty(member.ty)?;
                }
            }
            _ => {}
        }
        let span = self.place(self.from.types.get_span(old));
        let is_there = self.into.types.get(&ty).is_some();
        if !is_there {
            ty.name = self.name(&ty.name);
        }
        let new = self.into.types.insert(ty, span);
        self.types.insert(old, new);
        let (from, into) = (&self.from.special_types, &mut self.into.special_types);
        for (kind, special) in &from.predeclared_types {
            if *special == old {
                into.predeclared_types.insert(kind.clone(), new);
            }
        }
        for (from, into) in [
            (from.ray_desc, &mut into.ray_desc),
            (from.ray_intersection, &mut into.ray_intersection),
            (from.ray_vertex_return, &mut into.ray_vertex_return),
            (
                from.external_texture_params,
                &mut into.external_texture_params,
            ),
            (
                from.external_texture_transfer_function,
                &mut into.external_texture_transfer_function,
            ),
        ] {
            if from == Some(old) {
                *into = Some(new);
            }
        }
        Ok(new)
    }

    fn global_expression(&mut self, old: Handle<Expression>) -> Linked<Handle<Expression>> {
        if let Some(new) = self.expressions.get(&old) {
            return Ok(*new);
        }
        let mut operands = Vec::new();
        operands::each(&self.from.global_expressions[old], |at| operands.push(at));
        for operand in operands {
            self.global_expression(operand)?;
        }
        let mut expression = self.from.global_expressions[old].clone();
        operands::each_mut(&mut expression, |at| *at = self.expressions[at]);
        self.outside(&mut expression)?;
        let print = format!("{expression:?}");
        let new = match self.known.get(&print) {
            Some(same) => *same,
            None => {
                let span = self.place(self.from.global_expressions.get_span(old));
                let new = self.into.global_expressions.append(expression, span);
                self.known.insert(print, new);
                new
            }
        };
        self.expressions.insert(old, new);
        Ok(new)
    }

    fn constant(&mut self, old: Handle<Constant>) -> Linked<Handle<Constant>> {
        if let Some(new) = self.constants.get(&old) {
            return Ok(*new);
        }
        let mut constant = self.from.constants[old].clone();
        constant.ty = self.ty(constant.ty)?;
        constant.init = self.global_expression(constant.init)?;
        let same = self.into.constants.fetch_if(|have| *have == constant);
        let new = match same {
            Some(same) => same,
            None => {
                constant.name = self.name(&constant.name);
                let span = self.place(self.from.constants.get_span(old));
                self.into.constants.append(constant, span)
            }
        };
        self.constants.insert(old, new);
        Ok(new)
    }

    /// A pipeline constant: the host knows it by its name, or its number, so that it keeps both.
    fn setting(&mut self, old: Handle<Override>) -> Linked<Handle<Override>> {
        if let Some(new) = self.overrides.get(&old) {
            return Ok(*new);
        }
        let mut setting = self.from.overrides[old].clone();
        setting.ty = self.ty(setting.ty)?;
        if let Some(init) = &mut setting.init {
            *init = self.global_expression(*init)?;
        }
        let span = self.place(self.from.overrides.get_span(old));
        let alike = self.into.overrides.fetch_if(|have| {
            (have.id.is_some() && have.id == setting.id)
                || (have.name.is_some() && have.name == setting.name)
        });
        let new = match alike {
            Some(same) if self.into.overrides[same] == setting => same,
            Some(other) => {
                let name = setting.name.as_deref().unwrap_or("override");
                return Err(Box::new(Clash {
                    what: format!("the pipeline constant `{name}`"),
                    first: self.into.overrides.get_span(other),
                    second: span,
                }));
            }
            None => self.into.overrides.append(setting, span),
        };
        self.overrides.insert(old, new);
        Ok(new)
    }

    fn global(&mut self, old: Handle<GlobalVariable>) -> Linked<Handle<GlobalVariable>> {
        if let Some(new) = self.globals.get(&old) {
            return Ok(*new);
        }
        let mut variable = self.from.global_variables[old].clone();
        let span = self.place(self.from.global_variables.get_span(old));
        let bound =
            |have: &GlobalVariable| variable.binding.is_some() && have.binding == variable.binding;
        if let Some(there) = self.into.global_variables.fetch_if(bound)
            && !self.globals.values().any(|own| *own == there)
        {
            let have = &self.into.global_variables[there];
            let fits = same_space(&have.space, &variable.space)
                && alike(&self.into, have.ty, self.from, variable.ty);
            if !fits {
                let at = variable.binding.map(|at| (at.group, at.binding));
                let (group, binding) = at.unwrap_or_default();
                return Err(Box::new(Clash {
                    what: format!("`@group({group}) @binding({binding})`"),
                    first: self.into.global_variables.get_span(there),
                    second: span,
                }));
            }
            let have = self.into.global_variables.get_mut(there);
            if let (
                naga::AddressSpace::Storage { access },
                naga::AddressSpace::Storage { access: more },
            ) = (&mut have.space, variable.space)
            {
                *access |= more & StorageAccess::all();
            }
            // Access chains resolve against the earlier part's type, which has the same shape.
            let ty = have.ty;
            self.pair(variable.ty, ty);
            self.globals.insert(old, there);
            return Ok(there);
        }
        variable.ty = self.ty(variable.ty)?;
        if let Some(init) = &mut variable.init {
            *init = self.global_expression(*init)?;
        }
        variable.name = self.name(&variable.name);
        let new = self.into.global_variables.append(variable, span);
        self.globals.insert(old, new);
        Ok(new)
    }

    /// From now on, a type of this part is one of an earlier part that has its shape, and so are those in it:
    /// what is loaded from a shared resource has the type that the resource has.
    fn pair(&mut self, old: Handle<Type>, new: Handle<Type>) {
        if self.types.insert(old, new).is_some() {
            return;
        }
        let inner = (
            &self.from.types[old].inner,
            self.into.types[new].inner.clone(),
        );
        match inner {
            (TypeInner::Array { base, .. }, TypeInner::Array { base: other, .. })
            | (TypeInner::BindingArray { base, .. }, TypeInner::BindingArray { base: other, .. }) =>
            {
                self.pair(*base, other);
            }
            (
                TypeInner::Struct { members, .. },
                TypeInner::Struct {
                    members: others, ..
                },
            ) => {
                for (member, other) in members.iter().zip(others) {
                    self.pair(member.ty, other.ty);
                }
            }
            _ => {}
        }
    }

    fn filter(&mut self, old: Handle<DiagnosticFilterNode>) -> Handle<DiagnosticFilterNode> {
        if let Some(new) = self.filters.get(&old) {
            return *new;
        }
        let mut node = self.from.diagnostic_filters[old].clone();
        node.parent = node.parent.map(|parent| self.filter(parent));
        let span = self.place(self.from.diagnostic_filters.get_span(old));
        let new = self.into.diagnostic_filters.append(node, span);
        self.filters.insert(old, new);
        new
    }

    fn function(&mut self, old: Handle<Function>) -> Linked<Handle<Function>> {
        if let Some(new) = self.functions.get(&old) {
            return Ok(*new);
        }
        let mut function = self.body(&self.from.functions[old])?;
        let print = unplaced(&function);
        let earlier = self.into.functions.iter().take(self.earlier);
        let same = earlier
            .filter(|(_, have)| have.name == function.name)
            .find(|(_, have)| unplaced(have) == print)
            .map(|(at, _)| at);
        let new = match same {
            Some(same) => same,
            None => {
                function.name = self.name(&function.name);
                let span = self.place(self.from.functions.get_span(old));
                self.into.functions.append(function, span)
            }
        };
        self.functions.insert(old, new);
        Ok(new)
    }

    /// A function over what `into` has; handles within it stay as they are.
    fn body(&mut self, old: &Function) -> Linked<Function> {
        let mut new = Function {
            name: old.name.clone(),
            arguments: old.arguments.clone(),
            result: old.result.clone(),
            local_variables: Arena::new(),
            expressions: Arena::new(),
            named_expressions: old.named_expressions.clone(),
            body: old.body.clone(),
            diagnostic_filter_leaf: old.diagnostic_filter_leaf.map(|leaf| self.filter(leaf)),
        };
        for argument in &mut new.arguments {
            argument.ty = self.ty(argument.ty)?;
        }
        if let Some(result) = &mut new.result {
            result.ty = self.ty(result.ty)?;
        }
        for (at, variable) in old.local_variables.iter() {
            let variable = LocalVariable {
                ty: self.ty(variable.ty)?,
                ..variable.clone()
            };
            let span = self.place(old.local_variables.get_span(at));
            new.local_variables.append(variable, span);
        }
        for (at, expression) in old.expressions.iter() {
            let mut expression = expression.clone();
            self.outside(&mut expression)?;
            let span = self.place(old.expressions.get_span(at));
            new.expressions.append(expression, span);
        }
        let place = |span: Span| self.place(span);
        in_place(&mut new.body, &place);
        self.calls(&mut new.body)?;
        Ok(new)
    }

    /// What an expression names outside its arena.
    fn outside(&mut self, expression: &mut Expression) -> Linked<()> {
        match expression {
            Expression::Constant(constant) => *constant = self.constant(*constant)?,
            Expression::Override(setting) => *setting = self.setting(*setting)?,
            Expression::ZeroValue(ty)
            | Expression::Compose { ty, .. }
            | Expression::AtomicResult { ty, .. }
            | Expression::WorkGroupUniformLoadResult { ty }
            | Expression::SubgroupOperationResult { ty } => *ty = self.ty(*ty)?,
            Expression::GlobalVariable(variable) => *variable = self.global(*variable)?,
            Expression::CallResult(function) => *function = self.function(*function)?,
            _ => {}
        }
        Ok(())
    }

    fn calls(&mut self, block: &mut Block) -> Linked<()> {
        for statement in block.iter_mut() {
            if let Statement::Call { function, .. } = statement {
                *function = self.function(*function)?;
            }
            for inner in blocks_mut(statement) {
                self.calls(inner)?;
            }
        }
        Ok(())
    }
}

/// The module-scope names of a module.
fn names(module: &Module) -> BTreeSet<String> {
    let types = module.types.iter().filter_map(|(_, t)| t.name.clone());
    let constants = module.constants.iter().filter_map(|(_, c)| c.name.clone());
    let overrides = module.overrides.iter().filter_map(|(_, o)| o.name.clone());
    let variables = module.global_variables.iter();
    let variables = variables.filter_map(|(_, v)| v.name.clone());
    let functions = module.functions.iter().filter_map(|(_, f)| f.name.clone());
    let entries = module.entry_points.iter().map(|e| e.name.clone());
    let values = types.chain(constants).chain(overrides);
    values
        .chain(variables)
        .chain(functions)
        .chain(entries)
        .collect()
}

fn stage_name(stage: ShaderStage) -> String {
    format!("{stage:?}").to_lowercase()
}

fn same_space(one: &naga::AddressSpace, other: &naga::AddressSpace) -> bool {
    use naga::AddressSpace::Storage;
    match (one, other) {
        (Storage { .. }, Storage { .. }) => true,
        (one, other) => one == other,
    }
}

/// Whether two types lie in memory alike; what they and their members are called does not count.
fn alike(one: &Module, a: Handle<Type>, other: &Module, b: Handle<Type>) -> bool {
    match (&one.types[a].inner, &other.types[b].inner) {
        (
            TypeInner::Array { base, size, stride },
            TypeInner::Array {
                base: other_base,
                size: other_size,
                stride: other_stride,
            },
        ) => {
            stride == other_stride
                && same_size(size, other_size)
                && alike(one, *base, other, *other_base)
        }
        (
            TypeInner::BindingArray { base, size },
            TypeInner::BindingArray {
                base: other_base,
                size: other_size,
            },
        ) => same_size(size, other_size) && alike(one, *base, other, *other_base),
        (
            TypeInner::Struct { members, span },
            TypeInner::Struct {
                members: others,
                span: other_span,
            },
        ) => {
            span == other_span
                && members.len() == others.len()
                && members
                    .iter()
                    .zip(others)
                    .all(|(m, n)| m.offset == n.offset && alike(one, m.ty, other, n.ty))
        }
        (a, b) => a == b,
    }
}

fn same_size(one: &ArraySize, other: &ArraySize) -> bool {
    !matches!(one, ArraySize::Pending(_)) && one == other
}

/// A function as text, without places.
fn unplaced(function: &Function) -> String {
    let mut bare = function.clone();
    in_place(&mut bare.body, &|_| Span::UNDEFINED);
    format!("{bare:?}")
}

/// Changes the spans of a block's statements.
fn in_place(block: &mut Block, place: &dyn Fn(Span) -> Span) {
    for (statement, span) in block.span_iter_mut() {
        if let Some(span) = span {
            *span = place(*span);
        }
        for inner in blocks_mut(statement) {
            in_place(inner, place);
        }
    }
}

fn blocks_mut(statement: &mut Statement) -> Vec<&mut Block> {
    match statement {
        Statement::Block(block) => vec![block],
        Statement::If { accept, reject, .. } => vec![accept, reject],
        Statement::Switch { cases, .. } => cases.iter_mut().map(|case| &mut case.body).collect(),
        Statement::Loop {
            body, continuing, ..
        } => vec![body, continuing],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front::validate;

    fn parse(text: &str) -> Module {
        naga::front::wgsl::parse_str(text).expect("the test's shader parses")
    }

    /// Links whole modules; the second one's text lies behind the first one's, at 1000.
    fn linked(fragment: &str, vertex: &str) -> Result<Module, Box<Clash>> {
        let behind = |span: Span| {
            span.to_range().map_or(span, |r| {
                Span::new(r.start as u32 + 1000, r.end as u32 + 1000)
            })
        };
        let (fragment, vertex) = (parse(fragment), parse(vertex));
        link(&[
            Part {
                module: &fragment,
                wanted: &|_| true,
                place: &|span| span,
            },
            Part {
                module: &vertex,
                wanted: &|e| e.stage == ShaderStage::Vertex,
                place: &behind,
            },
        ])
    }

    fn text(module: &Module) -> String {
        let info = validate(module).expect("what was linked is valid");
        naga::back::wgsl::write_string(module, &info, naga::back::wgsl::WriterFlags::empty())
            .expect("it can be written")
    }

    const CAMERA: &str = "struct Camera { to_clip: mat4x4f, eye: vec3f }
        @group(0) @binding(0) var<uniform> camera: Camera;
        const TWO = 2.0;
        fn twice(x: f32) -> f32 { return TWO * x; }
        fn unused() -> f32 { return 3.0; }\n";

    #[test]
    fn what_both_have_alike_is_there_once() {
        let fragment = format!(
            "{CAMERA} @fragment fn fs() -> @location(0) vec4f {{ return vec4f(camera.eye, twice(1.0)); }}"
        );
        let vertex = format!(
            "{CAMERA} @vertex fn vs() -> @builtin(position) vec4f {{
                let c = camera; return c.to_clip * vec4f(twice(2.0)); }}
             @fragment fn other() {{}}"
        );
        let module = linked(&fragment, &vertex).unwrap();
        let text = text(&module);
        let entries: Vec<_> = module.entry_points.iter().map(|e| &*e.name).collect();
        assert_eq!(entries, ["fs", "vs"]);
        for once in ["struct Camera", "fn twice", "var<uniform>"] {
            assert_eq!(text.matches(once).count(), 1, "{once}: {text}");
        }
        assert!(!text.contains("unused"), "{text}");
    }

    #[test]
    fn what_is_called_alike_and_is_not_is_kept_apart() {
        let fragment = "struct S { a: f32 } var<private> p: S; fn f() -> f32 { return p.a; }
            @fragment fn main() -> @location(0) vec4f { return vec4f(f()); }";
        let vertex = "struct S { b: vec4f } var<private> p: S; fn f() -> vec4f { return p.b; }
            @vertex fn main() -> @builtin(position) vec4f { return f(); }";
        let module = linked(fragment, vertex).unwrap();
        let text = text(&module);
        for apart in [
            "struct S {",
            "struct S_other {",
            "p: S;",
            "p_other: S_other;",
            "fn f()",
            "fn f_other()",
            "fn main()",
            "fn main_vertex()",
        ] {
            assert!(text.contains(apart), "{apart}: {text}");
        }
    }

    #[test]
    fn a_resource_of_one_shape_is_one_under_two_names() {
        let fragment =
            "struct A { x: vec4f, n: array<f32> } @group(0) @binding(1) var<storage> a: A;
            @fragment fn fs() -> @location(0) vec4f { return a.x * a.n[1]; }";
        let vertex = "struct B { y: vec4f, m: array<f32> } struct I { i: vec4f }
            @group(0) @binding(1) var<storage, read_write> b: B;
            fn first() -> vec4f { let p = &b; (*p).m[0] = 1.0; return (*p).y; }
            @vertex fn vs() -> @builtin(position) vec4f { var i: I; i.i = first(); return i.i; }";
        let module = linked(fragment, vertex).unwrap();
        assert_eq!(module.global_variables.len(), 1);
        let text = text(&module);
        assert!(text.contains("var<storage, read_write> a: A;"), "{text}");
        assert!(!text.contains("struct B"), "{text}");
    }

    #[test]
    fn resources_and_settings_that_differ_clash_at_their_places() {
        let fragment = "@group(0) @binding(0) var<uniform> a: vec4f;
            @fragment fn fs() -> @location(0) vec4f { return a; }";
        let vertex = "@group(0) @binding(0) var<uniform> b: vec3f;
            @vertex fn vs() -> @builtin(position) vec4f { return vec4f(b, 1.0); }";
        let clash = linked(fragment, vertex).unwrap_err();
        assert_eq!(clash.what, "`@group(0) @binding(0)`");
        assert!(clash.first.to_range().unwrap().end < 1000);
        assert!(clash.second.to_range().unwrap().start >= 1000);
        let one =
            "override k: f32 = 1.0; @fragment fn fs() -> @location(0) vec4f { return vec4f(k); }";
        let other = "override k: f32 = 2.0; @vertex fn vs() -> @builtin(position) vec4f { return vec4f(k); }";
        let clash = linked(one, other).unwrap_err();
        assert_eq!(clash.what, "the pipeline constant `k`");
    }

    #[test]
    fn every_span_of_a_later_part_moves() {
        let fragment = "@fragment fn fs() -> @location(0) vec4f { return vec4f(1.0); }";
        let vertex = "struct S { a: vec4f } @group(0) @binding(0) var<uniform> s: S;
            fn f(i: u32) -> vec4f { if i > 1u { return s.a; } return -s.a; }
            @vertex fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f { return f(i); }";
        let module = linked(fragment, vertex).unwrap();
        let late = |span: Span| span.to_range().is_none_or(|r| r.start >= 1000);
        let (f, function) = module.functions.iter().next().unwrap();
        assert!(late(module.functions.get_span(f)) && module.functions.get_span(f).is_defined());
        assert!(
            function
                .expressions
                .iter()
                .all(|(e, _)| late(function.expressions.get_span(e)))
        );
        let mut bodies = vec![&function.body];
        let mut seen = 0;
        while let Some(block) = bodies.pop() {
            for (statement, span) in block.span_iter() {
                seen += usize::from(span.is_defined());
                assert!(late(*span), "{statement:?}");
                bodies.extend(operands::blocks(statement));
            }
        }
        assert!(seen > 2);
    }
}
