// Whitted's tree of rays (Whitted 1980), without recursion: rays wait in arrays, and the lighter branch of a surface is
// traced first. It has at most half of the light that arrives, so that few rays wait at a time:
// tracer/src/integrators/whitted/secondary_rays.h.
uniform ivec2 corner;        // of the drawn part in the image, from the lower left
uniform ivec2 size;          // pixels of the image
uniform int mode;            // 0 radiance; 1 the object, its distance and its material; 2 the media around the camera
uniform int sample_index;    // in the sequence of the pixel; -1: the center of pixel and lens
uniform uint light_points;
uniform float share;         // of the pixel's width, over which textures are filtered
uniform uvec2 seed;
uniform int max_depth;
uniform float cutoff;
uniform float roulette;      // rays below this throughput survive with it, by chance
uniform int late_depth;      // the bounce from which on paths end by chance
uniform int camera_type;     // 0 perspective, 1 orthographic, 2 panorama
uniform vec3 eye, forward, right, up;
uniform vec2 pixel;          // sides of a pixel: at distance 1, in render space, or as angles
uniform vec2 lens;           // radius and focus distance
uniform vec4 cue;            // front, back and their scales
uniform vec3 cue_color;
uniform bool has_alpha;
uniform sampler2D camera_media;
out vec4 result;

const int RAYS_OF_PIXEL = 4096;
const float OVERFLOW = 0.000244140625;  // 2^-12: in the count of samples, rays that had no place

uvec4 waiting_ids[RAYS];     // depth, primitive on which the ray starts + 2^31, path, bits of the cone's spread
vec4 waiting_origin[RAYS];   // and width of the cone
vec4 waiting_direction[RAYS];  // and the width of facets along the path
vec4 waiting_weight[RAYS];
#ifdef MEDIA
vec4 waiting_media[RAYS];
#endif
int waiting = 0;
float first_t = FAR;         // of the camera ray

// ---- background: tracer/src/textures/background.cpp

#ifdef ENVIRONMENT
vec3 face_color(int face, vec2 uv, vec2 width) {
  int id = int(cell(background, face).w);
  ivec2 wraps = ivec2(int(cell(background, face + 1).w), int(cell(background, face + 2).w));
  return color_at(id, looked_up(id, uv), covered_by(id, width), wraps);
}
vec3 environment(vec3 direction, float spread) {
  int id = int(cell(background, 4).w);
  float ahead = dot(direction, cell(background, 4).xyz), right = dot(direction, cell(background, 5).xyz);
  float above = dot(direction, cell(background, 6).xyz), level = length(vec2(ahead, right));
  float turn = 0.5 + (level > 0.0 ? atan(right, ahead) : 0.0) / (2.0 * PI);
  vec2 uv = vec2(turn - floor(turn), 0.5 + atan(above, level) / PI);
  vec4 kind = cell(textures, 6 * id);
  if (kind.y != 2.0) spread = 0.0;
  float height = min(1.0, spread / PI), width = spread < 2.0 * PI * level ? spread / (2.0 * PI * level) : 1.0;
  float turned = abs(cell(textures, 6 * id + 3).x), pieces = kind.x == 3.0 ? turned * cell(textures, 6 * id + 4).x
      : (kind.x == 2.0 ? turned * exp2(2.0 + kind.w) : 1.0);
  float lookups = spread > 0.0 ? max(1.0, roundEven(min(min(2.0 * width / height, width * pieces), 1024.0))) : 1.0;
  vec3 sum = vec3(0.0);
  for (float i = 0.0; i < lookups; ++i)
    sum += face_color(4, vec2(uv.x + width * ((i + 0.5) / lookups - 0.5), uv.y), vec2(width / lookups, height));
  return sum / lookups;
}
vec3 cube(vec3 direction, float spread) {
  int face = 4;
  for (int other = 7; other < 22; other += 3)
    if (dot(direction, cell(background, other).xyz) > dot(direction, cell(background, face).xyz)) face = other;
  float ahead = dot(direction, cell(background, face).xyz);
  vec2 at = vec2(dot(direction, cell(background, face + 1).xyz), dot(direction, cell(background, face + 2).xyz)) / ahead;
  return face_color(face, (1.0 + at) / 2.0, min(vec2(1.0), spread * sqrt(1.0 + at * at) / (2.0 * ahead)));
}
#endif

