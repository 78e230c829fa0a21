#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 colour;

layout(push_constant) uniform Draw {
    vec4 tint;
} draw;

void main() {
    colour = draw.tint;
}
