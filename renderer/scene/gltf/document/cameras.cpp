// cameras, with the lens of extras.heliograph.
#include <spdlog/fmt/fmt.h>

#include "renderer/base/camera_limits.h"
#include "renderer/scene/gltf/document/document.h"
#include "renderer/scene/gltf/document/extras.h"

namespace helio::gltf {

namespace {

constexpr const char* kAsAbsent = "read as absent";
constexpr const char* kAllDepths = "cameras see at all depths here";

// Depths between which rasterizers draw. Nothing here depends on them: what is wrong with them are slips.
void check_clipping(const JsonObject& object, std::initializer_list<const char*> required, bool near_may_be_0) {
  Diagnostics& diagnostics = object.diagnostics();
  for (const char* key : required) {
    if (!object.has(key))
      diagnostics.tolerate(object.place(), std::string("misses the required property \"") + key + '"', kAllDepths);
  }
  const Range any = {-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
  const double near = object.number("znear", near_may_be_0 ? 0 : 1e-30, any);
  const double far = object.number("zfar", std::numeric_limits<double>::infinity(), any);
  if (near < 0 || (near == 0 && !near_may_be_0))
    diagnostics.tolerate(object.place() / "znear",
                         fmt::format("is {}, allowed: {} 0", near, near_may_be_0 ? "at least" : "above"), kAllDepths);
  if (far <= near) diagnostics.tolerate(object.place(), "zfar is not above znear", kAllDepths);
}

void read_perspective(const JsonObject& object, CameraDescription& camera) {
  object.only({"aspectRatio", "yfov", "zfar", "znear"});
  if (!object.require("yfov")) return;
  camera.projection = Projection::perspective;
  camera.vertical_fov = object.number("yfov", 0.8, kPositive);
  if (camera.vertical_fov >= std::numbers::pi)
    object.diagnostics().fail(object.place() / "yfov",
                              "is " + std::to_string(camera.vertical_fov) + ", allowed: above 0 and below pi");
  camera.aspect = object.number("aspectRatio", 0, kNonNegative);
  if (object.has("aspectRatio") && camera.aspect == 0)
    object.diagnostics().tolerate(object.place() / "aspectRatio", "is 0, allowed: above 0", kAsAbsent);
  check_clipping(object, {"znear"}, false);
}

void read_orthographic(const JsonObject& object, CameraDescription& camera) {
  object.only({"xmag", "ymag", "zfar", "znear"});
  if (!object.require({"xmag", "ymag"})) return;
  camera.projection = Projection::orthographic;
  // The sign of a magnification only mirrors the picture; the size is its absolute value.
  const double x = std::abs(object.number("xmag", 1)), y = std::abs(object.number("ymag", 1));
  if (x == 0) object.diagnostics().fail(object.place() / "xmag", "is 0, allowed: any other number");
  if (y == 0) object.diagnostics().fail(object.place() / "ymag", "is 0, allowed: any other number");
  if (x == 0 || y == 0) return;
  for (const auto& [key, size] : {std::pair("xmag", x), std::pair("ymag", y)}) {
    if (!in_camera_length_range(size))
      object.diagnostics().fail(object.place() / key, fmt::format("is {}, allowed: magnitudes in {}",
                                                                  object.number(key, 1), kCameraLengthRange));
  }
  camera.half_height = y;
  camera.aspect = x / y;
  check_clipping(object, {"zfar", "znear"}, true);
}

}  // namespace

void read_cameras(const JsonObject& root, Document& document) {
  root.each("cameras", [&](const JsonObject& object, std::size_t) {
    object.only({"orthographic", "perspective", "type"});
    document.extensions.check(object, Site::elsewhere);
    CameraDescription camera;
    camera.name = object.string("name");
    Diagnostics& diagnostics = object.diagnostics();
    if (object.require("type")) {
      const std::string type = object.string("type");
      if (object.has("perspective") && object.has("orthographic"))
        diagnostics.fail(object.place(), "is both perspective and orthographic");
      if (type != "perspective" && type != "orthographic")
        diagnostics.fail(object.place() / "type", "is \"" + type + "\", allowed: perspective, orthographic");
      else if (object.require(type.c_str()))
        type == "perspective" ? read_perspective(object.object("perspective"), camera)
                              : read_orthographic(object.object("orthographic"), camera);
    }
    camera.keeps_aspect = camera.aspect > 0;
    read_camera_extras(object, camera);
    document.cameras.push_back(std::move(camera));
  });
}

}  // namespace helio::gltf
