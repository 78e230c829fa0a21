//! Bands behind thresholds, in which two levels are drawn.

use super::*;
use crate::eval::draw::shade;
use crate::eval::program::Program;
use crate::eval::raster::rasterize;
use crate::scene::Scene;

fn banded(transition: Transition) -> Output {
    Output {
        form: Form::Uniform,
        transition,
        ..Output::default()
    }
}

/// The text with levels at 0.85 and 2.1, which do what it does.
fn drawn(text: &str, output: Output) -> Result<String> {
    let source = source(text);
    let levels = [level(&source, 0.85), level(&source, 2.1)];
    let mut files = emit(&source, &base(&source), &levels, output)?;
    let (_, bytes) = files.swap_remove(0);
    Ok(String::from_utf8(bytes).expect("it is text"))
}

#[track_caller]
fn text(text: &str, output: Output) -> String {
    drawn(text, output).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn levels_are_mixed_behind_their_thresholds() {
    let text = text(SMALL, banded(Transition::Blend));
    has(
        &text,
        "\
    if !(level_of_detail.autoLOD >= 0.85) { return original_fs_main(uv0); }
    if !(level_of_detail.autoLOD >= 1.1) { return mix(original_fs_main(uv0), lod_one_fs_main(uv0), (level_of_detail.autoLOD - 0.85) / 0.25); }
    if !(level_of_detail.autoLOD >= 2.1) { return lod_one_fs_main(uv0); }
    if !(level_of_detail.autoLOD >= 2.35) { return mix(lod_one_fs_main(uv0), lod_two_fs_main(uv0), (level_of_detail.autoLOD - 2.1) / 0.25); }
    return lod_two_fs_main(uv0);
",
    );
}

#[test]
fn a_band_ends_where_the_next_level_begins() {
    let wide = Output {
        band: 5.0,
        ..banded(Transition::Blend)
    };
    let text = text(SMALL, wide);
    has(
        &text,
        "\
    if !(level_of_detail.autoLOD >= 2.1) { return mix(original_fs_main(uv0), lod_one_fs_main(uv0), (level_of_detail.autoLOD - 0.85) / 1.25); }
    if !(level_of_detail.autoLOD >= 7.1) { return mix(lod_one",
    );
}

#[test]
fn a_screen_door_asks_for_the_place_of_the_pixel() {
    let text = text(SMALL, banded(Transition::Dither));
    has(
        &text,
        "fn fs_main(@location(0) uv0: vec2f, @builtin(position) pixel_position: vec4f) -> @location(0) vec4f {",
    );
    // Both read textures with derivatives, which a branch by pixels may not.
    has(
        &text,
        "\
        let near = original_fs_main(uv0);
        let far = lod_one_fs_main(uv0);
        var chosen = near;
        if screen_door(pixel_position, (level_of_detail.autoLOD - 0.85) / 0.25) { chosen = far; }
        return chosen;
",
    );
}

const PLAIN: &str = "\
struct Out { @location(0) colour: vec4f, @location(1) id: vec2u, @builtin(frag_depth) depth: f32, }
struct In { @builtin(position) at: vec4f, @location(0) uv: vec2f, }
@group(0) @binding(0) var<uniform> tint: vec4f;
@fragment fn fs_main(near: In) -> Out { return Out(tint * near.uv.x, vec2u(near.uv), 0.5 * near.uv.y); }
";

#[test]
fn what_takes_no_derivatives_is_drawn_for_its_pixels_alone() {
    let text = text(PLAIN, banded(Transition::Dither));
    has(
        &text,
        "        var chosen: Out;
        if screen_door(near.at, (level_of_detail.autoLOD - 0.85) / 0.25) {
            chosen = lod_one_fs_main(near);
        } else {
            chosen = original_fs_main(near);
        }
        return chosen;
",
    );
}

#[test]
fn targets_and_depths_are_mixed_one_by_one() {
    let floats = PLAIN
        .replace("id: vec2u", "id: vec2f")
        .replace("vec2u(", "vec2f(");
    let text = text(&floats, banded(Transition::Blend));
    has(
        &text,
        "\
        let near_2 = original_fs_main(near);
        let far = lod_one_fs_main(near);
        let near_2_to_far = (level_of_detail.autoLOD - 0.85) / 0.25;
        return Out(mix(near_2.colour, far.colour, near_2_to_far), mix(near_2.id, far.id, near_2_to_far), mix(near_2.depth, far.depth, near_2_to_far));
",
    );
}

#[track_caller]
fn refused(text: &str, output: Output, message: &str, note: &str) {
    let error = drawn(text, output).expect_err("it cannot be drawn");
    assert!(error.message.contains(message), "{error}");
    assert!(error.notes.iter().any(|n| n.contains(note)), "{error}");
}

#[test]
fn what_cannot_be_mixed_is_refused() {
    let blend = banded(Transition::Blend);
    let way = "--transition dither";
    refused(PLAIN, blend, "`id` is no f32", way);
    let holes = SMALL.replace(
        "return vec4f(base",
        "if base.x < 0.5 { discard; }\nreturn vec4f(base",
    );
    refused(&holes, blend, "pixels are discarded", way);
    for form in [Form::Override, Form::Files] {
        refused(
            SMALL,
            Output { form, ..blend },
            "cannot pass into each other",
            "--form uniform",
        );
    }
    let band = Output { band: 0.0, ..blend };
    refused(SMALL, band, "a band of 0 is none", "0.25");
}

#[test]
fn an_autolod_of_the_authors_own_has_bands_where_it_may_change() {
    let own = SMALL.replace("rough1: f32,", "rough1: f32, autoLOD: f32,");
    let output = Output {
        form: Form::Override,
        ..banded(Transition::Blend)
    };
    has(&text(&own, output), "(mat_1.autoLOD - 0.85) / 0.25");
}

const HOLES: &str = "\
@group(0) @binding(0) var holes: texture_2d<f32>;
@group(0) @binding(1) var holes_sampler: sampler;
@fragment fn fs_main(@builtin(position) at: vec4f, @location(0) uv: vec2f) -> @location(0) vec4f {
    let seen = textureSample(holes, holes_sampler, uv * 9.0);
    if seen.x < 0.5 { discard; }
    return vec4f(seen.y, uv, 1.0);
}
";

#[test]
fn pixels_that_are_discarded_are_so_by_the_level_that_is_chosen() {
    let source = source(HOLES);
    // The level has its holes where the original has none.
    let other = Source::parse("a.wgsl", HOLES.replace("seen.x < 0.5", "seen.x >= 0.5"));
    let other = base(&other.unwrap_or_else(|e| panic!("{e}")));
    let levels = [EmitLevel {
        shader: other,
        ..level(&source, 1.0)
    }];
    let files = emit(&source, &base(&source), &levels, banded(Transition::Dither));
    let (_, bytes) = files.unwrap_or_else(|e| panic!("{e}")).swap_remove(0);
    let text = String::from_utf8(bytes).expect("it is text");
    has(&text, "let near = original_fs_main_whole(at, uv);");
    let emitted = Source::parse("dir/test.wgsl", &text).unwrap_or_else(|e| panic!("{e}"));
    let scene = "object = \"plane\"\nresolution = [64, 64]\n[views]\ndirections = [[0, 0, 1]]";
    let mut scene = Scene::resolve(&emitted, Some((Path::new("a.toml"), scene)))
        .unwrap_or_else(|e| panic!("{e}"));
    let fragment = emitted
        .module
        .entry_points
        .iter()
        .position(|e| e.name == "fs_main");
    let fragment =
        Program::compile(&emitted.module, fragment.expect("it is there"), &[]).expect("it runs");
    let stage = scene.vertex_stage.clone().expect("it is supplied");
    let vertex = Program::compile(&stage.module, 0, &[]).expect("it runs");
    let mut alive = |autolod: f64| -> Vec<bool> {
        scene.set_auto_lod(autolod);
        let frame = scene.frames(scene.nearest).remove(0);
        let coverage = rasterize(&vertex, &fragment, &frame);
        let shading = shade(&fragment, &coverage, &frame.bindings);
        shading.alive.clone()
    };
    let [near, both, far] = [0.5, 1.125, 2.0].map(&mut alive);
    assert!(near.iter().zip(&far).all(|(near, far)| near != far));
    let of_far = both
        .iter()
        .zip(&far)
        .filter(|(both, far)| both == far)
        .count();
    let share = of_far as f64 / both.len() as f64;
    assert!((share - 0.5).abs() < 0.02, "{share}");
}
