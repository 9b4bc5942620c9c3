// Surfaces, materials, media and direct lighting: tracer/src/interaction, tracer/src/materials/compiled_material.h, tracer/src/compiled/medium_stack.h,
// tracer/src/integrators/whitted.
uniform vec3 ambient, outside_absorption;
uniform int light_count;

// ---- surfaces

#ifdef TRIANGLES
// toward_tangent_plane() (Hanika 2021, "Hacking the Shadow Terminator").
vec3 toward_tangent_plane(vec3 vertex, vec3 vertex_normal, float weight) {
  vec3 normal = vertex_normal * (dot(vertex_normal, hit_face) < 0.0 ? -1.0 : 1.0);
  return normal * (-min(dot(hit_position - vertex, normal), 0.0) * weight);
}
void triangle_point() {
  int a = 2 * int(hit_cell.x), b = 2 * int(hit_cell.y), c = 2 * int(hit_cell.z);
  vec3 at_a = cell(vertices, a).xyz, at_b = cell(vertices, b).xyz, at_c = cell(vertices, c).xyz;
  float weight_a = 1.0 - hit_uv.x - hit_uv.y;
  vec3 from_a = at_a * weight_a, from_b = at_b * hit_uv.x, from_c = at_c * hit_uv.y;
  hit_position = from_a + from_b + from_c;
  hit_error = (abs(from_a) + abs(from_b) + abs(from_c)) * rounding_bound(16.0);
  hit_face = unit_or_zero(cross(at_b - at_a, at_c - at_a));
  hit_normal = hit_face;
#ifdef SMOOTH_NORMALS
  vec3 n_a = cell(vertices, a + 1).xyz, n_b = cell(vertices, b + 1).xyz, n_c = cell(vertices, c + 1).xyz;
  vec3 sum = n_a * weight_a + n_b * hit_uv.x + n_c * hit_uv.y;
  float squared = dot(sum, sum);
  if (!(squared > 9.1e-13)) return;
  hit_smooth = true;
  hit_normal = sum / sqrt(squared) * (dot(sum, hit_face) < 0.0 ? -1.0 : 1.0);
  hit_offset = toward_tangent_plane(at_a, n_a, weight_a) + toward_tangent_plane(at_b, n_b, hit_uv.x) +
               toward_tangent_plane(at_c, n_c, hit_uv.y);
#endif
}
#endif

#ifdef QUADRICS
// The point of a standard shape next to p, and its normal.
vec3 shape_point(int kind, float radius_0, float radius_1, float part, vec3 p, out vec3 normal) {
  if (kind == 1) {
    normal = p / max(length(p), 1e-30);
    return normal;
  }
  if (kind == 2) {
    normal = vec3(0.0, 0.0, 1.0);
    return vec3(p.xy, 0.0);
  }
  if (kind == 3) {
    if (part > 0.0) {
      normal = vec3(0.0, 0.0, part == 1.0 ? -1.0 : 1.0);
      return vec3(p.xy, part - 1.0);
    }
    float side_z = clamp(p.z, 0.0, 1.0), slope = radius_1 - radius_0, radius = radius_0 + slope * side_z, r = length(p.xy);
    bool apex = !(r > 0.0 && radius > 0.0);
    normal = apex ? vec3(0.0, 0.0, slope < 0.0 ? 1.0 : -1.0) : vec3(p.xy / r, -slope);
    return vec3(apex ? vec2(0.0) : p.xy / r * radius, side_z);
  }
  if (kind == 4) {
    int face = int(part) - 3, axis = face >> 1;
    float side = float(face & 1);
    normal = vec3(0.0);
    normal[axis] = 2.0 * side - 1.0;
    vec3 within = clamp(p, 0.0, 1.0);
    within[axis] = side;
    return within;
  }
  float r = length(p.xy);
  vec3 circle = r > 0.0 ? vec3(p.xy / r, 0.0) : vec3(1.0, 0.0, 0.0), arm = vec3(circle.xy * (r - 1.0), p.z);
  float size = length(arm);
  normal = size > 0.0 ? arm / size : circle;
  return circle + normal * radius_0;
}

