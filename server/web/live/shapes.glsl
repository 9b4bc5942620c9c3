// The tables of a scene (tracer/include/tracer/live.h) and arithmetic. Names and formulas are those of the tracer; each
// function names the header that it follows. No structs: some drivers keep their members in 16 bits.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;

uniform sampler2D nodes, primitives, vertices, shapes, planes, objects, materials, lights, textures, background;
uniform usampler2D texels;
uniform float world_per_render;

const float PI = 3.14159265358979;
const float FAR = 1e30;        // stands for an infinite distance
const float UNIT = 5.9604645e-8;  // 2^-24, the relative rounding error of an operation
const int NONE = -1;

vec4 cell(sampler2D table, int i) { return texelFetch(table, ivec2(i & 2047, i >> 11), 0); }

// rounding_bound() of tracer/src/math/rounding.h, in float.
float rounding_bound(float n) { return n * UNIT; }

bool is_black(vec3 color) { return color == vec3(0.0); }
float max_component(vec3 v) { return max(max(v.x, v.y), v.z); }

// unit_or_zero is normalize() of tracer/src/math/vec.h.
vec3 unit_or_zero(vec3 v) {
  float largest = max_component(abs(v));
  return largest > 0.0 ? normalize(v / largest) : vec3(0.0);
}

// A vector across unit n (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
vec3 perpendicular(vec3 n) {
  float side = n.z < 0.0 ? -1.0 : 1.0, a = -1.0 / (side + n.z);
  return vec3(1.0 + side * (n.x * n.x * a), side * (n.x * n.y * a), -side * n.x);
}

// clear_of() of tracer/src/math/rounding.h: the origin of a ray next to a surface.
vec3 clear_of(vec3 position, vec3 face, float clearance, vec3 direction) {
  vec3 shift = face * (dot(direction, face) < 0.0 ? -clearance : clearance);
  vec3 moved = position + shift;
  return moved + sign(shift) * abs(moved) * (2.0 * UNIT);
}

// Angle of (x, y) in turns, in [0,1): turns() of tracer/src/shapes/analytic_shape.h.
float turns(float y, float x) {
  if (x == 0.0 && y == 0.0) return 0.0;
  float t = atan(y, x) / (2.0 * PI);
  return t < 0.0 ? min(t + 1.0, 1.0 - UNIT) : t;
}

// ---- interfaces: tracer/src/math/optics.h (Born & Wolf 1999, sec. 1.5.2)

// Cosine of the refracted angle and reflectance; (0, 1) at total internal reflection.
vec2 dielectric_interface(float cos_i, float n_from, float n_to, out bool total) {
  float n = n_to / n_from, excess = (n_to - n_from) / n_from * (n + 1.0), squared_i = cos_i * cos_i;
  float squared_sine = (1.0 - cos_i) * (1.0 + cos_i);
  float squared = squared_i < 0.5 ? squared_i + excess : n * n - squared_sine;
  total = !(squared > 0.0);
  if (total) return vec2(0.0, 1.0);
  float n_cos_t = sqrt(squared), s = cos_i + n_cos_t, p = n * n * cos_i + n_cos_t;
  float r_s = -excess / (s * s), r_p = excess * (squared_i * (n * n) - squared_sine) / (p * p);
  return vec2(min(n_cos_t / n, 1.0), min(0.5 * (r_s * r_s + r_p * r_p), 1.0));
}
vec3 mirrored(vec3 d, vec3 n) { return d - n * (2.0 * dot(d, n)); }

// ---- intersections of rays: tracer/src/shapes, tracer/src/accel. The hit of the last traversal and the surface there are
// in these variables.
uniform int plane_count;
int hit_primitive;   // row of `primitives`, or -2 - plane; NONE: no hit
float hit_t;
vec2 hit_uv;         // barycentric coordinates, or the part of the surface
vec4 hit_cell;       // of the primitive; (0, 0, 0, code) for planes
vec3 hit_position, hit_error, hit_face;  // with bounds of its error; unit geometric normal, outward
vec3 hit_normal, hit_offset;             // shading normal, outward; from the point to the start of shadow rays
float hit_curvature;
bool hit_smooth;

