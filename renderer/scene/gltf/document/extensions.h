// Which glTF extensions are implemented, and where an extension's object may stand.
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "renderer/scene/gltf/document/json.h"

namespace helio::gltf {

enum class Site : unsigned {
  root = 1u << 0,
  node = 1u << 1,
  material = 1u << 2,
  texture_info = 1u << 3,
  texture = 1u << 4,
  primitive = 1u << 5,
  buffer = 1u << 6,
  buffer_view = 1u << 7,
  channel_target = 1u << 8,
  elsewhere = 1u << 9,
};

// What extensionsUsed and extensionsRequired say.
class ExtensionList {
 public:
  // Fails for every required extension that is not implemented (unimplemented, by name); warns for optional ones.
  static ExtensionList read(const JsonObject& root);

  bool used(std::string_view name) const;
  bool required(std::string_view name) const;

  // Fails for each extension object of `owner` that is not declared in extensionsUsed or, being known to us, may not
  // stand at such a place.
  void check(const JsonObject& owner, Site site) const;

 private:
  std::set<std::string, std::less<>> used_, required_;
};

}  // namespace helio::gltf
