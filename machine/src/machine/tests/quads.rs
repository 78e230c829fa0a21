//! Derivatives, discarded and helper lanes, counts and probes.

use super::*;

#[test]
fn derivatives_are_differences_within_quads() {
    let source = "@fragment fn main(@location(0) x: f32) -> @location(0) vec4f {
        let v = x * x;
        return vec4(dpdx(v), dpdy(v), dpdxCoarse(v), fwidthCoarse(v));
    }";
    let outcome = run(source);
    for lane in 0..LANES {
        let quad = lane / 4 * 4;
        let v = |corner: usize| ((quad + corner) * (quad + corner)) as f32;
        let (row, column) = (lane % 4 / 2 * 2, lane % 2);
        assert_eq!(
            outcome.float(0, lane),
            v(row + 1) - v(row),
            "dpdx, lane {lane}"
        );
        assert_eq!(
            outcome.float(1, lane),
            v(column + 2) - v(column),
            "dpdy, lane {lane}"
        );
        assert_eq!(
            outcome.float(2, lane),
            v(1) - v(0),
            "dpdxCoarse, lane {lane}"
        );
        let width = (v(1) - v(0)).abs() + (v(2) - v(0)).abs();
        assert_eq!(outcome.float(3, lane), width, "fwidthCoarse, lane {lane}");
    }
    // What is the same for all lanes does not change.
    check("return dpdx(3.0 * f32(i > -1));", |_| 0.0);
}

#[test]
fn discarded_lanes_go_on_as_helpers() {
    // Lanes 1 mod 4 are discarded, and still give their neighbours a derivative.
    let source = "@fragment fn main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32)
        -> @location(0) vec2f {
        if i % 4 == 1 { discard; }
        let v = x * 3.0;
        return vec2(dpdx(v), v);
    }";
    let outcome = run(source);
    for lane in 0..LANES {
        assert_eq!(outcome.kept.has(lane), lane % 4 != 1);
        if lane % 4 != 1 {
            assert_eq!(outcome.float(0, lane), 3.0, "lane {lane}");
            assert_eq!(outcome.float(1, lane), lane as f32 * 3.0);
        }
    }
}

#[test]
fn dead_quads_stop() {
    // Without the discard, the loop would not end in the first eight lanes.
    let source = "@fragment fn main(@location(0) @interpolate(flat) i: i32) -> @location(0) f32 {
        if i < 8 { discard; }
        var k = i; loop { if k >= 8 { break; } }
        return f32(k);
    }";
    let outcome = run(source);
    assert_eq!(outcome.profile.ran_away, 0);
    assert_eq!(outcome.kept, Mask([!0xFF, !0, !0, !0]));
    assert_eq!(outcome.float(0, 9), 9.0);
}

#[test]
fn loops_that_do_not_end_are_stopped() {
    let source = "@fragment fn main(@location(0) @interpolate(flat) i: i32) -> @location(0) vec2f {
        var k = i; loop { if k >= 8 { break; } k -= 1; if k < -5 { k = -5; } }
        return vec2(f32(k), 1.0);
    }";
    let outcome = run(source);
    assert_eq!(outcome.profile.ran_away, 8);
    for lane in 0..LANES {
        assert_eq!(outcome.float(0, lane).is_nan(), lane < 8);
        assert_eq!(outcome.float(1, lane).is_nan(), lane < 8);
    }
}

fn run_masked(source: &str, active: Mask, covered: Mask) -> (Vec<Words>, Profile) {
    let program = compile(source);
    let bindings = Bindings::new();
    let mut machine = Machine::new(&program, &bindings);
    let mut outputs = vec![[0; LANES]; program.outputs().len()];
    machine.run(&numbered(&program), active, covered, &mut outputs);
    (outputs, machine.profile())
}

#[test]
fn work_is_counted_where_it_is_done() {
    let source = "@fragment fn main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32)
        -> @location(0) f32 {
        var r = x;
        if i < 16 { r = sqrt(x) / x; } else { r = x + 1.0; }
        for (var k = 0; k < i / 64; k++) { r *= 2.0; }
        return r;
    }";
    let covered = Mask([0xFFFF_FFFF, 0, 0, 1]);
    let (_, profile) = run_masked(source, Mask::ALL, covered);
    assert_eq!(profile.lanes, 33);
    // 16 lanes do the root and the division.
    assert_eq!(profile.work.special, 32.0 + division(33.0 + 3.0));
    // All do one comparison; 17 the addition; the last one goes round three times: comparison,
    // division (10), product and increment; all do the comparison and division that end the loop.
    let expected = 33.0 + 17.0 + 3.0 * (1.0 + 10.0 + 2.0) + 33.0 * 11.0;
    assert_eq!(profile.work.simple, expected);
    assert_eq!(profile.work.samples, 0.0);
}

/// Quarter-rate operations in so many divisions of integers.
fn division(count: f64) -> f64 {
    count
}

#[test]
fn discarded_lanes_work_no_more() {
    let source = "@fragment fn main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32)
        -> @location(0) f32 { if i < 2 { discard; } return x * x; }";
    let (_, profile) = run_masked(source, Mask([15, 0, 0, 0]), Mask([7, 0, 0, 0]));
    assert_eq!(profile.lanes, 3);
    assert_eq!(profile.work.simple, 3.0 + 1.0);
}

#[test]
fn probes_see_covered_active_lanes() {
    let source = "@fragment fn main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32)
        -> @location(0) f32 {
        var r = 0.0;
        if i >= 2 { let v = vec2(x * 0.5, -x); r = v.x + v.y; }
        return r;
    }";
    let module = module(source);
    let function = &module.entry_points[0].function;
    let named = |name: &str| {
        let found = function.named_expressions.iter().find(|(_, n)| *n == name);
        *found.expect("it has a name").0
    };
    let argument = function
        .expressions
        .iter()
        .find(|(_, e)| matches!(e, naga::Expression::FunctionArgument(0)))
        .map(|(h, _)| h)
        .expect("there is an argument");
    let integer = function
        .expressions
        .iter()
        .find(|(_, e)| matches!(e, naga::Expression::FunctionArgument(1)))
        .map(|(h, _)| h)
        .expect("there is an argument");
    let program =
        Program::compile(&module, 0, &[named("v"), argument, integer]).expect("it compiles");
    let bindings = Bindings::new();
    let mut machine = Machine::new(&program, &bindings);
    let mut outputs = vec![[0; LANES]];
    let mut inputs = numbered(&program);
    machine.run(
        &inputs,
        Mask([0xFF, 0, 0, 0]),
        Mask([0x3F, 0, 0, 0]),
        &mut outputs,
    );
    let profile = machine.profile();
    // Lanes 2 to 5.
    let half = Probe {
        count: 4,
        weight: 4.0,
        sum: 7.0,
        min: 1.0,
        max: 2.5,
    };
    assert_eq!(profile.probes[0][0], half);
    assert_eq!(
        (profile.probes[0][1].sum, profile.probes[0][1].min),
        (-14.0, -5.0)
    );
    assert_eq!(
        (profile.probes[1][0].count, profile.probes[1][0].sum),
        (6, 15.0)
    );
    assert!(profile.probes[2].is_empty());
    inputs[0][3] = f32::NAN.to_bits();
    machine.run(&inputs, Mask::ALL, Mask([0xFF, 0, 0, 0]), &mut outputs);
    let probe = machine.profile().probes[0][0];
    assert!(probe.min.is_nan() && probe.max.is_nan() && probe.count == 4 + 6);
}
