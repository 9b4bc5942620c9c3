// Random numbers and textures: tracer/src/textures. Colors are linear.

// ---- random numbers: tracer/src/math/sampling.h, with numbers of 64 bits as (low, high)

uvec2 multiplied(uint a, uint b) {
  uint a0 = a & 0xffffu, a1 = a >> 16, b0 = b & 0xffffu, b1 = b >> 16;
  uint low = a0 * b0, middle = a1 * b0 + (low >> 16), other = a0 * b1 + (middle & 0xffffu);
  return uvec2((other << 16) | (low & 0xffffu), a1 * b1 + (middle >> 16) + (other >> 16));
}
uvec2 multiplied(uvec2 a, uvec2 b) {
  uvec2 product = multiplied(a.x, b.x);
  return uvec2(product.x, product.y + a.x * b.y + a.y * b.x);
}
uvec2 shifted(uvec2 a, int n) { return uvec2((a.x >> n) | (a.y << (32 - n)), a.y >> n); }

// mix(): finalizer of splitmix64 (Steele, Lea, Flood 2014).
uvec2 mix64(uvec2 x) {
  uint low = x.x + 0x7f4a7c15u;
  x = uvec2(low, x.y + 0x9e3779b9u + (low < x.x ? 1u : 0u));
  x = multiplied(x ^ shifted(x, 30), uvec2(0x1ce4e5b9u, 0xbf58476du));
  x = multiplied(x ^ shifted(x, 27), uvec2(0x133111ebu, 0x94d049bbu));
  return x ^ shifted(x, 31);
}

