//! What a program has of its materials: valid shaders, levels by distance, blocks with the layout of the shader.

use sample::{board, files, original, spirv, wall};

fn parsed(text: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(text).expect("the shader is WGSL");
    naga::valid::Validator::new(Default::default(), naga::valid::Capabilities::all())
        .validate(&module)
        .expect("the shader is valid");
    module
}

#[test]
fn the_shaders_are_those_of_the_locks() {
    assert_eq!(wall::SHADER, include_str!("../shaders/wall.lod.wgsl"));
    assert_eq!(board::SHADER, include_str!("../shaders/board.lod.wgsl"));
    for text in [wall::SHADER, board::SHADER] {
        parsed(text);
    }
    assert!(wall::SHADER.contains("override autoLOD"));
    assert_eq!(wall::AUTOLOD_CONSTANT, Some("autoLOD"));
    assert_eq!(wall::AUTOLOD_BUFFER, None);
}

#[test]
fn levels_change_with_the_distance_and_stick_at_thresholds() {
    assert_eq!(wall::LEVELS.len(), wall::THRESHOLDS.len() + 1);
    let mut model = [[0.0; 4]; 4];
    (0..4).for_each(|k| model[k][k] = 1.0);
    let object = wall::Object {
        model,
        centre: [0.0; 3],
        radius: 1.0,
    };
    let camera = |distance: f32| wall::Camera {
        eye: [0.0, 0.0, distance],
        fov: 45.0,
        // As high as the pictures that levels were made for.
        height: 64.0,
        z_near: 0.1,
    };
    for (level, of) in wall::LEVELS.iter().enumerate().skip(1) {
        let here = wall::auto_lod(&camera(of.distance as f32), &object);
        // Thresholds are rounded up to hundredths.
        assert!(
            (0.0..0.011).contains(&(f64::from(of.autolod) - here)),
            "{here}"
        );
        let beyond = wall::auto_lod(&camera(of.distance as f32 * 1.02), &object);
        assert_eq!(wall::level(beyond, None), level);
        // Not far enough to change.
        assert_eq!(wall::level(beyond, Some(level - 1)), level - 1);
        let value = wall::level_value(level);
        assert_eq!(wall::level(f64::from(value), None), level);
    }
    assert_eq!(wall::level(wall::auto_lod(&camera(1.5), &object), None), 0);
    assert_eq!(wall::level_value(0), 0.0);
}

#[test]
fn bindings_are_those_of_the_shader() {
    for (module, bindings) in [
        (parsed(wall::SHADER), wall::BINDINGS.len()),
        (parsed(board::SHADER), board::BINDINGS.len()),
    ] {
        let variables = module.global_variables.iter();
        let bound = variables.filter(|(_, variable)| variable.binding.is_some());
        assert_eq!(bound.count(), bindings);
    }
    let names = |places: &[usize]| -> Vec<&str> {
        places.iter().map(|at| wall::BINDINGS[*at].name).collect()
    };
    let textures: Vec<&[&str]> = wall::LEVELS.iter().map(|level| level.textures).collect();
    assert_eq!(textures[0], ["albedo", "grime"]);
    assert!(
        textures
            .windows(2)
            .all(|pair| pair[0].len() >= pair[1].len())
    );
    assert!(textures.last().is_some_and(|last| last.len() < 2));
    assert!(names(wall::LEVELS[0].bindings).contains(&"paint"));
    let paint = wall::BINDINGS.iter().find(|b| b.name == "paint");
    let paint = paint.expect("it is bound");
    assert!(paint.fragment && !paint.of_levels);
    let wall::Kind::Uniform(buffer) = paint.kind else {
        panic!("{paint:?}");
    };
    assert_eq!((buffer.ty, buffer.size), ("Paint", 32));
    assert_eq!(size_of::<wall::buffers::Paint>(), 32);
    let rim = buffer.members.iter().find(|m| m.name == "rim");
    assert_eq!(rim.map(|rim| (rim.offset, rim.size)), Some((28, 4)));
    assert!(wall::BINDINGS.iter().all(|b| !b.of_levels));
}

#[test]
fn parameters_are_filled_by_the_host() {
    let (group, binding, offset) = board::AUTOLOD_BUFFER.expect("a uniform chooses");
    assert_eq!(offset, 0);
    let chosen = |b: &&board::Binding| (b.group, b.binding) == (group, binding);
    assert!(
        board::BINDINGS
            .iter()
            .find(chosen)
            .is_some_and(|b| b.of_levels)
    );
    let parameters = board::BINDINGS.iter().position(|b| b.name == "parameters");
    let parameters = parameters.expect("levels have parameters");
    let readers = board::LEVELS
        .iter()
        .map(|l| l.bindings.contains(&parameters));
    assert_eq!(readers.collect::<Vec<_>>(), [false, true, true]);
    let camera = board::buffers::Camera {
        eye: [0.0, 0.0, 9.0],
        ..bytemuck::Zeroable::zeroed()
    };
    let paint = board::buffers::Paint {
        tint: [0.5; 3],
        gloss: 24.0,
        sun: [0.0, 3.0, 4.0],
        ..Default::default()
    };
    // What the stage reads is its own affair: both are handed over where it asks for both.
    let block = lod_parameters(&camera, &paint);
    assert_eq!(bytemuck::bytes_of(&block), block.to_bytes());
    assert!(bytemuck::bytes_of(&paint).starts_with(&0.5_f32.to_le_bytes()));
    let numbers: &[f32] = bytemuck::cast_slice(bytemuck::bytes_of(&block));
    assert!(numbers.iter().all(|number| number.is_finite()));
    // The direction of the sun is made a unit once a draw.
    let directed = numbers.windows(3).any(|at| at == [0.0, 0.6, 0.8]);
    assert!(directed, "{block:?}");
}

fn lod_parameters(
    camera: &board::buffers::Camera,
    paint: &board::buffers::Paint,
) -> board::buffers::LodParameters {
    board::buffers::lod_parameters(camera, paint)
}

#[test]
fn other_forms_have_the_same_items() {
    assert_eq!(files::SHADERS.len(), board::LEVELS.len());
    assert_eq!(files::THRESHOLDS, board::THRESHOLDS);
    for text in files::SHADERS {
        parsed(text);
    }
    let block = files::buffers_of_level_1::lod_parameters(&files::buffers_of_level_1::Paint {
        sun: [0.0, 3.0, 4.0],
        ..Default::default()
    });
    assert_eq!(block.to_sun, [0.0, 0.6, 0.8]);
    let [(name, bytes)] = spirv::SHADERS else {
        panic!("one file of both stages");
    };
    assert_eq!(*name, "wall.lod.spv");
    assert!(bytes.starts_with(&[3, 2, 0x23, 7]));
    assert!(spirv::AUTOLOD_BUFFER.is_some());
    assert!(original::THRESHOLDS.is_empty());
    assert_eq!((original::LEVELS.len(), original::level(9.0, None)), (1, 0));
    assert!(parsed(original::SHADER).entry_points.len() == 2);
}