// placed() of tracer/src/shapes/analytic_shape.h
void quadric_point(vec3 on_ray) {
  int kind = int(-1.0 - hit_cell.x), at = int(hit_cell.y);
  vec4 origin = cell(shapes, at);
  mat3 into = shape_from_render(at);
  mat3 from = mat3(cell(shapes, at + 4).xyz, cell(shapes, at + 5).xyz, cell(shapes, at + 6).xyz);
  vec3 normal, local = shape_point(kind, origin.w, cell(shapes, at + 1).w, hit_uv.x, into * (on_ray - origin.xyz), normal);
  vec3 arm = from * local;
  float shape_error = kind == 3 && cell(shapes, at + 2).w > 0.0 ? 2.0 * RIM_SLACK : (kind == 5 ? rounding_bound(16.0) : 0.0);
  mat3 absolute_in = mat3(abs(into[0]), abs(into[1]), abs(into[2])), absolute_out = mat3(abs(from[0]), abs(from[1]), abs(from[2]));
  hit_position = origin.xyz + arm;
  hit_error = absolute_out * (absolute_in * abs(arm) + 1.0) * (rounding_bound(16.0) + shape_error) +
              (abs(hit_position) + abs(origin.xyz)) * rounding_bound(2.0);
  hit_face = unit_or_zero(normal * into);  // by the inverse transpose
  hit_curvature = cell(shapes, at + 3).w;
}
#endif

// Sets the surface at the hit of a ray: compute_points() of tracer/src/interaction/surface.h.
void compute_point(vec3 o, vec3 d) {
  vec3 on_ray = o + d * hit_t;
  hit_offset = vec3(0.0);
  hit_curvature = 0.0;
  hit_smooth = false;
  if (hit_primitive < NONE) {
    vec3 point = cell(planes, 2 * (-2 - hit_primitive)).xyz;
    hit_face = cell(planes, 2 * (-2 - hit_primitive) + 1).xyz;
    hit_position = on_ray - hit_face * dot(on_ray - point, hit_face);
    hit_error = (abs(hit_position) + abs(point)) * rounding_bound(8.0);
  } else if (hit_cell.x == -1.0) {
    vec4 sphere = cell(shapes, int(hit_cell.y));
    // From the point of the line nearest to the center: a point at the distance of the hit has fewer digits.
    vec3 from = o - sphere.xyz, nearest = from - dot(from, d) * d;
    nearest -= dot(nearest, d) * d;
    float half_chord = sqrt(max(sphere.w * sphere.w - dot(nearest, nearest), 0.0));
    hit_face = unit_or_zero(nearest + d * (hit_t < -dot(from, d) ? -half_chord : half_chord));
    vec3 arm = hit_face * sphere.w;
    hit_position = sphere.xyz + arm;
    hit_error = abs(arm) * rounding_bound(16.0) + (abs(hit_position) + abs(sphere.xyz)) * rounding_bound(2.0);
    hit_curvature = 1.0 / sphere.w;
  }
#ifdef QUADRICS
  else if (hit_cell.x < -1.0) quadric_point(on_ray);
#endif
#ifdef TRIANGLES
  else triangle_point();
#endif
#ifdef SMOOTH_NORMALS
  if (hit_smooth) return;
#endif
  hit_normal = hit_face;
}

bool overflow = false;  // a ray or a medium had no place

// ---- materials

const int LIGHT_CELLS = 7;

int object_flags(int object) { return int(cell(objects, OBJECT_CELLS * object).y); }
int material_of(int object) { return MATERIAL_CELLS * int(cell(objects, OBJECT_CELLS * object).x); }
// A number of a material, at the place AT_ with the name of its field; the last cell has flags and textures.
float number_of(int material, int at) { return cell(materials, material + (at >> 2))[at & 3]; }
vec4 surface_of(int material) { return cell(materials, material + MATERIAL_CELLS - 1); }
int material_flags(int material) { return int(surface_of(material).x); }
bool refracts(int material) { return ((material_flags(material) >> 2) & 3) == 0; }

// ---- colors: the ColorOrTexture in a cell, with the number of its texture

vec2 surface_uv, surface_footprint;
vec3 color_of(vec3 plain, float id) {
#ifdef TEXTURES
  if (id > 0.0) return texture_color(int(id) - 1, surface_uv, surface_footprint);
#endif
  return plain;
}
// The colors of a material at the surface, by their cells; for shadows only what transmittance_of() needs.
const int COLOR = AT_COLOR / 4, EMISSION = AT_EMISSION / 4, SPECULAR = AT_SPECULAR_COLOR / 4, REFLECTION_COLOR = AT_REFLECTION_COLOR / 4,
  TRANSMISSION = AT_TRANSMISSION_COLOR / 4, DIFFUSE_TRANSMISSION = AT_DIFFUSE_TRANSMISSION_COLOR / 4, OPACITY = AT_OPACITY / 4,
  METALLIC = AT_METALLIC / 4, ROUGHNESS = AT_ROUGHNESS / 4;
