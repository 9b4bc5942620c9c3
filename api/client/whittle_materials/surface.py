"""glTF's materials (metallic-roughness) as coefficients of the local model.

    F = ((ior - 1) / (ior + 1))^2      a = max(roughness, 0.2)^2      n = 2 / a^2 - 2
    K_d = (1 - m) (1 - t) (1 - d) + m r        K_dt = (1 - m) (1 - t) d        K_r = m (1 - r)        K_t = (1 - m) t
    K_s = (m (1 - r) + (1 - m) F) (n + 2) / 8

m is metallic, r roughness, t transmission, d diffuse transmission. n is the exponent of Blinn's highlight as wide as a
microfacet distribution of width a (Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces",
section 5.2), a = roughness^2 (glTF 2.0, appendix B), and (n + 2) / 8 makes it as bright (Akenine-Moeller et al.,
"Real-Time Rendering", 3rd ed. 2008, section 7.6). The local model has no blurred mirror images: the share m r of a
metal's is diffuse. So K_d + K_dt + K_r + K_t <= 1, and paths conserve energy. Metals colour reflection and highlight.
A highlight of roughness below 0.2 would be a point; such a surface has the one of 0.2.
"""
import math

from whittle_materials.members import factor_and_color

READ = {"KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_transmission", "KHR_materials_unlit",
        "KHR_materials_volume", "KHR_materials_diffuse_transmission"}
WHITE = [1.0, 1.0, 1.0]
ABSORBED_MIN = 1e-6  # an attenuation color of 0 would be an infinite absorption


def material_of(file, at):
    """The material of the document for the glTF material at `at`."""
    return Surface(file, at).material()


