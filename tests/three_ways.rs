//! Random shaders, computed in three ways: the source and its normal form one lane at a time by the
//! slow evaluator of the tests, the normal form by the real one. All give the same bits.
//!
//! `SHADERS=100000` tries more of them, `SEED=17` begins elsewhere.

mod reference;

use lodc::eval::lane::{LANES, Mask, Words};
use lodc::eval::machine::{Bindings, Machine, Resource};
use lodc::eval::program::Program;
use lodc_passes::{Facts, PASSES, Shader, normalize};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Module, ScalarKind};
use std::fmt::Write as _;
use std::sync::Arc;

/// How many shaders are tried.
const SHADERS: u64 = 300;

/// How many lanes the slow evaluator runs.
const TRIED: usize = 24;

const LIMIT: usize = 100_000;

#[test]
fn source_and_normal_form_compute_the_same_bits() {
    let number = |name: &str| std::env::var(name).ok().and_then(|n| n.parse().ok());
    let first: u64 = number("SEED").unwrap_or(0);
    for seed in first..first + number("SHADERS").unwrap_or(SHADERS) {
        let source = Author::new(seed).shader();
        let module = naga::front::wgsl::parse_str(&source)
            .unwrap_or_else(|e| panic!("seed {seed}: {}", e.emit_to_string(&source)));
        let valid = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module);
        valid.unwrap_or_else(|e| panic!("seed {seed}: {}", e.emit_to_string(&source)));
        let normal = normalize(&module, None, "fs_main", LIMIT)
            .unwrap_or_else(|e| panic!("seed {seed}: {e}\n{source}"));
        let valid = normal.validate();
        valid.unwrap_or_else(|e| panic!("seed {seed}: {}", e.emit_to_string(&source)));
        let again = normalize(normal.module(), None, "fs_main", LIMIT)
            .unwrap_or_else(|e| panic!("seed {seed}: {e}\n{source}"));
        let fixed = normal.fingerprint() == again.fingerprint();
        assert!(fixed, "seed {seed}: twice\n{source}\n{}", text(&normal));

        let (drawn, kept) = draw(normal.module());
        for lane in 0..TRIED {
            let run = |module: &Module| {
                let arguments = vec![reference::float(x(lane)), reference::int(i(lane))];
                reference::run(module, arguments)
            };
            // What takes too long to say anything about proves nothing.
            let (Ok(wanted), Ok(found)) = (run(&module), run(normal.module())) else {
                continue;
            };
            let wanted = wanted.as_ref().map(reference::bits);
            let found = found.as_ref().map(reference::bits);
            let drawn: Vec<u32> = drawn.iter().map(|words| words[lane]).collect();
            let drawn = kept.has(lane).then_some(drawn);
            assert!(
                wanted == found && found == drawn,
                "seed {seed}, lane {lane}: {wanted:x?}, {found:x?} in normal form, evaluated \
                 {drawn:x?}\n{source}\n{}",
                text(&normal)
            );
        }
    }
}

#[test]
fn passes_keep_random_shaders_valid() {
    let facts = Facts::default();
    for seed in 0..SHADERS {
        let source = Author::new(seed).shader();
        let module = naga::front::wgsl::parse_str(&source)
            .unwrap_or_else(|e| panic!("seed {seed}: {}", e.emit_to_string(&source)));
        let mut shader = normalize(&module, None, "fs_main", LIMIT)
            .unwrap_or_else(|e| panic!("seed {seed}: {e}\n{source}"));
        for step in 0..4 {
            let all: Vec<_> = PASSES
                .iter()
                .flat_map(|pass| {
                    let candidates = pass.candidates(&shader, &facts).into_iter();
                    candidates.map(move |candidate| (pass, candidate))
                })
                .collect();
            let Some((pass, candidate)) = all.get((step * 131 + seed as usize) % all.len().max(1))
            else {
                break;
            };
            let before = text(&shader);
            shader = pass.apply(&shader, candidate);
            if let Err(error) = shader.validate() {
                panic!("seed {seed}: {candidate}: {error:?}\n{before}");
            }
        }
    }
}

fn x(lane: usize) -> f32 {
    lane as f32 * 0.625 - 7.0
}

fn i(lane: usize) -> i32 {
    lane as i32 % 13 - 4
}

