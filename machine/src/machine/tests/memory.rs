//! Variables, pointers, composites and buffers.

use super::*;

fn buffer(words: &[u32]) -> Resource {
    Resource::Buffer(Arc::new(
        words.iter().flat_map(|w| w.to_le_bytes()).collect(),
    ))
}

fn float_buffer(values: &[f32]) -> Resource {
    buffer(&values.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
}

/// Runs a shader with buffers at bindings 0, 1, ... and compares its float for every lane.
fn check_buffers(source: &str, buffers: &[Resource], expected: impl Fn(usize) -> f32) {
    let bindings = buffers
        .iter()
        .enumerate()
        .map(|(i, buffer)| ((0, i as u32), buffer.clone()))
        .collect();
    let outcome = run_bound(&compile(source), &bindings);
    for (lane, got) in outcome.floats().into_iter().enumerate() {
        let want = expected(lane);
        assert_eq!(
            words::bits(got),
            words::bits(want),
            "lane {lane}: {got}, not {want}"
        );
    }
}

#[test]
fn local_arrays_by_index() {
    check(
        "var t = array<f32, 6>(1.0, 2.0, 4.0, 8.0, 16.0, 32.0);
         t[i % 6] += x; if i > 100 { t[(i + 1) % 6] = 0.5; }
         var s = 0.0; for (var k = 0; k < 6; k++) { s += t[k] * f32(k + 1); } return s;",
        |i| {
            let mut t = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0f32];
            t[(i % 6) as usize] += i as f32;
            if i > 100 {
                t[((i + 1) % 6) as usize] = 0.5;
            }
            let mut s = 0.0;
            for (k, t) in t.iter().enumerate() {
                s += t * (k + 1) as f32;
            }
            s
        },
    );
    // Outside: the last one.
    check(
        "var t = array<f32, 3>(1.0, 2.0, 3.0); return t[i + 1];",
        |i| [2.0, 3.0][i.min(1) as usize],
    );
    check("var t = array<f32, 3>(1.0, 2.0, 3.0); return t[-i];", |i| {
        if i == 0 { 1.0 } else { 3.0 }
    });
}

#[test]
fn arrays_of_structures_by_index() {
    check_with(
        "struct Part { p: vec2f, n: i32, on: bool }",
        "var t: array<Part, 3>;
         for (var k = 0; k < 3; k++) { t[k] = Part(vec2(f32(k), x), k * 10, k == i % 3); }
         t[i % 3].p.y = -1.0;
         let q = t[(i + 1) % 3]; let r = t[i % 3];
         return q.p.x + q.p.y * 10.0 + f32(q.n) + select(0.0, 500.0, q.on) + select(0.0, 1000.0, r.on) + r.p.y;",
        |i| {
            let q = (i + 1) % 3;
            q as f32 + i as f32 * 10.0 + (q * 10) as f32 + 1000.0 - 1.0
        },
    );
}

#[test]
fn vectors_and_matrices_by_index() {
    check(
        "var v = vec4(1.0, 2.0, 3.0, 4.0); v[i & 3] = x; return v[(i + 1) & 3] + v.x;",
        |i| {
            let mut v = [1.0, 2.0, 3.0, 4.0];
            v[(i & 3) as usize] = i as f32;
            v[((i + 1) & 3) as usize] + v[0]
        },
    );
    check("let v = vec3(x, 2.0, 3.0); return v[u32(i) % 3u];", |i| {
        [i as f32, 2.0, 3.0][(i % 3) as usize]
    });
    check(
        "var m = mat2x3(1.0, 2.0, 3.0, 4.0, 5.0, 6.0); m[i & 1][(i >> 1u) % 3] = x; return m[0].y + m[1].z * 100.0;",
        |i| {
            let mut m = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
            m[(i & 1) as usize][((i >> 1) % 3) as usize] = i as f32;
            m[0][1] + m[1][2] * 100.0
        },
    );
}

