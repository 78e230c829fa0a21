//! Random shaders: what must hold for every valid shader, over programs that no person would write.
//!
//! A seeded generator writes WGSL with nested loops, switches, early returns, pointers, arrays, structs and
//! private state. `LODC_SEED=17` runs one program and prints it.

use lodc::front::Source;
use lodc_passes::{Facts, PASSES, Shader, Stage, normalize};
use std::fmt::Write;

/// How many programs are tried.
const PROGRAMS: u64 = 150;

/// Types that values have here.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Type {
    Float,
    Int,
    Bool,
    Pair,
}

impl Type {
    fn name(self) -> &'static str {
        match self {
            Self::Float => "f32",
            Self::Int => "i32",
            Self::Bool => "bool",
            Self::Pair => "vec2f",
        }
    }
}

/// What may be written where a statement stands.
#[derive(Clone, Copy)]
struct Place {
    /// Blocks around it.
    depth: usize,
    /// Whether `continue` has a loop to go on with.
    in_loop: bool,
    /// Whether `break` leaves a loop or a switch.
    in_breakable: bool,
    /// What the function returns.
    returns: Type,
    /// Functions that may be called are those before this one.
    function: usize,
}

/// Writes one program.
struct Writer {
    state: u64,
    text: String,
    names: usize,
    /// Variables in scope that may be assigned, and their types.
    variables: Vec<(String, Type)>,
    /// Values in scope that may be read.
    values: Vec<(String, Type)>,
    /// Calls that may still be written in this function, so that inlining does not explode.
    calls: usize,
    /// Statements that may still be written in this function.
    statements: usize,
}

const FUNCTIONS: [Type; 4] = [Type::Float, Type::Pair, Type::Int, Type::Float];

