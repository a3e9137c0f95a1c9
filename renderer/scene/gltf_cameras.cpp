// cameras, with the lens of extras.heliograph.
#include <spdlog/fmt/fmt.h>

#include "renderer/base/camera_limits.h"
#include "renderer/scene/gltf_document.h"
#include "renderer/scene/gltf_extras.h"

namespace helio::gltf {

namespace {

void read_perspective(const JsonObject& object, CameraDescription& camera) {
  object.only({"aspectRatio", "yfov", "zfar", "znear"});
  if (!object.require({"yfov", "znear"})) return;
  camera.projection = Projection::perspective;
  camera.vertical_fov = object.number("yfov", 0.8, kPositive);
  if (camera.vertical_fov >= std::numbers::pi)
    object.diagnostics().fail(object.place() / "yfov",
                              "is " + std::to_string(camera.vertical_fov) + ", allowed: above 0 and below pi");
  camera.aspect = object.has("aspectRatio") ? object.number("aspectRatio", 1, kPositive) : 0;
  const double near = object.number("znear", 1, kPositive);
  if (object.has("zfar") && object.number("zfar", near + 1, kPositive) <= near)
    object.diagnostics().fail(object.place(), "zfar is not above znear");
}

void read_orthographic(const JsonObject& object, CameraDescription& camera) {
  object.only({"xmag", "ymag", "zfar", "znear"});
  if (!object.require({"xmag", "ymag", "zfar", "znear"})) return;
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
  if (object.number("zfar", 1, kPositive) <= object.number("znear", 0, kNonNegative))
    object.diagnostics().fail(object.place(), "zfar is not above znear");
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
    read_camera_extras(object, camera);
    document.cameras.push_back(std::move(camera));
  });
}

}  // namespace helio::gltf
    camera.keeps_aspect = camera.aspect > 0;
