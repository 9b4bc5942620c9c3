"""glTF's materials (metallic-roughness) as coefficients of the local model.

    F = ((ior - 1) / (ior + 1))^2      a = max(roughness, 0.2)^2      n = 2 / a^2 - 2
    K_d = (1 - m) (1 - t) (1 - d) + m r        K_dt = (1 - m) (1 - t) d        K_r = m (1 - r)        K_t = (1 - m) t
    K_s C_s = (m (1 - r) base + (1 - m) F) (n + 2) / 8

m is metallic, r roughness, t transmission, d diffuse transmission. n is the exponent of Blinn's highlight as wide as a
microfacet distribution of width a (Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces",
section 5.2), a = roughness^2 (glTF 2.0, appendix B), and (n + 2) / 8 makes it as bright (Akenine-Moeller et al.,
"Real-Time Rendering", 3rd ed. 2008, section 7.6). The local model has no blurred mirror images: the share m r of a
metal's is diffuse. So K_d + K_dt + K_r + K_t <= 1, and paths conserve energy. Metals colour reflection and highlight.
A highlight of roughness below 0.2 would be a point; such a surface has the one of 0.2. KHR_materials_specular scales
F and colours it. Where m and r are textures, K_d C, K_r C_r and K_s C_s are images that are computed from them.
"""
import math

from whittle_materials.members import factor_and_color, of_equal_size, rescaled_normals, to_linear