fn text(shader: &Shader) -> String {
    let info = shader.validate().expect("it is valid");
    let flags = naga::back::wgsl::WriterFlags::empty();
    naga::back::wgsl::write_string(shader.module(), &info, flags).expect("it is WGSL")
}

/// What the evaluator computes for a block of lanes, and which lanes are kept.
fn draw(module: &Module) -> (Vec<Words>, Mask) {
    let program = Program::compile(module, 0, &[]).unwrap_or_else(|r| panic!("{}", r.what));
    let mut bindings = Bindings::new();
    for (_, global) in module.global_variables.iter() {
        if let Some(binding) = global.binding {
            let bytes = Arc::new(reference::buffer(module, global.ty));
            let place = (binding.group, binding.binding);
            bindings.insert(place, Resource::Buffer(bytes));
        }
    }
    let inputs: Vec<Words> = program
        .inputs()
        .iter()
        .map(|slot| {
            std::array::from_fn(|lane| match slot.kind {
                ScalarKind::Float => x(lane).to_bits(),
                _ => i(lane) as u32,
            })
        })
        .collect();
    let mut outputs = vec![[0; LANES]; program.outputs().len()];
    let mut machine = Machine::new(&program, &bindings);
    let kept = machine.run(&inputs, Mask::ALL, Mask::ALL, &mut outputs);
    (outputs, kept)
}

/// Writes a random shader.
struct Author {
    state: u64,
    text: String,
    depth: usize,
    /// Numbers given to names.
    names: usize,
    /// Readable names by type: floats, integers, bools, vectors.
    floats: Vec<String>,
    ints: Vec<String>,
    vectors: Vec<String>,
    /// Variables that may be stored to.
    float_vars: Vec<String>,
    int_vars: Vec<String>,
    vector_vars: Vec<String>,
    structs: Vec<String>,
    /// Functions that may be called.
    functions: usize,
    in_loop: bool,
    in_switch: bool,
    /// How a return is written here.
    result: &'static str,
    budget: usize,
}

impl Author {
    fn new(seed: u64) -> Self {
        Self {
            state: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678,
            text: String::new(),
            depth: 0,
            names: 0,
            floats: Vec::new(),
            ints: Vec::new(),
            vectors: Vec::new(),
            float_vars: Vec::new(),
            int_vars: Vec::new(),
            vector_vars: Vec::new(),
            structs: Vec::new(),
            functions: 0,
            in_loop: false,
            in_switch: false,
            result: "",
            budget: 0,
        }
    }

    fn below(&mut self, n: usize) -> usize {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }

    fn one(&mut self, of: &[String]) -> Option<String> {
        (!of.is_empty()).then(|| of[self.below(of.len())].clone())
    }

    fn name(&mut self, stem: &str) -> String {
        self.names += 1;
        format!("{stem}{}x", self.names)
    }

    fn line(&mut self, text: &str) {
        let _ = writeln!(self.text, "{}{text}", "    ".repeat(self.depth));
    }

    fn shader(mut self) -> String {
        self.text.push_str(
            "struct Part { a: f32, v: vec3f, w: array<f32, 2> }
struct Uniforms { k: vec4f, parts: array<Part, 2>, n: vec4f }
@group(0) @binding(0) var<storage, read> u: Uniforms;
const TABLE = array<f32, 3>(0.5, -1.5, 2.5);
var<private> secret: f32 = 0.75;
",
        );
        for _ in 0..self.below(4) {
            self.function();
        }
        self.line("@fragment fn fs_main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32) -> @location(0) vec4f { secret += x;");
        self.scope(&["x"], &["i"], &[], "vec4f");
        self.line("}");
        self.text
    }

    fn function(&mut self) {
        let head = format!(
            "fn f{}(x: f32, i: i32, p: ptr<function, Part>, q: vec3f) -> f32 {{",
            self.functions
        );
        self.line(&head);
        self.scope(&["x"], &["i"], &["(*p)"], "f32");
        self.line("}");
        self.functions += 1;
    }

