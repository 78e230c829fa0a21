// A watermelon without a single texture: stripes whose edges are torn by turbulence, veins, mottling,
// dents, a pale belly and a woody scar at the stem, all from noise on the object's own position.

struct Globals {
    view_proj: mat4x4f,
    camera_position: vec3f,
    time: f32,
}

struct Sun {
    direction: vec3f,
    colour: vec3f,
    ambient: vec3f,
}

struct Melon {
    light_rind: vec3f,
    stripes: f32,
    dark_rind: vec3f,
    raggedness: f32,
    belly: vec3f,
    dents: f32,
    ripeness: f32,
}

@group(0) @binding(0) var<uniform> globals: Globals;
@group(0) @binding(1) var<uniform> sun: Sun;
@group(1) @binding(0) var<uniform> model: mat4x4f;
@group(1) @binding(1) var<uniform> melon: Melon;

const PI = 3.14159265;
const STEM_COLOUR = vec3f(0.23, 0.16, 0.07);

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
}

struct Fragment {
    @builtin(position) clip_position: vec4f,
    @location(0) world_position: vec3f,
    @location(1) world_normal: vec3f,
    @location(2) object_position: vec3f,
}

@vertex
fn vs_main(vertex: Vertex) -> Fragment {
    var out: Fragment;
    let world = model * vec4f(vertex.position, 1.0);
    out.clip_position = globals.view_proj * world;
    out.world_position = world.xyz;
    out.world_normal = (model * vec4f(vertex.normal, 0.0)).xyz;
    out.object_position = vertex.position;
    return out;
}

fn scramble(value: u32) -> u32 {
    var x = value;
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    x ^= x >> 16u;
    return x;
}

// One of twelve directions to the edges of a cube, dotted with `offset`.
fn corner(cell: vec3i, offset: vec3f) -> f32 {
    let h = scramble(u32(cell.x) + 1619u * u32(cell.y) + 31337u * u32(cell.z)) & 15u;
    let u = select(offset.y, offset.x, h < 8u);
    let v = select(select(offset.z, offset.x, h == 12u || h == 14u), offset.y, h < 4u);
    return select(-u, u, (h & 1u) == 0u) + select(-v, v, (h & 2u) == 0u);
}

// Gradient noise, about -1..1.
fn noise(p: vec3f) -> f32 {
    let cell = vec3i(floor(p));
    let f = fract(p);
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    var planes: array<f32, 2>;
    for (var z = 0; z < 2; z++) {
        let dz = vec3f(0.0, 0.0, f32(z));
        let a = corner(cell + vec3i(0, 0, z), f - dz);
        let b = corner(cell + vec3i(1, 0, z), f - dz - vec3f(1.0, 0.0, 0.0));
        let c = corner(cell + vec3i(0, 1, z), f - dz - vec3f(0.0, 1.0, 0.0));
        let d = corner(cell + vec3i(1, 1, z), f - dz - vec3f(1.0, 1.0, 0.0));
        planes[z] = mix(mix(a, b, w.x), mix(c, d, w.x), w.y);
    }
    return mix(planes[0], planes[1], w.z);
}

// Folded noise: sharp creases where the noise passes through zero.
fn turbulence(p: vec3f, octaves: u32) -> f32 {
    var sum = 0.0;
    var frequency = 1.0;
    for (var i = 0u; i < octaves; i++) {
        sum += abs(noise(p * frequency)) / frequency;
        frequency *= 2.1;
    }
    return sum;
}

fn ridges(p: vec3f) -> f32 {
    var result = 0.0;
    var weight = 1.0;
    var frequency = 1.0;
    var i = 0;
    loop {
        let ridge = 1.0 - abs(noise(p * frequency));
        result = max(result, ridge * ridge * weight);
        frequency *= 2.3;
        weight *= 0.85;
        i += 1;
        if i >= 3 {
            break;
        }
    }
    return result;
}

// How dark the stripe is at a point of the rind: 0 between stripes, 1 in the middle of one.
fn stripe(direction: vec3f) -> f32 {
    let longitude = atan2(direction.z, direction.x);
    let latitude = asin(clamp(direction.y, -1.0, 1.0));
    let torn = turbulence(direction * 3.5, 4u) * melon.raggedness;
    let wave = sin(longitude * melon.stripes + torn * 5.0 + sin(latitude * 9.0) * 0.25);
    // Stripes run together and fade towards the ends.
    let body = smoothstep(0.0, 0.35, 1.0 - abs(latitude) / (0.5 * PI));
    return smoothstep(-0.25, 0.35, wave + torn * 0.7 - 0.3) * body;
}

fn dent(p: vec3f) -> f32 {
    return noise(p * 9.0) * 0.6 + noise(p * 23.0) * 0.25;
}

fn dented_normal(p: vec3f, n: vec3f) -> vec3f {
    if melon.dents <= 0.0 {
        return n;
    }
    let step = 0.02;
    let here = dent(p);
    let slope = vec3f(
        dent(p + vec3f(step, 0.0, 0.0)) - here,
        dent(p + vec3f(0.0, step, 0.0)) - here,
        dent(p + vec3f(0.0, 0.0, step)) - here,
    ) / step;
    // Only the part along the surface tilts it.
    return normalize(n - melon.dents * (slope - n * dot(slope, n)));
}

fn rind_colour(direction: vec3f) -> vec3f {
    let dark = stripe(direction);
    let vein = ridges(direction * 6.0 + 3.0);
    let mottled = noise(direction * 17.0) * 0.5 + noise(direction * 41.0) * 0.5;

    var colour = mix(melon.light_rind, melon.dark_rind, dark);
    colour = mix(colour, melon.dark_rind * 0.8, 0.55 * smoothstep(0.82, 1.0, vein) * (1.0 - dark));
    colour *= 1.0 + 0.22 * mottled;

    // It lay on the ground on this side.
    let lay = smoothstep(0.55, 0.95, dot(direction, normalize(vec3f(0.7, -0.2, 0.6))) + 0.15 * mottled);
    return mix(colour, melon.belly, lay * melon.ripeness);
}

@fragment
fn fs_main(in: Fragment) -> @location(0) vec4f {
    let direction = normalize(in.object_position);
    var colour = rind_colour(direction);
    var shine = 0.35;

    // The scar of the stem, with rings.
    let from_stem = acos(clamp(direction.y, -1.0, 1.0));
    if from_stem < 0.22 {
        let ring = 0.75 + 0.25 * sin(from_stem * 160.0 + noise(direction * 12.0) * 3.0);
        let scar = 1.0 - smoothstep(0.12, 0.2, from_stem + 0.03 * noise(direction * 25.0));
        colour = mix(colour, STEM_COLOUR * ring, scar);
        shine *= 1.0 - scar;
    }

    let n = dented_normal(direction, normalize(in.world_normal));
    let v = normalize(globals.camera_position - in.world_position);
    let l = normalize(sun.direction);
    let h = normalize(l + v);

    // The rind lets some light through, so that the shadow's edge is soft.
    let wrapped = saturate((dot(n, l) + 0.25) / 1.25);
    let fresnel = 0.04 + 0.96 * pow(1.0 - saturate(dot(n, v)), 5.0);
    let highlight = pow(saturate(dot(n, h)), 60.0) * shine;
    let waxy = fresnel * sun.ambient * (n.y * 0.5 + 0.5);
    let lit = colour * (sun.colour * wrapped * wrapped + sun.ambient) + sun.colour * highlight + waxy;
    return vec4f(saturate(lit), 1.0);
}
