//! Lanes do not influence each other: random programs, and the materials, run for all lanes at once and for
//! each lane alone, where every branch is uniform, give the same bits. So do a program and its normal form.

use super::operations::Random;
use super::*;
use std::fmt::Write;

/// Writes a random function body: integers and floats in nested control flow.
struct Author {
    random: Random,
    text: String,
    /// Loops around this place, and switches inside of those.
    loops: usize,
    switches: usize,
    names: usize,
}

impl Author {
    fn value(&mut self) -> String {
        match self.random.below(10) {
            0 => format!("{}", self.random.below(12)),
            1 => "a".into(),
            2 => "b".into(),
            3 => "c".into(),
            4 => "t[a & 3]".into(),
            5 => "t[1]".into(),
            6 => "i".into(),
            7 => "u.n".into(),
            8 => format!("(a + {})", self.random.below(5)),
            _ => "u.list[b & 3]".into(),
        }
    }

    fn target(&mut self) -> &'static str {
        ["a", "b", "c", "t[c & 3]", "t[2]"][self.random.below(5) as usize]
    }

    fn expression(&mut self) -> String {
        let (x, y) = (self.value(), self.value());
        match self.random.below(6) {
            0 => format!("{x} + {y}"),
            1 => format!("{x} - {y}"),
            2 => format!("({x} * {y}) & 63"),
            3 => format!("{x} ^ {y}"),
            4 => format!("helper({x}, {y})"),
            _ => format!("select({x}, {y}, {x} > {y})"),
        }
    }

    fn condition(&mut self) -> String {
        let (x, y) = (self.value(), self.value());
        match self.random.below(4) {
            0 => format!("({x} & 1) == 0"),
            1 => format!("u.n > {}", self.random.below(6)),
            2 => format!("{x} < {y}"),
            _ => format!("({x} & 3) != ({y} & 3)"),
        }
    }

    fn block(&mut self, depth: usize) {
        for _ in 0..1 + self.random.below(4) {
            self.statement(depth);
        }
    }

    fn statement(&mut self, depth: usize) {
        let choice = if depth == 0 { 0 } else { self.random.below(12) };
        match choice {
            0..=4 => {
                let (target, value) = (self.target(), self.expression());
                let _ = writeln!(self.text, "{target} = {value};");
            }
            5 | 6 => {
                let condition = self.condition();
                let _ = writeln!(self.text, "if {condition} {{");
                self.block(depth - 1);
                if self.random.below(2) == 0 {
                    self.text += "} else {\n";
                    self.block(depth - 1);
                }
                self.text += "}\n";
            }
            7 | 8 => {
                self.names += 1;
                let k = format!("k{}_", self.names);
                let bound = ["3", "u.n", "(i & 3) + 1"][self.random.below(3) as usize];
                let _ = writeln!(self.text, "for (var {k} = 0; {k} < {bound}; {k}++) {{");
                let switches = std::mem::take(&mut self.switches);
                self.loops += 1;
                self.block(depth - 1);
                let target = self.target();
                let _ = writeln!(self.text, "{target} += {k};");
                self.loops -= 1;
                self.switches = switches;
                self.text += "}\n";
            }
            9 => {
                let selector = self.value();
                let _ = writeln!(self.text, "switch ({selector}) & 3 {{ case 0: {{");
                self.switches += 1;
                self.block(depth - 1);
                self.text += "} case 1, 2: {\n";
                self.block(depth - 1);
                self.text += "} default: {\n";
                self.block(depth - 1);
                self.text += "} }\n";
                self.switches -= 1;
            }
            10 if self.loops > 0 || self.switches > 0 => {
                let condition = self.condition();
                let leave = match self.random.below(2) {
                    0 if self.loops > 0 => "continue",
                    _ => "break",
                };
                let _ = writeln!(self.text, "if {condition} {{ {leave}; }}");
            }
            _ => {
                let condition = self.condition();
                let _ = writeln!(
                    self.text,
                    "if {condition} {{ return vec4i(a, b, c, t[0]); }}"
                );
            }
        }
    }
}

