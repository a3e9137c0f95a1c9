// KHR_lights_punctual.
#include <spdlog/fmt/fmt.h>

#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

namespace {

// How far an inner cone may be wider than its outer one, in radians, and still count as one that rounding has made so.
constexpr double kConeRounding = 1e-3;

void read_cones(const JsonObject& light_object, PunctualLight& light) {
  Diagnostics& diagnostics = light_object.diagnostics();
  if (!light_object.has("spot"))
    diagnostics.tolerate(light_object.place(), "misses the required property \"spot\"",
                         "its cones are the default ones");
  const JsonObject spot = light_object.object("spot");
  spot.only({"innerConeAngle", "outerConeAngle"});
  double inner = spot.number("innerConeAngle", 0, {0, std::numbers::pi / 2});
  const double outer = spot.number("outerConeAngle", std::numbers::pi / 4, {0, std::numbers::pi / 2, true});
  if (inner >= outer) {
    const std::string place = spot.place() / (spot.has("outerConeAngle") ? "outerConeAngle" : "innerConeAngle");
    const std::string problem = fmt::format("the inner cone, {:.9g}, is not below the outer one, {:.9g}", inner, outer);
    if (inner - outer <= kConeRounding)
      diagnostics.tolerate(place, problem, "the spot has a hard edge");
    else
      diagnostics.fail(place, problem);
    inner = outer;
  }
  light.inner_cone_angle = float(inner);
  light.outer_cone_angle = float(outer);
}

}  // namespace

void read_lights(const JsonObject& root, Document& document) {
  const JsonObject extension = root.extension("KHR_lights_punctual");
  if (!extension.exists()) return;
  extension.only({"lights"});
  extension.require("lights");
  extension.each("lights", [&](const JsonObject& object, std::size_t) {
    Diagnostics& diagnostics = object.diagnostics();
    object.only({"color", "intensity", "type", "range", "spot"});
    PunctualLight light;
    light.name = object.string("name");
    light.intensity = object.rgb("color", Rgb(1), kUnit) * float(object.number("intensity", 1, kNonNegative));
    if (object.has("range")) light.range = float(object.number("range", 1, kPositive));
    if (object.require("type")) {
      const std::string type = object.string("type");
      if (type == "point") {
        light.kind = PunctualKind::point;
      } else if (type == "directional") {
        light.kind = PunctualKind::directional;
        light.range = std::numeric_limits<float>::infinity();  // the extension: range has no meaning here
      } else if (type == "spot") {
        light.kind = PunctualKind::spot;
        read_cones(object, light);
      } else {
        diagnostics.fail(object.place() / "type", "is \"" + type + "\", allowed: directional, point, spot");
      }
    }
    document.lights.push_back(std::move(light));
  });
}

}  // namespace helio::gltf
