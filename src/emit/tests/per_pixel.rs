//! Levels that each pixel chooses for itself.

use super::*;
use crate::eval::draw::shade;
use crate::eval::program::Program;
use crate::eval::raster::rasterize;
use crate::scene::Scene;

const OUTPUT: Output = Output {
    form: Form::Uniform,
    target: Target::Wgsl,
    transition: Transition::Pop,
    band: BAND,
    per_pixel: Some(0.01),
};

/// A texture at shifted coordinates, and at others that the first one shifts, under an edge that is as wide as a pixel.
const TEXTURED: &str = "\
@group(0) @binding(0) var surface: texture_2d<f32>;
@group(0) @binding(1) var surface_sampler: sampler;
@fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f {
    let at = uv * 3.0 + 0.25;
    let first = textureSample(surface, surface_sampler, at);
    var colour = first.rgb;
    if first.r > 0.3 {
        colour *= textureSampleLevel(surface, surface_sampler, uv, 0.0).rgb;
    }
    let second = textureSampleBias(surface, surface_sampler, at + first.xy, 0.5);
    return vec4f(mix(colour, second.rgb, saturate(uv.x / fwidth(uv.x))), 1.0);
}
";

/// The text of what is textured, with a level from 1 on that is of one colour.
fn textured(output: Output) -> String {
    let source = source(TEXTURED);
    let plain = "@fragment fn fs_main(@location(0) uv: vec2f) -> @location(0) vec4f { return vec4f(uv, 7.0, 1.0); }";
    let (head, _) = TEXTURED.split_once("@fragment").expect("it has one");
    let plain = base(&super::source(&format!("{head}{plain}")));
    let levels = [EmitLevel {
        shader: plain,
        ..level(&source, 1.0)
    }];
    let files = emit(&source, &base(&source), &levels, output);
    let (_, bytes) = files.unwrap_or_else(|e| panic!("{e}")).swap_remove(0);
    String::from_utf8(bytes).expect("it is text")
}

#[test]
fn what_looks_at_neighbours_comes_in_front_of_the_branch() {
    let text = textured(OUTPUT);
    has(
        &text,
        "\
    let across = dpdx(uv);
    let down = dpdy(uv);
    // Halvings of scale of this pixel since the nearest view.
    let pixel_lod = 0.5 * log2(min(dot(across, across), dot(down, down)) / 1e-4);
    let of_original_fs_main = original_fs_main_gradients(uv);
    if !(pixel_lod >= 1.0) { return original_fs_main(uv, ",
    );
    let (_, original) = text.split_once("// Level 0.").expect("it is there");
    let (original, _) = original.split_once("// Level 1.").expect("it is there");
    for word in ["textureSample(", "textureSampleBias(", "fwidth", "dpd"] {
        assert!(!original.contains(word), "{word} in\n{original}");
    }
    assert!(
        !text.contains("autoLOD:"),
        "the host has no part in it\n{text}"
    );
}

/// The first picture of a shader at a distance, of a plane that is seen aslant.
fn picture(text: &str, distance: f64) -> Vec<[f32; 4]> {
    let source = Source::parse("dir/test.wgsl", text).unwrap_or_else(|e| panic!("{e}"));
    let scene = "object = \"plane\"\nresolution = [64, 64]\n[views]\ndirections = [[0, 0.4, 0.6]]";
    let scene = Scene::resolve(&source, Some((Path::new("a.toml"), scene)));
    let scene = scene.unwrap_or_else(|e| panic!("{e}"));
    let entries = &source.module.entry_points;
    let fragment = entries
        .iter()
        .position(|e| e.name == "fs_main")
        .expect("it is there");
    let fragment = Program::compile(&source.module, fragment, &[]).expect("it runs");
    let stage = scene.vertex_stage.clone().expect("it is supplied");
    let vertex = Program::compile(&stage.module, 0, &[]).expect("it runs");
    let frame = scene.frames(distance).remove(0);
    let coverage = rasterize(&vertex, &fragment, &frame);
    let shading = shade(&fragment, &coverage, &frame.bindings);
    shading.colours.clone()
}

#[test]
fn pixels_have_the_level_of_their_own_scale() {
    let text = textured(OUTPUT);
    let of_level = |pixel: &[f32; 4]| pixel[2] == 7.0;
    let mut shares = Vec::new();
    for distance in [2.0, 3.0, 4.0, 6.0, 30.0] {
        let [original, chosen] = [TEXTURED, &text].map(|text| picture(text, distance));
        assert!(!original.is_empty() && original.len() == chosen.len());
        // A bias that scales gradients rounds otherwise than one that is added to a level.
        for (original, chosen) in original.iter().zip(&chosen) {
            let mut channels = original.iter().zip(chosen);
            let is_same = channels.all(|(a, b)| (a - b).abs() < 1e-3);
            assert!(
                of_level(chosen) || is_same,
                "at {distance}: {original:?} {chosen:?}"
            );
        }
        let count = chosen.iter().filter(|pixel| of_level(pixel)).count();
        shares.push(count as f64 / chosen.len() as f64);
    }
    assert!(shares.is_sorted(), "{shares:?}");
    assert!(shares[0] < 0.5 && shares[4] == 1.0, "{shares:?}");
    assert!(
        shares.iter().any(|share| *share > 0.0 && *share < 1.0),
        "{shares:?}"
    );
}

#[test]
fn levels_of_pixels_are_mixed_too() {
    let text = textured(Output {
        transition: Transition::Blend,
        ..OUTPUT
    });
    has(&text, "lod_one_fs_main(uv), (pixel_lod - 1.0) / 0.25)");
}

#[test]
fn what_is_known_on_the_way_only_is_refused() {
    let looped = TEXTURED.replace(
        "let at = uv * 3.0 + 0.25;",
        "var at = uv; for (var i = 0; i < i32(uv.x * 9.0); i++) { at = at * 2.0 + uv.yx; }",
    );
    let none = TEXTURED
        .replace("@location(0) uv: vec2f", "@builtin(position) pixel: vec4f")
        .replace("let at = uv", "let uv = pixel.xy;\n    let at = uv");
    for (text, message) in [
        (looped, "explicit gradients"),
        (none, "has none among its inputs"),
    ] {
        let source = source(&text);
        let levels = [level(&source, 1.0)];
        let error = emit(&source, &base(&source), &levels, OUTPUT).expect_err("it cannot be drawn");
        assert!(error.message.contains(message), "{error}");
        assert!(
            error.notes.iter().any(|note| note.contains("--per-pixel")),
            "{error}"
        );
    }
}
