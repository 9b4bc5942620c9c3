#include "api/src/reader/foreign_words.h"

#include <string>

namespace api {
namespace {

/// `words` are separated and surrounded by spaces, in lower case.
struct Row {
  std::string_view scope, words, form;
};

constexpr Row rows[] = {
    {"the document", " film image size resolution width height render renderer ",
     R"("image": {"width": W, "height": H})"},
    {"the document", " sampler integrator samples spp sampling quality antialias antialiasing settings ",
     R"("accuracy": {"preset": "fine"} or {"samples": N})"},
    {"the document", " fog mist haze atmosphere ", R"("depth_cue": {"front": Z, "back": Z, "color": COLOUR})"},
    {"the document", " world sky environment envmap backgroundcolor skysphere ",
     R"("background": COLOUR, {"zenith": COLOUR, "nadir": COLOUR} or {"environment": TEXTURE})"},
    {"the document", " ambientlight globalambient ", R"("ambient": COLOUR)"},
    {"the document", " light lightsource lightsources lamps ",
     R"("lights": [{"type": "point", "position": [x, y, z]}])"},
    {"the document",
     " shapes shape primitives geometry geometries meshes spheres sphere planes world entities children ",
     R"("objects": [{"type": "sphere", ...}])"},
    {"the document", " groups group instances templates ", R"("prototypes": {"NAME": [objects]})"},
    {"the image", " size resolution xresolution yresolution ", R"("width" and "height")"},
    {"the image", " spp samples samplesperpixel antialias antialiasing aa ", R"("accuracy": {"samples": N})"},
    {"the image", " format file filename ", R"("output": {"formats": ["png"]})"},
    {"the camera", " eye from origin location pos ", R"("position")"},
    {"the camera", " target at to center interest pointat ", R"("look_at": the point in the middle of the image)"},
    {"the camera", " direction dir forward rotation rotate quaternion ", R"("look_at": a point in that direction)"},
    {"the camera", " angle fovy vfov yfov lens focallength hfov ", R"("fov": the vertical angle in degrees)"},
    {"the camera", " near far clip clipstart clipend aspect aspectratio ",
     R"(nothing: the image's size gives the proportions, and nothing is clipped)"},
    {"the camera", " fstop lensradius ", R"("aperture": the diameter of the lens)"},
    {"the camera", " focaldistance focus ", R"("focus_distance")"},
    {"the background", " type ",
     R"(only the fields of one form: "color", "zenith" and "nadir", "environment" or "cube")"},
    {"the background", " top sky horizon ", R"("zenith")"},
    {"the background", " bottom ground floor ", R"("nadir")"},
    {"the background", " image map texture file hdri hdr ", R"("environment": {"file": NAME})"},
    {"a light", " l power energy strength radiance flux brightness emission ", R"("intensity" (a factor) and "color")"},
    {"a light", " castshadow castshadows shadow ", R"("shadows")"},
    {"a light", " falloff decay distance fadedistance fadepower ",
     R"("attenuation": "none", "inverse_square" or [c0, c1, c2])"},
    {"a directional light", " from to position location rotation rotate target lookat ",
     R"("direction": the way the light travels)"},
    {"a light", " location pos origin center ", R"("position")"},
    {"a light", " lookat pointat to at ", R"("target")"},
    {"a light", " angle coneangle spotangle spotsize penumbra blend radius cutoff tightness ",
     R"("inner_angle" and "outer_angle": half angles in degrees)"},
    {"a light", " width height size u v ", R"("corner", "edge_u" and "edge_v")"},
    {"a material", " opacity alpha transparent dissolve d tr filter transmit ",
     R"("transmission" (1 - opacity) with "transparency": "interpolated")"},
    {"a material", " roughness glossiness smoothness gloss ",
     R"("specular" (0 to 1) and "shininess" (the larger, the sharper the highlight))"},
    {"a material", " metallic metalness reflectivity reflective reflect mirror kr ",
     R"("reflection": 0 to 1, a mirror)"},
    {"a material", " refraction refractive glass kt ", R"("transmission": 0 to 1, and "ior")"},
    {"a material", " kd ", R"("diffuse" (a factor) and "color")"},
    {"a material", " ks phong highlight specularity ", R"("specular" (a factor) and "shininess")"},
    {"a material", " ka ", R"("ambient" (a factor))"},
    {"a material", " ke emissive emissioncolor emissivecolor emit glow luminance emissionstrength emissiveintensity ",
     R"("emission": COLOUR)"},
    {"a material", " ns exponent specularexponent phongsize phongexponent ", R"("shininess")"},
    {"a material", " eta refractiveindex indexofrefraction n ni ", R"("ior")"},
    {"a material", " diffusecolor basecolor albedo reflectance pigment rgb tint hsb hsv ", R"("color")"},
    {"a material", " texture map colormap albedomap diffusemap image checker ",
     R"("color": TEXTURE, for example {"checker": ["white", "black"]} or {"file": "wood.png"})"},
    {"a material", " bumpmap displacement displacementmap ", R"("bump": {"texture": TEXTURE, "scale": HEIGHT})"},
    {"a material", " finish ", R"(its fields in the material: "ambient", "diffuse", "specular", "reflection")"},
    {"a material", " type bsdf shader ", R"("model": "lambert", "phong" or "blinn_phong")"},
    {"a material", " name id ", R"("materials": {"NAME": MATERIAL})"},
    {"a material", " side doublesided ", "nothing: surfaces have two sides"},
    {"a colour", " hsv hsl ", R"({"hsb": [hue, saturation, brightness]}, hue in degrees)"},
    {"a colour", " rgb r red ", R"([r, g, b], each from 0 to 1, or "#rrggbb")"},
    {"a texture", " hsv ", R"({"hsb": [hue, saturation, brightness]}, hue in degrees)"},
    {"a texture", " hsl ", R"({"hsb": [hue, saturation, brightness]} or "#rrggbb")"},
    {"a texture", " rgb ", R"([r, g, b] from 0 to 1, or "#rrggbb")"},
    {"a texture", " type color colors color1 color2 ",
     R"({"checker": [c0, c1]}, "gradient" or "noise", or {"file": NAME})"},
    {"a texture", " repeat tile tiling frequency size ", R"("scale": repetitions)"},
    {"a texture", " image src path filename url map ", R"("file")"},
    {"the accuracy", " spp samplesperpixel antialias antialiasing aa ", R"("samples": N)"},
    {"the accuracy", " depth maxbounces bounces maxdepth recursion ", R"("max_depth")"},
    {"the accuracy", " noise noisethreshold threshold error quality ", R"("target_error": code values of 255)"},
    {"the accuracy", " time timelimit timeout ", R"("time_budget_ms")"},
    {"the output", " file filename path name ", R"(the file's name as option -o of "whittle render")"},
    {"the output", " gamma ", "nothing: images for display are sRGB"},
    {"the output", " tonemapping tonemap ", R"("overflow": "reinhard")"},
    {"a mesh", " vertices p points verts v vertex ", R"("positions": [[x, y, z], ...])"},
    {"a mesh", " indices index tris ", R"("triangles": [[0, 1, 2], ...])"},
    {"a mesh", " st uv texcoords texturecoordinates ", R"("uvs": [[u, v], ...])"},
    {"a mesh", " path filename src url ", R"("file")"},
    {"a mesh", " geometry ", R"("positions" and "triangles", or another "type" such as "box")"},
    {"a torus", " radius r major ", R"("major_radius")"},
    {"a torus", " tube tuberadius minor ", R"("minor_radius")"},
    {"a torus", " normal ", R"("axis")"},
    {"a plane", " y d distance offset center ", R"("point": any point of the plane)"},
    {"a triangle", " v0 v1 v2 a b c p0 p1 p2 points positions ", R"("vertices": [[x, y, z], [x, y, z], [x, y, z]])"},
    {"a cylinder", " start bottom p0 end top p1 direction axis center ",
     R"("from" and "to": the centres of its ends, or "base" and "height")"},
    {"a cone", " tip top ", R"("apex")"},
    {"a cone", " radiustop ", R"("apex_radius")"},
    {"an object", " radiustop radiusbottom r ", R"("radius")"},
    {"an object", " translate translation location pos origin ", R"("position": [x, y, z])"},
    {"an object", " rotation euler orientation ", R"("rotate": [x, y, z] in degrees)"},
    {"an object", " matrix ", R"("transform")"},
    {"an object", " color colour pigment texture finish bsdf ", R"("material": {"color": COLOUR})"},
    {"a box", " width depth height dimensions length ", R"("size": [x, y, z] with "center")"},
    {"an object", " width depth size dimensions ", R"("scale")"},
    {"type", " perspectivecamera pinhole ", R"("perspective")"},
    {"type", " orthographiccamera ortho ", R"("orthographic")"},
    {"type", " sun distant distantlight parallel sunlight ", R"("directional")"},
    {"type", " area arealight rectarealight rectlight ", R"("rect")"},
    {"type", " omni pointlight bulb ", R"("point")"},
    {"type", " ambient ambientlight hemisphere hemispherelight ", R"("ambient": COLOUR in the document)"},
    {"type", " infinite environment sky dome domelight skylight hdri envmap ",
     R"("background": {"environment": TEXTURE})"},
    {"type", " cube cuboid boxgeometry ", R"("box")"},
    {"type", " uvsphere icosphere ball ellipsoid spheregeometry ", R"("sphere", with "scale" for an ellipsoid)"},
    {"type", " quad rectangle rect square polygon planegeometry bilinearmesh ",
     R"("mesh" with four "positions" and "faces": [[0, 1, 2, 3]])"},
    {"type", " obj ply stl gltf glb model file objfile ", R"("mesh" with "file")"},
    {"type", " trianglemesh polyhedron indexedfaceset triangles loopsubdiv heightfield ",
     R"("mesh" with "positions" and "triangles")"},
    {"type", " circle ring annulus disk ", R"("disc")"},
    {"type", " tube rod pipe capsule ", R"("cylinder")"},
    {"type", " group union object use ref merge ", R"("instance" with "of": the name of a prototype)"},
    {"type", " ground floor ", R"("plane")"},
    {"type", " light lightsource ", R"("lights": [...] in the document)"},
};

}  // namespace

std::string_view form_of_foreign_word(std::string_view scope, std::string_view word) {
  constexpr std::size_t longest = 32;
  if (word.size() > longest) return {};
  std::string plain = " ";
  for (const char c : word)
    if (c != '_' && c != '-' && c != ' ') plain += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  plain += ' ';
  for (const Row& row : rows)
    if (row.scope == scope && plain.size() > 2 && row.words.find(plain) != std::string_view::npos) return row.form;
  return {};
}

}  // namespace api