#[test]
fn tables_of_constants_by_index() {
    check_with(
        "const TABLE = array<vec2f, 8>(vec2(0.0, 1.0), vec2(2.0, 3.0), vec2(4.0, 5.0), vec2(6.0, 7.0),
            vec2(8.0, 9.0), vec2(10.0, 11.0), vec2(12.0, 13.0), vec2(14.0, 15.0));",
        "var s = 0.0; for (var k = 0; k < 3; k++) { s += TABLE[(i + k) & 7].y; } return s;",
        |i| (0..3).map(|k| (((i + k) & 7) * 2 + 1) as f32).sum(),
    );
}

#[test]
fn pointers_as_arguments() {
    let items = "
        struct Two { a: f32, list: array<f32, 4> }
        fn add(p: ptr<function, f32>, by: f32) { *p += by; if by > 3.0 { return; } *p *= 2.0; }
        fn fill(p: ptr<function, array<f32, 4>>, n: i32) { for (var k = 0; k < n; k++) { (*p)[k] = f32(k + 1); } }";
    check_with(
        items,
        "var t: Two; t.a = x; add(&t.a, f32(i % 6)); fill(&t.list, i % 5); add(&t.list[2], 1.0);
         return t.a + t.list[0] + t.list[2] * 10.0 + t.list[3] * 100.0;",
        |i| {
            let add = |p: f32, by: f32| if by > 3.0 { p + by } else { (p + by) * 2.0 };
            let mut list = [0.0; 4];
            for k in 0..i % 5 {
                list[k as usize] = (k + 1) as f32;
            }
            list[2] = add(list[2], 1.0);
            add(i as f32, (i % 6) as f32) + list[0] + list[2] * 10.0 + list[3] * 100.0
        },
    );
}

#[test]
fn private_variables_and_overrides() {
    check_with(
        "var<private> seed: u32 = 5u; var<private> total: f32; override gain = 3.0; override twice = gain * 2.0;
         fn next() -> f32 { seed = seed * 13u + 7u; total += 1.0; return f32(seed & 15u); }",
        "var s = 0.0; if i > 3 { s += next(); } s += next() * twice; return s + total * 100.0;",
        |i| {
            let first = (5u32 * 13 + 7) & 15;
            let second = ((5u32 * 13 + 7) * 13 + 7) & 15;
            if i > 3 {
                first as f32 + second as f32 * 6.0 + 200.0
            } else {
                first as f32 * 6.0 + 100.0
            }
        },
    );
}

#[test]
fn uniform_buffers_in_their_layout() {
    // a at 0, m at 16 (columns every 16), s at 64, list at 80 (every 16), small at 128 (every 8).
    let source = "
        struct U { a: f32, m: mat3x3f, s: vec2i, list: array<vec4f, 3>, small: mat2x2f }
        @group(0) @binding(0) var<uniform> u: U;
        @fragment fn main(@location(0) @interpolate(flat) i: i32) -> @location(0) f32 {
            let whole = u;
            return u.a + u.m[1].z + f32(u.s.y) + u.list[i % 3].w + whole.small[1].y + u.m[i % 3][i & 1];
        }";
    let values: Vec<f32> = (0..40).map(|i| i as f32).collect();
    let mut words: Vec<u32> = values.iter().map(|x| x.to_bits()).collect();
    words[17] = 1000;
    check_buffers(source, &[buffer(&words)], |i| {
        let matrix = 4 + i % 3 * 4 + (i & 1);
        0.0 + 10.0 + 1000.0 + (20 + i % 3 * 4 + 3) as f32 + 35.0 + matrix as f32
    });
}

#[test]
fn storage_buffers_and_their_ends() {
    let source = "
        struct Item { p: vec3f, id: u32 }
        struct Items { count: u32, list: array<Item> }
        @group(0) @binding(0) var<storage> items: Items;
        @group(0) @binding(1) var<storage> plain: array<f32>;
        @fragment fn main(@location(0) @interpolate(flat) i: i32) -> @location(0) f32 {
            let n = arrayLength(&items.list);
            return items.list[i].p.y + f32(items.list[i].id) * 10.0 + f32(n) * 1000.0
                + plain[i - 2] + f32(arrayLength(&plain)) * 10000.0;
        }";
    let mut items = vec![3, 0, 0, 0];
    for k in 0..3u32 {
        items.extend([0, (k as f32 + 0.5).to_bits(), 0, k]);
    }
    let plain = [0.25, 0.75];
    check_buffers(source, &[buffer(&items), float_buffer(&plain)], |i| {
        let k = i.min(2) as f32;
        // Indices are clamped; -2 and -1 are the largest ones.
        let p = plain[if i == 2 { 0 } else { 1 }];
        k + 0.5 + k * 10.0 + 3000.0 + p + 20000.0
    });
}

