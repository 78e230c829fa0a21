// Layered leather: dyed hide under worn patches and a coat of wax. Grain and wrinkles are bump maps,
// read three times each for their slopes; how each light scatters comes out of two lookup tables.

const LIGHTS = 3u;

struct View {
    view_proj: mat4x4f,
    camera_position: vec3f,
}

struct Model {
    model: mat4x4f,
    normal_matrix: mat4x4f,
}

struct Lights {
    // Towards the light, with its brightness in w.
    directions: array<vec4f, 3>,
    colours: array<vec4f, 3>,
    ambient: vec3f,
}

struct Leather {
    dye: vec3f,
    grain_depth: f32,
    worn: vec3f,
    wrinkle_depth: f32,
    tiling: vec2f,
    wear: f32,
    wax: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> lights: Lights;
@group(1) @binding(0) var<uniform> object: Model;
@group(1) @binding(1) var<uniform> leather: Leather;
@group(1) @binding(2) var hide_sampler: sampler;
@group(1) @binding(3) var hide_albedo: texture_2d<f32>;
@group(1) @binding(4) var grain_height: texture_2d<f32>;
@group(1) @binding(5) var wrinkle_height: texture_2d<f32>;
@group(1) @binding(6) var wear_mask: texture_2d<f32>;
@group(2) @binding(0) var lut_sampler: sampler;
// Wrapped diffuse light: across, the cosine to the light; down, how curved the surface is.
@group(2) @binding(1) var diffuse_lut: texture_2d<f32>;
// Strength of the highlight: across, the cosine to the half vector; down, the roughness.
@group(2) @binding(2) var specular_lut: texture_2d<f32>;

struct Varyings {
    @builtin(position) clip_position: vec4f,
    @location(0) world_position: vec3f,
    @location(1) world_normal: vec3f,
    @location(2) world_tangent: vec3f,
    @location(3) uv: vec2f,
}

@vertex
fn vertex(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) tangent: vec4f,
) -> Varyings {
    let world = object.model * vec4f(position, 1.0);
    return Varyings(
        view.view_proj * world,
        world.xyz,
        (object.normal_matrix * vec4f(normal, 0.0)).xyz,
        (object.model * vec4f(tangent.xyz, 0.0)).xyz,
        uv,
    );
}

// Slopes of a height map by forward differences, one texel apart.
fn bump(height_map: texture_2d<f32>, uv: vec2f, depth: f32) -> vec2f {
    let texel = 1.0 / vec2f(textureDimensions(height_map, 0));
    let here = textureSample(height_map, hide_sampler, uv).r;
    let right = textureSample(height_map, hide_sampler, uv + vec2f(texel.x, 0.0)).r;
    let below = textureSample(height_map, hide_sampler, uv + vec2f(0.0, texel.y)).r;
    return vec2f(here - right, here - below) * depth;
}

struct Layer {
    colour: vec3f,
    roughness: f32,
    specular: f32,
}

fn dyed_hide(uv: vec2f, height: f32) -> Layer {
    let hide = textureSample(hide_albedo, hide_sampler, uv).rgb;
    // Dye gathers in the grooves.
    let gathered = mix(0.55, 1.05, smoothstep(0.1, 0.7, height));
    return Layer(hide * leather.dye * gathered, mix(0.75, 0.45, height), 0.35);
}

// Puts one layer on another, more of it where `amount` is larger.
fn cover(below: Layer, above: Layer, amount: f32) -> Layer {
    var result = below;
    result.colour = mix(below.colour, above.colour, amount);
    result.roughness = mix(below.roughness, above.roughness, amount);
    result.specular = mix(below.specular, above.specular, amount);
    return result;
}

fn shade(layer: Layer, n: vec3f, v: vec3f, curvature: f32) -> vec3f {
    var diffuse = lights.ambient * (n.y * 0.25 + 0.75);
    var highlight = vec3f(0.0);
    for (var i = 0u; i < LIGHTS; i += 1u) {
        let l = normalize(lights.directions[i].xyz);
        let radiance = lights.colours[i].rgb * lights.directions[i].w;
        let h = normalize(l + v);

        let wrapped = textureSampleLevel(diffuse_lut, lut_sampler, vec2f(dot(n, l) * 0.5 + 0.5, curvature), 0.0).rgb;
        diffuse += wrapped * radiance;

        let lobe = textureSampleLevel(specular_lut, lut_sampler, vec2f(saturate(dot(n, h)), layer.roughness), 0.0).r;
        let grazing = 0.3 + 0.7 * pow(1.0 - saturate(dot(v, h)), 5.0);
        highlight += radiance * (lobe * lobe * 4.0 * grazing * saturate(dot(n, l) * 4.0));
    }
    return layer.colour * diffuse + highlight * layer.specular;
}

@fragment
fn fragment(in: Varyings) -> @location(0) vec4f {
    let uv = in.uv * leather.tiling;

    let grain = bump(grain_height, uv * 2.0, leather.grain_depth);
    let wrinkles = bump(wrinkle_height, uv, leather.wrinkle_depth);
    let slope = grain + wrinkles;

    let n = normalize(in.world_normal);
    let t = normalize(in.world_tangent - n * dot(n, in.world_tangent));
    let b = cross(n, t);
    let bumped = normalize(n + t * slope.x + b * slope.y);

    let height = textureSample(grain_height, hide_sampler, uv * 2.0).r;
    var layer = dyed_hide(uv, height);

    // Ridges are rubbed first: the mask decides where, the height how early.
    let mask = textureSample(wear_mask, hide_sampler, in.uv).r;
    let rubbed = smoothstep(0.35, 0.75, mask * leather.wear + height * 0.35);
    layer = cover(layer, Layer(leather.worn, 0.85, 0.08), rubbed);
    if leather.wax > 0.0 {
        let wax = leather.wax * (1.0 - rubbed) * (0.5 + 0.5 * height);
        layer = cover(layer, Layer(layer.colour * 0.9, 0.25, 0.9), wax);
    }

    let curvature = saturate(0.25 + length(slope) * 0.4);
    let v = normalize(view.camera_position - in.world_position);
    let lit = shade(layer, bumped, v, curvature);

    // A thin sheen of loose fibres at grazing angles.
    let rim = pow(1.0 - saturate(dot(n, v)), 4.0);
    return vec4f(saturate(lit + lights.ambient * rim * 0.35), 1.0);
}
