#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 colour;

layout(set = 0, binding = 0) uniform Material {
    layout(offset = 16) vec4 tint;
} material;

void main() {
    colour = material.tint;
}