#[test]
fn values_of_buffers_are_computed_once() {
    let source = "
        struct Light { at: vec3f, power: f32 }
        struct U { count: i32, lights: array<Light, 4> }
        @group(0) @binding(0) var<uniform> u: U;
        @fragment fn main(@location(0) x: f32) -> @location(0) f32 {
            var s = 0.0;
            for (var k = 0; k < u.count; k++) {
                let l = u.lights[k];
                if x < 0.0 { continue; }
                s += x * length(l.at) * pow(l.power, 2.0);
            }
            return s;
        }";
    let program = compile(source);
    // The loop, its counter, and everything about the lights are uniform; left are the comparison, the
    // two products and the sum.
    let varying = program
        .code
        .instructions
        .iter()
        .filter(|i| matches!(i, Instruction::Op { to, .. } if !to.is_uniform()))
        .count();
    assert_eq!(varying, 4, "{:#?}", program.code);
}

#[test]
fn refuses_what_it_does_not_run() {
    let cases = [
        (
            "@group(0) @binding(0) var<storage, read_write> b: array<f32>;",
            "b[0] = x;",
            "a write to a buffer",
        ),
        (
            "@group(0) @binding(0) var<storage, read_write> b: atomic<u32>;",
            "atomicAdd(&b, 1u);",
            "an atomic operation",
        ),
        (
            "@group(0) @binding(0) var t: texture_storage_2d<rgba8unorm, write>;",
            "textureStore(t, vec2(0), vec4(x));",
            "a write to a storage texture",
        ),
        (
            "@group(0) @binding(0) var t: texture_multisampled_2d<f32>;",
            "let v = textureLoad(t, vec2(0), 0);",
            "a multisampled texture",
        ),
        (
            "@group(0) @binding(0) var t: texture_external; @group(0) @binding(1) var s: sampler;",
            "let v = textureSampleBaseClampToEdge(t, s, vec2(x));",
            "an external texture",
        ),
        (
            "override k: f32;",
            "return k;",
            "an override without a default value",
        ),
    ];
    for (items, body, what) in cases {
        let source = format!(
            "{items}
            @fragment fn main(@location(0) x: f32) -> @location(0) f32 {{ {body} return x; }}"
        );
        let refused = refuse(&source);
        assert_eq!(refused.what, what);
        let range = refused.span.to_range().expect("it has a place");
        assert!(range.end <= source.len() && !range.is_empty());
    }
    let refused = refuse(
        "enable f16; @fragment fn main(@location(0) x: f32) -> @location(0) f32 { return f32(f16(x)); }",
    );
    assert_eq!(refused.what, "numbers of 16 or 64 bits");
}

#[test]
fn members_beside_indexed_arrays() {
    check_with(
        "struct Local { n: i32, list: array<i32, 4> }",
        "var u: Local; u.n = 3; var b = 2;
         for (var k = 0; k < 4; k++) { u.list[k] = k * 7 + 5; }
         return f32(u.n * 1000 + u.list[b & 3]);",
        |_| 3019.0,
    );
}

#[test]
fn buffers_copied_in_a_loop() {
    let source = "
        struct U { n: i32, list: array<vec4i, 4> }
        @group(0) @binding(0) var<uniform> u: U;
        @fragment fn main(@location(0) @interpolate(flat) i: i32) -> @location(0) f32 {
            var list: array<i32, 4>;
            for (var k = 0; k < 4; k++) { list[k] = u.list[k].x; }
            var s = 0; for (var k = 0; k < u.n; k++) { s = u.n * 1000 + list[2]; }
            return f32(s);
        }";
    let mut words = vec![0; 20];
    (words[0], words[4], words[8], words[12], words[16]) = (3, 5, 0, 9, 2);
    check_buffers(source, &[buffer(&words)], |_| 3009.0);
}