class Surface:
    """One material of `file` (gltf.GltfFile), which makes its textures and lists what is not carried over."""

    def __init__(self, file, at):
        self.file, self.at = file, at
        self.pbr = self.part(at.get("pbrMetallicRoughness", dict), "pbrMetallicRoughness")
        *color, self.alpha = self.pbr.numbers_or("baseColorFactor", [1.0] * 4, 0, 1)
        self.texture_info = self.pbr.get("baseColorTexture", dict)
        texture = file.texture(self.texture_info) if self.texture_info is not None else None
        self.base, self.scale = (texture, max(color)) if texture else (color, 1.0)
        if texture and max(color) != min(color):
            self.omit(self.pbr, "the hue of baseColorFactor beside baseColorTexture")

    def omit(self, at, what):
        self.file.omit(at, what)

    def part(self, value, name):
        """The value, or an empty one in its place."""
        return value if value is not None else type(self.at)(self.at.path, {}, f"{self.at.pointer}/{name}")

    def extension(self, name):
        return self.part(self.at.extension(name), f"extensions/{name}")

    def omit_members(self, at, *names):
        for name in names:
            if (member := at.get(name)) is not None:
                self.omit(member, name)

    def material(self):
        self.omit_members(self.at, "occlusionTexture")
        for name in (extensions := self.part(self.at.get("extensions", dict), "extensions")).value:
            if name not in READ:
                self.omit(extensions, name)
        if self.at.extension("KHR_materials_unlit") is not None:
            material = {"model": "lambert", "color": 0, "ambient": 0, "diffuse": 0, "emission": self.base}
            if self.scale != 1:
                self.omit(self.pbr, "baseColorFactor of an unlit texture")
        else:
            material = {"model": "blinn_phong", "color": self.base, **self.coefficients()}
            self.add_emission(material)
            self.add_normal_map(material)
        self.add_opacity(material)
        return material

    def metallic_roughness(self):
        metallic, roughness = (self.pbr.number_or(name, 1.0, 0, 1) for name in ("metallicFactor", "roughnessFactor"))
        if (texture := self.pbr.get("metallicRoughnessTexture")) is not None:
            self.omit(texture, "metallicRoughnessTexture: metallic is 0, roughness its factor, the texture itself")
            metallic = 0.0
        return metallic, roughness

    def coefficients(self):
        metallic, roughness = self.metallic_roughness()
        transmission, diffuse_transmission, transmitted_color = self.transmissions()
        ior = self.extension("KHR_materials_ior").number_or("ior", 1.5, 1)
        fresnel = ((ior - 1) / (ior + 1)) ** 2
        exponent = 2 / max(roughness, 0.2) ** 4 - 2
        matt = (1 - metallic) * (1 - transmission)
        diffuse = (matt * (1 - diffuse_transmission) + metallic * roughness) * self.scale
        highlight = (metallic * (1 - roughness) * self.scale + (1 - metallic) * fresnel) * (exponent + 2) / 8
        fields = {"diffuse": diffuse, "ambient": diffuse}
        if highlight > 0:
            fields.update(specular=float(f"{highlight:.9g}"), shininess=float(f"{exponent:.9g}"))
            if metallic >= 0.5:
                fields["specular_color"] = self.base
        if diffuse_transmission > 0:
            fields.update(diffuse_transmission=matt * diffuse_transmission, diffuse_transmission_color=transmitted_color)
        if (clear := (1 - metallic) * transmission) > 0:
            self.add_transmission(fields, clear, ior, fresnel, roughness)
        elif (mirror := metallic * (1 - roughness) * self.scale) > 0:
            fields.update(reflection=mirror, reflection_color=self.base)
        return fields

    def transmissions(self):
        """Shares of light that is transmitted clearly and diffusely, and the color of the latter."""
        clear, diffuse = (self.extension("KHR_materials_" + name) for name in ("transmission", "diffuse_transmission"))
        self.omit_members(clear, "transmissionTexture")
        self.omit_members(diffuse, "diffuseTransmissionTexture")
        color = diffuse.numbers_or("diffuseTransmissionColorFactor", WHITE, 0, 1)
        if (info := diffuse.get("diffuseTransmissionColorTexture", dict)) is not None:
            texture = self.file.texture(info)
            if texture and color != WHITE:
                self.omit(diffuse, "diffuseTransmissionColorFactor beside a texture")
            color = texture or color
        return (clear.number_or("transmissionFactor", 0.0, 0, 1), diffuse.number_or("diffuseTransmissionFactor", 0.0, 0, 1),
                color)

    def add_transmission(self, fields, clear, ior, fresnel, roughness):
        """Glass that refracts if it has a volume, else a thin sheet that light passes straight."""
        volume = self.extension("KHR_materials_volume")
        self.omit_members(volume, "thicknessTexture")
        if roughness > 0:
            self.omit(self.pbr, "the roughness of what is transmitted")
        fields["transmission_color"] = self.base
        if volume.number_or("thicknessFactor", 0.0, 0) > 0:
            fields.update(transmission=clear * self.scale, reflection=clear, ior=ior, fresnel=True)
            color = volume.numbers_or("attenuationColor", WHITE, 0, 1)
            if volume.get("attenuationDistance") is not None and color != WHITE:
                distance = volume.get("attenuationDistance").number(1e-9)
                fields["absorption"] = [-math.log(max(channel, ABSORBED_MIN)) / distance for channel in color]
        else:
            fields.update(transparency="filtered", transmission=clear * self.scale * (1 - fresnel), reflection=clear * fresnel)

    def add_emission(self, material):
        strength = self.extension("KHR_materials_emissive_strength").number_or("emissiveStrength", 1.0, 0)
        factor = [strength * channel for channel in self.at.numbers_or("emissiveFactor", [0.0] * 3, 0, 1)]
        if max(factor) == 0:
            return
        material["emission"] = factor
        info = self.at.get("emissiveTexture", dict)
        texture = self.file.texture(info) if info is not None else None
        if texture:
            material["emission"] = texture
            if factor != WHITE:
                self.omit(self.at, f"the factor {factor_and_color(factor)[0]:g} of emissiveTexture")

    def add_normal_map(self, material):
        if (info := self.at.get("normalTexture", dict)) is None:
            return
        if texture := self.file.texture(info, color_space="linear"):
            material["normal_map"] = texture
            if info.number_or("scale", 1.0) != 1:
                self.omit(info, "the scale of normalTexture")

    def add_opacity(self, material):
        mode = self.at.get("alphaMode", str)
        if mode is None or mode.value == "OPAQUE":
            return
        if mode.value not in ("MASK", "BLEND"):
            mode.fail("must be OPAQUE, MASK or BLEND")
        if material.get("fresnel"):
            self.omit(mode, "the opacity of glass")
            return
        texture = self.file.texture(self.texture_info, channel="alpha") if self.texture_info is not None else None
        if texture:
            material["opacity"] = texture
            if mode.value == "MASK":
                self.omit(mode, "the sharp edge at alphaCutoff")
            elif self.alpha != 1:
                self.omit(self.pbr, "the alpha of baseColorFactor beside a texture")
        else:
            shown = self.alpha if mode.value == "BLEND" else float(self.alpha >= self.at.number_or("alphaCutoff", 0.5, 0))
            if shown < 1:
                material["opacity"] = shown