uint reverse_bits(uint x) {
  x = (x << 16) | (x >> 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
  return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
}

// Owen scrambling (Burley 2020, "Practical Hash-based Owen Scrambling"; hash of Laine & Karras 2011).
uint owen_scrambled_reverse(uint x, uint seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverse_bits(x);
}
uint sobol_second_reverse(uint index) {
  index ^= (index >> 1) & 0x55555555u;
  index ^= (index >> 2) & 0x33333333u;
  index ^= (index >> 4) & 0x0f0f0f0fu;
  index ^= (index >> 8) & 0x00ff00ffu;
  return index ^ (index >> 16);
}
// The upper 24 bits: a float has no more.
vec2 fraction(uint x, uint y) { return vec2(x >> 8, y >> 8) * UNIT; }
vec2 sequence_point(uint index, uvec2 key) {
  return fraction(owen_scrambled_reverse(index, key.x), owen_scrambled_reverse(sobol_second_reverse(index), key.y));
}
vec2 shuffled_point(uint index, uvec2 key) {
  return sequence_point(owen_scrambled_reverse(reverse_bits(index), mix64(key).x), key);
}

// ---- textures

float wrapped(int wrap, float x) {
  if (wrap == 0) return x - floor(x);
  if (wrap == 1) return clamp(x, 0.0, 1.0);
  return abs(x - 2.0 * roundEven(x / 2.0));
}

#if defined(TEXTURES) || defined(ENVIRONMENT)
// ---- images: tracer/src/textures/image_map.cpp

int wrapped_index(int wrap, float index, float n) {
  if (wrap == 0) index -= floor(index / n) * n;
  if (wrap == 2) {
    index -= floor(index / (2.0 * n)) * (2.0 * n);
    if (index > n - 1.0) index = 2.0 * n - 1.0 - index;
  }
  return int(clamp(index, 0.0, n - 1.0));
}
float brought_near(int wrap, float x) {
  if (wrap == 1) return clamp(x, -1.0, 2.0);
  return wrap == 0 ? x - floor(x) : x - 2.0 * floor(x / 2.0);
}
vec3 texel(int first, ivec2 size, int x, int y) {
  int i = first + (size.y - 1 - y) * size.x + x;
  uvec2 packed = texelFetch(texels, ivec2(i & 2047, i >> 11), 0).xy;
  return vec3(unpackHalf2x16(packed.x), unpackHalf2x16(packed.y).x);
}
vec3 bilinear(int first, ivec2 size, vec2 uv, ivec2 wraps) {
  float x = brought_near(wraps.x, uv.x) * float(size.x) - 0.5, y = brought_near(wraps.y, uv.y) * float(size.y) - 0.5;
  float i = floor(x), j = floor(y);
  int left = wrapped_index(wraps.x, i, float(size.x)), right = wrapped_index(wraps.x, i + 1.0, float(size.x));
  int low = wrapped_index(wraps.y, j, float(size.y)), high = wrapped_index(wraps.y, j + 1.0, float(size.y));
  return mix(mix(texel(first, size, left, low), texel(first, size, right, low), x - i),
             mix(texel(first, size, left, high), texel(first, size, right, high), x - i), y - j);
}
vec3 image_color(int row, int filtering, vec2 uv, vec2 covered, ivec2 wraps) {
  vec4 place = cell(textures, row + 4);
  int first = int(cell(textures, row + 1).w);
  ivec2 size = ivec2(place.xy);
  if (filtering == 0) {
    float x = floor(brought_near(wraps.x, uv.x) * place.x), y = floor(brought_near(wraps.y, uv.y) * place.y);
    return texel(first, size, wrapped_index(wraps.x, x, place.x), wrapped_index(wraps.y, y, place.y));
  }
  float wide = max(covered.x * place.x, covered.y * place.y);
  float level = filtering == 1 || !(wide > 1.0) ? 0.0 : min(log2(wide), cell(textures, row + 2).w - 1.0), fine = floor(level);
  vec3 sum = vec3(0.0);
  for (float i = 0.0; i <= fine + 1.0; ++i) {
    float weight = i == fine ? 1.0 - (level - fine) : (i > fine ? level - fine : 0.0);
    if (weight > 0.0) sum += bilinear(first, size, uv, wraps) * weight;
    first += size.x * size.y;
    size = max(size / 2, ivec2(1));
  }
  return sum;
}

// ---- patterns: means over boxes, tracer/src/textures/texture.h

bool is_even(float whole) { return floor(whole * 0.5) * 2.0 == whole; }
float sawtooth_area(float t) { return abs(t - 2.0 * roundEven(t / 2.0)); }
float alternating_mean(float x, float width) {
  float low = floor(x - width / 2.0);
  if (!(width > 0.0) || low == floor(x + width / 2.0)) return is_even(floor(x)) ? 1.0 : -1.0;
  float whole = roundEven(x), left = x - whole - width / 2.0, right = x - whole + width / 2.0;
  float mean = (sawtooth_area(right) - sawtooth_area(left)) / width;
  return is_even(whole) ? mean : -mean;
}
float repeat_area(float t) {
  float whole = floor(t), part = t - whole;
  return whole == -1.0 ? t + t * t / 2.0 : whole / 2.0 + part * part / 2.0;
}
float mirror_area(float t) {
  float turned = roundEven(t / 2.0), rest = t - 2.0 * turned;
  return turned + sign(rest) * rest * rest / 2.0;
}
float clamp_area(float t) { return t < 0.0 ? 0.0 : (t < 1.0 ? t * t / 2.0 : t - 0.5); }
float wrapped_mean(int wrap, float x, float width) {
  float left = x - width / 2.0, right = x + width / 2.0;
  if (!(width > 0.0) || floor(left) == floor(right)) return wrapped(wrap, x);
  float whole = roundEven(x), part = x - whole;
  if (wrap == 0) return (repeat_area(part + width / 2.0) - repeat_area(part - width / 2.0)) / width;
  if (wrap == 1) {
    bool upper = x > 0.5;
    float from = upper ? 1.0 - x : x, mean = (clamp_area(from + width / 2.0) - clamp_area(from - width / 2.0)) / width;
    return clamp(upper ? 1.0 - mean : mean, 0.0, 1.0);
  }
  float mean = (mirror_area(part + width / 2.0) - mirror_area(part - width / 2.0)) / width;
  return is_even(whole) ? mean : 1.0 - mean;
}

// The bits of a whole number as a double, of which the hash is made.
uvec2 double_bits(float whole) {
  if (whole == 0.0) return uvec2(0u);
  uint bits = floatBitsToUint(whole), exponent = ((bits >> 23) & 255u) + 896u, mantissa = bits & 0x7fffffu;
  return uvec2(mantissa << 29, (bits & 0x80000000u) | (exponent << 20) | (mantissa >> 3));
}
float lattice_slope(float i, float j, float x, float y) {
  const float DIAGONAL = 0.70710678;
  uint which = mix64(double_bits(i) ^ mix64(double_bits(j))).y >> 29;
  float along = (which & 1u) == 0u ? 1.0 : -1.0;
  if (which < 2u) return x * along;
  if (which < 4u) return y * along;
  if (which == 4u) return (x + y) * DIAGONAL;
  if (which == 7u) return (-x - y) * DIAGONAL;
  return (x - y) * (which == 5u ? DIAGONAL : -DIAGONAL);
}
float fade(float t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }
// Perlin 2002, "Improving Noise".
float gradient_noise(float x, float y) {
  float i = floor(x), j = floor(y), u = x - i, v = y - j;
  float low = mix(lattice_slope(i, j, u, v), lattice_slope(i + 1.0, j, u - 1.0, v), fade(u));
  float high = mix(lattice_slope(i, j + 1.0, u, v - 1.0), lattice_slope(i + 1.0, j + 1.0, u - 1.0, v - 1.0), fade(u));
  return 1.41421356 * mix(low, high, fade(v));
}
vec2 lattice_area(float x) {
  float s = min(abs(x), 1.0), s2 = s * s;
  return vec2(sign(x) * (s + s2 * s2 * (-2.5 + s * (3.0 - s))), s2 / 2.0 + s2 * s2 * s * (-2.0 + s * (2.5 - s * (6.0 / 7.0))));
}
vec2 lattice_means(float t, float width) { return (lattice_area(t + width / 2.0) - lattice_area(t - width / 2.0)) / width; }
// Narrower boxes than in doubles have the value at their middle: the difference of areas would be rounding.
float gradient_noise_mean(float x, float y, vec2 width) {
  const float NARROW = 0.004;
  if (!(max(width.x, width.y) > NARROW)) return gradient_noise(x, y);
  float i = floor(x), j = floor(y), u = x - i, v = y - j, sum = 0.0;
  vec2 box = max(width, vec2(NARROW));
  for (float row = floor(v - box.y / 2.0); row <= floor(v + box.y / 2.0) + 1.0; ++row) {
    vec2 in_v = lattice_means(v - row, box.y);
    for (float column = floor(u - box.x / 2.0); column <= floor(u + box.x / 2.0) + 1.0; ++column) {
      vec2 in_u = lattice_means(u - column, box.x);
      sum += lattice_slope(i + column, j + row, in_u.y * in_v.x, in_u.x * in_v.y);
    }
  }
  return 1.41421356 * sum;
}
float octave_noise(float x, float y, int octaves, vec2 width) {
  float sum = 0.0, squares = 0.0, amplitude = 1.0;
  for (int octave = 0; octave < octaves; ++octave) {
    squares += amplitude * amplitude;
    float points = (width.x + 2.0) * (width.y + 2.0), left = clamp(2.0 - points / 32.0, 0.0, 1.0);
    if (left > 0.0) sum += amplitude * left * gradient_noise_mean(x, y, width);
    width *= 2.0;
    amplitude /= 2.0;
    x *= 2.0;
    y *= 2.0;
  }
  return clamp(sum / sqrt(squares), -1.0, 1.0);
}

// ---- lookups

vec2 looked_up(int id, vec2 uv) {
  vec4 place = cell(textures, 6 * id + 3);
  return uv * place.xy + place.zw;
}
vec2 covered_by(int id, vec2 width) {
  return cell(textures, 6 * id).y == 2.0 ? width * abs(cell(textures, 6 * id + 3).xy) : vec2(0.0);
}
vec3 color_at(int id, vec2 at, vec2 covered, ivec2 wraps) {
  int row = 6 * id;
  vec4 kind = cell(textures, row);
  vec3 factor = cell(textures, row + 5).rgb;
  if (kind.x == 3.0) return factor * image_color(row, int(kind.y), at, covered, wraps);
  vec3 first = factor * cell(textures, row + 1).rgb, second = factor * cell(textures, row + 2).rgb;
  if (kind.x == 0.0) {
    float even = alternating_mean(at.x, covered.x) * alternating_mean(at.y, covered.y);
    return first * ((1.0 + even) / 2.0) + second * ((1.0 - even) / 2.0);
  }
  float t = kind.x == 1.0 ? wrapped_mean(wraps.y, at.y, covered.y) : 0.5 + 0.5 * octave_noise(at.x, at.y, int(kind.w), covered);
  return first * (1.0 - t) + second * t;
}
// texture_color(): `width` is the footprint around uv.
vec3 texture_color(int id, vec2 uv, vec2 width) {
  int wrap = int(cell(textures, 6 * id).z);
  return color_at(id, looked_up(id, uv), covered_by(id, width), ivec2(wrap));
}
#endif

#ifdef TEXTURES
// ---- texture coordinates of the last surface: uv_at(), uv_gradients_at() of tracer/src/interaction/surface.h

vec3 along_axes(int at, vec3 p) { return vec3(dot(p, cell(objects, at + 1).xyz), dot(p, cell(objects, at + 2).xyz), dot(p, cell(objects, at + 3).xyz)); }
vec2 spherical_uv(vec3 n) { return vec2(turns(n.y, n.x), 1.0 - atan(length(n.xy), n.z) / PI); }
vec2 disc_uv(vec3 p, float radius) { return radius > 0.0 ? p.xy / (2.0 * radius) + 0.5 : vec2(0.5); }
vec3 latitude_gradient(vec3 p) { return vec3(-p.z * p.xy / length(p.xy), length(p.xy)) / (PI * dot(p, p)); }
vec3 turn_gradient(vec3 p) { return vec3(-p.y, p.x, 0.0) / (2.0 * PI * dot(p.xy, p.xy)); }

// The directions of u and v on a face of the cube.
void cube_axes(int face, out vec3 u, out vec3 v) {
  u = face == 0 ? vec3(0, 0, 1) : (face == 1 ? vec3(0, 0, -1) : (face == 4 ? vec3(-1, 0, 0) : vec3(1, 0, 0)));
  v = face == 2 ? vec3(0, 0, 1) : (face == 3 ? vec3(0, 0, -1) : vec3(0, 1, 0));
}

#ifdef QUADRICS
vec2 quadric_uv(out vec3 gradient_u, out vec3 gradient_v) {
  int kind = int(-1.0 - hit_cell.x), at = int(hit_cell.y), part = int(hit_uv.x);
  vec4 origin = cell(shapes, at);
  mat3 into = shape_from_render(at);
  vec3 p = into * (hit_position - origin.xyz), u = vec3(0.0), v = vec3(0.0);
  float radius = kind == 2 ? 1.0 : (part == 1 ? origin.w : cell(shapes, at + 1).w);
  vec2 uv;
  if (kind == 1) {
    uv = spherical_uv(p);
    u = turn_gradient(p);
    v = latitude_gradient(p);
  } else if (kind == 2 || (kind == 3 && part > 0)) {
    uv = disc_uv(p, radius);
    u = vec3(0.5 / radius, 0.0, 0.0);
    v = vec3(0.0, 0.5 / radius, 0.0);
  } else if (kind == 3) {
    uv = vec2(turns(p.y, p.x), clamp(p.z, 0.0, 1.0));
    u = turn_gradient(p);
    v = vec3(0.0, 0.0, 1.0);
  } else if (kind == 4) {
    cube_axes(part - 3, u, v);
    uv = vec2(dot(u, p) + (u.x + u.y + u.z < 0.0 ? 1.0 : 0.0), dot(v, p) + (v.x + v.y + v.z < 0.0 ? 1.0 : 0.0));
  } else {
    float r = length(p.xy), across = r - 1.0, turn = 2.0 * PI * (across * across + p.z * p.z);
    uv = vec2(turns(p.y, p.x), turns(p.z, across));
    u = turn_gradient(p);
    v = vec3(-p.z * p.xy / (r * turn), across / turn);
  }
  gradient_u = u * into;
  gradient_v = v * into;
  return uv;
}
#endif

#ifdef TRIANGLES
vec2 triangle_uv(out vec3 gradient_u, out vec3 gradient_v) {
  int a = 2 * int(hit_cell.x), b = 2 * int(hit_cell.y), c = 2 * int(hit_cell.z);
  vec4 at_a = cell(vertices, a), at_b = cell(vertices, b), at_c = cell(vertices, c);
  vec2 uv_a = vec2(0.0), uv_b = vec2(1.0, 0.0), uv_c = vec2(0.0, 1.0);
  if ((int(cell(objects, OBJECT_CELLS * hit_object()).y) & 2) == 0) {
    uv_a = vec2(at_a.w, cell(vertices, a + 1).w);
    uv_b = vec2(at_b.w, cell(vertices, b + 1).w);
    uv_c = vec2(at_c.w, cell(vertices, c + 1).w);
  }
  vec3 to_b = at_b.xyz - at_a.xyz, to_c = at_c.xyz - at_a.xyz, normal = cross(to_b, to_c);
  float area = dot(normal, normal);
  vec3 along_b = cross(to_c, normal) / area, along_c = cross(normal, to_b) / area;
  vec2 by_b = uv_b - uv_a, by_c = uv_c - uv_a;
  gradient_u = along_b * by_b.x + along_c * by_c.x;
  gradient_v = along_b * by_b.y + along_c * by_c.y;
  return uv_a * (1.0 - hit_uv.x - hit_uv.y) + uv_b * hit_uv.x + uv_c * hit_uv.y;
}
#endif

vec2 uv_at(out vec3 gradient_u, out vec3 gradient_v) {
  int at = OBJECT_CELLS * hit_object();
  if (hit_primitive < NONE) {
    vec3 point = cell(planes, 2 * (-2 - hit_primitive)).xyz;
    gradient_u = cell(objects, at + 1).xyz * world_per_render;
    gradient_v = cell(objects, at + 2).xyz * world_per_render;
    return along_axes(at, hit_position - point).xy * world_per_render;
  }
#ifdef QUADRICS
  if (hit_cell.x < -1.0) return quadric_uv(gradient_u, gradient_v);
#endif
#ifdef TRIANGLES
  if (hit_cell.x >= 0.0) return triangle_uv(gradient_u, gradient_v);
#endif
  vec3 n = along_axes(at, hit_face);
  mat3 axes = mat3(cell(objects, at + 1).xyz, cell(objects, at + 2).xyz, cell(objects, at + 3).xyz);
  gradient_u = axes * turn_gradient(n) * hit_curvature;
  gradient_v = axes * latitude_gradient(n) * hit_curvature;
  return spherical_uv(n);
}

// uv_footprint() (Akenine-Moeller et al. 2021, "Improved Shader and Texture Level of Detail Using Ray Cones").
vec2 uv_footprint(vec3 gradient_u, vec3 gradient_v, vec3 normal, vec3 direction, float width) {
  float cosine = dot(direction, normal);
  vec3 down = direction - normal * cosine;
  float sine = length(down);
  vec3 along = sine > 1e-4 ? down / sine : perpendicular(normal), across = cross(normal, along);
  float stretched = width / max(abs(cosine), 1e-30);
  return vec2(length(vec2(dot(gradient_u, along) * stretched, dot(gradient_u, across) * width)),
              length(vec2(dot(gradient_v, along) * stretched, dot(gradient_v, across) * width)));
}
#endif

#ifdef BUMP
// height_slope(): finite differences over the footprint.
float height_at(int id, vec2 at, vec2 covered) {
  vec3 color = color_at(id, at, covered, ivec2(int(cell(textures, 6 * id).z)));
  return (color.r + color.g + color.b) / 3.0;
}
vec2 height_slope(int id, vec2 uv, vec2 width) {
  vec4 kind = cell(textures, 6 * id), place = cell(textures, 6 * id + 3);
  vec2 at = looked_up(id, uv), covered = covered_by(id, width), size = cell(textures, 6 * id + 4).xy;
  vec2 least = kind.x == 3.0 ? max(max(covered.x * size.x, covered.y * size.y), 1.0) / size
                             : vec2(kind.x == 2.0 ? exp2(1.0 - kind.w) : 1.0) * 0.0009765625;
  vec2 reach = max(covered, least) / 2.0;
  float left = at.x - reach.x, right = at.x + reach.x, low = at.y - reach.y, high = at.y + reach.y;
  vec4 heights;
  for (int i = 0; i < 4; ++i) heights[i] = height_at(id, i < 2 ? vec2(i == 0 ? right : left, at.y) : vec2(at.x, i == 2 ? high : low), covered);
  return vec2((heights.x - heights.y) / (right - left) * place.x, (heights.z - heights.w) / (high - low) * place.y);
}
bool is_direction(vec3 v) { return dot(v, v) > 0.5 && dot(v, v) < 2.0; }
// Blinn 1978, "Simulation of Wrinkled Surfaces".
vec3 bumped_normal(vec3 normal, vec3 gradient_u, vec3 gradient_v, vec2 slope) {
  vec3 steepest = gradient_u * slope.x + gradient_v * slope.y;
  vec3 perturbed = unit_or_zero(normal - (steepest - normal * dot(steepest, normal)));
  return is_direction(perturbed) ? perturbed : normal;
}
vec3 mapped_normal(vec3 normal, vec3 gradient_u, vec3 gradient_v, vec3 tangent_space) {
  vec3 u = unit_or_zero(gradient_u), v = unit_or_zero(gradient_v);
  float side = dot(normal, cross(u, v)) < 0.0 ? -1.0 : 1.0;
  vec3 along_u = unit_or_zero(cross(v, normal)) * side, along_v = unit_or_zero(cross(normal, u)) * side;
  vec3 perturbed = unit_or_zero(along_u * tangent_space.x + along_v * tangent_space.y + normal * tangent_space.z);
  return is_direction(perturbed) ? perturbed : normal;
}
#endif
