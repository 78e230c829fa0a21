#!/usr/bin/env python3
"""Writes fragment shaders from MaterialX materials, for tests/corpus.rs.

usage: materialx.py OUT [DOCUMENTS]

OUT/library     the surface shaders of the library that comes with the package, each with its default inputs
OUT/documents   the materials of the .mtlx files in the folder DOCUMENTS, at most two of each file

Each shader is written in two flavours of GLSL: NAME.frag keeps textures and samplers apart, NAME.vulkan.frag combines
them. Beside it stands a scene with the values that the material gives its parameters. A material that a generator
refuses is named on stderr, and left out.
"""

import pathlib
import sys

import MaterialX as mx
from MaterialX import PyMaterialXGenGlsl as glsl
from MaterialX import PyMaterialXGenShader as gen

PER_DOCUMENT = 2
LIGHTS = 4
SCENE = """resolution = [32, 32]
levels = 2

[views]
directions = [[0.3, 0.4, 1.0]]
"""
SIZES = {"color3": 3, "color4": 4, "vector2": 2, "vector3": 3, "vector4": 4}
ZERO = "[0.0, 0.0, 0.0]"
STRUCTS = {
    "surfaceshader": {"color": ZERO, "transparency": ZERO},
    "displacementshader": {"offset": ZERO, "scale": "0.0"},
}
# What the host of a shader says, in place of the material.
OVERRIDES = {"u_envRadianceSamples": "4", "u_envRadianceMips": "4"}
TOLD = {"u_viewPosition"}
PACKAGE = pathlib.Path(mx.__file__).parent


def standard_library():
    library = mx.createDocument()
    mx.loadLibraries(["libraries"], mx.FileSearchPath(str(PACKAGE)), library)
    return library


def generated(flavour, element):
    """An element's shader, which its stages live no longer than."""
    generator = flavour.create()
    context = gen.GenContext(generator)
    context.registerSourceCodeSearchPath(mx.FileSearchPath(str(PACKAGE)))
    options = context.getOptions()
    options.shaderInterfaceType = gen.SHADER_INTERFACE_COMPLETE
    options.hwMaxActiveLightSources = LIGHTS
    options.hwSpecularEnvironmentMethod = gen.HwSpecularEnvironmentMethod.SPECULAR_ENVIRONMENT_FIS
    return generator.generate(element.getName(), element, context)


def number(port):
    """A parameter's value as a scene writes it; None for what is no number."""
    kind = port.getType().getName()
    if port.getVariable() in OVERRIDES:
        return OVERRIDES[port.getVariable()]
    text = port.getValue().getValueString() if port.getValue() else ""
    if kind == "integer":
        return text if text.lstrip("-").isdigit() else "1" if text == "true" else "0"
    if kind == "boolean":
        return "1" if text == "true" else "0"
    if kind in ("filename", "string"):
        return None
    values = [repr(float(value)) for value in text.split(",")] if text else []
    if kind == "float":
        return values[0] if values else "0.0"
    if kind in SIZES:
        return "[" + ", ".join(values or ["0.0"] * SIZES[kind]) + "]"
    if kind == "matrix44" and len(values) == 16:
        return "[" + ", ".join("[" + ", ".join(values[i : i + 4]) + "]" for i in range(0, 16, 4)) + "]"
    return None


def scene(pixel_stage):
    """The scene of a stage. What is not in it, lodc tells from names."""
    lines = [SCENE, "[uniforms]"]
    for _, block in sorted(pixel_stage.getUniformBlocks().items()):
        for index in range(block.size()):
            port = block[index]
            name = f"{block.getName()}_pixel.{port.getVariable()}"
            value = number(port) if port.getVariable() not in TOLD else None
            if block.getName() == "LightData":
                lines += [f'"LightData_pixel.u_lightData[{light}].light_type" = 0' for light in range(LIGHTS)]
            elif port.getType().getName() in STRUCTS:
                lines += [f'"{name}.{member}" = {zero}' for member, zero in STRUCTS[port.getType().getName()].items()]
            elif value is not None:
                lines.append(f'"{name}" = {value}')
    return "\n".join(lines) + "\n"


def write(folder, name, element):
    for ending, flavour in ((".frag", glsl.WgslShaderGenerator), (".vulkan.frag", glsl.VkShaderGenerator)):
        try:
            shader = generated(flavour, element)
        except Exception as refusal:  # whatever a generator says, in whatever type
            print(f"{name}{ending}: {str(refusal).splitlines()[0]}", file=sys.stderr)
            continue
        pixel_stage = shader.getStage(gen.PIXEL_STAGE)
        (folder / f"{name}{ending}").write_text(pixel_stage.getSourceCode(), encoding="utf-8")
        (folder / f"{name}{ending}").with_suffix(".toml").write_text(scene(pixel_stage), encoding="utf-8")


def from_library(library, folder):
    """A material of each surface shader that has an implementation."""
    folder.mkdir(parents=True, exist_ok=True)
    for definition in sorted(library.getNodeDefs(), key=lambda d: d.getName()):
        if definition.getType() != "surfaceshader" or definition.getNodeGroup() != "pbr":
            continue
        document = mx.createDocument()
        document.setDataLibrary(library)
        name = definition.getName().removeprefix("ND_")
        try:
            shader = document.addNodeInstance(definition, "shader")
            material = document.addMaterialNode("material", shader)
        except Exception as refusal:
            print(f"{name}: {refusal}", file=sys.stderr)
            continue
        write(folder, name, material)


def from_documents(library, documents, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(documents.glob("*.mtlx")):
        document = mx.createDocument()
        mx.readFromXmlFile(document, str(path))
        document.setDataLibrary(library)
        for element in gen.findRenderableElements(document)[:PER_DOCUMENT]:
            write(folder, f"{path.stem}.{element.getName()}", element)


def main(out, documents=None):
    library = standard_library()
    from_library(library, pathlib.Path(out) / "library")
    if documents:
        from_documents(library, pathlib.Path(documents), pathlib.Path(out) / "documents")


if __name__ == "__main__":
    main(*sys.argv[1:])