    /// The body of a function.
    fn scope(&mut self, floats: &[&str], ints: &[&str], structs: &[&str], result: &'static str) {
        let owned = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        self.floats = owned(floats);
        self.ints = owned(ints);
        self.structs = owned(structs);
        self.vectors = if result == "f32" {
            owned(&["q"])
        } else {
            Vec::new()
        };
        self.float_vars = vec!["secret".into()];
        self.int_vars.clear();
        self.vector_vars.clear();
        self.result = result;
        self.budget = 25;
        self.depth += 1;
        self.line("var part: Part;");
        self.structs.push("part".into());
        self.declare();
        self.declare();
        let count = 3 + self.below(5);
        self.statements(count);
        let value = self.returned();
        self.line(&format!("return {value};"));
        self.depth -= 1;
    }

    fn returned(&mut self) -> String {
        if self.result == "f32" {
            self.float(2)
        } else {
            let (a, v) = (self.float(2), self.vector(2));
            format!("vec4f({v}, {a})")
        }
    }

    /// Statements in a block of their own: what they declare is gone afterwards.
    fn block(&mut self, count: usize) {
        let lengths = [
            self.floats.len(),
            self.ints.len(),
            self.vectors.len(),
            self.float_vars.len(),
            self.int_vars.len(),
            self.vector_vars.len(),
            self.structs.len(),
        ];
        self.depth += 1;
        self.statements(count);
        self.depth -= 1;
        let [a, b, c, d, e, f, g] = lengths;
        self.floats.truncate(a);
        self.ints.truncate(b);
        self.vectors.truncate(c);
        self.float_vars.truncate(d);
        self.int_vars.truncate(e);
        self.vector_vars.truncate(f);
        self.structs.truncate(g);
    }

    fn statements(&mut self, count: usize) {
        for _ in 0..count {
            if self.budget == 0 {
                return;
            }
            self.budget -= 1;
            self.statement();
        }
    }

    fn declare(&mut self) {
        match self.below(5) {
            0 => {
                let (name, value) = (self.name("f"), self.float(2));
                self.line(&format!("var {name} = {value};"));
                self.floats.push(name.clone());
                self.float_vars.push(name);
            }
            1 => {
                let (name, value) = (self.name("v"), self.vector(2));
                self.line(&format!("var {name} = {value};"));
                self.vectors.push(name.clone());
                self.vector_vars.push(name);
            }
            2 => {
                let (name, value) = (self.name("n"), self.int(2));
                self.line(&format!("var {name} = {value};"));
                self.ints.push(name.clone());
                self.int_vars.push(name);
            }
            3 => {
                let (name, value) = (self.name("c"), self.float(3));
                self.line(&format!("let {name} = {value};"));
                self.floats.push(name);
            }
            _ => {
                let name = self.name("s");
                match self.below(3) {
                    0 => self.line(&format!("var {name}: Part;")),
                    1 => self.line(&format!("var {name} = u.parts[1];")),
                    _ => {
                        let other = self.one(&self.structs.clone()).unwrap_or("part".into());
                        self.line(&format!("var {name} = {other};"));
                    }
                }
                self.structs.push(name);
            }
        }
    }

