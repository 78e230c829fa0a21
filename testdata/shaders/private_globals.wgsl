// Private variables carry state between calls; they start afresh in every invocation.
struct State {
    seed: u32,
    calls: i32,
    history: array<f32, 3>,
}

var<private> state: State = State(7u, 0, array<f32, 3>(0.1, 0.2, 0.3));
var<private> total: f32;
var<private> colour = vec3f(0.25, 0.5, 0.75);

fn next() -> f32 {
    state.seed = state.seed * 1664525u + 1013904223u;
    let value = f32(state.seed >> 8u) / 16777216.0;
    state.history[state.calls % 3] = value;
    state.calls++;
    return value;
}

fn maybe_next(x: f32) -> f32 {
    if x < 0.4 {
        return total;
    }
    total += next();
    return total * 0.5;
}

fn stir(amount: f32) {
    if amount > 0.5 {
        colour = colour.zxy;
        return;
    }
    colour.y *= amount;
}

@fragment
fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    state.seed += u32(uv.x * 64.0);
    let a = maybe_next(uv.x) + maybe_next(uv.y);
    for (var i = 0; i < 3; i++) {
        if next() > 0.6 {
            stir(uv.y);
        }
    }
    let b = state.history[0] + state.history[1] * state.history[2];
    return vec4f(fract(colour + vec3f(a, b, f32(state.calls) * 0.1)), 1.0);
}
