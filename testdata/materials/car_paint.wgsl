// Metallic car paint: a base that changes hue with the angle, two layers of procedural flakes in it,
// and a clear coat that mirrors an environment cube map.

struct Scene {
    view_projection: mat4x4f,
    eye: vec3f,
    sun_direction: vec3f,
    sun_colour: vec3f,
}

struct Paint {
    facing: vec3f,
    flake_density: f32,
    grazing: vec3f,
    flake_strength: f32,
    flake_colour: vec3f,
    coat: f32,
    // Levels of the environment map, the last of which is as good as diffuse.
    environment_levels: f32,
}

@group(0) @binding(0) var<uniform> scene: Scene;
@group(0) @binding(1) var<uniform> model: mat4x4f;
@group(1) @binding(0) var<uniform> paint: Paint;
@group(1) @binding(1) var environment: texture_cube<f32>;
@group(1) @binding(2) var environment_sampler: sampler;

struct Surface {
    @builtin(position) position: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
}

@vertex
fn vs_car(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Surface {
    var out: Surface;
    let world = model * vec4f(position, 1.0);
    out.position = scene.view_projection * world;
    out.world = world.xyz;
    out.normal = (model * vec4f(normal, 0.0)).xyz;
    out.uv = uv;
    return out;
}

// Three random numbers in 0..1 for a cell of an integer grid: a permuted congruential generator
// on three words that feed each other.
fn random_of_cell(cell: vec3i) -> vec3f {
    var state = vec3u(cell) * 1664525u + 1013904223u;
    state.x += state.y * state.z;
    state.y += state.z * state.x;
    state.z += state.x * state.y;
    state ^= state >> vec3u(16u);
    state.x += state.y * state.z;
    state.y += state.z * state.x;
    state.z += state.x * state.y;
    return vec3f(state >> vec3u(8u)) * (1.0 / 16777216.0);
}

struct Flake {
    // Direction in which it is tilted away from the surface, along the tangents.
    tilt: vec2f,
    // How much of the point it covers.
    amount: f32,
    brightness: f32,
}

// The flake over a point: one round flake a cell, somewhere in it, with a tilt and a brightness of its own.
fn flake_at(uv: vec2f, density: f32, layer: i32) -> Flake {
    let scaled = uv * density;
    let corner = floor(scaled);
    let random = random_of_cell(vec3i(vec2i(corner), layer));
    let offset = scaled - corner - (0.3 + 0.4 * random.xy);
    let size = 0.2 + 0.2 * random.z;
    var flake: Flake;
    flake.amount = 1.0 - smoothstep(size * 0.7, size, length(offset));
    flake.tilt = (random.yz - 0.5) * 0.9;
    flake.brightness = 0.3 + 0.7 * random.x * random.x;
    return flake;
}

fn schlick(f0: f32, cosine: f32) -> f32 {
    let x = 1.0 - saturate(cosine);
    let x2 = x * x;
    return f0 + (1.0 - f0) * x2 * x2 * x;
}

fn flake_light(flake: Flake, n: vec3f, t: vec3f, b: vec3f, h: vec3f) -> f32 {
    if flake.amount <= 0.0 {
        return 0.0;
    }
    let tilted = normalize(n + t * flake.tilt.x + b * flake.tilt.y);
    return flake.amount * flake.brightness * pow(saturate(dot(tilted, h)), 24.0);
}

@fragment
fn fs_car(in: Surface) -> @location(0) vec4f {
    let n = normalize(in.normal);
    let v = normalize(scene.eye - in.world);
    let l = normalize(scene.sun_direction);
    let h = normalize(l + v);
    let n_dot_v = saturate(dot(n, v));
    let n_dot_l = saturate(dot(n, l));

    // Any pair of tangents will do: flakes have no preferred direction.
    var helper = vec3f(0.0, 1.0, 0.0);
    if abs(n.y) > 0.9 {
        helper = vec3f(1.0, 0.0, 0.0);
    }
    let t = normalize(cross(helper, n));
    let b = cross(n, t);

    // Base coat: pigment under a rough metallic lobe.
    let flop = pow(1.0 - n_dot_v, 1.5);
    let pigment = mix(paint.facing, paint.grazing, flop);
    let blurred = textureSampleLevel(environment, environment_sampler, n, paint.environment_levels - 1.0).rgb;
    let glossy = textureSampleLevel(environment, environment_sampler, reflect(-v, n), paint.environment_levels * 0.6).rgb;
    var colour = pigment * (blurred * 0.7 + glossy * 0.5 + scene.sun_colour * n_dot_l * 0.6);
    colour += pigment * scene.sun_colour * pow(saturate(dot(n, h)), 12.0) * 0.4;

    // Flakes: coarse ones that sparkle one by one, fine ones that shimmer.
    let coarse = flake_at(in.uv, paint.flake_density, 1);
    let fine = flake_at(in.uv + 0.37, paint.flake_density * 2.7, 2);
    let sparkle = flake_light(coarse, n, t, b, h) + 0.5 * flake_light(fine, n, t, b, h);
    let glitter = flake_light(coarse, n, t, b, normalize(v + n)) + 0.5 * flake_light(fine, n, t, b, normalize(v + n));
    colour += paint.flake_colour * paint.flake_strength * (sparkle * scene.sun_colour * 2.0 + glitter * blurred);

    // Clear coat: a mirror on top, with a slight orange peel.
    let peel = sin(in.uv.x * 190.0) * sin(in.uv.y * 170.0) * 0.006;
    let coat_normal = normalize(n + (t + b) * peel);
    let reflected = reflect(-v, coat_normal);
    let mirrored = textureSample(environment, environment_sampler, reflected).rgb;
    let coat = paint.coat * schlick(0.04, dot(coat_normal, v));
    let glint = scene.sun_colour * pow(saturate(dot(coat_normal, h)), 600.0) * n_dot_l;
    colour = mix(colour, mirrored, coat) + glint * paint.coat * 3.0;
    return vec4f(min(colour, vec3f(1.0)), 1.0);
}