vec3 background_radiance(vec3 direction, float spread) {
  int kind = int(cell(background, 0).x);
  vec3 zenith = cell(background, 1).rgb;
  if (kind == 0) return zenith;
#ifdef ENVIRONMENT
  if (kind == 2) return environment(direction, spread);
  if (kind == 3) return cube(direction, spread);
#endif
  float t = clamp((dot(direction, cell(background, 3).xyz) + 1.0) / 2.0, 0.0, 1.0);
  return cell(background, 2).rgb * (1.0 - t) + zenith * t;
}

// ---- camera: tracer/src/cameras/compiled_camera.h

vec3 ray_origin, ray_direction;
vec2 disc_from_square(vec2 xi) {
  vec2 at = 2.0 * xi - 1.0;
  if (at == vec2(0.0)) return at;
  bool wide = abs(at.x) > abs(at.y);
  float radius = wide ? at.x : at.y, angle = wide ? PI / 4.0 * (at.y / at.x) : PI / 2.0 - PI / 4.0 * (at.x / at.y);
  return radius * vec2(cos(angle), sin(angle));
}
float view_depth(vec3 direction, float t) { return camera_type == 2 ? t : t * dot(direction, forward); }
void generate_ray(vec2 at, vec2 xi) {
  vec2 off = vec2(at.x - 0.5 * float(size.x), 0.5 * float(size.y) - at.y) * pixel;
  vec3 across = right, above = up;
  ray_origin = eye;
  if (camera_type == 0) {
    ray_direction = normalize(forward + right * off.x + up * off.y);
  } else if (camera_type == 1) {
    ray_origin += right * off.x + up * off.y;
    ray_direction = forward;
  } else {
    ray_direction = normalize((forward * cos(off.x) + right * sin(off.x)) * cos(off.y) + up * sin(off.y));
    across = right * cos(off.x) - forward * sin(off.x);
    above = cross(across, ray_direction);
  }
#ifdef LENS
  vec2 point = disc_from_square(xi) * lens.x;
  vec3 offset = across * point.x + above * point.y, focus = ray_direction * (lens.y / view_depth(ray_direction, 1.0));
  ray_origin += offset;
  ray_direction = normalize(focus - offset);
#endif
}
vec2 pixel_cone(vec3 direction) {
  if (camera_type == 0) return vec2(0.0, pixel.y * dot(direction, forward));
  if (camera_type == 1) return vec2(pixel.y, 0.0);
  return vec2(0.0, max(pixel.y, pixel.x * length(cross(direction, up))));
}

uint path_of(uint path, uint which) { return mix64(uvec2(path << 1 | which, path >> 31)).x; }

// A ray of kind 0, reflected, 1, refracted, or 2, which passes a boundary without effect. Rays below the cutoff or beyond the depth
// of the document are dropped, others by chance: Termination of tracer/src/integrators/whitted/wavefront_state.h. `late`: the least
// throughput with which they survive.
void push(uint kind, vec3 origin, vec3 direction, vec3 weight, float late, uint depth, int from, uint path, vec2 cone, vec4 media) {
  float largest = max_component(weight), kept = max(largest < roulette ? roulette : largest, late);
  if (!(largest >= cutoff && largest > 0.0) || int(depth) > max_depth) return;
  if (kind < 2u && kept > largest) {
    uvec2 random = mix64(mix64(sample_key ^ mix64(uvec2(sample_number, 0u))) ^ mix64(~uvec2(path << 1 | kind, path >> 31)));
    if (!(float(random.y >> 8) * UNIT * kept < largest)) return;
    weight *= kept / largest;
  }
  if (kind < 2u) path = path_of(path, kind);
  if (waiting == RAYS) {
    overflow = true;
    return;
  }
  waiting_ids[waiting] = uvec4(depth, uint(from) + 0x80000000u, path, floatBitsToUint(cone.y));
  waiting_origin[waiting] = vec4(origin, cone.x);
  waiting_direction[waiting] = vec4(direction, path_alpha);
  waiting_weight[waiting] = vec4(weight, 0.0);
#ifdef MEDIA
  waiting_media[waiting] = media;
#endif
  ++waiting;
}

