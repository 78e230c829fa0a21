//! The committed textures are what the seeded generator makes, pixel by pixel.
#![cfg(feature = "search")]

#[path = "../examples/textures.rs"]
#[allow(dead_code, reason = "an example's main is not called here")]
mod textures;

use std::collections::BTreeSet;
use std::fs;
use std::io::BufReader;

#[test]
fn the_generator_makes_the_committed_pixels() {
    let folder = textures::folder();
    let mut expected = BTreeSet::new();
    for image in textures::all() {
        let path = folder.join(format!("{}.png", image.name));
        let file = fs::File::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let length = file.metadata().expect("a file").len();
        assert!(length < 200_000, "{} has {length} bytes", path.display());
        let mut reader = png::Decoder::new(BufReader::new(file))
            .read_info()
            .expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("a small image")];
        let info = reader.next_frame(&mut pixels).expect("a whole PNG");
        assert_eq!((info.width, info.height), (image.size, image.size));
        assert!(
            pixels == image.pixels,
            "{} differs; run: cargo run --example textures",
            path.display()
        );
        expected.insert(path);
    }
    let found: BTreeSet<_> = fs::read_dir(&folder)
        .expect("the folder of textures")
        .map(|entry| entry.expect("a readable folder").path())
        .collect();
    assert_eq!(found, expected, "files that the generator does not make");
}