const float RIM_SLACK = 3.8e-6;  // 2^-18: rim_slack, for floats

bool hits_plane(int i, vec3 o, vec3 d) {
  vec4 point = cell(planes, 2 * i);
  vec3 normal = cell(planes, 2 * i + 1).xyz;
  float t = dot(point.xyz - o, normal) / dot(d, normal);
  if (!(t > 0.0 && t < hit_t)) return false;
  hit_t = t;
  hit_primitive = -2 - i;
  hit_cell = vec4(0.0, 0.0, 0.0, point.w);
  return true;
}

// The discriminant is the squared radius minus the squared distance of the line from the center (tracer/src/accel/packet.cpp). A
// radius of one would cost another rounding of the origin, which is large beside a small sphere.
float sphere_hit(vec3 o, vec3 d, float radius_squared, float speed) {
  float b = -dot(o, d) / speed;
  vec3 nearest = o + b * d;
  float discriminant = (radius_squared - dot(nearest, nearest)) / speed;
  if (!(discriminant >= 0.0)) return FAR;
  float root = sqrt(discriminant), q = b >= 0.0 ? b + root : b - root, other = (dot(o, o) - radius_squared) / speed / q;
  float first = min(q, other), last = max(q, other);
  return first > 0.0 ? first : (last > 0.0 ? last : FAR);
}

#ifdef TRIANGLES
// Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection".
vec3 permuted(vec3 v, int axis) { return axis == 0 ? v.yzx : (axis == 1 ? v.zxy : v); }
bool hits_triangle(vec4 triangle, vec3 o, int axis, vec3 shear) {
  vec3 a = permuted(cell(vertices, 2 * int(triangle.x)).xyz - o, axis);
  vec3 b = permuted(cell(vertices, 2 * int(triangle.y)).xyz - o, axis);
  vec3 c = permuted(cell(vertices, 2 * int(triangle.z)).xyz - o, axis);
  a.xy -= shear.xy * a.z;
  b.xy -= shear.xy * b.z;
  c.xy -= shear.xy * c.z;
  float u = c.x * b.y - c.y * b.x, v = a.x * c.y - a.y * c.x, w = b.x * a.y - b.y * a.x;
  if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return false;
  float determinant = u + v + w;
  float t = (u * a.z + v * b.z + w * c.z) * shear.z / determinant;
  if (determinant == 0.0 || !(t > 0.0 && t < hit_t)) return false;
  hit_t = t;
  hit_uv = vec2(v, w) / determinant;
  return true;
}
#endif

#ifdef QUADRICS
float best_t, best_part;
void update_nearest(float t, bool valid, float part) {
  if (!valid || !(t > 0.0 && t < best_t)) return;
  best_t = t;
  best_part = part;
}

// tracer/src/shapes/unit_disc.h
void disc_hit(vec3 o, vec3 d, float inner) {
  float t = -o.z / d.z;
  vec2 p = o.xy + t * d.xy;
  float squared = dot(p, p);
  update_nearest(t, squared <= 1.0 && squared >= inner * inner, 2.0);
}

