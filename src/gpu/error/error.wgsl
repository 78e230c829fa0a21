// The error sums of pictures: what `src/search/error` adds up on the CPU, in the same order as far as numbers go.

struct Picture {
    // Width and height in pixels.
    size: vec2u,
    // Fine pixels to a pixel along each axis, of the picture that the reference is made of.
    grid: u32,
    // What the shader returns: 0 linear light, 1 encoded, 2 light without a limit.
    output: u32,
    // With the last: 0 cut off, 1 Reinhard, 2 ACES.
    tone_mapping: u32,
    exposure: f32,
    // How many drawings there are, counting the one that is added.
    drawings: u32,
    // Where the frame's tiles begin among all.
    first_tile: u32,
    // Whether colours are premultiplied, with coverage.
    blends: u32,
}

// The mean of a pixel's samples, linear and premultiplied: the bits of floats.
struct Mean {
    // Over black; their covered share.
    black: vec4u,
    // How much more that is over white.
    more: vec4u,
}

// What the drawings of a frame leave at a pixel. Differences are over black, then over white; those of the first
// drawing are kept, and the others taken from it, so that what does not vary has a variance of exactly 0.
struct Total {
    // The first differences over black; the sum of squares, each the mean of six.
    black: vec4f,
    // The first differences over white; the largest of all, whatever its sign.
    white: vec4f,
    // Sums of what the others differ from the first ones; the sum of the squares of that, of six.
    black_sum: vec4f,
    white_sum: vec4f,
}

@group(0) @binding(0) var<uniform> picture: Picture;
// The bits of floats.
@group(0) @binding(1) var colours: texture_2d<u32>;
// 1 where something is drawn.
@group(0) @binding(2) var covered: texture_2d<u32>;
@group(0) @binding(3) var<storage, read_write> reference: array<Mean>;
@group(0) @binding(4) var<storage, read_write> totals: array<Total>;
// For each tile: squares, coverage, largest difference, variance.
@group(0) @binding(5) var<storage, read_write> tiles: array<vec4f>;

const NAN = 0x7fc00000u;
// Light beyond this is as bright as can be, and its square is a number.
const BRIGHTEST = 1e9;

fn is_nan(bits: u32) -> bool {
    return (bits & 0x7fffffffu) > 0x7f800000u;
}

// What a number of 0..1 is encoded as in sRGB; what is outside is clamped.
fn encode(linear: f32) -> f32 {
    let x = clamp(linear, 0.0, 1.0);
    let t = sqrt(sqrt(sqrt(x))) - 0.75;
    var power = -0.03346191 + t * 0.01289352;
    power = 0.18403861 + t * power;
    power = 1.656745 + t * power;
    power = 2.7957164 + t * power;
    power = 1.7972456 + t * power;
    return select(min(0.3493803 + t * power, 1.0), 12.92 * x, x <= 0.0031308);
}

// The other way.
fn decode(encoded: f32) -> f32 {
    let x = clamp(encoded, 0.0, 1.0);
    let y = (x + 0.055) / 1.055;
    let t = sqrt(sqrt(y)) - 0.75;
    var power = -0.030011794 + t * 0.02004144;
    power = 0.044822954 + t * power;
    power = -0.095708475 + t * power;
    power = 0.5385361 + t * power;
    power = 1.346346 + t * power;
    power = 0.6310998 + t * power;
    return select(y * y * power, x / 12.92, x <= 0.04045);
}

// What a display shows of a component, in linear light of 0..1. It is no NaN.
fn displayed(bits: u32) -> f32 {
    // An infinity is told by its bits: drivers may take it that there is none.
    let endless = (bits & 0x7fffffffu) == 0x7f800000u;
    var light = bitcast<f32>(select(bits, 0u, endless));
    if endless {
        light = select(0.0, BRIGHTEST, bits == 0x7f800000u);
    }
    if picture.output == 0u {
        return clamp(light, 0.0, 1.0);
    }
    if picture.output == 1u {
        return decode(light);
    }
    // Clamped before and after, so that the product is a number too.
    light = clamp(clamp(light, 0.0, BRIGHTEST) * picture.exposure, 0.0, BRIGHTEST);
    if picture.tone_mapping == 1u {
        light = light / (1.0 + light);
    } else if picture.tone_mapping == 2u {
        light = light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14);
    }
    return min(light, 1.0);
}

// How much more it shows over white, where a pixel holds a colour over black of these bits and as much coverage.
fn through(bits: u32, coverage: u32) -> f32 {
    if picture.blends == 0u {
        return 0.0;
    }
    let black = displayed(bits);
    let kept = 1.0 - bitcast<f32>(coverage);
    if picture.output == 1u {
        return displayed(bitcast<u32>(bitcast<f32>(bits) + kept)) - black;
    }
    return min(kept, 1.0 - black);
}

