//! A host that holds its textures in memory: it answers the library's questions for them by name, and draws no file.
//!
//! ```sh
//! cargo run --release --example images
//! ```

use lodc::eval::texture::{Dimension, Image, Texture};
use lodc::front::Source;
use lodc::scene::{ImageAnswer, ImageSource, Scene};
use std::io;
use std::path::Path;

/// Textures as an application has them.
#[derive(Debug)]
struct Memory;

impl ImageSource for Memory {
    fn texture(&self, name: &str) -> lodc::Result<ImageAnswer> {
        Ok(match name {
            // Two rows of two texels, in linear light.
            "albedo" => {
                let (light, dark) = ([0.8, 0.7, 0.6, 1.0], [0.2, 0.1, 0.1, 1.0]);
                let image = Image {
                    width: 2,
                    height: 2,
                    texels: vec![light, dark, dark, light],
                };
                match Texture::new(Dimension::D2, vec![image]) {
                    Ok(texture) => ImageAnswer::Pixels(texture),
                    Err(_) => ImageAnswer::Unknown,
                }
            }
            "reflections" => ImageAnswer::Dynamic,
            _ => ImageAnswer::Unknown,
        })
    }

    fn file(&self, _: &Path) -> io::Result<Vec<u8>> {
        Err(io::ErrorKind::NotFound.into())
    }
}

const SHADER: &str = "
    @group(0) @binding(0) var albedo: texture_2d<f32>;
    @group(0) @binding(1) var reflections: texture_2d<f32>;
    @group(0) @binding(2) var dirt: texture_2d<f32>;
    @group(0) @binding(3) var filtering: sampler;
    @fragment fn fs(@location(0) uv: vec2f) -> @location(0) vec4f {
        return textureSample(albedo, filtering, uv) * textureSample(reflections, filtering, uv)
            + textureSample(dirt, filtering, uv);
    }";

fn main() -> lodc::Result<()> {
    let source = Source::parse("memory.wgsl", SHADER)?;
    let scene = Scene::resolve_with(&source, None, &Memory)?;
    for texture in &scene.textures {
        let [width, height, _] = texture.images[0].size(0);
        match texture.dynamic {
            true => println!("{}: dynamic", texture.name),
            false => println!("{}: {width} x {height} texels", texture.name),
        }
    }
    for warning in &scene.warnings {
        println!("{warning}");
    }
    Ok(())
}