// tracer/src/shapes/frustum.h
float cone_form(vec3 v, vec3 w) { return v.x * w.x + v.y * w.y - v.z * w.z; }
void frustum_hit(vec3 ray_o, vec3 d, float radius_0, float radius_1, bool caps) {
  vec3 from_middle = ray_o - vec3(0.0, 0.0, 0.5);
  float shift = dot(from_middle, from_middle) > 64.0 ? -dot(from_middle, d) / dot(d, d) : 0.0;
  vec3 o = ray_o + shift * d;
  float slope = radius_1 - radius_0, slack = caps ? RIM_SLACK : 0.0;
  vec3 cone_o = vec3(o.xy, radius_0 + slope * o.z), cone_d = vec3(d.xy, slope * d.z);
  float a = cone_form(cone_d, cone_d), b = -cone_form(cone_o, cone_d), c = cone_form(cone_o, cone_o);
  float turn = cone_o.x * cone_d.y - cone_o.y * cone_d.x;
  vec2 over = cone_o.xy * cone_d.z - cone_o.z * cone_d.xy;
  float discriminant = dot(over, over) - turn * turn, root = sqrt(max(discriminant, 0.0));
  bool crosses = discriminant >= 0.0 || a < 0.0;
  float q = b >= 0.0 ? b + root : b - root, t_0 = q / a, t_1 = c / q;
  float z_0 = o.z + t_0 * d.z, z_1 = o.z + t_1 * d.z;
  update_nearest(t_0 + shift, crosses && z_0 >= -slack && z_0 <= 1.0 + slack, 0.0);
  update_nearest(t_1 + shift, crosses && z_1 >= -slack && z_1 <= 1.0 + slack, 0.0);
  if (!caps) return;
  for (int end = 0; end < 2; ++end) {
    float radius = end == 0 ? radius_0 : radius_1, t = (float(end) - o.z) / d.z, reach = radius * (1.0 + RIM_SLACK);
    vec2 p = o.xy + t * d.xy;
    update_nearest(t + shift, radius > 0.0 && dot(p, p) <= reach * reach, 1.0 + float(end));
  }
}

// Slabs (Kay & Kajiya 1986): tracer/src/shapes/unit_cube.h
void cube_hit(vec3 o, vec3 d) {
  float enter = -FAR, leave = FAR, enter_part = 0.0, leave_part = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0.0) {
      if (o[axis] < 0.0 || o[axis] > 1.0) return;
      continue;
    }
    float t_0 = -o[axis] / d[axis], t_1 = (1.0 - o[axis]) / d[axis], part = 3.0 + 2.0 * float(axis);
    bool forward = d[axis] > 0.0;
    float near = forward ? t_0 : t_1, far = forward ? t_1 : t_0;
    if (near > enter) { enter = near; enter_part = forward ? part : part + 1.0; }
    if (far < leave) { leave = far; leave_part = forward ? part + 1.0 : part; }
  }
  if (enter > leave) return;
  if (enter > 0.0) update_nearest(enter, true, enter_part);
  else update_nearest(leave, true, leave_part);
}