vec3 colors[MATERIAL_CELLS];
void set_colors(int material, bool all) {
  for (int i = 0; i < AT_AMBIENT / 4; ++i) {  // the first number
    if (!all && i != TRANSMISSION && i != OPACITY && i != COLOR && i != METALLIC) continue;
    vec4 color = cell(materials, material + i);
    colors[i] = color_of(color.rgb, color.w);
  }
  float cutoff = number_of(material, AT_OPACITY_CUTOFF);
  colors[OPACITY] = cutoff > 0.0 ? step(cutoff, colors[OPACITY]) : clamp(colors[OPACITY], 0.0, 1.0);
}
bool is_principled(int material) { return (material_flags(material) & 3) == 3; }
bool is_cut_out(int material) { return cell(materials, material + OPACITY) != vec4(1.0, 1.0, 1.0, 0.0); }
// Precondition of this: set_colors().
vec3 transmittance_of(int material) {
  vec3 surface = colors[TRANSMISSION] * number_of(material, AT_TRANSMISSION);
  if (is_principled(material)) surface *= colors[COLOR] * (1.0 - clamp(colors[METALLIC].r, 0.0, 1.0));
  return is_cut_out(material) ? surface * colors[OPACITY] + (1.0 - colors[OPACITY]) : surface;
}
bool is_textured(int material) { return (material_flags(material) & 64) != 0; }

// ---- media: the objects around a ray + 1, from the first entered one on; at most four

#ifdef MEDIA
float priority_of(int object) { return number_of(material_of(object), AT_PRIORITY); }
bool displaces(int object, int other) {
  float mine = priority_of(object), its = priority_of(other);
  if (mine != its) return mine > its;
  int boundary = object_flags(object) >> 2, its_boundary = object_flags(other) >> 2;
  if (boundary != its_boundary) return boundary == 2;
  float diagonal = cell(objects, OBJECT_CELLS * object).z, its_diagonal = cell(objects, OBJECT_CELLS * other).z;
  if (diagonal != its_diagonal) return diagonal < its_diagonal;
  int material = material_of(object), its_material = material_of(other);
  return material != its_material ? material > its_material : object > other;
}
int current_medium(vec4 list) {
  int best = int(list.x) - 1;
  for (int i = 1; i < 4; ++i) {
    if (list[i] == 0.0) break;
    if (displaces(int(list[i]) - 1, best)) best = int(list[i]) - 1;
  }
  return best;
}
vec4 enter(vec4 list, int object) {
  for (int i = 0; i < 4; ++i) {
    if (list[i] > 0.0) continue;
    list[i] = float(object + 1);
    return list;
  }
  overflow = true;
  return list;
}
vec4 leave(vec4 list, int object) {
  int place = NONE;
  for (int i = 0; i < 4; ++i)
    if (int(list[i]) - 1 == object) place = i;
  for (int i = 0; i < 4 && place == NONE; ++i)
    if (list[3 - i] > 0.0 && material_of(int(list[3 - i]) - 1) == material_of(object)) place = 3 - i;
  if (place == NONE) return list;
  for (int i = 0; i < 3; ++i)
    if (i >= place) list[i] = list[i + 1];
  list.w = 0.0;
  return list;
}
float ior_of(int medium) {
  if (medium == NONE) return 1.0;
  int material = material_of(medium);
  return refracts(material) ? number_of(material, AT_IOR) : 1.0;
}
// MediumStack::Crossing
vec4 cross_after;
int cross_near, cross_far;
bool cross_hidden, cross_unentered;
void cross_boundary(vec4 before, int object, bool back) {
  int boundary = object_flags(object) >> 2;
  cross_after = before;
  cross_hidden = cross_unentered = false;
  cross_near = cross_far = current_medium(before);
  if (boundary == 0) return;
  cross_after = back ? leave(before, object) : enter(before, object);
  cross_far = current_medium(cross_after);
  cross_unentered = cross_after == before;
  if (cross_unentered || cross_near != cross_far || cross_near == NONE) return;
  cross_hidden = object_flags(cross_near) >> 2 == 2 && (boundary == 2 || priority_of(cross_near) > priority_of(object));
}
#endif

