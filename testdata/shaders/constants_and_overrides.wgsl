// Constants of every kind, tables indexed at run time, overrides with and without ids, and what depends on them.
const STEPS = 3;
const SCALE = 1.0 / f32(STEPS);
const AXES = array<vec3f, 3>(vec3f(1, 0, 0), vec3f(0, 1, 0), vec3f(0, 0, 1));
const TABLE = array(0.1, 0.4, 0.2, 0.8, 0.6);
const MASK = (1u << 5u) - 1u;
const LOWEST = i32(-2147483648);
const TURN = mat2x2f(0.0, 1.0, -1.0, 0.0);
const_assert STEPS * 2 == 6;

override gain: f32 = 0.75;
@id(12) override rounds: i32 = 2;
override bright = true;
override doubled: f32 = gain * 2.0 + f32(rounds);
@id(3) override levels: u32 = 4u;

fn quantised(x: f32) -> f32 {
    let n = f32(levels);
    return floor(x * n) / n;
}

@fragment
fn fs_main(@location(0) uv: vec2f, @location(1) normal: vec3f) -> @location(0) vec4f {
    var sum = vec3f(0.0);
    for (var i = 0; i < STEPS; i++) {
        sum += AXES[i] * abs(dot(normal, AXES[(i + 1) % STEPS])) * SCALE;
    }
    let at = u32(uv.x * 31.0) & MASK;
    var value = TABLE[at % 5u];
    for (var r = 0; r < rounds; r++) {
        value = value * gain + 0.1;
    }
    if bright {
        value += 0.1;
    }
    let turned = TURN * uv;
    let lowest = select(0.0, 0.125, LOWEST + 1 < -2147483646);
    return vec4f(sum + vec3f(value, quantised(turned.y) * 0.1, lowest + fract(doubled) * 0.2), 1.0);
}
