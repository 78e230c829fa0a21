struct Camera { eye: vec3f }
@group(0) @binding(0) var<uniform> camera: Camera;
@fragment fn fs_main(@location(0) world: vec3f) -> @location(0) vec4f { return vec4f(camera.eye - world, 1.0); }
