#pragma once
/// Torus (r - 1)^2 + z^2 = radius_0^2 around the unit circle, 0 < radius_0 < 1.
///
/// A ray p = n + s u with unit u and n its point nearest to the center intersects where the quartic
///   (s^2 + k)^2 - 4 |p_xy|^2 = 0,  k = |n|^2 + 1 - a^2,
/// which has no cubic term (Hanrahan 1989, "A Survey of Ray-Surface Intersection Algorithms", in Glassner, An
/// Introduction to Ray Tracing, sec. 3). Between the roots of its derivative the quartic is monotone, and between those
/// of the second derivative the derivative is (Yuksel 2022, "High-Performance Polynomial Root Finding for Graphics",
/// Proc. ACM CGIT 5(3)): these intervals isolate all roots. The sign within them comes from the factor of the quartic
/// that vanishes on the torus, (r - 1)^2 + z^2 - a^2, which keeps its digits where the tube is thin and the
/// coefficients lose theirs; the other factor is positive.

#include "tracer/src/shapes/analytic_shape.h"

namespace tracer {

/// Value and derivative.
struct Slope {
  double value, derivative;
};

/// The root of a function with opposite signs at low and high, > low: Newton's method within a shrinking bracket, with
/// a bisection where its steps do not halve (Press et al. 2007, Numerical Recipes, sec. 9.4).
template <class Function>
double bracketed_root(const Function& f, double low, double high, bool positive_at_high) {
  const double begin = low, end = high;
  double at = 0.5 * (low + high), step = high - low;
  for (;;) {
    const Slope here = f(at);
    ((here.value > 0) == positive_at_high ? high : low) = at;
    const double newton = at - here.value / here.derivative;
    const bool halves = newton > low && newton < high && 2 * std::abs(newton - at) < std::abs(step);
    const double next = halves ? newton : 0.5 * (low + high);
    step = next - at;
    if (std::abs(step) <= 0x1p-53 * (1 + std::abs(at))) break;
    at = next;
  }
  return at > begin ? at : end;
}

/// A ray against the torus with tube radius a; distances s are in the units of its space.
class TorusRay {
 public:
  TorusRay(const ShapeRay& ray, double tube_radius) : a_(tube_radius) {
    const Vec3 o{ray.ox, ray.oy, ray.oz}, d{ray.dx, ray.dy, ray.dz};
    speed_ = length(d);
    u_ = d / speed_;
    start_ = dot(o, u_);
    n_ = o - u_ * start_;
    const double again = dot(n_, u_);  // rounding of a distant origin
    start_ += again;
    n_ = n_ - u_ * again;
  }

  /// Distance along the ray as it was given, or infinity.
  [[nodiscard]] double nearest_hit() const {
    constexpr double none = std::numeric_limits<double>::infinity();
    constexpr double slack = 0x1p-40;  // margin of the bounding sphere and slab
    const double radius = (1 + a_) * (1 + slack), squared = dot(n_, n_);
    if (!(squared < radius * radius)) return none;
    const double half = std::sqrt(radius * radius - squared), slab = a_ * (1 + slack) + slack;
    double low = -half, high = half;
    const double in = (-slab - n_.z) / u_.z, out = (slab - n_.z) / u_.z;
    if (u_.z == 0) {
      if (std::abs(n_.z) > slab) return none;
    } else {
      low = std::max(low, std::min(in, out));
      high = std::min(high, std::max(in, out));
    }
    const bool starts_within = start_ > low;
    if (starts_within) low = start_;
    if (!(low < high)) return none;
    const double s = first_root(low, high, starts_within && surface(low).value < 0);
    const double t = (s - start_) / speed_;
    return t > 0 ? t : none;
  }

 private:
  /// (r - 1)^2 + z^2 - a^2 at s: positive outside the torus.
  [[nodiscard]] Slope surface(double s) const {
    const Vec3 p = n_ + u_ * s;
    const double r = std::sqrt(p.x * p.x + p.y * p.y), across = r - 1;
    const double tube = std::sqrt(across * across + p.z * p.z);
    return {(tube - a_) * (tube + a_), 2 * (across * (p.x * u_.x + p.y * u_.y) / r + p.z * u_.z)};
  }

