#include "renderer/trace/lights/light_bounds.h"

namespace helio {
namespace {

float angle_between(const V3f& a, const V3f& b) {
  return std::atan2(length(cross(a, b)), dot(a, b));
}

// The smallest cone around two cones (axis, half angle).
void merge_cones(const LightBounds& a, const LightBounds& b, LightBounds& out) {
  const float between = angle_between(a.axis, b.axis);
  out.axis = a.axis;
  out.theta_o = kPi;
  if (std::min(between + b.theta_o, kPi) <= a.theta_o) {
    out.theta_o = a.theta_o;
    return;
  }
  if (std::min(between + a.theta_o, kPi) <= b.theta_o) {
    out.axis = b.axis;
    out.theta_o = b.theta_o;
    return;
  }
  const float theta = 0.5f * (a.theta_o + between + b.theta_o);
  const V3f around = cross(a.axis, b.axis);
  const float sine = length(around);
  if (theta >= kPi || !(sine > 1e-4f)) return;  // (anti)parallel axes: all directions will do
  // a.axis turned by theta - a.theta_o towards b.axis; a little wider than exact, for the rounding.
  const float turn = theta - a.theta_o;
  out.axis = normalize(a.axis * std::cos(turn) + cross(around * (1 / sine), a.axis) * std::sin(turn));
  out.theta_o = std::min(theta + 1e-5f, kPi);
}

}  // namespace

LightBounds merge(const LightBounds& a, const LightBounds& b) {
  LightBounds out;
  out.box = a.box;
  out.box.extendBy(b.box);
  merge_cones(a, b, out);
  out.theta_e = std::max(a.theta_e, b.theta_e);
  out.two_sided = a.two_sided || b.two_sided;
  out.intensity = a.intensity + b.intensity;
  out.range = std::max(a.range, b.range);
  return out;
}

double cluster_cost(const LightBounds& bounds) {
  const float o = bounds.theta_o, w = std::min(o + bounds.theta_e, kPi);
  const float sine = std::sin(o), cosine = std::cos(o);
  const float directions =
      kTwoPi * (1 - cosine) + kPi / 2 * (2 * w * sine - std::cos(o - 2 * w) - 2 * o * sine + cosine);
  return bounds.intensity * double(directions) * length_squared(V3d(bounds.box.size()));
}

}  // namespace helio