#ifdef ABSORPTION
vec3 transmittance_along(vec4 media, float distance) {
  vec3 absorption = media.x == 0.0 ? outside_absorption : cell(materials, material_of(current_medium(media)) + AT_ABSORPTION / 4).rgb;
  return mix(vec3(1.0), exp(-absorption * (distance * world_per_render)), greaterThan(absorption, vec3(0.0)));
}
#endif

// ---- shadows

#ifdef SHADOWS
// S_i of Whitted's equation: the product of K_t C_t over the surfaces to the light, and of the absorption between them.
vec3 shadow_transmittance(vec3 o, vec3 d, float t_max, int from, vec4 media) {
  vec3 transmittance = vec3(1.0);
#ifndef TRANSMISSIVE_SHADOWS
  if (intersect(o, d, t_max, from, 1, true)) return vec3(0.0);
#else
  for (int crossing = -1; crossing < 64; ++crossing) {  // first whether something opaque is in the way
    bool is_first = crossing < 0, hit = intersect(o, d, t_max, from, is_first ? 1 : 2, is_first);
    if (is_first && hit) return vec3(0.0);
    if (is_first) continue;
#ifdef ABSORPTION
    int medium = current_medium(media);
    if (medium == NONE || (object_flags(medium) & 1) == 0) transmittance *= transmittance_along(media, hit ? hit_t : t_max);
#endif
    if (!hit) break;
    compute_point(o, d);
    int object = hit_object(), material = material_of(object);
    if ((object_flags(object) & 1) == 0) {
      bool hidden = false;
#ifdef MEDIA
      if (number_of(material, AT_TRANSMISSION) > 0.0) {
        cross_boundary(media, object, dot(d, hit_face) > 0.0);
        media = cross_after;
        hidden = cross_hidden;
      }
#endif
#ifdef TEXTURES
      surface_footprint = vec2(0.0);
      vec3 gradient_u, gradient_v;
      if (is_textured(material)) surface_uv = uv_at(gradient_u, gradient_v);
#endif
      set_colors(material, false);
      if (!hidden) transmittance *= transmittance_of(material);
    }
    t_max -= hit_t;
    if (is_black(transmittance) || !(t_max > 0.0)) break;
    o = clear_of(hit_position, hit_face, dot(abs(hit_face), hit_error), d);
    from = hit_primitive;
  }
#endif
  return transmittance;
}
#endif

// ---- direct lighting: one side of a shading point

vec3 point_position, point_face, point_normal, point_unperturbed, point_to_eye, point_diffuse, point_specular, point_offset;
float point_clearance, point_shininess, point_eta;
int point_from;
vec4 point_media;
bool point_blinn, point_far_side;

// ---- facets of a principled surface: PrincipledPoint of tracer/src/materials/principled.h

vec3 facet_weight;       // of the light that they reflect; 0: the surface is not principled
float path_alpha = 0.0;  // width of the facets by way of which the ray arrives
#ifdef PRINCIPLED
uniform sampler2D albedos;  // facetAlbedos() of renderer.js
vec3 facet_f0, nonmetal_f0, nonmetal_several, base_factor, several_factor;
float facet_f90, nonmetal_f90, facet_roughness, highlight_alpha, coat_share, coat_roughness, passed_coat;
const float COAT_F0 = 0.04;

