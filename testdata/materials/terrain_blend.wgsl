// Ground that blends grass into rock by a painted mask and by steepness. Holes in the mask are cut out,
// the height decides between shore, land and snow, and debug views return early.

struct Camera {
    view_proj: mat4x4f,
    position: vec3f,
}

struct Ground {
    tiling: f32,
    blend_width: f32,
    hole_threshold: f32,
    // What is drawn: 0 the ground, 1 its colour, 2 its normals, 3 the blend.
    view: u32,
    shore_height: f32,
    snow_height: f32,
    fog_start: f32,
    fog_end: f32,
    fog_colour: vec3f,
}

struct Sun {
    direction: vec3f,
    strength: f32,
    colour: vec3f,
    ambient: vec3f,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> sun: Sun;
@group(1) @binding(0) var<uniform> model: mat4x4f;
@group(1) @binding(1) var<uniform> ground: Ground;
@group(1) @binding(2) var ground_sampler: sampler;
@group(1) @binding(3) var grass_albedo: texture_2d<f32>;
@group(1) @binding(4) var cliff_albedo: texture_2d<f32>;
// Red: rock over grass; green: slow variation of brightness; blue: wetness; alpha: holes.
@group(1) @binding(5) var splat_mask: texture_2d<f32>;

const VIEW_COLOUR = 1u;
const VIEW_NORMALS = 2u;
const VIEW_BLEND = 3u;

struct VertexOutput {
    @builtin(position) clip: vec4f,
    @location(0) world_position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> VertexOutput {
    var out: VertexOutput;
    let world = model * vec4f(position, 1.0);
    out.clip = camera.view_proj * world;
    out.world_position = world.xyz;
    out.normal = (model * vec4f(normal, 0.0)).xyz;
    out.uv = uv;
    return out;
}

// The band of height: 0 shore, 1 land, 2 snow.
fn band_of(height: f32, ripple: f32) -> i32 {
    let h = height + ripple;
    if h < ground.shore_height {
        return 0;
    }
    if h > ground.snow_height {
        return 2;
    }
    return 1;
}

// Height-weighted blend: the alpha of both textures is a height, and the higher one shows.
fn blend(grass: vec4f, cliff: vec4f, amount: f32) -> vec3f {
    let grass_top = grass.a + (1.0 - amount);
    let cliff_top = cliff.a + amount;
    let level = max(grass_top, cliff_top) - ground.blend_width;
    let a = max(grass_top - level, 0.0);
    let b = max(cliff_top - level, 0.0);
    return (grass.rgb * a + cliff.rgb * b) / (a + b);
}

fn fogged(colour: vec3f, distance: f32) -> vec3f {
    if distance <= ground.fog_start {
        return colour;
    }
    let amount = saturate((distance - ground.fog_start) / (ground.fog_end - ground.fog_start));
    return mix(colour, ground.fog_colour, amount * amount);
}

@fragment
fn fs_main(in: VertexOutput) -> @location(0) vec4f {
    // All samples come first: past the first return that not every pixel takes there are no derivatives.
    let mask = textureSample(splat_mask, ground_sampler, in.uv);
    let grass = textureSample(grass_albedo, ground_sampler, in.uv * ground.tiling);
    let cliff = textureSample(cliff_albedo, ground_sampler, in.uv * ground.tiling * 0.6);
    let macro_cliff = textureSample(cliff_albedo, ground_sampler, in.uv * 1.7 + 0.31);

    if mask.a < ground.hole_threshold {
        discard;
    }

    let n = normalize(in.normal);
    let steep = 1.0 - smoothstep(0.6, 0.92, n.y);
    let amount = saturate(mask.r + steep);
    var colour = blend(grass, cliff, amount) * mix(0.75, 1.2, mask.g);
    colour *= mix(1.0, dot(macro_cliff.rgb, vec3f(1.1)) + 0.35, 0.6);
    var gloss = 0.05;

    switch band_of(in.world_position.y, (mask.g - 0.5) * 0.2) {
        case 0: {
            let wet = mask.b;
            colour = mix(colour, vec3f(0.33, 0.27, 0.17), 0.6) * (1.0 - 0.5 * wet);
            gloss = 0.1 + 0.5 * wet;
        }
        case 2: {
            let settled = smoothstep(0.5, 0.8, n.y);
            colour = mix(colour, vec3f(0.82, 0.86, 0.92), settled);
            gloss = mix(gloss, 0.2, settled);
        }
        default: {}
    }

    switch ground.view {
        case VIEW_COLOUR: {
            return vec4f(colour, 1.0);
        }
        case VIEW_NORMALS: {
            return vec4f(n * 0.5 + 0.5, 1.0);
        }
        case VIEW_BLEND: {
            return vec4f(vec3f(amount), 1.0);
        }
        default: {}
    }

    let to_eye = camera.position - in.world_position;
    let distance = length(to_eye);
    let l = normalize(sun.direction);
    let n_dot_l = dot(n, l);
    let ambient = colour * sun.ambient * (0.6 + 0.4 * n.y);
    if n_dot_l <= 0.0 {
        return vec4f(fogged(ambient, distance), 1.0);
    }

    let h = normalize(l + to_eye / distance);
    let highlight = gloss * pow(saturate(dot(n, h)), 40.0);
    let lit = ambient + (colour * n_dot_l + highlight) * sun.colour * sun.strength;
    return vec4f(fogged(lit, distance), 1.0);
}