fn program(seed: u64) -> String {
    let mut author = Author {
        random: Random(seed * 0x9E37_79B9 + 1),
        text: String::new(),
        loops: 0,
        switches: 0,
        names: 0,
    };
    author.block(4);
    format!(
        "struct U {{ n: i32, list: array<vec4i, 4> }}
        @group(0) @binding(0) var<uniform> uniforms: U;
        struct Local {{ n: i32, list: array<i32, 4> }}
        fn helper(x: i32, y: i32) -> i32 {{
            if x > y {{ return x - y; }}
            var s = 0;
            for (var k = 0; k < (y & 3); k++) {{ if (x & 1) == (k & 1) {{ continue; }} s += k; if s > 4 {{ return s; }} }}
            return s + x;
        }}
        fn body(i: i32) -> vec4i {{
            var u: Local; u.n = uniforms.n;
            for (var k = 0; k < 4; k++) {{ u.list[k] = uniforms.list[k].x; }}
            var a = i & 15; var b = 2; var c = uniforms.n; var t = array<i32, 4>(1, i & 7, 3, c);
            {}
            return vec4i(a, b, c, t[1]);
        }}
        @fragment fn main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32) -> @location(0) vec4i {{
            return body(i);
        }}",
        author.text
    )
}

/// Runs all lanes at once.
fn together(program: &Program, inputs: &[Words], bindings: &Bindings) -> Vec<Words> {
    let mut machine = Machine::new(program, bindings);
    let mut outputs = vec![[0; LANES]; program.outputs().len()];
    machine.run(inputs, Mask::ALL, Mask::ALL, &mut outputs);
    assert_eq!(machine.profile().ran_away, 0);
    outputs
}

/// Runs lanes `step` at a time, each group alone.
fn apart(program: &Program, inputs: &[Words], bindings: &Bindings, step: usize) -> Vec<Words> {
    let mut machine = Machine::new(program, bindings);
    let mut outputs = vec![[0; LANES]; program.outputs().len()];
    let mut gathered = outputs.clone();
    for first in (0..LANES).step_by(step) {
        let mut mask = Mask::default();
        for lane in first..first + step {
            mask.0[lane / 64] |= 1 << (lane % 64);
        }
        machine.run(inputs, mask, mask, &mut outputs);
        for (gathered, output) in gathered.iter_mut().zip(&outputs) {
            gathered[first..first + step].copy_from_slice(&output[first..first + step]);
        }
    }
    gathered
}

fn compare(what: &str, source: &str, got: &[Words], want: &[Words]) {
    for (output, (got, want)) in got.iter().zip(want).enumerate() {
        for lane in 0..LANES {
            assert_eq!(
                got[lane], want[lane],
                "{what}: output {output}, lane {lane}\n{source}"
            );
        }
    }
}

#[test]
fn lanes_of_random_programs_are_independent() {
    let mut bytes = vec![0u8; 80];
    for (place, value) in [(0, 3u32), (16, 5), (32, 0), (48, 9), (64, 2)] {
        bytes[place..place + 4].copy_from_slice(&value.to_le_bytes());
    }
    let bindings = Bindings::from([((0, 0), Resource::Buffer(Arc::new(bytes)))]);
    for seed in 0..300 {
        let source = program(seed);
        let module = module(&source);
        let program = Program::compile(&module, 0, &[])
            .unwrap_or_else(|refused| panic!("{refused:?}\n{source}"));
        let inputs = numbered(&program);
        let all = together(&program, &inputs, &bindings);
        compare(
            "lane by lane",
            &source,
            &apart(&program, &inputs, &bindings, 1),
            &all,
        );
        if seed % 4 == 0 {
            let normal = lodc_passes::normalize(&module, None, "main", 1_000_000)
                .unwrap_or_else(|error| panic!("{error}\n{source}"));
            let normal = Program::compile(normal.module(), 0, &[]).expect("it compiles");
            compare(
                "normal form",
                &source,
                &together(&normal, &inputs, &bindings),
                &all,
            );
        }
    }
}