// tracer/src/shapes/unit_torus.h: the derivative of the quartic isolates its roots (Yuksel 2022); Newton's method within
// brackets finds them (Press et al. 2007, sec. 9.4).
vec3 torus_n, torus_u;
float torus_a, torus_p, torus_q;
vec2 torus_surface(float s) {
  vec3 p = torus_n + torus_u * s;
  float r = length(p.xy), across = r - 1.0, tube = length(vec2(across, p.z));
  return vec2((tube - torus_a) * (tube + torus_a), 2.0 * (across * dot(p.xy, torus_u.xy) / r + p.z * torus_u.z));
}
vec2 torus_derivative(float s) { return vec2((s * s + torus_p) * s - torus_q, 3.0 * s * s + torus_p); }
float bracketed_root(bool of_surface, float low, float high, bool positive_at_high) {
  float begin = low, end = high, at = 0.5 * (low + high), last = high - low;
  for (int i = 0; i < 40; ++i) {
    vec2 here = of_surface ? torus_surface(at) : torus_derivative(at);
    if ((here.x > 0.0) == positive_at_high) high = at;
    else low = at;
    float newton = at - here.x / here.y;
    bool halves = newton > low && newton < high && 2.0 * abs(newton - at) < abs(last);
    float next = halves ? newton : 0.5 * (low + high);
    last = next - at;
    if (abs(last) <= UNIT * (1.0 + abs(at))) break;
    at = next;
  }
  return at > begin ? at : end;
}
float torus_first_root(float low, float high, bool inside) {
  float begin = low, from = low, turning = torus_p < 0.0 ? sqrt(-torus_p / 3.0) : 0.0;
  for (int i = 0; i < 3; ++i) {
    float to = i == 0 ? -turning : (i == 1 ? turning : high);
    if (!(to > from)) continue;
    float end = min(to, high);
    bool rises = torus_derivative(end).x > 0.0;
    if (rises != (torus_derivative(from).x > 0.0)) {
      float extremum = bracketed_root(false, from, end, rises);
      bool inside_there = torus_surface(extremum).x < 0.0;
      if (inside_there != inside) return bracketed_root(true, begin, extremum, !inside_there);
      begin = extremum;
    }
    from = end;
  }
  return inside ? bracketed_root(true, begin, high, true) : FAR;
}
void torus_hit(vec3 o, vec3 d, float a) {
  float speed = length(d), radius = (1.0 + a) * (1.0 + 1e-5);
  torus_a = a;
  torus_u = d / speed;
  float start = dot(o, torus_u);
  torus_n = o - torus_u * start;
  float again = dot(torus_n, torus_u);
  start += again;
  torus_n -= torus_u * again;
  float squared = dot(torus_n, torus_n), slab = a + 1e-5;
  if (!(squared < radius * radius)) return;
  float high = sqrt(radius * radius - squared), low = -high;
  if (torus_u.z == 0.0) {
    if (abs(torus_n.z) > slab) return;
  } else {
    float t_0 = (-slab - torus_n.z) / torus_u.z, t_1 = (slab - torus_n.z) / torus_u.z;
    low = max(low, min(t_0, t_1));
    high = min(high, max(t_0, t_1));
  }
  bool starts_within = start > low;
  if (starts_within) low = start;
  if (!(low < high)) return;
  torus_p = squared + (1.0 - a) * (1.0 + a) - 2.0 * dot(torus_u.xy, torus_u.xy);
  torus_q = 2.0 * dot(torus_n.xy, torus_u.xy);
  float s = torus_first_root(low, high, starts_within && torus_surface(low).x < 0.0);
  if (s < FAR) update_nearest((s - start) / speed, true, 0.0);
}

bool hits_quadric(int kind, int at, vec3 o, vec3 d) {
  vec4 origin = cell(shapes, at), x = cell(shapes, at + 1), y = cell(shapes, at + 2), z = cell(shapes, at + 3);
  mat3 shape_from_render = mat3(x.xyz, y.xyz, z.xyz);
  vec3 local_o = shape_from_render * (o - origin.xyz), local_d = shape_from_render * d;
  best_t = hit_t;
  if (kind == 1) update_nearest(sphere_hit(local_o, local_d, 1.0, dot(local_d, local_d)), true, 0.0);
  else if (kind == 2) disc_hit(local_o, local_d, origin.w);
  else if (kind == 3) frustum_hit(local_o, local_d, origin.w, x.w, y.w > 0.0);
  else if (kind == 4) cube_hit(local_o, local_d);
  else torus_hit(local_o, local_d, origin.w);
  if (!(best_t < hit_t)) return false;
  hit_t = best_t;
  hit_uv = vec2(best_part, 0.0);
  return true;
}
#endif

// ---- traversal

const int STACK = 52;  // live_bvh_depth_max, and some

// The distance at which a ray enters a box, or FAR. The far side is widened by the rounding of its distance (Ize 2013,
// "Robust BVH Ray Traversal").
float enter_box(vec3 low, vec3 high, vec3 o, vec3 inverse) {
  vec3 t_0 = (low - o) * inverse, t_1 = (high - o) * inverse, near = min(t_0, t_1), far = max(t_0, t_1);
  float enter = max(max_component(near), 0.0), leave = min(min(far.x, far.y), far.z) * 1.0000005;
  return enter <= leave && enter < hit_t ? enter : FAR;
}