impl Writer {
    fn random(&mut self, below: usize) -> usize {
        // Splitmix64.
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % below as u64) as usize
    }

    fn pick<'a>(&mut self, choices: &[&'a str]) -> &'a str {
        choices[self.random(choices.len())]
    }

    fn line(&mut self, depth: usize, line: &str) {
        let _ = writeln!(self.text, "{}{line}", "    ".repeat(depth));
    }

    fn fresh(&mut self) -> String {
        self.names += 1;
        // Some names end in digits, some are shadowed later.
        match self.random(4) {
            0 => format!("v{}", self.names % 5),
            1 => format!("name_{}", self.names),
            _ => format!("w{}x", self.names),
        }
    }

    fn in_scope(&mut self, wanted: Type) -> Option<String> {
        let all = self.values.iter().chain(&self.variables);
        // A name that is shadowed by another type must not be read as the old one.
        let mut names: Vec<&(String, Type)> = all.filter(|(_, t)| *t == wanted).collect();
        names.dedup();
        let found: Vec<String> = names.iter().map(|(n, _)| n.clone()).collect();
        match found.len() {
            0 => None,
            n => Some(found[self.random(n)].clone()),
        }
    }

    /// An expression; floats stay small, so that no value becomes infinite or undefined.
    fn expression(&mut self, wanted: Type, depth: usize, place: Place) -> String {
        if depth == 0 || self.random(5) == 0 {
            if let Some(name) = self.in_scope(wanted)
                && self.random(4) > 0
            {
                return name;
            }
            return match wanted {
                Type::Float => self.pick(&["0.25f", "1.5f", "uv.x", "uv.y", "acc", "0.75f"]),
                Type::Int => self.pick(&["1i", "3i", "-2i", "count", "i32(uv.x * 9.0)"]),
                Type::Bool => self.pick(&["true", "(uv.x > 0.4)", "(count > 2)", "(uv.y < uv.x)"]),
                Type::Pair => self.pick(&["uv", "vec2f(0.5, acc)", "uv.yx"]),
            }
            .to_owned();
        }
        if self.calls > 0 && place.function > 0 && self.random(5) == 0 {
            let callee = self.random(place.function);
            if FUNCTIONS[callee] == wanted {
                self.calls -= 1;
                return self.call(callee, depth, place);
            }
        }
        let mut sub = |wanted| self.expression(wanted, depth - 1, place);
        match wanted {
            Type::Float => {
                let (a, b) = (sub(Type::Float), sub(Type::Float));
                let (p, i, c) = (sub(Type::Pair), sub(Type::Int), sub(Type::Bool));
                match self.random(9) {
                    0 => format!("({a} + {b})"),
                    1 => format!("fract({a} * {b})"),
                    2 => format!("mix({a}, {b}, 0.25)"),
                    3 => format!("select({a}, {b}, {c})"),
                    4 => format!("({p}).x"),
                    5 => format!("items[({i}) & 3]"),
                    6 => format!("({a} / (1.0 + abs({b})))"),
                    7 => format!("f32(({i}) & 15) * 0.1"),
                    _ => format!("max(dot({p}, vec2f(0.5)), -{b})"),
                }
            }
            Type::Int => {
                let (a, b, c) = (sub(Type::Int), sub(Type::Int), sub(Type::Bool));
                let f = sub(Type::Float);
                match self.random(7) {
                    0 => format!("({a} + {b})"),
                    1 => format!("({a} * 3 - {b})"),
                    2 => format!("({a} % 7)"),
                    3 => format!("(({a}) & ({b}))"),
                    4 => format!("select({a}, {b}, {c})"),
                    5 => format!("i32(clamp({f}, -9.0, 9.0))"),
                    _ => format!("(({a}) >> 1u)"),
                }
            }
            Type::Bool => {
                let (a, b) = (sub(Type::Bool), sub(Type::Bool));
                let (f, g, i) = (sub(Type::Float), sub(Type::Float), sub(Type::Int));
                match self.random(6) {
                    0 => format!("({a} && {b})"),
                    1 => format!("({a} || {b})"),
                    2 => format!("!({a})"),
                    3 => format!("({f} < {g})"),
                    4 => format!("(({i}) == 2)"),
                    _ => format!("({a} & {b})"),
                }
            }
            Type::Pair => {
                let (a, b) = (sub(Type::Pair), sub(Type::Pair));
                let (f, g) = (sub(Type::Float), sub(Type::Float));
                match self.random(6) {
                    0 => format!("vec2f({f}, {g})"),
                    1 => format!("({a} + {b})"),
                    2 => format!("fract({a} * {f})"),
                    3 => format!("({a}).yx"),
                    4 => format!("min({a}, {b})"),
                    _ => "node.at".to_owned(),
                }
            }
        }
    }

    fn call(&mut self, callee: usize, depth: usize, place: Place) -> String {
        let depth = depth.min(2).saturating_sub(1);
        let (a, b) = (
            self.expression(Type::Float, depth, place),
            self.expression(Type::Pair, depth, place),
        );
        format!("f{callee}({a}, {b}, &carried)")
    }

    fn block(&mut self, place: Place, most: usize) {
        let scope = (self.variables.len(), self.values.len());
        let count = 1 + self.random(most);
        for _ in 0..count {
            if self.statements == 0 {
                break;
            }
            self.statements -= 1;
            if !self.statement(place) {
                break;
            }
        }
        self.variables.truncate(scope.0);
        self.values.truncate(scope.1);
    }

    fn nested(&mut self, place: Place) {
        self.block(
            Place {
                depth: place.depth + 1,
                ..place
            },
            3,
        );
    }

    /// Writes a statement; false when nothing may follow it.
    fn statement(&mut self, place: Place) -> bool {
        let depth = place.depth;
        let deep = depth > 4;
        match self.random(16) {
            0 | 1 => {
                let of = [Type::Float, Type::Int, Type::Bool, Type::Pair][self.random(4)];
                let value = self.expression(of, 3, place);
                let name = format!("l{}", self.names);
                self.names += 1;
                self.line(depth, &format!("let {name} = {value};"));
                self.values.push((name, of));
            }
            2 | 3 => {
                let of = [Type::Float, Type::Int, Type::Pair, Type::Bool][self.random(4)];
                let name = self.fresh();
                if self
                    .values
                    .iter()
                    .chain(&self.variables)
                    .any(|(n, _)| *n == name)
                {
                    return true;
                }
                if self.random(3) == 0 {
                    self.line(depth, &format!("var {name}: {};", of.name()));
                } else {
                    let value = self.expression(of, 2, place);
                    self.line(depth, &format!("var {name}: {} = {value};", of.name()));
                }
                self.variables.push((name, of));
            }
            4..=6 => self.assignment(place),
            7 => {
                let value = self.expression(Type::Float, 2, place);
                let line = match self.random(4) {
                    0 => format!("acc = fract(acc + {value});"),
                    1 => "count = (count * 5 + 1) & 63;".to_owned(),
                    2 => format!("carried = fract({value});"),
                    _ => format!("_ = {value};"),
                };
                self.line(depth, &line);
            }
            8 | 9 if !deep => {
                let condition = self.expression(Type::Bool, 2, place);
                self.line(depth, &format!("if {condition} {{"));
                self.nested(place);
                if self.random(2) == 0 {
                    self.line(depth, "} else {");
                    self.nested(place);
                }
                self.line(depth, "}");
            }
            10 if !deep => self.counted_loop(place),
            11 if !deep => self.open_loop(place),
            12 if !deep => self.switch(place),
            13..=15 => {
                let value = self.expression(place.returns, 2, place);
                let leave = match self.random(3) {
                    0 if place.in_breakable => "break;".to_owned(),
                    1 if place.in_loop => "continue;".to_owned(),
                    _ => format!("return {value};"),
                };
                if depth > 2 && self.random(4) == 0 {
                    self.line(depth, &leave);
                    return false;
                }
                let condition = self.expression(Type::Bool, 2, place);
                self.line(depth, &format!("if {condition} {{ {leave} }}"));
            }
            _ => {
                self.line(depth, "{");
                self.nested(place);
                self.line(depth, "}");
            }
        }
        true
    }

    fn assignment(&mut self, place: Place) {
        let depth = place.depth;
        let index = self.expression(Type::Int, 1, place);
        let float = self.expression(Type::Float, 2, place);
        let pair = self.expression(Type::Pair, 2, place);
        let line = match self.random(7) {
            0 => format!("items[({index}) & 3] = fract({float});"),
            1 => format!("node.at = fract({pair});"),
            2 => format!("node.at.y = fract({float});"),
            3 => format!("node.weights[({index}) & 1] += fract({float});"),
            _ => {
                if self.variables.is_empty() {
                    return;
                }
                let at = self.random(self.variables.len());
                let (name, of) = self.variables[at].clone();
                let value = self.expression(of, 3, place);
                match of {
                    Type::Float if self.random(2) == 0 => format!("{name} -= fract({value});"),
                    Type::Float | Type::Pair => format!("{name} = fract({value});"),
                    Type::Int if self.random(2) == 0 => format!("{name}++;"),
                    Type::Int | Type::Bool => format!("{name} = {value};"),
                }
            }
        };
        self.line(depth, &line);
    }

    fn counted_loop(&mut self, place: Place) {
        let name = format!("k{}", self.names);
        self.names += 1;
        let rounds = 1 + self.random(3);
        self.line(
            place.depth,
            &format!("for (var {name} = 0; {name} < {rounds}; {name}++) {{"),
        );
        self.values.push((name, Type::Int));
        self.nested(Place {
            in_loop: true,
            in_breakable: true,
            ..place
        });
        self.values.pop();
        self.line(place.depth, "}");
    }

    fn open_loop(&mut self, place: Place) {
        let name = format!("n{}", self.names);
        self.names += 1;
        let depth = place.depth;
        self.line(depth, &format!("var {name} = 0;"));
        self.line(depth, "loop {");
        self.line(depth + 1, &format!("{name}++;"));
        let stop = 1 + self.random(4);
        self.line(depth + 1, &format!("if {name} > {stop} {{ break; }}"));
        self.values.push((name.clone(), Type::Int));
        self.nested(Place {
            in_loop: true,
            in_breakable: true,
            ..place
        });
        self.values.pop();
        if self.random(2) == 0 {
            self.line(depth + 1, "continuing {");
            self.line(depth + 2, &format!("acc = fract(acc + 0.1 * f32({name}));"));
            if self.random(2) == 0 {
                self.line(depth + 2, "break if acc > 0.8;");
            }
            self.line(depth + 1, "}");
        }
        self.line(depth, "}");
        self.values.push((name, Type::Int));
    }

    fn switch(&mut self, place: Place) {
        let depth = place.depth;
        let selector = self.expression(Type::Int, 2, place);
        self.line(depth, &format!("switch ({selector}) & 3 {{"));
        let inner = Place {
            depth: depth + 1,
            in_breakable: true,
            ..place
        };
        for case in ["case 0: {", "case 1, 3: {", "default: {"] {
            self.line(depth + 1, case);
            self.nested(inner);
            self.line(depth + 1, "}");
        }
        self.line(depth, "}");
    }

    fn function(&mut self, at: usize) {
        let returns = FUNCTIONS[at];
        self.line(
            0,
            &format!(
                "fn f{at}(x: f32, p: vec2f, out: ptr<function, f32>) -> {} {{",
                returns.name()
            ),
        );
        self.line(1, "let uv = p;");
        self.line(1, "var carried = *out;");
        self.body(at, returns);
        self.line(1, "*out = fract(carried + x);");
        let place = Place {
            depth: 1,
            in_loop: false,
            in_breakable: false,
            returns,
            function: at,
        };
        let value = self.expression(returns, 2, place);
        self.line(1, &format!("return {value};"));
        self.line(0, "}\n");
    }

    fn body(&mut self, at: usize, returns: Type) {
        self.line(1, "var items = array<f32, 4>(0.1, x, 0.3, acc);");
        self.line(1, "var node: Node;");
        self.variables.clear();
        self.values = vec![("x".into(), Type::Float)];
        self.calls = 2;
        self.statements = 22;
        let place = Place {
            depth: 1,
            in_loop: false,
            in_breakable: false,
            returns,
            function: at,
        };
        for _ in 0..7 {
            if self.statements > 0 {
                self.statements -= 1;
                self.statement(place);
            }
        }
        // What was declared at the top of the function stays in scope for its result.
    }

    fn program(seed: u64) -> String {
        let mut writer = Self {
            state: seed,
            text: String::new(),
            names: 0,
            variables: Vec::new(),
            values: Vec::new(),
            calls: 0,
            statements: 0,
        };
        writer.text.push_str(
            "struct Node {\n    at: vec2f,\n    weights: array<f32, 2>,\n}\n\nvar<private> acc: f32 = 0.5;\nvar<private> count: i32;\n\n",
        );
        for at in 0..FUNCTIONS.len() {
            writer.function(at);
        }
        writer.text.push_str(
            "@fragment\nfn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    var carried = uv.y;
    let x = uv.x;
    let a = f3(x, uv, &carried);
    let b = f1(carried, uv.yx, &carried);
    let c = f2(a, b, &carried);
    return vec4f(fract(a + b.x), fract(f32(c) * 0.1 + acc), fract(carried + b.y + f32(count) * 0.01), 1.0);
}
",
        );
        writer.text
    }
}