READ = {"KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_transmission", "KHR_materials_unlit",
        "KHR_materials_volume", "KHR_materials_diffuse_transmission", "KHR_materials_specular"}
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
        *self.color, self.alpha = self.pbr.numbers_or("baseColorFactor", [1.0] * 4, 0, 1)
        self.texture_info = self.pbr.get("baseColorTexture", dict)
        self.base, self.scale = self.base_color()

    def base_color(self):
        """A color or texture, and the factor of what it colors."""
        texture = self.file.texture(self.texture_info) if self.texture_info is not None else None
        if not texture:
            return self.color, 1.0
        if max(self.color) == min(self.color):
            return texture, self.color[0]
        if (product := self.product("base", self.texture_info, self.color)) is not None:
            return product, 1.0
        self.omit(self.pbr, "the hue of baseColorFactor beside baseColorTexture")
        return texture, max(self.color)

    def product(self, what, info, factor):
        """The texture of colors times a factor, or nothing if it cannot be computed."""
        texels, placing = self.file.texels(info)
        return None if texels is None else self.file.computed(self.at, what, to_linear(texels[..., :3]) * factor, placing)

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
            material = {"model": "lambert", "color": 0, "ambient": 0, "diffuse": 0, "emission": self.unlit()}
        else:
            material = {"model": "blinn_phong", "color": self.base, **self.coefficients()}
            self.add_emission(material)
            self.add_normal_map(material)
        self.add_opacity(material)
        return material

    def unlit(self):
        if self.scale == 1:
            return self.base
        if (product := self.product("base", self.texture_info, self.color)) is not None:
            return product
        self.omit(self.pbr, "baseColorFactor of an unlit texture")
        return self.base

    def coefficients(self):
        metallic, roughness = (self.pbr.number_or(name, 1.0, 0, 1) for name in ("metallicFactor", "roughnessFactor"))
        if (info := self.pbr.get("metallicRoughnessTexture", dict)) is None:
            return self.uniform_coefficients(metallic, roughness)
        texels, placing = self.file.texels(info)
        if texels is None:
            self.omit(info, "metallicRoughnessTexture: metallic is 0, roughness its factor, the texture itself")
            return self.uniform_coefficients(0.0, roughness)
        metallic, roughness = metallic * texels[..., 2:3], roughness * texels[..., 1:2]
        base, base_placing = self.file.texels(self.texture_info) if self.texture_info is not None else (None, placing)
        if base_placing == placing:
            return self.textured_coefficients(metallic, roughness, base, placing)
        self.omit(info, "metallicRoughnessTexture, placed unlike baseColorTexture: its means are, the texture itself")
        return self.uniform_coefficients(float(metallic.mean()), float(roughness.mean()))

    def uniform_coefficients(self, metallic, roughness):
        transmission, diffuse_transmission, transmitted_color = self.transmissions()
        ior, fresnel = self.fresnel()
        exponent = 2 / max(roughness, 0.2) ** 4 - 2
        matt, mirror = (1 - metallic) * (1 - transmission), metallic * (1 - roughness)
        diffuse = (matt * (1 - diffuse_transmission) + metallic * roughness) * self.scale
        fields = {"diffuse": diffuse, "ambient": diffuse}
        if isinstance(self.base, list):
            highlight, color = factor_and_color([mirror * channel + (1 - metallic) * part
                                                 for channel, part in zip(self.base, fresnel)])
        else:
            highlight = mirror * self.scale + (1 - metallic) * max(fresnel)
            color = self.base if metallic >= 0.5 else factor_and_color(fresnel)[1]
        self.add_highlight(fields, highlight, color, exponent)
        if diffuse_transmission > 0:
            fields.update(diffuse_transmission=matt * diffuse_transmission, diffuse_transmission_color=transmitted_color)
        if (clear := (1 - metallic) * transmission) > 0:
            self.add_transmission(fields, clear, ior, max(fresnel), roughness)
        elif mirror * self.scale > 0:
            fields.update(reflection=mirror * self.scale, reflection_color=self.base)
        return fields

    def textured_coefficients(self, metallic, roughness, base, placing):
        """`metallic` and `roughness` are images, `base` is one as it is coded or nothing; all in the same place."""
        if base is None:
            base = to_linear(metallic[:1, :1] * 0) + self.color
        else:
            base = to_linear(base[..., :3]) * self.color
        metallic, roughness, base = of_equal_size([metallic, roughness, base])
        transmission, diffuse_transmission, transmitted_color = self.transmissions()
        ior, fresnel = self.fresnel()
        matt, mirror = (1 - metallic) * (1 - transmission), metallic * (1 - roughness)
        mean_roughness, mean_matt = float(roughness.mean()), float(matt.mean())
        if roughness.min() != roughness.max():
            self.omit(self.pbr.get("metallicRoughnessTexture"), f"the width of highlights by texel: they have that of the "
                      f"mean roughness {mean_roughness:.2g}, the texture's")
        image = lambda what, values: self.file.computed(self.at, what, values, placing)
        fields = {"color": image("diffuse", base * (matt * (1 - diffuse_transmission) + metallic * roughness)),
                  "diffuse": 1, "ambient": 1}
        highlight = mirror * base + (1 - metallic) * fresnel
        if (strength := float(highlight.max())) > 0:
            self.add_highlight(fields, strength, image("specular", highlight / strength),
                               2 / max(mean_roughness, 0.2) ** 4 - 2)
        if diffuse_transmission > 0:
            fields.update(diffuse_transmission=mean_matt * diffuse_transmission, diffuse_transmission_color=transmitted_color)
        if (clear := float(1 - metallic.mean()) * transmission) > 0:
            self.add_transmission(fields, clear, ior, max(fresnel), mean_roughness)
        elif mirror.max() > 0:
            fields.update(reflection=1, reflection_color=image("reflection", base * mirror))
        return fields

    def fresnel(self):
        """The index of refraction, and the reflectance of nonmetals from the front by channel."""
        ior = self.extension("KHR_materials_ior").number_or("ior", 1.5, 1)
        specular = self.extension("KHR_materials_specular")
        self.omit_members(specular, "specularTexture", "specularColorTexture")
        factor = specular.number_or("specularFactor", 1.0, 0, 1)
        color = specular.numbers_or("specularColorFactor", WHITE, 0)
        return ior, [factor * min(1.0, channel * ((ior - 1) / (ior + 1)) ** 2) for channel in color]

    @staticmethod
    def add_highlight(fields, strength, color, exponent):
        if strength > 0:
            fields.update(specular=float(f"{strength * (exponent + 2) / 8:.9g}"), shininess=float(f"{exponent:.9g}"))
            if color != WHITE:
                fields["specular_color"] = color

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
        if texture and factor != WHITE and (product := self.product("emission", info, factor)) is not None:
            material["emission"] = product
        elif texture:
            material["emission"] = texture
            if factor != WHITE:
                self.omit(self.at, f"the factor {factor_and_color(factor)[0]:g} of emissiveTexture")

    def add_normal_map(self, material):
        if (info := self.at.get("normalTexture", dict)) is None:
            return
        if (scale := info.number_or("scale", 1.0)) != 1:
            texels, placing = self.file.texels(info)
            if texels is not None:
                material["normal_map"] = self.file.computed(self.at, "normal", rescaled_normals(texels[..., :3], scale), placing)
                return
            self.omit(info, "the scale of normalTexture")
        if texture := self.file.texture(info, color_space="linear"):
            material["normal_map"] = texture

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
        is_mask, cutoff = mode.value == "MASK", self.at.number_or("alphaCutoff", 0.5, 0)
        texels, placing = self.file.texels(self.texture_info) if texture else (None, {})
        if texels is not None and is_mask:
            sharp = (texels[..., 3:] * self.alpha >= cutoff).astype(texels.dtype)
            material["opacity"] = self.file.computed(self.at, "opacity", sharp, {**placing, "filter": "nearest"})
        elif texels is not None and self.alpha != 1:
            material["opacity"] = self.file.computed(self.at, "opacity", texels[..., 3:] * self.alpha, placing)
        elif texture:
            material["opacity"] = texture
            if is_mask:
                self.omit(mode, "the sharp edge at alphaCutoff")
            elif self.alpha != 1:
                self.omit(self.pbr, "the alpha of baseColorFactor beside a texture")
        else:
            shown = float(self.alpha >= cutoff) if is_mask else self.alpha
            if shown < 1:
                material["opacity"] = shown
