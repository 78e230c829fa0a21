//! Variants with stages of their own: what values at the vertices, for a draw and in textures cost and look like.

use crate::compile::normal_form;
use crate::eval::draw::shade;
use crate::eval::programs::{Programs, Stand, fragment, vertex};
use crate::eval::raster::{Frame, rasterize};
use crate::front::Source;
use crate::scene::mesh::Mesh;
use crate::scene::{Scene, Split};
use crate::search::best::best;
use crate::search::exact::Scope;
use crate::search::interval::Interval;
use crate::search::kept::Kept;
use crate::search::{Level, SampleSet, Samples, find};
use glam::Vec3;
use lodc_passes::to_parameter::ToParameter;
use lodc_passes::vertex_motion::VertexMotion;
use lodc_passes::{Pass, Shader, Stage, recipe};
use std::path::Path;
use std::sync::Arc;

/// A material of the repository and its scene, with so many pixels along an edge.
fn material(name: &str, pixels: u32) -> (Shader, Scene) {
    changed_material(name, pixels, |text| text)
}

/// The same with another text.
fn changed_material(
    name: &str,
    pixels: u32,
    change: impl FnOnce(String) -> String,
) -> (Shader, Scene) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/materials");
    let path = folder.join(name).with_extension("wgsl");
    let text = std::fs::read_to_string(&path).expect("it is there");
    let source = Source::parse(&path.display().to_string(), change(text)).expect("it parses");
    let path = path.with_extension("toml");
    let text = std::fs::read_to_string(&path).expect("it is there");
    let lines = text.lines().filter(|line| !line.starts_with("resolution"));
    let size = format!("resolution = [{pixels}, {pixels}]");
    let lines: Vec<&str> = [&*size].into_iter().chain(lines).collect();
    let scene = Scene::resolve(&source, Some((&path, &lines.join("\n"))));
    let scene = scene.unwrap_or_else(|e| panic!("{e}"));
    (normal_form(&source).expect("it is small"), scene)
}

#[test]
fn exact_motion_changes_nothing_but_the_rounding_of_what_is_interpolated() {
    let (mut flat, mut affine) = (0, 0);
    for name in [
        "pbr",
        "gltf_pbr",
        "car_paint",
        "leather",
        "clay",
        "terrain_blend",
    ] {
        let (base, scene) = material(name, 48);
        let original = fragment(&base, &[]).expect("it runs");
        let (vertex, _) = vertex(&base).expect("it runs").expect("it has one");
        let frame = scene.frames(scene.nearest).remove(0);
        let known = rasterize(&vertex, &original, &frame);
        let before = shade(&original, &known, &frame.bindings);
        for candidate in VertexMotion.candidates(&base, &lodc_passes::Facts::default()) {
            if VertexMotion.class(&candidate) != lodc_passes::Class::Lossless {
                continue;
            }
            let shader = recipe::apply(&base, &candidate).expect("it was offered");
            let own = Programs::of(&shader).expect("it runs");
            let (own_vertex, _) = own.vertex.as_ref().expect("it has one of its own");
            let more = known.with_inputs_of(own_vertex, &own.fragment, &frame);
            let after = shade(&own.fragment, &more, &frame.bindings);
            if candidate.choice == "flat" {
                assert_eq!(before.colours, after.colours, "{name}: {candidate}");
                flat += 1;
                continue;
            }
            affine += 1;
            // Rounding moves a number by parts in 10^7; a highlight and a texture's steps magnify that.
            let mut worst = 0.0_f32;
            for (before, after) in before.colours.iter().zip(&after.colours) {
                for (before, after) in before.iter().zip(after) {
                    worst = worst.max((before - after).abs() / before.abs().max(1.0));
                }
            }
            assert!(worst < 2e-3, "{name}: {candidate}: {worst}");
        }
    }
    assert!(flat > 3 && affine > 3, "{flat} flat, {affine} affine");
}

#[test]
fn light_of_clay_at_the_vertices_of_a_sphere_is_cheap_and_looks_alike() {
    let (base, scene) = material("clay", 128);
    let (vertex, _) = vertex(&base).expect("it runs").expect("it has one");
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let cost = |distance| {
        let set = SampleSet::new(&stand, distance, Samples::Full).expect("it runs");
        let candidates = VertexMotion.candidates(&base, &set.facts(&base));
        let mut all = candidates.iter();
        let light = all.find(|candidate| candidate.site.path() == "fs_main.light");
        let light = light.expect("the light is offered");
        let shader = recipe::apply(&base, light).expect("it was offered");
        let figures = set.figures(&shader).expect("it runs");
        assert!(figures.excess() < 0.002, "{figures:?}");
        let work = set.measure(&shader).expect("it runs").used.work;
        work.total() / set.original().used.work.total()
    };
    // From near there are more fragments than vertices, from afar fewer.
    assert!(
        cost(2.5) < 0.4 && cost(20.0) > 1.0,
        "{} {}",
        cost(2.5),
        cost(20.0)
    );
}