// ---- one ray

vec3 shaded(vec3 o, vec3 d, vec3 weight, uint depth, int from, uint path, vec2 cone, vec4 media) {
  bool hit = intersect(o, d, FAR, from, 3, false);
  float t = hit_t;
  if (mode == 1) return vec3(0.0);
#ifdef ABSORPTION
  weight *= transmittance_along(media, t);
#endif
  if (!hit) return depth == 0u && has_alpha ? vec3(0.0) : weight * background_radiance(d, abs(cone.y));
  if (depth == 0u) first_t = t;
  compute_point(o, d);
  int object = hit_object(), material = material_of(object), flags = material_flags(material);
  bool back = dot(d, hit_face) > 0.0, is_flat = (flags & 32) != 0;
  vec3 outward = is_flat ? hit_face : hit_normal, face_outward = back ? -hit_face : hit_face;
  point_position = hit_position;
  point_face = hit_face;
  point_clearance = dot(abs(hit_face), hit_error);
  point_normal = point_unperturbed = back ? -outward : outward;
  point_to_eye = -d;
  point_from = hit_primitive;
  point_media = media;
  point_far_side = false;
  vec3 offset = is_flat ? vec3(0.0) : hit_offset;
  point_offset = back ? vec3(0.0) : offset;
  float curvature = back ? -hit_curvature : hit_curvature;

#ifdef TEXTURES
  bool textured = is_textured(material);
  vec3 gradient_u, gradient_v;
  float wide = abs(cone.x + cone.y * t);
  if (textured) {
    surface_uv = uv_at(gradient_u, gradient_v);
#ifdef FILTERED_TEXTURES
    surface_footprint = uv_footprint(gradient_u, gradient_v, hit_face, d, wide);
#else
    surface_footprint = vec2(0.0);
#endif
  }
#endif

  // ---- media on both sides, and coefficients() of tracer/src/materials/compiled_material.h
  float reflection = number_of(material, AT_REFLECTION), transmission = number_of(material, AT_TRANSMISSION), ior = number_of(material, AT_IOR);
  bool transmits = transmission > 0.0, refracting = transmits && refracts(material);
  bool fresnel = (flags & 16) != 0 && (transmits || reflection > 0.0);
  float n_from = 1.0, n_to = ior;
  vec4 media_after = media;
#ifdef MEDIA
  if (transmits) {
    cross_boundary(media, object, back);
    media_after = cross_after;
    n_from = refracting && cross_unentered ? ior : ior_of(cross_near);
    if (refracting) n_to = ior_of(cross_far);
#ifdef REFRACTION
    if (cross_hidden) {  // nested in a solid of higher priority: the surface has no effect
      push(2u, clear_of(point_position, point_face, point_clearance, d), d, weight, 0.0, depth + 1u, point_from, path,
           vec2(cone.x + cone.y * t, cone.y), media_after);
      return vec3(0.0);
    }
#endif
  } else if (fresnel) n_from = ior_of(current_medium(media));
#endif
  set_colors(material, true);
  vec3 there = is_cut_out(material) ? colors[OPACITY] : vec3(1.0), through = transmittance_of(material);
  float opaque_share = ((flags >> 2) & 3) == 1 ? 1.0 - transmission : 1.0;
  vec3 emitted = colors[EMISSION] + ambient * colors[COLOR] * (number_of(material, AT_AMBIENT) * opaque_share);
  bool has_specular = (flags & 3) != 0 && (flags & 3) != 3;
  vec3 specular_color = has_specular ? colors[SPECULAR] : vec3(0.0);
  point_diffuse = weight * there * colors[COLOR] * (number_of(material, AT_DIFFUSE) * opaque_share);
  point_specular = weight * there * specular_color * number_of(material, AT_SPECULAR);
  float shininess = point_shininess = number_of(material, AT_SHININESS);
  point_blinn = (flags & 3) == 2;
  vec3 reflectance = colors[REFLECTION_COLOR] * reflection * there, behind = colors[DIFFUSE_TRANSMISSION], mirrored_facets = vec3(0.0);
#ifdef BUMP
  vec4 surface = surface_of(material);
  int normal_map = int(surface.y) - 1, bump = int(surface.z) - 1;
  if (normal_map >= 0 || bump >= 0) {
    // Textures perturb the front; the back is its reverse.
    if (normal_map >= 0) outward = mapped_normal(outward, gradient_u, gradient_v, (2.0 * texture_color(normal_map, surface_uv, surface_footprint) - 1.0) * vec3(vec2(number_of(material, AT_NORMAL_SCALE)), 1.0));
    if (bump >= 0) outward = bumped_normal(outward, gradient_u, gradient_v, height_slope(bump, surface_uv, surface_footprint) * (surface.w / world_per_render));
    point_normal = back ? -outward : outward;
  }
#endif
  facet_weight = vec3(0.0);
#ifdef PRINCIPLED
  if ((flags & 3) == 3) {
    // principled_surface() and coefficients() of tracer/src/materials/compiled_material.h; a mirror image stands for the light of
    // all facets.
    float metallic = clamp(colors[METALLIC].r, 0.0, 1.0), clear = min(transmission * max_component(colors[TRANSMISSION]), 1.0);
    if (!(dot(point_normal, -d) > 0.0)) point_normal = face_outward;
    float amplitude = (ior - 1.0) / (ior + 1.0), view = clamp(dot(point_normal, -d), 1e-6, 1.0), matt = (1.0 - clear) * (1.0 - metallic);
    float glass = refracting ? clear * (1.0 - metallic) : 0.0;
    facet_weight = weight * there;
    nonmetal_f90 = min(number_of(material, AT_SPECULAR), 1.0);
    nonmetal_f0 = min(nonmetal_f90 * colors[SPECULAR] * amplitude * amplitude, 1.0);
    facet_f0 = mix(nonmetal_f0, colors[COLOR], metallic);
    facet_f90 = mix(nonmetal_f90, 1.0, metallic);
    facet_roughness = clamp(colors[ROUGHNESS].r, 0.0, 1.0);
    highlight_alpha = max(path_alpha, 0.04);
    if (!is_black(facet_weight)) path_alpha = max(path_alpha, min(facet_roughness * facet_roughness, 0.25));
    coat_share = clamp(colors[AT_COAT / 4].r, 0.0, 1.0);
    coat_roughness = clamp(colors[AT_COAT_ROUGHNESS / 4].r, 0.0, 1.0);
    set_facets(colors[COLOR] * (1.0 - clear) * (1.0 - number_of(material, AT_DIFFUSE_TRANSMISSION)), colors[COLOR], metallic, view, 1.0 - glass);
    point_diffuse = vec3(0.0);
    emitted = colors[EMISSION] + ambient * colors[COLOR] * (matt * number_of(material, AT_AMBIENT));
    behind *= matt;
    reflectance = there * glass;
    vec2 of_facets = mirror_albedo(view, facet_roughness), of_coat = mirror_albedo(view, coat_roughness);
    vec3 reflected = (facet_f0 * of_facets.x + facet_f90 * of_facets.y) * (passed_coat * (1.0 - glass)) +
                     coat_share * (COAT_F0 * of_coat.x + of_coat.y);
    mirrored_facets = there * reflected;
    if (!refracting) through -= (through - (1.0 - there)) * reflected;
  }
#endif
  vec3 normal = point_normal, face = point_face, position = point_position;
  float clearance = point_clearance;
  int start = point_from;

  // ---- light, of the near side and then of the far one
  vec3 radiance = weight * there * emitted;
  uint points = depth == 0u ? light_points : 1u;
#ifdef TRANSMITTED_LIGHT
  float diffuse_transmission = number_of(material, AT_DIFFUSE_TRANSMISSION);
  float specular_transmission = has_specular ? number_of(material, AT_SPECULAR_TRANSMISSION) : 0.0;
  for (int side = 0; side < 2; ++side) {
    radiance += direct_lighting(path, points);
    if (side == 1 || !(diffuse_transmission > 0.0 || specular_transmission > 0.0)) break;
    point_far_side = true;
    point_normal = -point_normal;
    point_diffuse = weight * there * behind * diffuse_transmission;
    point_specular = weight * there * specular_color * specular_transmission;
    point_shininess = point_blinn ? shininess / 4.0 : shininess;
    point_eta = refracting ? n_to / n_from : 1.0;
    point_media = media_after;
    point_offset = back ? offset : vec3(0.0);
  }
#else
  radiance += direct_lighting(path, points);
#endif

#if defined(REFLECTION) || defined(REFRACTION)
  // ---- secondary rays: spawn_reflection(), spawn_dielectric()
  bool splits = fresnel || !is_black(through);
  if (dot(d, normal) >= 0.0) normal = face_outward;  // an interpolated normal may point away from the ray
  float cos_i = min(-dot(d, normal), 1.0);
  bool total = false;
  vec2 at = splits ? dielectric_interface(cos_i, n_from, n_to, total) : vec2(1.0);
  total = total && (fresnel || refracting);
  vec3 reflected_part = mirrored_facets + reflectance * (fresnel ? at.y : 1.0) + (total && !fresnel ? through : vec3(0.0));
  vec3 transmitted_part = total ? vec3(0.0) : through * (fresnel ? 1.0 - at.y : 1.0);
  vec3 mirror = normalize(mirrored(d, normal)), passing = d;
  if (dot(mirror, face_outward) < 0.0) mirror = normalize(mirrored(mirror, face_outward));
  float n = n_from / n_to, cone_width = cone.x + cone.y * t;
  vec2 mirror_cone = vec2(cone_width, cone.y + 2.0 * curvature * cone_width), passing_cone = vec2(cone_width, cone.y);
  if (refracting) {
    passing = normalize((d + normal * (cos_i - at.x / n)) * n);
    passing_cone.y = cone.y * n + (n - 1.0) * curvature * cone_width;
  }
#ifdef BUMP
  if (dot(passing, face_outward) > 0.0) passing = normalize(mirrored(passing, face_outward));
#endif
  vec3 mirror_weight = weight * reflected_part, passing_weight = weight * transmitted_part;
  float of_mirror = max_component(mirror_weight), of_passing = max_component(passing_weight), late = 0.0;
  if (int(depth) + 1 >= late_depth) late = max((of_mirror + of_passing) / (1.0 - 2.0 / float(depth + 1u)), max_component(weight));
  for (int i = 0; i < 2; ++i) {
    if ((i == 1) == (of_mirror < of_passing))
      push(0u, clear_of(position, face, clearance, mirror), mirror, mirror_weight, late, depth + 1u, start, path, mirror_cone, media);
    else
      push(1u, clear_of(position, face, clearance, passing), passing, passing_weight, late, depth + 1u, start, path, passing_cone, media_after);
  }
#endif
  return radiance;
}

