#include "renderer/scene/gltf/document/document.h"

#include "renderer/scene/gltf/document/extras.h"

namespace helio::gltf {

M44d to_matrix(const Trs& trs) {
  const auto [x, y, z, w] = trs.rotation;
  M44d m;  // rows: images of the axes
  m[0][0] = 1 - 2 * (y * y + z * z), m[0][1] = 2 * (x * y + z * w), m[0][2] = 2 * (x * z - y * w);
  m[1][0] = 2 * (x * y - z * w), m[1][1] = 1 - 2 * (x * x + z * z), m[1][2] = 2 * (y * z + x * w);
  m[2][0] = 2 * (x * z + y * w), m[2][1] = 2 * (y * z - x * w), m[2][2] = 1 - 2 * (x * x + y * y);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) m[row][column] *= trs.scale[row];
  for (int column = 0; column < 3; ++column) m[3][column] = trs.translation[column];
  return m;
}

bool is_mirrored(const Trs& trs) {
  return (trs.scale.x < 0) != ((trs.scale.y < 0) != (trs.scale.z < 0));
}

namespace {

struct Version {
  std::uint64_t major = 0, minor = 0;
  bool valid = false;
};

Version parse_version(const std::string& text) {
  Version version;
  const std::size_t dot = text.find('.');
  if (dot == std::string::npos || dot == 0 || dot + 1 == text.size() || text.size() > 9) return version;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i == dot) continue;
    if (text[i] < '0' || text[i] > '9') return version;
    std::uint64_t& part = i < dot ? version.major : version.minor;
    part = part * 10 + std::uint64_t(text[i] - '0');
  }
  version.valid = true;
  return version;
}

// The asset object decides whether the rest can be understood at all.
void check_asset(const JsonObject& root) {
  Diagnostics& diagnostics = root.diagnostics();
  if (!root.require("asset")) return;
  const JsonObject asset = root.object("asset");
  asset.only({"version", "minVersion", "generator", "copyright"});
  if (!asset.require("version")) return;
  const std::string text = asset.string("version");
  const Version version = parse_version(text);
  if (!version.valid || version.major != 2)
    diagnostics.fail(asset.place() / "version", "is \"" + text + "\", allowed: 2.x", ErrorCode::unimplemented);
  if (!asset.has("minVersion")) return;
  const std::string least = asset.string("minVersion");
  const Version min_version = parse_version(least);
  if (!min_version.valid)
    diagnostics.fail(asset.place() / "minVersion", "is \"" + least + "\", expected a version such as 2.0");
  else if (min_version.major > version.major || min_version.minor > version.minor)
    diagnostics.fail(asset.place() / "minVersion", "is \"" + least + "\", which is above version \"" + text + '"');
  else if (min_version.major != 2 || min_version.minor > 0)
    diagnostics.fail(asset.place() / "minVersion", "is \"" + least + "\", supported: 2.0", ErrorCode::unimplemented);
}

}  // namespace

Document read_document(const JsonObject& root) {
  Document document;
  Diagnostics& diagnostics = root.diagnostics();
  check_asset(root);
  document.extensions = ExtensionList::read(root);
  if (diagnostics.failed()) return document;

  root.only({"asset", "extensionsUsed", "extensionsRequired", "buffers", "bufferViews", "accessors", "images",
             "samplers", "textures", "materials", "meshes", "nodes", "skins", "scenes", "scene", "animations",
             "cameras"});
  document.extensions.check(root, Site::root);
  read_buffers(root, document);
  read_accessors(root, document);
  read_textures(root, document);
  read_materials(root, document);
  read_meshes(root, document);
  read_cameras(root, document);
  read_lights(root, document);
  read_nodes(root, document);
  read_skins(root, document);
  read_scenes(root, document);
  read_animations(root, document);
  read_environment_extras(root, document);
  if (!diagnostics.failed()) check_consistency(document, diagnostics);
  return document;
}

}  // namespace helio::gltf
