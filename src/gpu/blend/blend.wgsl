// What layers leave of a picture, pixel by pixel, from the nearest to the farthest: what `src/eval/draw/blend.rs` composes
// from the farthest.

struct Told {
    // Width and height in fine pixels.
    size: vec2u,
    // Whether the target holds 0..1 alone.
    clamped: u32,
    // Whether there is no layer before.
    first: u32,
}

@group(0) @binding(0) var<uniform> told: Told;
// What was drawn: the bits of floats, and the order of each fragment, or 0 where nothing is.
@group(0) @binding(1) var drawn: texture_2d<u32>;
@group(0) @binding(2) var orders: texture_2d<u32>;
// What is composed of the layers before: premultiplied colour and coverage, and how much of what is behind is still
// seen. The bits of floats.
@group(0) @binding(3) var composed: texture_2d<u32>;
@group(0) @binding(4) var kept: texture_2d<u32>;
// The same with what was drawn; at the end the picture, and 1 where it is none that any background looks like.
@group(0) @binding(5) var composed_then: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(6) var kept_then: texture_storage_2d<r32uint, write>;
// How many fragments the layer has.
@group(0) @binding(7) var<storage, read_write> found: atomic<u32>;

const ALPHA = 1u;
const PREMULTIPLIED = 2u;
const ADDITIVE = 3u;

// A number within 0..1. What is not finite is told by its bits: drivers may take it that there is none.
fn of_one(bits: u32) -> f32 {
    let size = bits & 0x7fffffffu;
    if size > 0x7f800000u {
        return bitcast<f32>(bits);
    }
    if size == 0x7f800000u {
        return select(0.0, 1.0, bits == size);
    }
    return clamp(bitcast<f32>(bits), 0.0, 1.0);
}

// What the target holds of a fragment's colour.
fn held(bits: vec4u) -> vec4f {
    var colour = bitcast<vec4f>(bits);
    if told.clamped != 0u {
        colour = vec4f(of_one(bits.x), of_one(bits.y), of_one(bits.z), 0.0);
    }
    return vec4f(colour.xyz, of_one(bits.w));
}

// A layer.
@compute @workgroup_size(8, 8)
fn add(@builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= told.size) {
        return;
    }
    var before = vec4f();
    var still = 1.0;
    if told.first == 0u {
        before = bitcast<vec4f>(textureLoad(composed, at.xy, 0));
        still = bitcast<f32>(textureLoad(kept, at.xy, 0).x);
    }
    let order = textureLoad(orders, at.xy, 0).x;
    if order != 0u {
        atomicAdd(&found, 1u);
        let colour = held(textureLoad(drawn, at.xy, 0));
        let blend = order & 3u;
        var light = colour.xyz;
        if blend != PREMULTIPLIED {
            light *= colour.w;
        }
        before += vec4f(still * light, 0.0);
        if blend != ADDITIVE {
            before.w += still * colour.w;
            still *= 1.0 - colour.w;
        }
    }
    textureStore(composed_then, at.xy, bitcast<vec4u>(before));
    textureStore(kept_then, at.xy, vec4u(bitcast<u32>(still)));
}

// What is opaque, behind all layers.
@compute @workgroup_size(8, 8)
fn finish(@builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= told.size) {
        return;
    }
    var before = vec4f();
    var still = 1.0;
    if told.first == 0u {
        before = bitcast<vec4f>(textureLoad(composed, at.xy, 0));
        still = bitcast<f32>(textureLoad(kept, at.xy, 0).x);
    }
    if textureLoad(orders, at.xy, 0).x != 0u {
        let colour = held(textureLoad(drawn, at.xy, 0));
        before += still * vec4f(colour.xyz, 1.0);
    }
    let bits = bitcast<vec4u>(before);
    let seen = any((bits & vec4u(0x7fffffffu)) != vec4u());
    textureStore(composed_then, at.xy, bits);
    textureStore(kept_then, at.xy, vec4u(u32(seen)));
}