    fn statement(&mut self) {
        match self.below(22) {
            0..=3 => self.declare(),
            4 | 5 => {
                if let Some(to) = self.one(&self.float_vars.clone()) {
                    let (op, value) = (["", "+", "*"][self.below(3)], self.float(3));
                    self.line(&format!("{to} {op}= {value};"));
                }
            }
            6 => {
                if let Some(to) = self.one(&self.vector_vars.clone()) {
                    let part = ["", ".x", ".z", "[1]"][self.below(4)];
                    let value = if part.is_empty() {
                        self.vector(2)
                    } else {
                        self.float(2)
                    };
                    self.line(&format!("{to}{part} = {value};"));
                }
            }
            7 => {
                if let Some(to) = self.one(&self.vector_vars.clone()) {
                    let (at, value) = (self.int(1), self.float(2));
                    self.line(&format!("{to}[({at}) & 1] = {value};"));
                }
            }
            8 => {
                if let Some(to) = self.one(&self.int_vars.clone()) {
                    let value = self.int(2);
                    self.line(&format!("{to} = {value};"));
                }
            }
            9..=11 => {
                if let Some(to) = self.one(&self.structs.clone()) {
                    let (number, vector) = (self.float(2), self.vector(2));
                    let at = self.int(1);
                    let text = match self.below(6) {
                        0 => format!("{to}.a = {number};"),
                        1 => format!("{to}.v = {vector};"),
                        2 => format!("{to}.v.y = {number};"),
                        3 => format!("{to}.w[0] += {number};"),
                        4 if self.below(3) == 0 => format!("{to}.w[({at}) & 1] = {number};"),
                        _ => {
                            let other = self.one(&self.structs.clone()).unwrap_or("part".into());
                            format!("{to} = {other};")
                        }
                    };
                    self.line(&text);
                }
            }
            12 | 13 if self.functions > 0 => {
                let name = self.name("r");
                let (x, i, q) = (self.float(1), self.int(1), self.vector(1));
                let to = self.one(&self.structs.clone()).unwrap_or("part".into());
                let to = if to == "(*p)" {
                    "p".into()
                } else {
                    format!("&{to}")
                };
                let callee = self.below(self.functions);
                self.line(&format!("let {name} = f{callee}({x}, {i}, {to}, {q});"));
                self.floats.push(name);
            }
            14..=16 => {
                let (test, count) = (self.bool(2), 1 + self.below(3));
                self.line(&format!("if {test} {{"));
                self.block(count);
                if self.below(2) == 0 {
                    self.line("} else {");
                    let count = 1 + self.below(3);
                    self.block(count);
                }
                self.line("}");
            }
            17 => self.repeat(),
            18 => self.switch(),
            19 => {
                let (test, value) = (self.bool(1), self.returned());
                self.line(&format!("if {test} {{ return {value}; }}"));
            }
            20 if self.in_loop || self.in_switch => {
                let test = self.bool(1);
                let jump = match self.in_loop && self.below(2) == 0 {
                    true => "continue",
                    false => "break",
                };
                self.line(&format!("if {test} {{ {jump}; }}"));
            }
            21 if self.result != "f32" && self.below(3) == 0 => {
                let test = self.bool(1);
                self.line(&format!("if {test} {{ discard; }}"));
            }
            _ => {}
        }
    }

    fn repeat(&mut self) {
        let before = (self.in_loop, self.in_switch);
        (self.in_loop, self.in_switch) = (true, false);
        let counter = self.name("k");
        let rounds = 1 + self.below(4);
        let count = 1 + self.below(4);
        match self.below(3) {
            0 => {
                self.line(&format!(
                    "for (var {counter} = 0; {counter} < {rounds}; {counter}++) {{"
                ));
                self.ints.push(counter);
                self.block(count);
                self.ints.pop();
                self.line("}");
            }
            1 => {
                self.line(&format!("var {counter} = 0;"));
                self.line("loop {");
                self.depth += 1;
                self.line(&format!("if {counter} >= {rounds} {{ break; }}"));
                self.depth -= 1;
                self.ints.push(counter.clone());
                self.block(count);
                self.depth += 1;
                self.line("continuing {");
                self.line(&format!("    {counter} += 1;"));
                if self.below(2) == 0 {
                    let test = self.bool(1);
                    self.line(&format!("    break if {test};"));
                }
                self.line("}");
                self.depth -= 1;
                self.line("}");
            }
            _ => {
                let test = self.bool(1);
                self.line(&format!("var {counter} = 0;"));
                self.line(&format!("while {counter} < {rounds} && {test} {{"));
                self.depth += 1;
                self.line(&format!("{counter} += 1;"));
                self.depth -= 1;
                self.ints.push(counter.clone());
                self.block(count);
                self.line("}");
            }
        }
        (self.in_loop, self.in_switch) = before;
    }

    fn switch(&mut self) {
        let before = self.in_switch;
        self.in_switch = true;
        let selector = self.int(2);
        self.line(&format!("switch ({selector}) & 3 {{"));
        for case in ["case 0: {", "case 1, 3: {", "default: {"] {
            self.depth += 1;
            self.line(case);
            let count = self.below(3);
            self.block(count);
            if self.below(4) == 0 {
                let value = self.returned();
                self.line(&format!("    return {value};"));
            }
            self.line("}");
            self.depth -= 1;
        }
        self.line("}");
        self.in_switch = before;
    }

