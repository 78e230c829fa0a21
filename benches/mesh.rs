//! How long an image-driven simplification takes, and how far it comes: `cargo bench --bench mesh -- [TRIANGLES]`.
//!
//! A rock of so many triangles with `testdata/materials/pbr.wgsl` (three textures), seen where the whole of it is in the
//! picture.

use glam::DVec3;
use lodc::compile::normal_form;
use lodc::eval::program::Program;
use lodc::front::Source;
use lodc::mesh::{Pictures, Settings, Simplifier, Subject, Triangles, Until, baseline};
use lodc::scene::Scene;
use lodc::scene::mesh::Mesh;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

fn main() {
    let numbers = std::env::args().skip(1).filter_map(|a| a.parse().ok());
    let wanted: Vec<usize> = numbers.collect();
    let wanted = if wanted.is_empty() {
        vec![40_000]
    } else {
        wanted
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let source = Source::read(&root.join("testdata/materials/pbr.wgsl")).expect("it parses");
    let base = normal_form(&source).expect("it is small");
    let programs = [lodc_passes::Stage::Vertex, lodc_passes::Stage::Fragment].map(|stage| {
        let entry = base.index(stage).expect("it has one");
        Program::compile(base.module(), entry, &[]).expect("it runs")
    });
    for triangles in wanted {
        let mut scene = Scene::read(&source, None).expect("it resolves");
        scene.mesh = Arc::new(rock(triangles));
        let subject = Subject {
            vertex: &programs[0],
            fragment: &programs[1],
            scene: &scene,
        };
        let distance = scene.sphere.radius / (scene.fov.to_radians() / 2.0).sin();
        let start = Instant::now();
        let mut simplifier = Simplifier::new(subject, Settings::default());
        let mut rounds = 0;
        let counter = std::cell::Cell::new(0);
        let sequence = simplifier.run(distance, Until::Error(0.05), &|watch| {
            counter.set(counter.get() + 1);
            println!(
                "{:7.1} s  round {:3}  {:6} triangles  excess {:.4}",
                start.elapsed().as_secs_f64(),
                counter.get(),
                watch.triangles,
                watch.excess
            );
        });
        rounds += counter.get();
        let kept = sequence.worth_keeping(500);
        println!(
            "{} triangles, {rounds} rounds, {:.1} s, {} meshes worth keeping",
            sequence.triangles,
            start.elapsed().as_secs_f64(),
            kept.len()
        );
        let judge = Pictures::held_out(subject, distance, lodc::scene::Split::Test, 24);
        println!("floor {:.4}", judge.floor().sqrt());
        for share in [0.75, 0.5, 0.35, 0.25, 0.175, 0.125] {
            let count = (share * sequence.triangles as f64) as usize;
            let steps = sequence
                .steps
                .iter()
                .take_while(|step| step.triangles >= count)
                .count();
            let own = Triangles::left(&sequence.surface(steps), &scene.mesh);
            let [plain, all] = [false, true].map(|a| baseline::to_triangles(&scene.mesh, count, a));
            println!(
                "{count:6}: image-driven {} {:.4}   meshopt {} {:.4}   with attributes {} {:.4}",
                own.count(),
                judge.excess(&own),
                plain.count(),
                judge.excess(&plain),
                all.count(),
                judge.excess(&all),
            );
        }
    }
}

/// A sphere with bumps of several sizes, with a seam along u.
fn rock(triangles: usize) -> Mesh {
    let down = ((triangles as f64 / 4.0).sqrt().round() as u32).max(2);
    let around = 2 * down;
    let mut mesh = Mesh::default();
    let at = |u: f64, v: f64| {
        let (turn, fall) = (u * std::f64::consts::TAU, v * std::f64::consts::PI);
        let out = DVec3::new(fall.sin() * turn.sin(), fall.cos(), fall.sin() * turn.cos());
        let wave =
            |f: f64, p: DVec3| (p.x * f).sin() * (p.y * f + 1.0).sin() * (p.z * f + 2.0).sin();
        let height = 0.12 * wave(3.0, out)
            + 0.05 * wave(8.0, out)
            + 0.02 * wave(21.0, out)
            + 0.006 * wave(55.0, out);
        out * (1.0 + height)
    };
    for j in 0..=down {
        for i in 0..=around {
            let (u, v) = (
                f64::from(i % around) / f64::from(around),
                f64::from(j) / f64::from(down),
            );
            let p = match j {
                0 => at(0.0, 0.0),
                _ if j == down => at(0.0, 1.0),
                _ => at(u, v),
            };
            let e = 1e-4;
            let (du, dv) = (at(u + e, v) - at(u - e, v), at(u, v + e) - at(u, v - e));
            let normal = match j == 0 || j == down {
                true => p.normalize(),
                false => dv.cross(du).normalize(),
            };
            let tangent = match j == 0 || j == down {
                true => normal.any_orthonormal_vector(),
                false => (du - normal * du.dot(normal)).normalize(),
            };
            let normal = if normal.dot(p) < 0.0 { -normal } else { normal };
            mesh.positions.push(p.as_vec3().to_array());
            mesh.normals.push(normal.as_vec3().to_array());
            mesh.tangents.push(tangent.as_vec3().extend(1.0).to_array());
            mesh.uvs
                .push([4.0 * i as f32 / around as f32, 2.0 * j as f32 / down as f32]);
            mesh.colours.push([1.0; 4]);
        }
    }
    for j in 0..down {
        for i in 0..around {
            let a = j * (around + 1) + i;
            let b = a + around + 1;
            if j > 0 {
                mesh.indices.extend([a, b, a + 1]);
            }
            if j + 1 < down {
                mesh.indices.extend([a + 1, b, b + 1]);
            }
        }
    }
    mesh
}
