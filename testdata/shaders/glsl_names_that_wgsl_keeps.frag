#version 450
// Names that GLSL takes and WGSL does not: keywords, overloads, a block without an instance.
layout(location = 0) in vec3 let;
layout(location = 1) in VertexData { vec3 normal; vec2 uv; } vd;
layout(location = 0) out vec4 colour;
layout(std140, binding = 0) uniform Material { vec4 fn; float rough1; float vec3f; };
layout(std140, binding = 1) uniform Lamp { vec3 at; float power; } loop;
layout(binding = 2) uniform texture2D texture1;
layout(binding = 3) uniform sampler sampler1;

struct ptr { float type; vec2 tint__x; };

float sample_(float x) { return x * 0.5; }
float sample_(vec2 x) { return x.x + x.y; }
vec3 loop_(ptr p, inout float sum) { sum += p.type; return vec3(p.tint__x, sum); }

void main() {
    float var = sample_(let.x) + sample_(let.xy);
    ptr match_ = ptr(var, vd.uv);
    vec3 override = loop_(match_, var);
    vec4 read = texture(sampler2D(texture1, sampler1), vd.uv);
    float lit = max(dot(vd.normal, normalize(loop.at)), 0.0) * loop.power;
    colour = fn * rough1 * lit + vec4(override, vec3f) * var + read;
    if (isinf(colour.x) || any(isnan(vd.uv))) colour = vec4(0.0);
    if (!gl_FrontFacing) colour.xyz = vec3(1.0) - colour.xyz;
}