    fn float(&mut self, depth: usize) -> String {
        if depth == 0 || self.below(4) == 0 {
            return match self.below(7) {
                0 => ["0.0", "1.0", "-0.5", "2.0", "0.25"][self.below(5)].into(),
                1 => ["u.k.x", "u.n.w", "u.parts[1].a", "u.parts[0].v.y"][self.below(4)].into(),
                2 => {
                    let at = self.int(0);
                    format!("TABLE[({at}) & 1]")
                }
                3 => match self.one(&self.structs.clone()) {
                    Some(s) => format!("{s}{}", [".a", ".v.x", ".w[1]", ".v.z"][self.below(4)]),
                    None => "0.125".into(),
                },
                4 => match self.one(&self.vectors.clone()) {
                    Some(v) => format!("{v}{}", [".x", ".y", "[2]"][self.below(3)]),
                    None => "secret".into(),
                },
                _ => self.one(&self.floats.clone()).unwrap_or("1.5".into()),
            };
        }
        let (a, b) = (self.float(depth - 1), self.float(depth - 1));
        match self.below(11) {
            0 | 1 => format!("({a} + {b})"),
            2 => format!("({a} - {b})"),
            3 => format!("({a} * {b})"),
            4 => format!("min({a}, {b})"),
            5 => format!("sin({a})"),
            6 => format!("select({a}, {b}, {})", self.bool(depth - 1)),
            7 => format!("f32({})", self.int(depth - 1)),
            8 => format!(
                "dot({}, {})",
                self.vector(depth - 1),
                self.vector(depth - 1)
            ),
            9 => format!("({a} / (abs({b}) + 1.0))"),
            _ => {
                let (s, at) = (self.one(&self.structs.clone()), self.int(0));
                match s {
                    Some(s) if self.below(4) == 0 => format!("{s}.w[({at}) & 1]"),
                    _ => format!("u.parts[({at}) & 1].w[0]"),
                }
            }
        }
    }

    fn int(&mut self, depth: usize) -> String {
        if depth == 0 || self.below(3) == 0 {
            return match self.below(3) {
                0 => ["0", "1", "2", "7"][self.below(4)].into(),
                _ => self.one(&self.ints.clone()).unwrap_or("3".into()),
            };
        }
        let (a, b) = (self.int(depth - 1), self.int(depth - 1));
        match self.below(5) {
            0 | 1 => format!("({a} + {b})"),
            2 => format!("({a} * {b})"),
            3 => format!("({a} ^ {b})"),
            _ => format!("select({a}, {b}, {})", self.bool(depth - 1)),
        }
    }

    fn bool(&mut self, depth: usize) -> String {
        let inner = depth.saturating_sub(1);
        if depth > 0 && self.below(2) == 0 {
            let (a, b) = (self.bool(inner), self.bool(inner));
            return match self.below(3) {
                0 => format!("({a} && {b})"),
                1 => format!("({a} || {b})"),
                _ => format!("!({a})"),
            };
        }
        match self.below(3) {
            0 => format!("({} < {})", self.float(inner), self.float(inner)),
            1 => format!("({} > {})", self.int(inner), self.int(inner)),
            _ => format!("(({} & 1) == 0)", self.int(inner)),
        }
    }

    fn vector(&mut self, depth: usize) -> String {
        if depth == 0 || self.below(3) == 0 {
            return match self.below(4) {
                0 => "vec3f(0.5, 1.0, -1.0)".into(),
                1 => ["u.k.xyz", "u.parts[0].v", "u.n.wzy"][self.below(3)].into(),
                2 => match self.one(&self.structs.clone()) {
                    Some(s) => format!("{s}.v"),
                    None => "vec3f(1.0)".into(),
                },
                _ => self
                    .one(&self.vectors.clone())
                    .unwrap_or("vec3f(0.25)".into()),
            };
        }
        let (a, b) = (self.vector(depth - 1), self.vector(depth - 1));
        match self.below(7) {
            0 => format!("({a} + {b})"),
            1 => format!("({a} * {})", self.float(depth - 1)),
            2 => format!("{a}.zyx"),
            3 => {
                let (x, y) = (self.float(depth - 1), self.float(depth - 1));
                format!("vec3f({x}, vec2f({y}, 0.5))")
            }
            4 => format!("vec3f({a}.yz, {})", self.float(depth - 1)),
            5 => format!("cross({a}, {b})"),
            _ => format!("select({a}, {b}, {})", self.bool(depth - 1)),
        }
    }
}
