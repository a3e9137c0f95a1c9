// What the daemon tells about a scene.
#pragma once

#include <cstddef>
#include <string>

#include "heliograph/v1/render_service.pb.h"
#include "server/scenes/scene_registry.h"

namespace helio {

inline constexpr std::size_t kMaxName = 256;
// At most `size` bytes, UTF-8 kept whole; bytes that are not UTF-8 would not travel in a string field.
std::string printable(const std::string& text, std::size_t size);

template <class Vector>
void write_vector(const Vector& vector, heliograph::v1::Vec3& message) {
  message.set_x(vector.x);
  message.set_y(vector.y);
  message.set_z(vector.z);
}

// Lists are cut, and their totals say so; cameras begin with the one of this number.
heliograph::v1::SceneInfo to_scene_info(const LoadedScene& scene, std::size_t first_camera = 0);
heliograph::v1::LoadSceneResponse to_load_response(const LoadedScene& scene, bool already_loaded);

}  // namespace helio
