//! Texture operations reach the texture with the right operands.

use super::*;
use crate::texture::{Dimension, Request};

fn texture() -> Arc<Texture> {
    Arc::new(Texture::placeholder(5, Dimension::D2, 3))
}

fn bindings() -> Bindings {
    Bindings::from([
        ((0, 0), Resource::Texture(texture())),
        ((0, 1), Resource::Sampler(Arc::new(Sampler::default()))),
        (
            (0, 2),
            Resource::Texture(Arc::new(Texture::placeholder(9, Dimension::Cube, 1))),
        ),
    ])
}

const ITEMS: &str = "
    @group(0) @binding(0) var t: texture_2d_array<f32>;
    @group(0) @binding(1) var s: sampler;
    @group(0) @binding(2) var c: texture_cube<f32>;
    @group(0) @binding(0) var d: texture_depth_2d_array;
    @group(0) @binding(1) var compare: sampler_comparison;
    @group(0) @binding(0) var whole: texture_2d_array<u32>;";

fn coordinates() -> [crate::texture::Floats; 2] {
    [
        std::array::from_fn(|lane| (lane as f32 * 0.01).fract()),
        std::array::from_fn(|lane| (lane / 4) as f32 * 0.003 + (lane % 4 / 2) as f32 * 0.02),
    ]
}

/// Runs a body that computes the vector `r` from `uv` (see [`coordinates`]) and `i`.
fn sampled(body: &str) -> Outcome {
    let source = format!(
        "{ITEMS}
        @fragment fn main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32) -> @location(0) vec4f {{
            let uv = vec2(fract(x * 0.01), f32(i / 4) * 0.003 + f32(i % 4 / 2) * 0.02);
            {body}
        }}"
    );
    run_bound(&compile(&source), &bindings())
}

fn expect(outcome: &Outcome, want: &[crate::texture::Floats; 4]) {
    for lane in 0..LANES {
        for (component, want) in want.iter().enumerate() {
            assert_eq!(outcome.float(component, lane), want[lane], "lane {lane}");
        }
    }
}

#[test]
fn samples() {
    let [u, v] = coordinates();
    let at = [&u, &v];
    let sampler = Sampler::default();
    let layers: [i32; LANES] = std::array::from_fn(|lane| lane as i32 % 3);
    let mut want = [[0.0; LANES]; 4];
    let mut plain = Request::implicit(&at);
    plain.layer = Some(&layers);

    texture().sample(&sampler, &plain, Mask::ALL, &mut want);
    expect(&sampled("return textureSample(t, s, uv, i % 3);"), &want);

    let bias = [1.5; LANES];
    let mut request = plain;
    request.detail = crate::texture::Detail::Implicit { bias: Some(&bias) };
    request.offset = [1, -2, 0];
    texture().sample(&sampler, &request, Mask::ALL, &mut want);
    expect(
        &sampled("return textureSampleBias(t, s, uv, i % 3, 1.5, vec2(1, -2));"),
        &want,
    );

    let level: [f32; LANES] = std::array::from_fn(|lane| lane as f32 * 0.01);
    let mut request = plain;
    request.detail = crate::texture::Detail::Exact(&level);
    texture().sample(&sampler, &request, Mask::ALL, &mut want);
    expect(
        &sampled("return textureSampleLevel(t, s, uv, i % 3, x * 0.01);"),
        &want,
    );

    let (x, y) = ([0.1; LANES], [0.0; LANES]);
    let (across, down) = ([&x, &y], [&y, &level]);
    let mut request = plain;
    request.detail = crate::texture::Detail::Gradients {
        ddx: &across,
        ddy: &down,
    };
    texture().sample(&sampler, &request, Mask::ALL, &mut want);
    let body = "return textureSampleGrad(t, s, uv, i % 3, vec2(0.1, 0.0), vec2(0.0, x * 0.01));";
    expect(&sampled(body), &want);

    let mut request = plain;
    request.gather = Some(2);
    texture().sample(&sampler, &request, Mask::ALL, &mut want);
    expect(&sampled("return textureGather(2, t, s, uv, i % 3);"), &want);

    let half = [0.5; LANES];
    let mut request = plain;
    request.detail = crate::texture::Detail::Zero;
    request.reference = Some(&half);
    texture().sample(&sampler, &request, Mask::ALL, &mut want);
    let one = want[0];
    let body = "return vec4(textureSampleCompareLevel(d, compare, uv, i % 3, 0.5));";
    expect(&sampled(body), &[one; 4]);
}

#[test]
fn cubes_loads_and_queries() {
    let [u, v] = coordinates();
    let ones = [1.0; LANES];
    let mut want = [[0.0; LANES]; 4];
    let cube = Texture::placeholder(9, Dimension::Cube, 1);
    let at = [&u, &v, &ones];
    cube.sample(
        &Sampler::default(),
        &Request::implicit(&at),
        Mask::ALL,
        &mut want,
    );
    expect(
        &sampled("return textureSample(c, s, vec3(uv, 1.0));"),
        &want,
    );

    let column: [i32; LANES] = std::array::from_fn(|lane| lane as i32 % 7);
    let (row, layer, level) = ([2; LANES], [1; LANES], column);
    texture().load(
        &[&column, &row],
        Some(&layer),
        Some(&level),
        Mask::ALL,
        &mut want,
    );
    expect(
        &sampled("return textureLoad(t, vec2(i % 7, 2), 1, i % 7);"),
        &want,
    );
    // Values in 0..1 as unsigned integers.
    let body = "return vec4f(textureLoad(whole, vec2(u32(i % 7), 2u), 1u, i % 7));";
    expect(&sampled(body), &want.map(|c| c.map(|x| x.trunc())));

    let [width, height, _] = texture().size(0);
    let [small, _, _] = texture().size(1);
    let body = "return vec4(vec2f(textureDimensions(t)), f32(textureNumLevels(t)), f32(textureNumLayers(t)));";
    let levels = texture().level_count() as f32;
    let answers = [width as f32, height as f32, levels, 3.0];
    expect(&sampled(body), &answers.map(|x| [x; LANES]));
    let body = "return vec4(f32(textureDimensions(t, i & 1).x));";
    let each = std::array::from_fn(|lane| if lane % 2 == 0 { width } else { small } as f32);
    expect(&sampled(body), &[each; 4]);
}

#[test]
fn textures_reach_functions_as_arguments() {
    let [u, v] = coordinates();
    let at = [&u, &v];
    let mut request = Request::implicit(&at);
    let layers = [2; LANES];
    request.layer = Some(&layers);
    let mut want = [[0.0; LANES]; 4];
    texture().sample(&Sampler::default(), &request, Mask::ALL, &mut want);
    let source = format!(
        "{ITEMS}
        fn read(a: texture_2d_array<f32>, b: sampler, at: vec2f) -> vec4f {{ return textureSample(a, b, at, 2); }}
        @fragment fn main(@location(0) x: f32, @location(1) @interpolate(flat) i: i32) -> @location(0) vec4f {{
            let uv = vec2(fract(x * 0.01), f32(i / 4) * 0.003 + f32(i % 4 / 2) * 0.02);
            return read(t, s, uv);
        }}"
    );
    expect(&run_bound(&compile(&source), &bindings()), &want);
}
