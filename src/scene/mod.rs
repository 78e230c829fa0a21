//! The scene: the views, distances, lights, uniforms, textures and mesh that errors are measured over.

pub mod mesh;
