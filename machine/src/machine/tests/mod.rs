//! Programs against results worked out by hand: control flow here, the rest in the modules.

mod lanes;
mod memory;
mod operations;
mod quads;
mod textures;

use super::*;
use crate::program::Refused;

fn module(source: &str) -> naga::Module {
    let module = match naga::front::wgsl::parse_str(source) {
        Ok(module) => module,
        Err(error) => panic!("{}", error.emit_to_string(source)),
    };
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::all(),
    );
    if let Err(error) = validator.validate(&module) {
        panic!("{}", error.emit_to_string(source));
    }
    module
}

fn compile(source: &str) -> Program {
    let module = module(source);
    Program::compile(&module, 0, &[]).unwrap_or_else(|refused| panic!("{refused:?}"))
}

fn refuse(source: &str) -> Refused {
    match Program::compile(&module(source), 0, &[]) {
        Err(refused) => refused,
        Ok(_) => panic!("it is not refused"),
    }
}

/// What each input slot holds: lane + 1000 slots, as a float, or the lane as an integer.
fn numbered(program: &Program) -> Vec<Words> {
    program
        .inputs()
        .iter()
        .enumerate()
        .map(|(slot, input)| {
            std::array::from_fn(|lane| match input.kind {
                ScalarKind::Float => (lane as f32 + 1000.0 * slot as f32).to_bits(),
                _ => lane as u32,
            })
        })
        .collect()
}

struct Outcome {
    outputs: Vec<Words>,
    kept: Mask,
    profile: Profile,
}

impl Outcome {
    fn float(&self, output: usize, lane: usize) -> f32 {
        f32::from_bits(self.outputs[output][lane])
    }

    /// The first output for every lane.
    fn floats(&self) -> Vec<f32> {
        self.outputs[0].iter().map(|&w| f32::from_bits(w)).collect()
    }
}

fn run_bound(program: &Program, bindings: &Bindings) -> Outcome {
    let mut machine = Machine::new(program, bindings);
    let mut outputs = vec![[0; LANES]; program.outputs().len()];
    let inputs = numbered(program);
    let kept = machine.run(&inputs, Mask::ALL, Mask::ALL, &mut outputs);
    Outcome {
        outputs,
        kept,
        profile: machine.profile(),
    }
}

fn run(source: &str) -> Outcome {
    run_bound(&compile(source), &Bindings::new())
}

/// Runs a fragment shader whose body computes `r`, a float, from the lane's number `x` (also as
/// `i`), and compares it for every lane.
fn check(body: &str, expected: impl Fn(i32) -> f32) {
    check_with("", body, expected);
}

fn check_with(items: &str, body: &str, expected: impl Fn(i32) -> f32) {
    let source = format!(
        "{items}
        @fragment fn main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32)
            -> @location(0) f32 {{
            {body}
        }}"
    );
    let outcome = run(&source);
    for (lane, got) in outcome.floats().into_iter().enumerate() {
        let want = expected(lane as i32);
        assert_eq!(
            words::bits(got),
            words::bits(want),
            "lane {lane}: {got}, not {want}"
        );
    }
}

#[test]
fn straight_code() {
    check("return x * 2.0 + 1.0;", |i| i as f32 * 2.0 + 1.0);
    check("return f32((i * 3 - 7) % 5);", |i| ((i * 3 - 7) % 5) as f32);
    check("let v = vec3(x, 2.0, 3.0); return dot(v, v.zyx);", |i| {
        (i as f32 * 3.0 + 4.0) + i as f32 * 3.0
    });
    check("return select(1.0, 2.0, i > 5 && i < 9);", |i| {
        if i > 5 && i < 9 { 2.0 } else { 1.0 }
    });
    check("return 7.0;", |_| 7.0);
}

#[test]
fn branches() {
    check(
        "var r = 1.0; if i < 10 { r = x; } else { r += 5.0; } return r;",
        |i| {
            if i < 10 { i as f32 } else { 6.0 }
        },
    );
    check(
        "var r = 0.0; if i < 10 { if i < 5 { r = 1.0; } r += 2.0; } else if i < 20 { r = 9.0; }
         return r + x;",
        |i| {
            let r = match i {
                0..5 => 3.0,
                5..10 => 2.0,
                10..20 => 9.0,
                _ => 0.0,
            };
            r + i as f32
        },
    );
}

#[test]
fn returns_in_branches_and_loops() {
    check(
        "if i < 3 { return 1.0; } if i < 6 { return 2.0; } return x;",
        |i| match i {
            0..3 => 1.0,
            3..6 => 2.0,
            _ => i as f32,
        },
    );
    check(
        "var s = 0.0; for (var k = 0; k < 10; k++) { if k == i { return s; } s += f32(k); }
         return -s;",
        |i| {
            if i < 10 {
                (i * (i - 1) / 2) as f32
            } else {
                -45.0
            }
        },
    );
}

#[test]
fn early_returns_of_calls() {
    let items = "
        fn clamped(a: f32, b: i32) -> f32 {
            if b < 4 { return a * 10.0; }
            for (var k = 0; k < 5; k++) { if k + 4 == b { return f32(k); } }
            return -1.0;
        }";
    let expected = |i: i32| match i {
        0..4 => i as f32 * 10.0,
        4..9 => (i - 4) as f32,
        _ => -1.0,
    };
    check_with(items, "return clamped(x, i);", expected);
    check_with(
        items,
        "var s = 0.0; for (var k = 0; k < 3; k++) { s += clamped(x, i + k); } return s;",
        |i| {
            (0..3)
                .map(|k| {
                    if i + k < 4 {
                        i as f32 * 10.0
                    } else {
                        expected(i + k)
                    }
                })
                .fold(0.0, |a, b| a + b)
        },
    );
}