// The transmissive solids around the camera: find_back_face_hits(), media_enclosing_camera() of tracer/src/compile.
#ifdef MEDIA
ivec4 find_back_face_hits(vec3 o, vec3 d) {
  ivec4 found = ivec4(NONE);
  int count = 0, from = NONE;
  int seen[16];
  int visited = 0;
  for (int crossing = 0; crossing < 64 && count < 4 && visited < 16; ++crossing) {
    if (!intersect(o, d, FAR, from, 2, false)) break;
    compute_point(o, d);
    int object = hit_object();
    bool is_new = object_flags(object) >> 2 != 0;
    for (int i = 0; i < visited; ++i) is_new = is_new && seen[i] != object;
    if (is_new) {
      seen[visited++] = object;
      if (dot(d, hit_face) > 0.0) found[count++] = hit_primitive < NONE ? object | 0x40000000 : object;
    }
    o = clear_of(hit_position, hit_face, dot(abs(hit_face), hit_error), d);
    from = hit_primitive;
  }
  return found;
}
vec4 media_enclosing_camera() {
  generate_ray(0.5 * vec2(size), vec2(0.5));
  ivec4 ahead = ivec4(NONE), behind = ivec4(NONE);
  for (int side = 0; side < 2; ++side) {
    ahead = behind;
    behind = find_back_face_hits(ray_origin, side == 0 ? ray_direction : -ray_direction);
  }
  vec4 list = vec4(0.0);
  for (int i = 3; i >= 0; --i) {
    if (ahead[i] == NONE) continue;
    int object = ahead[i] & 0x3fffffff;
    bool is_plane = ahead[i] != object;
    if (is_plane || any(equal(behind, ivec4(object)))) list = enter(list, object);
  }
  return list;
}
#endif

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) + corner;
  uvec2 place = uvec2(at.x, size.y - 1 - at.y);
  uint number = place.y * uint(size.x) + place.x;
  sample_key = mix64(uvec2(number, 0u) ^ mix64(seed));
