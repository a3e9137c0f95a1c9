// KHR_lights_punctual.
#include "renderer/scene/gltf_document.h"

namespace helio::gltf {

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
        object.require("spot");
        const JsonObject spot = object.object("spot");
        spot.only({"innerConeAngle", "outerConeAngle"});
        light.inner_cone_angle = float(spot.number("innerConeAngle", 0, {0, std::numbers::pi / 2}));
        light.outer_cone_angle =
            float(spot.number("outerConeAngle", std::numbers::pi / 4, {0, std::numbers::pi / 2, true}));
        if (light.outer_cone_angle <= light.inner_cone_angle)
          diagnostics.fail(spot.place() / "outerConeAngle", "is not above innerConeAngle");
      } else {
        diagnostics.fail(object.place() / "type", "is \"" + type + "\", allowed: directional, point, spot");
      }
    }
    document.lights.push_back(std::move(light));
  });
}

}  // namespace helio::gltf