#[test]
fn loops() {
    // A trip count of each lane's own.
    check(
        "var s = 0.0; for (var k = 0; k < i; k++) { s += f32(k); } return s;",
        |i| (i * (i - 1) / 2) as f32,
    );
    // `continue` runs `continuing`.
    check(
        "var s = 0.0; for (var k = 0; k < 8; k++) { if (k & 1) == (i & 1) { continue; } s += f32(k); }
         return s;",
        |i| if i % 2 == 0 { 16.0 } else { 12.0 },
    );
    check(
        "var s = 0; var k = 0;
         loop { if k == 3 { continue; } s += k; if s > i { break; }
            continuing { k += 1; break if k >= 6 + (i & 1); } }
         return f32(s * 100 + k);",
        |i| {
            let (mut s, mut k) = (0, 0);
            loop {
                if k != 3 {
                    s += k;
                    if s > i {
                        break;
                    }
                }
                k += 1;
                if k >= 6 + (i & 1) {
                    break;
                }
            }
            (s * 100 + k) as f32
        },
    );
    // The counter of a loop that lanes leave one by one, read after it.
    check(
        "var k = 0; var t = 0.0; loop { t += 1.5; if t > x { break; } k += 1; if k == 20 { break; } }
         return f32(k) + t * 100.0;",
        |i| {
            let (mut k, mut t) = (0, 0.0f32);
            loop {
                t += 1.5;
                if t > i as f32 {
                    break;
                }
                k += 1;
                if k == 20 {
                    break;
                }
            }
            k as f32 + t * 100.0
        },
    );
    // Nested, with a return out of both.
    check(
        "var s = 0.0;
         for (var a = 0; a < 6; a++) { for (var b = 0; b < 6; b++) {
            if a * 6 + b == i { return s + 1000.0; } if b > a { break; } s += f32(b); } }
         return s;",
        |i| {
            let mut s = 0.0;
            for a in 0..6 {
                for b in 0..6 {
                    if a * 6 + b == i {
                        return s + 1000.0;
                    }
                    if b > a {
                        break;
                    }
                    s += b as f32;
                }
            }
            s
        },
    );
}

#[test]
fn values_of_an_earlier_round() {
    // What some lanes wrote in one round, others must not read in the next.
    check(
        "var last = -1.0; var s = 0.0;
         for (var k = 0; k < 6; k++) { if ((i >> u32(k)) & 1) == 1 { s += last; last = f32(k); } }
         return s * 10.0 + last;",
        |i| {
            let (mut last, mut s) = (-1.0, 0.0);
            for k in 0..6 {
                if (i >> k) & 1 == 1 {
                    s += last;
                    last = k as f32;
                }
            }
            s * 10.0 + last
        },
    );
}

#[test]
fn switches() {
    check(
        "var r = 0.0; switch i % 5 { case 0: { r = 1.0; } case 1, 2: { r = 2.0; if i > 50 { break; } r += x; }
            case 3: { return -1.0; } default: { r = 5.0; } } return r;",
        |i| match i % 5 {
            0 => 1.0,
            1 | 2 if i > 50 => 2.0,
            1 | 2 => 2.0 + i as f32,
            3 => -1.0,
            _ => 5.0,
        },
    );
    // `continue` out of a switch, and a default in the middle.
    check(
        "var s = 0; for (var k = 0; k < 7; k++) {
            switch (k + i) % 4 { case 0: { continue; } default: { s += 10; } case 2: { s += 100; break; } }
            s += 1; } return f32(s);",
        |i| {
            let mut s = 0;
            for k in 0..7 {
                match (k + i) % 4 {
                    0 => continue,
                    2 => s += 100,
                    _ => s += 10,
                }
                s += 1;
            }
            s as f32
        },
    );
    // On a value that is the same for all lanes.
    check_with(
        "override which = 2;",
        "var r = 0.0; for (var k = 0; k < 3; k++) { switch which + k { case 2: { r += x; } case 3: { r += 10.0; } default: {} } } return r;",
        |i| i as f32 + 10.0,
    );
}

/// A switch that falls through cannot be written in WGSL: the flags are set by hand.
#[test]
fn switches_that_fall_through() {
    let source = "@fragment fn main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32)
            -> @location(0) f32 {
            var r = 0.0;
            switch i % 4 { case 0: { r += 1.0; } case 1: { r += 10.0; if i > 100 { break; } }
                case 2: { r += 100.0; } default: { r += 1000.0; } }
            return r; }";
    let mut module = module(source);
    fn mark(block: &mut naga::Block) {
        for statement in block.iter_mut() {
            if let naga::Statement::Switch { cases, .. } = statement {
                cases[0].fall_through = true;
                cases[1].fall_through = true;
            }
        }
    }
    mark(&mut module.entry_points[0].function.body);
    let program = Program::compile(&module, 0, &[]).expect("it compiles");
    let outcome = run_bound(&program, &Bindings::new());
    for (lane, got) in outcome.floats().into_iter().enumerate() {
        let want = match lane % 4 {
            0 if lane > 100 => 11.0,
            0 => 111.0,
            1 if lane > 100 => 10.0,
            1 => 110.0,
            2 => 100.0,
            _ => 1000.0,
        };
        assert_eq!(got, want, "lane {lane}");
    }
}