// The reference: the mean of each pixel's fine ones.
@compute @workgroup_size(8, 8)
fn average(@builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= picture.size) {
        return;
    }
    var sum = vec3f();
    var more = vec3f();
    var nan = vec3<bool>();
    var count = 0u;
    for (var y = 0u; y < picture.grid; y++) {
        for (var x = 0u; x < picture.grid; x++) {
            let fine = at.xy * picture.grid + vec2u(x, y);
            if textureLoad(covered, fine, 0).x == 0u {
                more += 1.0;
                continue;
            }
            count++;
            let bits = textureLoad(colours, fine, 0);
            for (var i = 0u; i < 3u; i++) {
                if is_nan(bits[i]) {
                    nan[i] = true;
                } else {
                    sum[i] += displayed(bits[i]);
                    more[i] += through(bits[i], bits.w);
                }
            }
        }
    }
    let all = f32(picture.grid * picture.grid);
    let mean = select(bitcast<vec3u>(sum / all), vec3u(NAN), nan);
    reference[at.y * picture.size.x + at.x] = Mean(
        vec4u(mean, bitcast<u32>(f32(count) / all)),
        vec4u(bitcast<vec3u>(more / all), 0u),
    );
}

// Adds a drawing.
@compute @workgroup_size(8, 8)
fn add(@builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= picture.size) {
        return;
    }
    let pixel = at.y * picture.size.x + at.x;
    let mean = reference[pixel];
    let drawn = textureLoad(covered, at.xy, 0).x != 0u;
    let bits = textureLoad(colours, at.xy, 0);
    var black = vec3f();
    var white = vec3f();
    for (var i = 0u; i < 3u; i++) {
        // A NaN in the reference counts as 0, over white too.
        var over_black = 0.0;
        var over_white = 0.0;
        if !is_nan(mean.black[i]) {
            let light = bitcast<f32>(mean.black[i]);
            over_black = encode(light);
            over_white = encode(light + bitcast<f32>(mean.more[i]));
        }
        if !drawn {
            black[i] = -over_black;
            white[i] = 1.0 - over_white;
        } else if is_nan(bits[i]) {
            // As wrong as a colour can be.
            black[i] = 1.0;
            white[i] = 1.0;
        } else {
            let light = displayed(bits[i]);
            black[i] = encode(light) - over_black;
            white[i] = encode(light + through(bits[i], bits.w)) - over_white;
        }
    }
    let square = (dot(black, black) + dot(white, white)) / 6.0;
    let either = max(abs(black), abs(white));
    let largest = max(max(either.x, either.y), either.z);
    if picture.drawings == 1u {
        totals[pixel] = Total(vec4f(black, square), vec4f(white, largest), vec4f(), vec4f());
        return;
    }
    var total = totals[pixel];
    let from_black = black - total.black.xyz;
    let from_white = white - total.white.xyz;
    total.black.w += square;
    total.white.w = max(total.white.w, largest);
    let spread = dot(from_black, from_black) + dot(from_white, from_white);
    total.black_sum += vec4f(from_black, spread);
    total.white_sum += vec4f(from_white, 0.0);
    totals[pixel] = total;
}

// One workgroup is one tile.
var<workgroup> shares: array<vec4f, 64>;

// Sums the drawings of a frame, tile by tile: pairs of pixels, then pairs of pairs, always the same ones.
@compute @workgroup_size(8, 8)
fn finish(
    @builtin(global_invocation_id) at: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) tile: vec3u,
) {
    var share = vec4f();
    if all(at.xy < picture.size) {
        let pixel = at.y * picture.size.x + at.x;
        let total = totals[pixel];
        var variance = 0.0;
        if picture.drawings > 1u {
            let drawings = f32(picture.drawings);
            let of_black = dot(total.black_sum.xyz, total.black_sum.xyz);
            let of_white = dot(total.white_sum.xyz, total.white_sum.xyz);
            let spread = total.black_sum.w - (of_black + of_white) / drawings;
            variance = max(spread, 0.0) / (6.0 * (drawings - 1.0));
        }
        let coverage = bitcast<f32>(reference[pixel].black.w);
        share = vec4f(total.black.w, coverage, total.white.w, variance);
    }
    shares[local] = share;
    for (var half = 32u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            let a = shares[local];
            let b = shares[local + half];
            shares[local] = vec4f(a.xy + b.xy, max(a.z, b.z), a.w + b.w);
        }
    }
    if local == 0u {
        let across = (picture.size.x + 7u) / 8u;
        tiles[picture.first_tile + tile.y * across + tile.x] = shares[0];
    }
}
