// Pointers into uniforms and private variables, kept in a let and passed to functions.
struct Lamp {
    colour: vec3f,
    strength: f32,
}

struct Rig {
    lamps: array<Lamp, 3>,
    gain: f32,
}

struct Tally {
    sum: vec3f,
    count: i32,
}

@group(0) @binding(0) var<uniform> rig: Rig;
var<private> tally: Tally;
var<private> spare: array<f32, 4>;
var<private> first: f32;

fn add(t: ptr<private, Tally>, colour: vec3f) -> bool {
    if colour.x < 0.05 {
        return false;
    }
    (*t).sum += colour;
    (*t).count += 1;
    return true;
}

fn put(value: ptr<private, f32>, to: f32) {
    *value = to;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    for (var i = 0; i < 3; i++) {
        let lamp = &rig.lamps[i];
        let strength = (*lamp).strength * rig.gain;
        if !add(&tally, (*lamp).colour * strength * fract(uv.x * f32(i + 1))) {
            continue;
        }
        let slot = &spare[i + 1];
        *slot += strength;
    }
    let all = &tally;
    let before = *all;
    (*all).sum.y += 0.125;
    let gain = &rig.gain;
    put(&first, uv.y * *gain);
    return vec4f((tally.sum + before.sum) * 0.3, 1.0) + vec4f(first, spare[2], spare[3] * f32(before.count) * 0.1, 0.0) * 0.2;
}