#[test]
fn two_sums_over_the_lamps_of_clay_cost_one_loop_at_the_vertices() {
    // Lamps are seen in a glaze as well.
    let glazed = |text: String| {
        text.replace(
            "var diffuse = sky;",
            "var diffuse = sky; var gloss = vec3f();",
        )
        .replace(
            "let falloff = ",
            "let shine = dot(normal, normalize(towards + to_eye)); let falloff = ",
        )
        .replace("    // Dust", "    let glaze = gloss * gloss;\n    // Dust")
        .replace(
            "        diffuse +=",
            "        gloss += lamp.colour * (falloff * shine);\n        diffuse +=",
        )
        .replace("clay.colour * diffuse", "clay.colour * diffuse + glaze")
    };
    let (base, scene) = changed_material("clay", 32, glazed);
    let (vertex, _) = vertex(&base).expect("it runs").expect("it has one");
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let set = SampleSet::new(&stand, scene.nearest, Samples::Full).expect("it runs");
    let cost = |sites: &[&str]| {
        let mut shader = base.clone();
        for site in sites {
            let mut all = VertexMotion
                .candidates(&shader, &set.facts(&base))
                .into_iter();
            let found = all.find(|candidate| candidate.site.path() == *site);
            let found = found.unwrap_or_else(|| panic!("{site} is not offered"));
            shader = recipe::apply(&shader, &found).expect("it was offered");
        }
        set.measure(&shader).expect("it runs").used.work.moved
    };
    let diffuse = cost(&["fs_main.light.mul"]);
    let gloss = cost(&["fs_main.gloss_3"]);
    let both = cost(&["fs_main.light.mul", "fs_main.gloss_3"]);
    println!("at the vertices: {diffuse:.1}, {gloss:.1}, and together {both:.1}");
    assert!(both < 0.85 * (diffuse + gloss), "{diffuse} {gloss} {both}");
}

/// A sphere of radius 1: an octahedron whose triangles are parted in four so many times.
fn sphere(times: u32) -> Mesh {
    let mut corners: Vec<[Vec3; 3]> = Vec::new();
    for (x, y, z) in [0, 1, 2, 3, 4, 5, 6, 7].map(|i| (i & 1, i >> 1 & 1, i >> 2)) {
        let sign = |bit: i32| if bit == 1 { 1.0 } else { -1.0 };
        let [x, y, z] = [x, y, z].map(sign);
        let mut corner = [Vec3::X * x, Vec3::Y * y, Vec3::Z * z];
        if x * y * z < 0.0 {
            corner.swap(1, 2);
        }
        corners.push(corner);
    }
    for _ in 0..times {
        let parted = corners.iter().flat_map(|[a, b, c]| {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| (*a + *b).normalize());
            [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
        });
        corners = parted.collect();
    }
    let positions: Vec<[f32; 3]> = corners
        .as_flattened()
        .iter()
        .map(|p| p.to_array())
        .collect();
    let count = positions.len();
    Mesh {
        normals: positions.clone(),
        uvs: vec![[0.0; 2]; count],
        tangents: vec![[1.0, 0.0, 0.0, 1.0]; count],
        colours: vec![[1.0; 4]; count],
        indices: (0..count as u32).collect(),
        positions,
        ..Mesh::default()
    }
}

#[test]
fn light_at_the_vertices_of_a_finer_mesh_is_nearer_to_the_original() {
    let (base, scene) = material("clay", 96);
    let (vertex, _) = vertex(&base).expect("it runs").expect("it has one");
    let excess = |times| {
        // The same level on another mesh.
        let mut scene = scene.clone();
        scene.mesh = Arc::new(sphere(times));
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let set = SampleSet::new(&stand, 2.5, Samples::Full).expect("it runs");
        let mut all = VertexMotion
            .candidates(&base, &set.facts(&base))
            .into_iter();
        let light = all.find(|candidate| candidate.site.path() == "fs_main.light");
        let light = light.expect("the light is offered");
        let shader = recipe::apply(&base, &light).expect("it was offered");
        set.figures(&shader).expect("it runs").excess()
    };
    let [coarse, fine] = [1, 4].map(excess);
    assert!(coarse > 0.005 && fine < 0.25 * coarse, "{coarse} {fine}");
}