  /// The first sign change in (low, high), which lies outside the torus at its end; infinity without one.
  [[nodiscard]] double first_root(double low, double high, bool starts_inside) const {
    const double k = dot(n_, n_) + (1 - a_) * (1 + a_);
    const double p = k - 2 * (u_.x * u_.x + u_.y * u_.y), q = 2 * (n_.x * u_.x + n_.y * u_.y);
    const auto derivative = [=](double s) { return Slope{(s * s + p) * s - q, 3 * s * s + p}; };
    double root = std::numeric_limits<double>::infinity();
    double begin = low;
    bool inside = starts_inside;
    // Ends an interval on which the quartic is monotone. True: the root is found.
    const auto end_interval = [&](double end, bool inside_there) {
      if (inside_there != inside)
        root = bracketed_root([this](double s) { return surface(s); }, begin, end, !inside_there);
      begin = end;
      return inside_there != inside;
    };
    const double turning = p < 0 ? std::sqrt(-p / 3) : 0;
    double from = low;
    for (const double to : {-turning, turning, high}) {  // the derivative is monotone between these
      if (!(to > from)) continue;
      const double end = std::min(to, high);
      const bool rises = derivative(end).value > 0;
      if (rises != (derivative(from).value > 0)) {
        const double extremum = bracketed_root(derivative, from, end, rises);
        if (end_interval(extremum, surface(extremum).value < 0)) return root;
      }
      from = end;
    }
    end_interval(high, false);
    return root;
  }

  double a_;
  double speed_, start_;  ///< length of the given direction, and s at the given origin
  Vec3 n_, u_;
};

struct UnitTorus : StandardShape {
  static constexpr std::uint64_t max_hits = 4;
  static constexpr bool scalar = true;

  static Bounds box(const Quadric& q) {
    const double a = q.radius_0;
    return {{-1 - a, -1 - a, -a}, {1 + a, 1 + a, a}};
  }
  /// A torus is the Minkowski sum of the rim of a disc and a sphere.
  static void include(Bounds& bounds, const Quadric& q) {
    const Linear& m = q.render_from_shape;
    bounds.include(q.origin, disc_extent(m) + ellipsoid_extent(m) * q.radius_0);
  }
  static double curvature(const Quadric& q) {
    const Linear& m = q.render_from_shape;
    return 1 / (std::min({length(m.x), length(m.y), length(m.z)}) * q.radius_0);
  }
  /// Rounding of the ray's recentring and of the surface's sign, for coordinates of up to 2.
  static double error(const Quadric&) { return rounding_bound(16); }

  template <class Use>
  static WHITTLE_INLINE void with_hit(const Quadric& q, const Use& use) {
    use([a = q.radius_0](const ShapeRay& ray) { return QuadricHit{TorusRay(ray, a).nearest_hit(), 0}; });
  }

  static ShapePoint point(double a, double, double, const Vec3& p) {
    const double r = std::sqrt(p.x * p.x + p.y * p.y);
    const Vec3 circle = r > 0 ? Vec3{p.x / r, p.y / r, 0} : Vec3{1, 0, 0};
    const Vec3 arm{circle.x * (r - 1), circle.y * (r - 1), p.z};
    const double size = length(arm);
    const Vec3 normal = size > 0 ? arm / size : circle;
    return {circle + normal * a, normal};
  }
  static Vec2 uv(const Quadric&, QuadricPart, const Vec3& p) {
    return {turns(p.y, p.x), turns(p.z, std::sqrt(p.x * p.x + p.y * p.y) - 1)};
  }
  static UvGradients gradients(const Quadric&, QuadricPart, const Vec3& p) {
    const double r = std::sqrt(p.x * p.x + p.y * p.y), across = r - 1;
    const double turn = 2 * std::numbers::pi * (across * across + p.z * p.z);
    return {turn_gradient(p), {-p.z * p.x / (r * turn), -p.z * p.y / (r * turn), across / turn}};
  }
};

inline StandardImage<UnitTorus> standard_image(const Torus& t) {
  const double major = t.major_radius;
  return {round_about(t.center, normalize(t.axis) * major, t.u_axis, major), t.minor_radius / major};
}

inline double reach(const Torus& t) { return largest_component(t.center) + t.major_radius + t.minor_radius; }

template <class Checks>
void check(Checks& checks, const Torus& torus) {
  checks.less("minor_radius", torus.minor_radius, "major_radius", torus.major_radius);
  checks.not_parallel("u_axis", torus.u_axis, torus.axis, "must not be parallel to the axis");
}

}  // namespace tracer