/// The normal form, valid.
fn normal(name: &str, module: &naga::Module) -> Shader {
    let shader =
        normalize(module, None, "fs_main", 200_000).unwrap_or_else(|e| panic!("{name}: {e}"));
    check(name, &shader);
    shader
}

fn check(name: &str, shader: &Shader) {
    if let Err(error) = lodc::front::validate(shader.module()) {
        panic!("{name}: {}", error.emit_to_string(""));
    }
}

#[test]
fn random_shaders_have_a_normal_form_that_passes_keep_valid() {
    let seeds = match std::env::var("LODC_SEED") {
        Ok(seed) => {
            let seed = seed.parse().expect("a number");
            println!("{}", Writer::program(seed));
            seed..seed + 1
        }
        Err(_) => 0..PROGRAMS,
    };
    for seed in seeds {
        let name = format!("LODC_SEED={seed}");
        let text = Writer::program(seed);
        let source = Source::parse(&name, text.as_str()).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let shader = normal(&name, &source.module);
        assert!(
            shader.function(Stage::Fragment).is_some(),
            "{name}: the fragment stage stays"
        );
        let again = normal(&name, shader.module());
        assert_eq!(
            shader.fingerprint(),
            again.fingerprint(),
            "{name}: normal form is a fixed point"
        );
        let mut changed = shader;
        for step in 0..4_usize {
            let facts = Facts::default();
            let all: Vec<_> = PASSES
                .iter()
                .flat_map(|pass| {
                    let candidates = pass.candidates(&changed, &facts).into_iter();
                    candidates.map(move |candidate| (pass, candidate))
                })
                .collect();
            let Some((pass, candidate)) = all.get((step * 131 + seed as usize) % all.len().max(1))
            else {
                break;
            };
            changed = pass.apply(&changed, candidate);
            check(&format!("{name} after {candidate}"), &changed);
        }
    }
}
