#version 450
layout(location = 0) in vec2 uv;
layout(location = 0) out vec4 colour;

layout(set = 0, binding = 0) uniform sampler linear;
layout(set = 0, binding = 1) uniform texture2D layers[4];

void main() {
    colour = texture(sampler2D(layers[1], linear), uv);
}
