//! `examples/viewer` on a display in memory: its window shows each level, chosen by keys and by distance.
//!
//! Needs Xvfb and Vulkan. Where one is missing it is skipped, aloud; where `CI` is set that is a failure. The window is opened in a
//! process of its own: this program, once more.

#[path = "pictures/mod.rs"]
mod pictures;
#[path = "../examples/viewer/main.rs"]
#[allow(dead_code, reason = "the test calls what `main` calls")]
mod viewer;

use lodc::eval::image::{Image, Space, read_png};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Set for the process that opens the window: the folder of its pictures.
const SHOTS: &str = "LODC_VIEWER_SHOTS";

const NAME: &str = "the_window_shows_each_level";

fn main() {
    if let Some(folder) = std::env::var_os(SHOTS) {
        let arguments = [
            root("tests/sample/shaders/wall.wgsl"),
            "--shots".into(),
            folder.into(),
        ];
        let arguments = arguments.map(|path: PathBuf| path.display().to_string());
        if let Err(error) = viewer::run(arguments.into_iter()) {
            eprintln!("{error}");
            std::process::exit(1);
        }
        return;
    }
    // As of other tests: names that are asked for, and options.
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut names = arguments.iter().filter(|a| !a.starts_with('-')).peekable();
    let is_meant = names.peek().is_none() || names.any(|name| NAME.contains(name.as_str()));
    if arguments.iter().any(|argument| argument == "--list") {
        println!("{NAME}: test");
    } else if is_meant {
        the_window_shows_each_level();
        println!("test {NAME} ... ok");
    }
}

fn root(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(file)
}

/// A display in memory, for as long as this lives.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    /// `None` when there is no Xvfb, which is said.
    fn open() -> Option<Self> {
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "800x800x24"])
            .args(["-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut server) = server else {
            let missing = "Xvfb is missing; .ci/run installs it";
            assert!(std::env::var_os("CI").is_none(), "{missing}");
            println!("SKIPPED: {missing}");
            return None;
        };
        // It says its number when it is ready.
        let said = server.stdout.take().map(BufReader::new);
        let number = said.and_then(|said| said.lines().next()?.ok());
        let name = format!(":{}", number.unwrap_or_default());
        Some(Self { server, name })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn picture(folder: &Path, name: &str) -> Image {
    let read = read_png(&folder.join(name), Space::Linear);
    read.unwrap_or_else(|error| panic!("{error}"))
}

/// The mean colour of what is drawn, and how many pixels that is.
fn mean(image: &Image) -> ([f32; 3], usize) {
    let drawn = image.texels.iter().filter(|texel| texel[3] > 0.0);
    let count = drawn.clone().count();
    let sum = drawn.fold([0.0; 3], |sum, texel| {
        [0, 1, 2].map(|channel| sum[channel] + texel[channel])
    });
    (sum.map(|channel| channel / count.max(1) as f32), count)
}

fn the_window_shows_each_level() {
    if pictures::open("vulkan").is_none() {
        return;
    }
    let Some(display) = Display::open() else {
        return;
    };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("viewer");
    let _ = std::fs::remove_dir_all(&folder);
    let program = std::env::current_exe().expect("it has a file");
    let output = Command::new(program)
        .env(SHOTS, &folder)
        .env("DISPLAY", &display.name)
        .env("WGPU_BACKEND", "vulkan")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}{error}");
    let lines: Vec<&str> = said.lines().collect();
    let expected: Vec<String> = ["level", "distance"]
        .into_iter()
        .flat_map(|by| (0..3).map(move |level| (by, level)))
        .map(|(by, level)| {
            let file = folder.join(format!("{by}-{level}.png"));
            format!("{}: level {level}", file.display())
        })
        .collect();
    assert_eq!(lines, expected);

    // By hand: the same view, another level, each of its tint. The first has none.
    let by_hand = [0, 1, 2].map(|level| picture(&folder, &format!("level-{level}.png")));
    let means = by_hand.each_ref().map(mean);
    let [(original, count), (green, _), (yellow, _)] = means;
    assert!(count > 10_000, "{count} pixels are drawn");
    assert!(means.iter().all(|(_, of)| *of == count), "{means:?}");
    let red_of = |[r, g, _]: [f32; 3]| r / g;
    let blue_of = |[_, g, b]: [f32; 3]| b / g;
    assert!(red_of(green) < 0.9 * red_of(original), "{means:?}");
    assert!(blue_of(yellow) < 0.9 * blue_of(original), "{means:?}");
    assert!(red_of(yellow) > red_of(green), "{means:?}");

    // By distance: smaller and smaller, in the wall's own colours.
    let by_distance = [0, 1, 2].map(|level| picture(&folder, &format!("distance-{level}.png")));
    let seen = by_distance.each_ref().map(mean);
    assert!(
        seen[0].1 > seen[1].1 && seen[1].1 > seen[2].1 && seen[2].1 > 10,
        "{seen:?}"
    );
    for (colour, _) in &seen[1..] {
        let apart = (red_of(*colour) - red_of(original)).abs();
        assert!(apart < 0.05, "{seen:?} {original:?}");
    }
}
