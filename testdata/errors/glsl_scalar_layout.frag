#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 colour;

layout(scalar, set = 0, binding = 0) uniform Material {
    vec3 tint;
    float shine;
} material;

void main() {
    colour = vec4(material.tint, material.shine);
}
