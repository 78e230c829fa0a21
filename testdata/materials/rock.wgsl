// Rock without texture coordinates: colour and normals are projected along the three axes and blended,
// fractal noise varies the colour, and moss grows where the surface faces up. Writes linear HDR light.

struct Frame {
    view_proj: mat4x4f,
    camera_position: vec3f,
    light_direction: vec3f,
    light_colour: vec3f,
    sky_colour: vec3f,
}

struct Rock {
    scale: f32,
    sharpness: f32,
    bumpiness: f32,
    moss: f32,
    moss_colour: vec3f,
    dust_colour: vec3f,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(1) @binding(0) var<uniform> model: mat4x4f;
@group(1) @binding(1) var<uniform> rock: Rock;
@group(1) @binding(2) var rock_sampler: sampler;
@group(1) @binding(3) var rock_albedo: texture_2d<f32>;
@group(1) @binding(4) var rock_normal: texture_2d<f32>;

struct VertexOutput {
    @builtin(position) clip: vec4f,
    @location(0) world_position: vec3f,
    @location(1) world_normal: vec3f,
}

@vertex
fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f) -> VertexOutput {
    var out: VertexOutput;
    let world = model * vec4f(position, 1.0);
    out.clip = frame.view_proj * world;
    out.world_position = world.xyz;
    out.world_normal = (model * vec4f(normal, 0.0)).xyz;
    return out;
}

fn hash(p: vec3i) -> f32 {
    var h = u32(p.x) * 374761393u + u32(p.y) * 668265263u + u32(p.z) * 2147483647u;
    h = (h ^ (h >> 13u)) * 1274126177u;
    return f32((h ^ (h >> 16u)) >> 8u) * (1.0 / 16777216.0);
}

// Noise in 0..1 on the unit lattice, smooth in between.
fn value_noise(p: vec3f) -> f32 {
    let base = floor(p);
    let f = p - base;
    let w = f * f * (3.0 - 2.0 * f);
    let i = vec3i(base);
    let near = mix(
        mix(hash(i), hash(i + vec3i(1, 0, 0)), w.x),
        mix(hash(i + vec3i(0, 1, 0)), hash(i + vec3i(1, 1, 0)), w.x),
        w.y,
    );
    let far = mix(
        mix(hash(i + vec3i(0, 0, 1)), hash(i + vec3i(1, 0, 1)), w.x),
        mix(hash(i + vec3i(0, 1, 1)), hash(i + vec3i(1, 1, 1)), w.x),
        w.y,
    );
    return mix(near, far, w.z);
}

// Octaves of noise, each twice as fine and half as strong as the one before; in 0..1.
fn fractal_noise(p: vec3f, octaves: i32) -> f32 {
    var sum = 0.0;
    var weight = 0.5;
    var total = 0.0;
    var q = p;
    for (var octave = 0; octave < octaves; octave++) {
        sum += weight * value_noise(q);
        total += weight;
        // Turned as well as scaled, so that the lattices do not line up.
        q = vec3f(q.y + q.z, q.z - q.x, q.x + q.y) * 1.43 + 5.1;
        weight *= 0.5;
    }
    return sum / total;
}

struct Projections {
    x: vec2f,
    y: vec2f,
    z: vec2f,
    weights: vec3f,
}

fn project(position: vec3f, n: vec3f) -> Projections {
    let p = position * rock.scale;
    var weights = pow(abs(n), vec3f(rock.sharpness));
    weights /= weights.x + weights.y + weights.z;
    return Projections(p.zy, p.xz, p.xy, weights);
}

fn triplanar_colour(p: Projections) -> vec3f {
    let along_x = textureSample(rock_albedo, rock_sampler, p.x).rgb;
    let along_y = textureSample(rock_albedo, rock_sampler, p.y).rgb;
    let along_z = textureSample(rock_albedo, rock_sampler, p.z).rgb;
    return along_x * p.weights.x + along_y * p.weights.y + along_z * p.weights.z;
}

fn unpack(texel: vec4f) -> vec2f {
    return (texel.xy * 2.0 - 1.0) * rock.bumpiness;
}

// Each projection bends the normal in its own plane ("whiteout" blending).
fn triplanar_normal(p: Projections, n: vec3f) -> vec3f {
    let tx = unpack(textureSample(rock_normal, rock_sampler, p.x));
    let ty = unpack(textureSample(rock_normal, rock_sampler, p.y));
    let tz = unpack(textureSample(rock_normal, rock_sampler, p.z));
    let nx = vec3f(n.x, n.y + tx.y, n.z + tx.x);
    let ny = vec3f(n.x + ty.x, n.y, n.z + ty.y);
    let nz = vec3f(n.x + tz.x, n.y + tz.y, n.z);
    return normalize(nx * p.weights.x + ny * p.weights.y + nz * p.weights.z);
}

@fragment
fn fs_main(in: VertexOutput) -> @location(0) vec4f {
    let geometric = normalize(in.world_normal);
    let projections = project(in.world_position, geometric);
    var albedo = triplanar_colour(projections);
    let n = triplanar_normal(projections, geometric);

    // Strata and stains.
    let stain = fractal_noise(in.world_position * 3.0, 5);
    let layer = sin(in.world_position.y * 14.0 + stain * 6.0) * 0.5 + 0.5;
    albedo *= mix(0.65, 1.2, stain) * mix(0.85, 1.1, layer);
    albedo = mix(albedo, rock.dust_colour, 0.3 * smoothstep(0.45, 0.8, stain));

    // Moss on what faces up, in patches.
    let patches = fractal_noise(in.world_position * 7.0 + 31.7, 4);
    let moss = smoothstep(0.35, 0.75, n.y * rock.moss + (patches - 0.5) * 0.9);
    var gloss = 0.25;
    if moss > 0.01 {
        let tuft = value_noise(in.world_position * 60.0);
        albedo = mix(albedo, rock.moss_colour * (0.6 + 0.8 * tuft), moss);
        gloss = mix(gloss, 0.02, moss);
    }

    let l = normalize(frame.light_direction);
    let v = normalize(frame.camera_position - in.world_position);
    let h = normalize(l + v);
    let sky = frame.sky_colour * (n.y * 0.35 + 0.65);
    let cavity = mix(0.55, 1.0, smoothstep(0.2, 0.6, stain));
    let diffuse = albedo * (frame.light_colour * saturate(dot(n, l)) + sky * cavity);
    let specular = frame.light_colour * (gloss * pow(saturate(dot(n, h)), 22.0) * saturate(dot(n, l)));
    return vec4f(diffuse + specular, 1.0);
}