#[test]
fn inputs_that_are_added_to_known_fragments_are_those_of_a_picture_of_its_own() {
    for name in ["car_paint", "ivy"] {
        let (base, scene) = material(name, 48);
        let original = fragment(&base, &[]).expect("it runs");
        let (vertex, _) = vertex(&base).expect("it runs").expect("it has one");
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        let set = SampleSet::new(&stand, scene.nearest, Samples::Full).expect("it runs");
        let candidates = VertexMotion.candidates(&base, &set.facts(&base));
        assert!(candidates.len() > 3, "{name}: {candidates:?}");
        let mut seen = 0;
        for candidate in candidates.iter().step_by(candidates.len() / 4) {
            let shader = recipe::apply(&base, candidate).expect("it was offered");
            let own = Programs::of(&shader).expect("it runs");
            let (own_vertex, _) = own.vertex.as_ref().expect("it has one of its own");
            for frame in scene.frames(scene.nearest).into_iter().take(2) {
                let frame = Frame {
                    offset: [0.25, -0.125],
                    ..frame
                };
                let alone = rasterize(own_vertex, &own.fragment, &frame);
                let known = rasterize(&vertex, &original, &frame);
                for part in [false, true] {
                    let keep = |(x, y): (u32, u32)| !part || (x + y) % 3 == 0;
                    let alone = alone.part(keep);
                    let known = known.part(keep);
                    let more = known.with_inputs_of(own_vertex, &own.fragment, &frame);
                    let [direct, added] = [&alone, &more]
                        .map(|coverage| shade(&own.fragment, coverage, &frame.bindings));
                    assert_eq!(direct.colours, added.colours, "{candidate}");
                    assert_eq!(direct.alive, added.alive, "{candidate}");
                    seen += added.colours.len();
                }
            }
            let measured = set.measure(&shader).expect("it runs");
            let by_both = Programs::of(&shader).expect("it runs");
            let (own_vertex, _) = by_both.vertex.expect("it has one of its own");
            let by_both = Programs::new(own_vertex, by_both.fragment);
            assert_eq!(measured.error, set.measure_programs(&by_both).error);
            assert!(
                measured.used.work.moved > own.handing_over,
                "{candidate}: {measured:?}"
            );
        }
        assert!(seen > 1000, "{seen}");
    }
}

/// What is lit by a light that the scene samples, and has only that to vary with the draw.
const LIT: &str = "
    struct Light { direction: vec3f, strength: f32 }
    @group(0) @binding(0) var<uniform> light: Light;
    @group(0) @binding(1) var<uniform> camera: mat4x4f;
    struct Surface {
        @builtin(position) clip: vec4f,
        @location(0) normal: vec3f,
        @location(1) uv: vec2f,
    }
    @vertex fn vs_main(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) uv: vec2f) -> Surface {
        let grown = 1.0 + 0.1 * sin(light.strength) * cos(light.strength);
        return Surface(camera * vec4f(position * grown, 1.0), normal, uv);
    }
    @fragment fn fs_main(in: Surface) -> @location(0) vec4f {
        let towards = normalize(light.direction);
        let rounded = in.normal + vec3f(0.3 * sin(9.0 * in.uv.x), 0.0, 4.0);
        let lambert = max(dot(normalize(rounded), towards), 0.0);
        let bright = pow(light.strength, 1.5) > 0.5;
        var sum = 0.0;
        for (var i = 0; i < 4; i++) {
            sum += light.strength / f32(i + 2);
        }
        let colour = select(vec3f(0.5), vec3f(0.9, 0.8, 0.7), bright);
        return vec4f(colour * (lambert + 0.1 * sum), 1.0);
    }";