vec2 facet_albedo(float cosine, float roughness) {
  vec2 at = vec2(sqrt(cosine), roughness) * 31.0;
  ivec2 first = ivec2(min(at, 30.0));
  vec2 part = at - vec2(first);
  vec2 low = mix(texelFetch(albedos, first, 0).xy, texelFetch(albedos, first + ivec2(1, 0), 0).xy, part.x);
  return mix(low, mix(texelFetch(albedos, first + ivec2(0, 1), 0).xy, texelFetch(albedos, first + 1, 0).xy, part.x), part.y);
}
vec2 mean_albedo(float roughness) {
  float at = roughness * 31.0;
  int first = int(min(at, 30.0));
  return mix(texelFetch(albedos, ivec2(32, first), 0).xy, texelFetch(albedos, ivec2(32, first + 1), 0).xy, at - float(first));
}
vec3 several_reflections(vec3 f0, float f90, float white) {
  vec3 average = (20.0 * f0 + f90) / 21.0;
  return average * average * white / (1.0 - average * (1.0 - white));
}
vec3 below_facets(vec2 albedo) {
  return 1.0 - (nonmetal_f0 * albedo.x + nonmetal_f90 * albedo.y + nonmetal_several * (1.0 - albedo.x - albedo.y));
}
float through_coat(float cosine) {
  if (coat_share == 0.0) return 1.0;
  vec2 albedo = facet_albedo(cosine, coat_roughness);
  return 1.0 - coat_share * (COAT_F0 * albedo.x + albedo.y);
}
// Share of the light that facets reflect at once in the direction of a mirror, for smooth ones that of Schlick.
vec2 mirror_albedo(float cosine, float roughness) {
  float x = 1.0 - cosine, grazing = x * x * x * x * x;
  return roughness * roughness < 1e-3 ? vec2(1.0 - grazing, grazing) : facet_albedo(cosine, roughness);
}
// Factors of lit_facets(), seen at a cosine. `glossy`: the share that is no glass.
void set_facets(vec3 base, vec3 metal, float metallic, float view, float glossy) {
  vec2 seen = facet_albedo(view, facet_roughness), mean = mean_albedo(facet_roughness);
  float white = mean.x + mean.y, average_lost = 1.0 - white;
  bool loses = average_lost > 1e-3;
  nonmetal_several = loses ? several_reflections(nonmetal_f0, nonmetal_f90, white) : vec3(0.0);
  vec3 several = loses ? glossy * mix(nonmetal_several, several_reflections(metal, 1.0, white), metallic) : vec3(0.0);
  passed_coat = through_coat(view);
  vec3 average = below_facets(mean);
  if (coat_share > 0.0) {
    average = vec3(0.0);
    average_lost = 0.0;
    for (int i = 0; i < 8; ++i) {
      float cosine = (float(i) + 0.5) / 8.0, part = cosine / 4.0 * through_coat(cosine);
      vec2 there = facet_albedo(cosine, facet_roughness);
      average += below_facets(there) * part;
      average_lost += (1.0 - there.x - there.y) * part;
    }
  }
  several_factor = loses ? several * (passed_coat * (1.0 - seen.x - seen.y) / average_lost) : vec3(0.0);
  base_factor = passed_coat * (1.0 - metallic) * base * below_facets(seen) / max(average, 1e-3);
}
float masking_root(float cosine, float alpha) { return sqrt(mix(cosine * cosine, 1.0, alpha * alpha)); }
// D G / (4 c_o), times pi, as wide as lights see it, and the share of f90.
vec2 eval_facets(vec3 l, float cosine, float roughness) {
  float alpha = max(roughness * roughness, highlight_alpha), squared = alpha * alpha;
  vec3 h = normalize(l + point_to_eye);
  float view = max(dot(point_normal, point_to_eye), 1e-4), x = 1.0 - min(dot(point_to_eye, h), 1.0), along = dot(point_normal, h);
  float root = 1.0 - along * along * (1.0 - squared);
  float masking = cosine / (2.0 * (view * masking_root(cosine, alpha) + cosine * masking_root(view, alpha)));
  return vec2(squared / max(root * root, 1e-12) * masking, x * x * x * x * x);
}
vec3 lit_facets(vec3 l, float cosine) {
  vec2 albedo = facet_albedo(min(cosine, 1.0), facet_roughness), facets = eval_facets(l, cosine, facet_roughness);
  float through = through_coat(min(cosine, 1.0));
  vec3 sum = (base_factor * below_facets(albedo) + several_factor * (1.0 - albedo.x - albedo.y)) * (through * cosine) +
             mix(facet_f0, vec3(facet_f90), facets.y) * (facets.x * min(passed_coat, through));
  if (coat_share > 0.0) {
    facets = eval_facets(l, cosine, coat_roughness);
    sum += coat_share * mix(COAT_F0, 1.0, facets.y) * facets.x;
  }
  return facet_weight * sum;
}
#endif

float spot_factor(float c, float inner, float outer) {
  float x = (c - outer) / (inner - outer);
  return c >= inner ? 1.0 : (c <= outer ? 0.0 : x * x * (3.0 - 2.0 * x));
}
float attenuation(vec4 coefficients, float d) {
  if (coefficients.w == 0.0) return 1.0;
  if (coefficients.w == 1.0) return 1.0 / (d * d);
  return min(1.0 / (coefficients.x + (coefficients.y + coefficients.z * d) * d), 1.0);
}

