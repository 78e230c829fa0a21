/* A header /* with a comment inside */ that goes on. */
// Lines end in two characters here, and the last one does not end.
@group(0)@binding(0)var<uniform>tint:vec4f;

struct Out{@location(0)colour:vec4f,}

fn original_fs_main(x: f32) -> f32 { return x * 0.5; } // a name that a splice might take
fn lod_one_fs_main(x: f32) -> f32 { return x + 0.1; }

/* before */ @ /* inside */ fragment /* after */
@diagnostic(off, derivative_uniformity) fn /* name */ fs_main // fs_main(
(
	@location( /* zero */ 0 ) uv : vec2f, // fn fs_main() -> @location(0)
	@interpolate(flat) @location(0x1) id : u32,
) -> Out
{
	var out: Out; /* } */
	out.colour = vec4f(original_fs_main(uv.x), lod_one_fs_main(uv.y), f32(id & 1u), 1.0) * tint;
	return out;
}