#if !defined(LENS) && !defined(SOFT_LIGHTS)
  if (sample_index < 0) sample_key = uvec2(number, seed.x);  // fill() of tracer/src/sampling/camera_samples.h
#endif
  vec2 in_pixel = vec2(0.5), xi = vec2(0.5);
  sample_number = uint(max(sample_index, 0));
  if (sample_index >= 0) {
    in_pixel = sequence_point(sample_number, sample_key);
    xi = shuffled_point(sample_number, mix64(sample_key ^ mix64(uvec2(0u))));
  }
  vec4 media = vec4(0.0);
#ifdef MEDIA
  if (mode == 2) {
    result = media_enclosing_camera();
    return;
  }
  media = texelFetch(camera_media, ivec2(0), 0);
#endif
  generate_ray(vec2(place) + in_pixel, xi);
  vec3 radiance = vec3(0.0);
  push(2u, ray_origin, ray_direction, vec3(1.0), 0.0, 0u, NONE, 0u, pixel_cone(ray_direction) * share, media);
  for (int count = 0; waiting > 0 && count < RAYS_OF_PIXEL; ++count) {
    --waiting;
    uvec4 id = waiting_ids[waiting];
    vec4 origin = waiting_origin[waiting];
    path_alpha = waiting_direction[waiting].w;
#ifdef MEDIA
    media = waiting_media[waiting];
#endif
    radiance += shaded(origin.xyz, waiting_direction[waiting].xyz, waiting_weight[waiting].rgb, id.x, int(id.y - 0x80000000u), id.z,
                       vec2(origin.w, uintBitsToFloat(id.w)), media);
  }
  if (mode == 1) {
    result = hit_primitive == NONE ? vec4(0.0) : vec4(hit_object() + 1, hit_t, material_of(hit_object()) / MATERIAL_CELLS, view_depth(ray_direction, hit_t));
    return;
  }
#ifdef DEPTH_CUE
  float depth = FAR;
  if (first_t < FAR) depth = view_depth(ray_direction, first_t) * world_per_render;
  if (depth < FAR || !has_alpha) {
    float scale = depth <= cue.x ? cue.z : (!(depth < cue.y) ? cue.w : cue.z + (cue.w - cue.z) * ((depth - cue.x) / (cue.y - cue.x)));
    radiance = radiance * scale + cue_color * (1.0 - scale);
  }
#endif
  // A sample that is no number is left out. The last channel counts samples.
  bvec3 none = not(greaterThan(radiance, vec3(-FAR)));
  overflow = overflow || waiting > 0 || any(none);
  result = vec4(any(none) ? vec3(0.0) : min(radiance, FAR), overflow ? 1.0 + OVERFLOW : 1.0);
}