uvec2 sample_key;  // of the pixel
uint sample_number;
// The point of a light: LightTraits::point() of tracer/src/lights/light_registry.h.
vec3 light_point(int light, int kind, uint path, uint number, uint index) {
  vec3 position = cell(lights, light).xyz;
#ifdef SOFT_LIGHTS
  if (kind < 3) return position;
  vec3 u = cell(lights, light + 3).xyz, v = cell(lights, light + 4).xyz;
  vec2 xi = shuffled_point(index, mix64(sample_key ^ mix64(uvec2(number + 1u, path))));
  if (kind == 3) return position + u * xi.x;
  if (kind == 4) return position + u * xi.x + v * xi.y;
  float phi = 2.0 * PI * xi.y;
  if (kind == 5) return position + sqrt(xi.x) * (u * cos(phi) + v * sin(phi));
  float z = 1.0 - 2.0 * xi.x, r = sqrt(max(0.0, 1.0 - z * z));
  return position + vec3(r * cos(phi), r * sin(phi), z) * cell(lights, light + 4).w;
#else
  return position;
#endif
}

// pow(c, n) with 0^0 = 1: power_of() of tracer/src/math/power.h.
float power_of(float c, float n) { return c > 0.0 ? pow(min(c, 1.0), n) : (n > 0.0 ? 0.0 : 1.0); }

float eval_highlight(vec3 l, float cosine) {
  vec3 n = point_normal, v = point_to_eye;
  if (point_far_side) {
    float squared = 1.0 - point_eta * point_eta * (1.0 - cosine * cosine);
    if (!(squared > 0.0)) return 0.0;  // total reflection
    return power_of(-point_eta * dot(l, v) - (sqrt(squared) - point_eta * cosine) * dot(n, v), point_shininess);
  }
  if (!point_blinn) return power_of(dot(n * (2.0 * cosine) - l, v), point_shininess);
  vec3 between = l + v;
  float size = length(between);
  return power_of(size > 0.0 ? dot(n, between) / size : 0.0, point_shininess);
}

vec3 sample_light(int number, vec3 from, float share) {
  int light = LIGHT_CELLS * number;
  vec4 axis = cell(lights, light + 2);
  bool directional = cell(lights, light).w == 1.0;
  vec3 to_light = axis.xyz, offset = from - point_position;
  float distance = FAR, strength = share;
  if (!directional) {
    distance = length(offset);
    if (!(distance > 0.0)) return vec3(0.0);
    to_light = offset / distance;
    strength *= attenuation(cell(lights, light + 5), distance * world_per_render);
    if (cell(lights, light).w == 2.0) strength *= spot_factor(-dot(to_light, axis.xyz), axis.w, cell(lights, light + 3).w);
  }
  float cosine = dot(point_normal, to_light);
  if (!(cosine > 0.0)) return vec3(0.0);
  vec4 color = cell(lights, light + 1);
  vec3 radiance = point_diffuse * cosine;
  if (!is_black(point_specular)) radiance += point_specular * eval_highlight(to_light, cosine);
#ifdef PRINCIPLED
  if (!point_far_side && !is_black(facet_weight)) radiance += lit_facets(to_light, cosine);
#endif
  radiance *= color.rgb * (color.w * strength);
  if (is_black(radiance)) return radiance;
#ifdef BUMP
  if (dot(point_unperturbed, point_far_side ? -to_light : to_light) < 0.0) return vec3(0.0);
#endif
#ifdef SHADOWS
  if (cell(lights, light + 6).x == 0.0) return radiance;
  vec3 start = point_position + point_offset, direction = to_light;
  float reach = distance;
  if (!directional && point_offset != vec3(0.0)) {
    offset = from - start;
    reach = length(offset);
    if (reach > 0.0) direction = offset / reach;
  }
  vec3 origin = clear_of(start, point_face, point_clearance, direction);
  radiance *= shadow_transmittance(origin, direction, directional ? FAR : reach * (1.0 - 16.0 * UNIT), point_from, point_media);
#endif
  return radiance;
}

vec3 direct_lighting(uint path, uint points) {
  vec3 sum = vec3(0.0);
#ifdef LIGHTS
  for (int number = 0; number < light_count; ++number) {
    int light = LIGHT_CELLS * number, kind = int(cell(lights, light).w);
    uint count = kind < 3 ? 1u : points;
    for (uint point = 0u; point < count; ++point)
      sum += sample_light(number, light_point(light, kind, path, uint(number), sample_number * count + point), 1.0 / float(count));
  }
#endif
  return sum;
}
