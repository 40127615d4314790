"""What `q3rays export` writes, as arrays, pictures and meshes for Mitsuba (whose variant must have been chosen)."""

import io
import json
import pathlib
import struct

import mitsuba as mi
import numpy as np
from PIL import Image

import drjit as dr


class Glb:
    """A binary glTF file."""

    def __init__(self, path):
        data = pathlib.Path(path).read_bytes()
        length = struct.unpack("<I", data[12:16])[0]
        self.json = json.loads(data[20 : 20 + length])
        self.binary = data[28 + length :]

    def view(self, number):
        v = self.json["bufferViews"][number]
        return self.binary[v["byteOffset"] :][: v["byteLength"]]

    def accessor(self, number):
        a = self.json["accessors"][number]
        kind = {5125: "<u4", 5126: "<f4"}[a["componentType"]]
        values = np.frombuffer(self.view(a["bufferView"]), kind)
        return values.reshape(a["count"], -1) if a["type"] != "SCALAR" else values

    def texture(self, number):
        """RGBA, colour linear, and whether it clamps."""
        t = self.json["textures"][number]
        png = self.view(self.json["images"][t["source"]]["bufferView"])
        texels = np.asarray(Image.open(io.BytesIO(png)).convert("RGBA"), np.float32) / 255
        low = texels[..., :3] <= 0.04045
        texels = texels.copy()
        texels[..., :3] = np.where(low, texels[..., :3] / 12.92, ((texels[..., :3] + 0.055) / 1.055) ** 2.4)
        return texels, self.json["samplers"][t["sampler"]]["wrapS"] == 33071


class Picture:
    """A texture that Dr.Jit looks up with bilinear filtering."""

    def __init__(self, texels, clamps):
        mode = dr.WrapMode.Clamp if clamps else dr.WrapMode.Repeat
        self.texture = mi.Texture2f(mi.TensorXf(np.ascontiguousarray(texels)), wrap_mode=mode)

    def at(self, uv):
        return self.texture.eval(uv)


def to_mesh(name, positions, uvs, normals=None, props=None):
    count = len(positions)
    kind = dict(has_vertex_normals=normals is not None, has_vertex_texcoords=True)
    mesh = mi.Mesh(name, count, count // 3, **kind, props=props or mi.Properties())
    params = mi.traverse(mesh)
    params["vertex_positions"] = np.ravel(positions)
    params["vertex_texcoords"] = np.ravel(uvs)
    params["faces"] = np.arange(count, dtype=np.uint32)
    if normals is not None:
        params["vertex_normals"] = np.ravel(normals)
    params.update()
    return mesh
