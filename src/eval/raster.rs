//! The rasteriser: triangles to quads of fragments, with depth, near clipping and perspective-correct inputs.
