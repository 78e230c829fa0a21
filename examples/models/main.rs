//! Writes a model of any size to simplify: `cargo run --release --example models -- rock 70000 rock.glb`.
//!
//! The shapes are `rock`, `knot` and `vase`; the number is that of triangles, as near as the shape's grid comes to it. The
//! same bytes come out everywhere.

mod shapes;

use lodc::scene::mesh::write::{Level, Looks, Sight, glb};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [shape, count, output] = arguments.as_slice() else {
        return Err("usage: models rock|knot|vase TRIANGLES OUTPUT.glb".into());
    };
    let count: u32 = count.parse()?;
    let Some(mesh) = shapes::shape(shape, count) else {
        return Err(format!("there is no shape `{shape}`: rock, knot, vase").into());
    };
    let level = Level {
        mesh: &mesh,
        distance: 0.0,
    };
    let looks = Looks {
        of_draws: vec![Some(0)],
        materials: vec![format!(
            "{{\"name\":\"{shape}\",\"pbrMetallicRoughness\":{{\"baseColorFactor\":[0.4,0.35,0.3,1],\"metallicFactor\":0,\"roughnessFactor\":0.7}}}}"
        )],
        ..Looks::default()
    };
    std::fs::write(output, glb(&[level], &Sight::default(), &looks)?)?;
    println!(
        "{output}: {} triangles, {} vertices",
        mesh.indices.len() / 3,
        mesh.positions.len()
    );
    Ok(())
}
