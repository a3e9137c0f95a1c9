#include "renderer/scene/gltf/document/extras.h"

#include <algorithm>

#include "renderer/base/camera_limits.h"

namespace helio::gltf {

namespace {

// Extras may be any JSON value and belong to everybody; only our own key in an object is looked at.
JsonObject own_extras(const JsonObject& owner) {
  if (!owner.is_object("extras")) return JsonObject::absent(owner.place() / "extras", owner.diagnostics());
  const JsonObject extras = owner.object("extras");
  return extras.object("heliograph");
}

// Unlike JsonObject::only, name and extras mean nothing here.
void only(const JsonObject& object, std::initializer_list<std::string_view> known) {
  for (const std::string& key : object.keys())
    if (std::find(known.begin(), known.end(), key) == known.end()) object.diagnostics().unread(object.place() / key);
}

void read_environment(const JsonObject& extras, Document& document) {
  only(extras, {"environment"});
  if (!extras.has("environment")) return;
  const JsonObject object = extras.object("environment");
  only(object, {"radiance", "image", "rotation"});
  Environment environment;
  environment.radiance = object.rgb("radiance", Rgb(1), kNonNegative);
  document.environment_uri.reset();
  if (object.is_string("image"))
    document.environment_uri = object.string("image");
  else
    environment.image = object.reference("image", document.images.size(), "images");
  environment.to_world.setAxisAngle(V3d(0, 1, 0), object.number("rotation", 0));
  document.environment = environment;
}

// Some converters leave what glTF has no place for as text of the scene that they read. Lights that are missing make
// another picture, so this is no key of somebody else's business.
void warn_of_emitters(const JsonObject& asset) {
  if (!asset.is_object("extras")) return;
  const JsonObject extras = asset.object("extras");
  if (!extras.has("mitsuba_emitters")) return;
  extras.diagnostics().warn(
      extras.place() / "mitsuba_emitters",
      "names lights of the scene that was converted, which are not read; a constant background is "
      "asset.extras.heliograph.environment.radiance");
}

}  // namespace

void read_environment_extras(const JsonObject& root, Document& document) {
  const JsonObject asset = root.object("asset");
  read_environment(own_extras(asset), document);
  warn_of_emitters(asset);
  const int chosen = document.scene >= 0 ? document.scene : 0;
  root.each("scenes", [&](const JsonObject& scene, std::size_t i) {
    if (int(i) == chosen) read_environment(own_extras(scene), document);
  });
}

std::optional<Sphere> read_sphere_extras(const JsonObject& node, const Document& document) {
  const JsonObject extras = own_extras(node);
  only(extras, {"sphere"});
  if (!extras.has("sphere")) return std::nullopt;
  const JsonObject object = extras.object("sphere");
  only(object, {"radius", "center", "material"});
  Sphere sphere;
  sphere.radius = float(object.number("radius", 1, kPositive));
  sphere.center = object.rgb("center", V3f(0), kAny);
  sphere.material = object.reference("material", document.materials.size(), "materials");
  return sphere;
}

void read_material_extras(const JsonObject& object, Material& material) {
  const JsonObject extras = own_extras(object);
  only(extras, {"conductor", "distribution", "alpha"});
  if (extras.has("conductor")) {
    const JsonObject conductor = extras.object("conductor");
    only(conductor, {"eta", "k"});
    material.model = MaterialModel::conductor;
    conductor.require("eta");
    conductor.require("k");
    material.conductor_eta = conductor.rgb("eta", material.conductor_eta, kPositive);
    material.conductor_k = conductor.rgb("k", material.conductor_k, kNonNegative);
  }
  const std::string distribution = extras.string("distribution", "ggx");
  if (distribution == "beckmann")
    material.distribution = MicrofacetDistribution::beckmann;
  else if (distribution != "ggx")
    extras.diagnostics().fail(extras.place() / "distribution", "is \"" + distribution + "\", allowed: ggx, beckmann");
  if (extras.has("alpha")) {
    // Stored as what its square root means in glTF's perceptual scale; glossiness is its complement.
    material.roughness = float(std::sqrt(extras.number("alpha", 1, kUnit)));
    material.glossiness = 1 - material.roughness;
  }
}

void read_camera_extras(const JsonObject& object, CameraDescription& camera) {
  const JsonObject extras = own_extras(object);
  only(extras, {"lens_radius", "focus_distance"});
  camera.lens_radius = extras.number("lens_radius", 0, {0, kMaxLensRadius});
  camera.focus_distance = extras.number("focus_distance", 1, {kMinCameraLength, kMaxCameraLength});
}

}  // namespace helio::gltf