/// A scene of that, with the direction of the light spread between two.
fn lit_scene(source: &Source, resolution: u32) -> Scene {
    let scene = format!(
        "object = \"plane\"
         resolution = [{resolution}, {resolution}]
         [uniforms]
         \"camera\" = \"model-view-projection\"
         \"light.strength\" = {{ samples = [0.25, 0.9] }}
         \"light.direction\" = {{ from = [-0.9, 0.2, 0.6], to = [0.9, 0.3, 0.6], count = 4 }}"
    );
    let scene = Scene::resolve(source, Some((Path::new("lit.toml"), &scene)));
    scene.unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn what_is_moved_to_parameters_exactly_leaves_the_same_picture() {
    let source = Source::parse("lit.wgsl", LIT).expect("it parses");
    let base = normal_form(&source).expect("it is small");
    let scene = lit_scene(&source, 48);
    let (vertex, _) = vertex(&base).expect("it runs").expect("it has one");
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let set = SampleSet::new(&stand, scene.nearest, Samples::Full).expect("it runs");
    let mut shader = base.clone();
    let exact: Vec<_> = ToParameter
        .candidates(&base, &set.facts(&base))
        .into_iter()
        .filter(|candidate| candidate.choice == "exact")
        .collect();
    for candidate in &exact {
        shader = recipe::apply(&shader, candidate).expect("none takes another away");
    }
    let sites: Vec<&str> = exact.iter().map(|exact| exact.site.path()).collect();
    assert_eq!(shader.parameters().len(), exact.len(), "{sites:?}");
    assert!(exact.len() >= 4, "{sites:?}");
    assert!(shader.reads_parameters(Stage::Vertex), "{sites:?}");
    let moved = set.measure(&shader).expect("it runs");
    let original = set.original();
    assert_eq!(moved.error, original.error);
    assert!(moved.used.work.operations() < 0.7 * original.used.work.operations());
    // It is done once for all fragments of a draw.
    assert!(
        moved.used.work.moved > 0.0 && moved.used.work.moved < 1.0,
        "{moved:?}"
    );
    let pictures = [&base, &shader].map(|shader| set.pictures(shader).expect("it runs"));
    assert_eq!(pictures[0], pictures[1]);
}

#[test]
fn an_averaged_parameter_follows_a_light_that_a_constant_does_not() {
    let source = Source::parse("lit.wgsl", LIT).expect("it parses");
    let base = normal_form(&source).expect("it is small");
    let scene = lit_scene(&source, 64);
    let (vertex, _) = vertex(&base).expect("it runs").expect("it has one");
    let stand = Stand {
        base: &base,
        vertex: &vertex,
        scene: &scene,
    };
    let distance = scene.distances[1];
    let search = Interval::new(&stand, &[distance], Samples::Search).expect("it runs");
    let facts = search.start().facts(&base);
    let held_out = Samples::HeldOut(Split::Test);
    let held_out = SampleSet::new(&stand, distance, held_out).expect("it runs");
    let full = SampleSet::new(&stand, distance, Samples::Full).expect("it runs");
    let mut excess = Vec::new();
    for word in ["average", "mean"] {
        let candidates = recipe::candidates(&base, &facts).into_iter();
        let candidates = candidates.chain(ToParameter.candidates(&base, &facts));
        let mut candidates = candidates.filter(|c| c.site.path() == "fs_main.lambert");
        let candidate = candidates.find(|c| c.choice.starts_with(word));
        let candidate = candidate.unwrap_or_else(|| panic!("{word} is offered"));
        let shader = recipe::apply(&base, &candidate).expect("it was offered");
        let measured = search.measure(&shader).expect("it runs");
        // Both with the best numbers that there are.
        let better = best(&search, &base, &candidate, &measured);
        let shader = better.map_or(shader, |better| better.shader);
        for set in [&full, &held_out] {
            let error = set.measure(&shader).expect("it runs").error;
            let added = error.square() - set.original().error.square();
            excess.push(added.max(0.0).sqrt());
        }
    }
    let [averaged, averaged_held_out, baked, baked_held_out] = excess[..] else {
        panic!("{excess:?}");
    };
    println!("excess                 searched light   held-out light");
    println!("averaged parameter     {averaged:14.4}   {averaged_held_out:14.4}");
    println!("baked constant         {baked:14.4}   {baked_held_out:14.4}");
    assert!(averaged < 0.5 * baked, "{excess:?}");
    assert!(averaged_held_out < 0.5 * baked_held_out, "{excess:?}");
}

#[test]
fn levels_have_parameters_where_the_host_fills_them() {
    let source = Source::parse("lit.wgsl", LIT).expect("it parses");
    let base = normal_form(&source).expect("it is small");
    let mut scene = lit_scene(&source, 32);
    scene.distances = vec![scene.distances[0], scene.distances[2], scene.distances[4]];
    scene.e_max = 0.01;
    let (vertex, _) = vertex(&base).expect("it runs").expect("it has one");
    let mut found = Vec::new();
    for parameters in [false, true] {
        scene.host.parameters = parameters;
        let stand = Stand {
            base: &base,
            vertex: &vertex,
            scene: &scene,
        };
        found.push(
            find(&stand, (Scope::None, &Kept::default()), None, &|_| {})
                .expect("it runs")
                .levels,
        );
    }
    let [without, with] = &found[..] else {
        unreachable!("there are two");
    };
    assert!(with.len() > 1 && without.len() > 1);
    let saved = without[1]
        .with_parameters
        .expect("the light's are the same for a draw");
    assert!(saved < without[1].cost, "{saved} {}", without[1].cost);
    assert!(
        without
            .iter()
            .all(|level| level.shader.parameters().is_empty())
    );
    let moved = |level: &Level| {
        let mut steps = level.recipe.0.iter();
        steps.any(|step| step.pass == ToParameter.name())
    };
    assert!(moved(&with[1]), "{:?}", with[1].recipe);
    for level in &with[1..] {
        assert_eq!(moved(level), !level.shader.parameters().is_empty());
        assert_eq!(level.with_parameters, None);
        assert!(level.error.excess() <= level.error.bound);
        let again = level.recipe.replay(&base).expect("it replays");
        assert_eq!(again.fingerprint(), level.shader.fingerprint());
    }
    assert!(
        with[1].cost < without[1].cost,
        "{} {}",
        with[1].cost,
        without[1].cost
    );
}
