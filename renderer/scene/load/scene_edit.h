// Edits of a loaded scene, as plain data: what may change without a load, and what a list of edits comes to.
//
// An edit names its target by name or by number and gives new values; what it leaves out stays. Names are those of the
// file (node, material, light); numbers count from 0 in the order of SceneDescription. Edits of one list apply in
// order.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>

#include "renderer/base/math.h"
#include "renderer/base/result.h"
#include "renderer/scene/description/scene_description.h"

namespace helio {

using EditTarget = std::variant<std::string, std::uint32_t>;  // name or number

// Places an object (SceneDescription::instances).
struct ObjectEdit {
  EditTarget target;
  M44d transform;         // object to world; finite, not flattening, and the object stays within kMaxCoordinate
  bool relative = false;  // the transform comes after the present one, in world space
};

struct MaterialEdit {
  EditTarget target;
  std::optional<Rgb> base_color;   // [0, 1]; multiplies a texture; not of conductors and blends
  std::optional<Rgb> emission;     // radiance, W / (sr m^2), finite, >= 0; multiplies a texture; not of unlit ones
  std::optional<float> roughness;  // perceptual, [0, 1]; along the tangent; not of panes, unlit ones and blends
};

// A point, spot or directional light. What shines because of its material is edited there.
struct LightEdit {
  EditTarget target;
  std::optional<Rgb> intensity;  // PunctualLight::intensity, finite, >= 0
  double scale = 1;              // multiplies it, finite, >= 0
};

struct EnvironmentEdit {
  std::optional<Rgb> radiance;  // Environment::radiance: factor of the map, or the constant; finite, >= 0
  double scale = 1;             // multiplies it, finite, >= 0
};

using SceneEdit = std::variant<ObjectEdit, MaterialEdit, LightEdit, EnvironmentEdit>;

inline constexpr std::size_t kMaxSceneEdits = 1024;

// What is edited of a material.
struct MaterialValues {
  Rgb base_color{1, 1, 1}, emission{0, 0, 0};
  float roughness = 1;
  bool operator==(const MaterialValues&) const = default;
};
// Which of them materials of a model have.
struct EditableValues {
  bool base_color = true, emission = true, roughness = true;
};
EditableValues editable_values(MaterialModel model);
const char* to_string(MaterialModel model);  // "metallic_roughness", as the enumerator

MaterialValues material_values(const Material& material);
void set_material_values(const MaterialValues& values, Material& material);

template <class T>
struct Changed {
  T from, to;
};

// Values before and after, by number. Entries that change nothing are left out, but for transforms: an object that was
// moved and put back is traced as an instance.
struct SceneChanges {
  std::map<std::uint32_t, Changed<M44d>> transforms;
  std::map<std::uint32_t, Changed<MaterialValues>> materials;
  std::map<std::uint32_t, Changed<Rgb>> lights;
  std::optional<Changed<Rgb>> environment;

  bool empty() const { return transforms.empty() && materials.empty() && lights.empty() && !environment; }
};

// Finds the targets and works out their new values. invalid_argument, every problem at once, with the place
// ("edits[2].material.roughness"), the value and what is allowed; for a name that there is not, names like it.
Result<SceneChanges> resolve_edits(const SceneDescription& scene, std::span<const SceneEdit> edits);

// `first`, then `second`, as one.
SceneChanges merge_changes(const SceneChanges& first, const SceneChanges& second);

}  // namespace helio