// The nearest hit of the unit direction d in (0, t_max), or any one. `mask`: 1 opaque surfaces, 2 others. A ray does not
// hit the flat primitive `from`, on which it starts.
bool intersect(vec3 o, vec3 d, float t_max, int from, int mask, bool any) {
  hit_primitive = NONE;
  hit_t = t_max;
#ifdef PLANES
  for (int i = 0; i < plane_count; ++i) {
    if (from == -2 - i || (mask & 1 + (int(cell(planes, 2 * i).w) & 1)) == 0) continue;
    if (hits_plane(i, o, d) && any) return true;
  }
#endif
#ifdef NODES
  float stack_t[STACK];
  int stack_node[STACK];
  int top = 0, node = 0;
  vec3 safe = mix(d, vec3(1e-20), lessThan(abs(d), vec3(1e-20))), inverse = 1.0 / safe;
#ifdef TRIANGLES
  vec3 size = abs(d);
  int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  vec3 along = permuted(d, axis), shear = vec3(along.xy, 1.0) / along.z;
#endif
  vec4 low = cell(nodes, 0), high = cell(nodes, 1);
  if (enter_box(low.xyz, high.xyz, o, inverse) == FAR) return hit_primitive != NONE;
  for (;;) {
    int count = int(high.w), first = int(low.w);
    bool is_inner = count == 0;
    for (int i = first; i < first + count; ++i) {
      vec4 primitive = cell(primitives, i);
      if ((i == from && primitive.x >= 0.0) || (mask & 1 + (int(primitive.w) & 1)) == 0) continue;
      bool hit = false;
#ifdef TRIANGLES
      if (primitive.x >= 0.0) hit = hits_triangle(primitive, o, axis, shear);
#endif
#ifdef SPHERES
      if (primitive.x == -1.0) {
        vec4 sphere = cell(shapes, int(primitive.y));
        float t = sphere_hit(o - sphere.xyz, d, sphere.w * sphere.w, 1.0);
        hit = t < hit_t;
        if (hit) hit_t = t;
      }
#endif
#ifdef QUADRICS
      if (primitive.x < -1.0) hit = hits_quadric(int(-1.0 - primitive.x), int(primitive.y), o, d);
#endif
      if (!hit) continue;
      hit_primitive = i;
      hit_cell = primitive;
      if (any) return true;
    }
    if (is_inner) {
      int left = node + 1;
      vec4 left_low = cell(nodes, 2 * left), left_high = cell(nodes, 2 * left + 1);
      vec4 right_low = cell(nodes, 2 * first), right_high = cell(nodes, 2 * first + 1);
      float to_left = enter_box(left_low.xyz, left_high.xyz, o, inverse);
      float to_right = enter_box(right_low.xyz, right_high.xyz, o, inverse);
      bool left_first = to_left <= to_right;
      float farther = left_first ? to_right : to_left;
      if (farther < FAR && top < STACK) {
        stack_t[top] = farther;
        stack_node[top++] = left_first ? first : left;
      }
      if (min(to_left, to_right) < FAR) {
        node = left_first ? left : first;
        low = left_first ? left_low : right_low;
        high = left_first ? left_high : right_high;
        continue;
      }
    }
    while (top > 0 && stack_t[top - 1] >= hit_t) --top;
    if (top == 0) break;
    node = stack_node[--top];
    low = cell(nodes, 2 * node);
    high = cell(nodes, 2 * node + 1);
  }
#endif
  return hit_primitive != NONE;
}

int hit_object() { return int(hit_cell.w) >> 1; }
#ifdef QUADRICS
mat3 shape_from_render(int at) { return mat3(cell(shapes, at + 1).xyz, cell(shapes, at + 2).xyz, cell(shapes, at + 3).xyz); }
#endif
