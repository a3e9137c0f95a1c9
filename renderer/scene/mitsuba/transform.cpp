#include "renderer/scene/mitsuba/transform.h"

#include <cmath>
#include <numbers>

#include "renderer/scene/mitsuba/values.h"

namespace helio::mitsuba {

namespace {

std::optional<M44d> matrix_of(const Element& e) {
  const auto v = parse_numbers(e.attribute("value"));
  if (!v || (v->size() != 16 && v->size() != 9)) return std::nullopt;
  const std::size_t n = v->size() == 16 ? 4 : 3;
  M44d m;
  for (std::size_t row = 0; row < n; ++row)
    for (std::size_t column = 0; column < n; ++column) m[int(column)][int(row)] = (*v)[row * n + column];
  if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1) return std::nullopt;
  return m;
}

// Rodrigues' formula with the axis as it is given: as in Mitsuba 3, one that is not of unit length scales as well.
std::optional<M44d> rotation_of(const Element& e) {
  const auto axis = vector_of(e, 0);
  const auto angle = parse_numbers(e.attribute("angle"));
  if (!axis || !angle || angle->size() != 1 || !(length(*axis) > 0)) return std::nullopt;
  const double radians = angle->front() * std::numbers::pi / 180, c = std::cos(radians), s = std::sin(radians);
  const V3d& a = *axis;
  const V3d rest = a * (1 - c);
  return M44d(c + rest.x * a.x, rest.x * a.y + s * a.z, rest.x * a.z - s * a.y, 0,  //
              rest.y * a.x - s * a.z, c + rest.y * a.y, rest.y * a.z + s * a.x, 0,  //
              rest.z * a.x + s * a.y, rest.z * a.y - s * a.x, c + rest.z * a.z, 0,  //
              0, 0, 0, 1);
}

std::optional<M44d> look_at_of(const Element& e) {
  const auto triple = [&](const char* key) -> std::optional<V3d> {
    const auto v = parse_numbers(e.attribute(key));
    if (!v || v->size() != 3) return std::nullopt;
    return V3d((*v)[0], (*v)[1], (*v)[2]);
  };
  const auto origin = triple("origin"), target = triple("target");
  if (!origin || !target) return std::nullopt;
  const V3d along = *target - *origin;
  if (!(length(along) > 0)) return std::nullopt;
  const V3d forward = normalize(along);
  V3d up(0, 0, 0);
  if (!e.attribute("up").empty()) {
    const auto given = triple("up");
    if (!given) return std::nullopt;
    up = *given;
  }
  V3d left = cross(up, forward);
  if (!(length(left) > 1e-12 * length(up))) {  // no up, or along the view: any direction across
    up = std::abs(forward.y) < 0.9 ? V3d(0, 1, 0) : V3d(1, 0, 0);
    left = cross(up, forward);
  }
  left = normalize(left);
  const V3d true_up = cross(forward, left);
  return M44d(left.x, left.y, left.z, 0, true_up.x, true_up.y, true_up.z, 0, forward.x, forward.y, forward.z, 0,
              origin->x, origin->y, origin->z, 1);
}

void warn_about_axis(const Element& e, Diagnostics& diagnostics) {
  const auto axis = vector_of(e, 0);
  if (axis && std::fabs(length(*axis) - 1) > 1e-4)
    diagnostics.warn(e.place, "<rotate> has an axis that is not of unit length: as in Mitsuba 3, it scales as well");
}

std::optional<M44d> step_of(const Element& e) {
  M44d m;
  if (e.tag == "matrix") return matrix_of(e);
  if (e.tag == "rotate") return rotation_of(e);
  if (e.tag == "lookat") return look_at_of(e);
  if (e.tag == "translate") {
    const auto v = vector_of(e, 0);
    if (!v) return std::nullopt;
    return m.setTranslation(*v);
  }
  const auto v = vector_of(e, 1);
  if (!v) return std::nullopt;
  return m.setScale(*v);
}

}  // namespace

std::optional<V3d> vector_of(const Element& e, double missing) {
  const std::string& value = e.attribute("value");
  if (!value.empty()) {
    const auto v = parse_numbers(value);
    if (!v || (v->size() != 1 && v->size() != 3)) return std::nullopt;
    return v->size() == 1 ? V3d(v->front()) : V3d((*v)[0], (*v)[1], (*v)[2]);
  }
  V3d out(missing);
  int axis = 0;
  for (const char* key : {"x", "y", "z"}) {
    if (const std::string& text = e.attribute(key); !text.empty()) {
      const auto v = parse_numbers(text);
      if (!v || v->size() != 1) return std::nullopt;
      out[axis] = v->front();
    }
    ++axis;
  }
  return out;
}

M44d read_transform(const Element& element, Diagnostics& diagnostics) {
  M44d all;
  element.read = true;
  for (const Element& e : element.children) {
    e.read = true;
    if (e.tag != "matrix" && e.tag != "rotate" && e.tag != "lookat" && e.tag != "translate" && e.tag != "scale") {
      diagnostics.fail(e.place, "<" + e.tag + "> in a transform, allowed: translate, rotate, scale, matrix, lookat");
      continue;
    }
    if (e.tag == "rotate") warn_about_axis(e, diagnostics);
    if (const std::optional<M44d> step = step_of(e))
      all = all * *step;
    else
      diagnostics.fail(e.place, "<" + e.tag + "> needs finite numbers: translate and scale x, y, z or value; rotate an "
                                "axis that is not 0 and angle; lookat origin, target (apart) and up; matrix 9 or 16 in "
                                "rows, the last of them 0 0 0 1");
  }
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      if (!std::isfinite(all[row][column])) {
        diagnostics.fail(element.place, "the transform has an entry that is not finite");
        return M44d();
      }
  return all;
}

bool mirrors(const M44d& m) {
  const V3d x(m[0][0], m[0][1], m[0][2]), y(m[1][0], m[1][1], m[1][2]), z(m[2][0], m[2][1], m[2][2]);
  return dot(cross(x, y), z) < 0;
}

M44d camera_to_world(const M44d& mitsuba_to_world) {
  M44d turn;
  turn.setScale(V3d(-1, 1, -1));
  return turn * mitsuba_to_world;
}

std::array<float, 6> uv_rows(const M44d& m) {
  return {float(m[0][0]), float(m[1][0]), float(m[3][0]), float(m[0][1]), float(m[1][1]), float(m[3][1])};
}

}  // namespace helio::mitsuba
